// Light on the terrain, computed once for a terrain: slopes, and the share of light at each
// position.

import { everyNth } from "../terrain.js";

/** Maximum samples along a side of the picture: every WebGL 2 supports textures of that size. */
const MAX_SIDE = 2048;
/** Samples along a side of the map of shadows. */
const SHADOW_SIDE = 384;
/** Direction towards the sun: north-west, as on maps. */
export const SUN = [-0.6, 0.5, 0.62];

/** Returns heights and slopes to draw: `nx`, `ny`, `heights`, `texels` (RGBA, see `slopes`). */
export function shade(terrain) {
  const step = Math.ceil((Math.max(terrain.nx, terrain.ny) - 1) / (MAX_SIDE - 1));
  const drawn = everyNth(terrain, step);
  const coarse = everyNth(terrain, Math.ceil((Math.max(terrain.nx, terrain.ny) - 1) / (SHADOW_SIDE - 1)));
  return { ...drawn, texels: slopes(drawn, coarse, shadows(coarse)) };
}

/** Returns the share of sun and sky at each position, 0 to 1, where higher ground may block it. */
function shadows({ nx, ny, heights, cellMm }) {
  const share = new Float32Array(nx * ny);
  const flat = Math.hypot(SUN[0], SUN[1]);
  const directions = [[SUN[0] / flat, SUN[1] / flat], [1, 0], [0, 1], [-1, 0], [0, -1], [0.7, 0.7], [0.7, -0.7], [-0.7, -0.7]];
  const at = (x, y) => heights[Math.round(y) * nx + Math.round(x)];
  /** Returns the steepest slope up to higher ground on one side. */
  const horizon = (column, row, [dx, dy], height) => {
    let steepest = 0;
    for (let reach = 1; reach < 90; reach *= 1.35) {
      const [x, y] = [column + dx * reach, row + dy * reach];
      if (x < 0 || y < 0 || x > nx - 1 || y > ny - 1) break;
      steepest = Math.max(steepest, (at(x, y) - height) / (reach * cellMm) || 0);
    }
    return steepest;
  };
  for (let row = 0; row < ny; row++) {
    for (let column = 0; column < nx; column++) {
      const height = at(column, row);
      const slopes = directions.map((direction) => horizon(column, row, direction, height));
      const sun = Math.max(0, Math.min(1, 0.5 + 5 * (SUN[2] / flat - slopes[0])));
      const sky = slopes.reduce((sum, slope) => sum + 1 - slope / Math.hypot(1, slope), 0) / slopes.length;
      share[row * nx + column] = 0.62 * sun + 0.38 * sky ** 1.5;
    }
  }
  return share;
}

/** Returns a texel a sample: the normal's x and y (0.5 is level), light, and 0 for no-data. */
function slopes({ nx, ny, heights, cellMm }, coarse, share) {
  const texels = new Uint8Array(4 * nx * ny);
  const [sx, sy] = [(coarse.nx - 1) / (nx - 1), (coarse.ny - 1) / (ny - 1)];
  for (let row = 0; row < ny; row++) {
    const [south, north] = [Math.max(0, row - 1), Math.min(ny - 1, row + 1)];
    for (let i = 0; i < nx; i++) {
      const [west, east] = [Math.max(0, i - 1), Math.min(nx - 1, i + 1)];
      const dx = (heights[row * nx + east] - heights[row * nx + west]) / ((east - west) * cellMm);
      const dy = (heights[north * nx + i] - heights[south * nx + i]) / ((north - south) * cellMm);
      const scale = 127.5 / Math.sqrt(1 + dx * dx + dy * dy);
      texels.set([127.5 - dx * scale, 127.5 - dy * scale, 255 * interpolate(coarse, share, i * sx, row * sy), dx + dy === dx + dy ? 255 : 0], 4 * (row * nx + i));
    }
  }
  return texels;
}

/** Returns an interpolated value between four samples. */
function interpolate({ nx, ny }, values, x, y) {
  const [i, j] = [Math.min(nx - 2, Math.floor(x)), Math.min(ny - 2, Math.floor(y))];
  const [u, v, first] = [x - i, y - j, j * nx + i];
  const south = values[first] * (1 - u) + values[first + 1] * u;
  return south * (1 - v) + (values[first + nx] * (1 - u) + values[first + nx + 1] * u) * v;
}
