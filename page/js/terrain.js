// Terrain in the hand: heights in millimetres, row 0 the southernmost.

/** Maximum samples of a terrain: of a larger one every second, third, … is used. */
export const MAX_SAMPLES = 4_000_000;
/** Max difference of a cell's sides, as a share, without interpolation. */
const SQUARE = 1e-3;
/** Max distance of a position from a sample that it is on, in cells. */
const ON_SAMPLE = 1e-6;
/** Maximum radius of a ball, cells. */
const MAX_TIP_CELLS = 8;
/** The longer side in the hand, mm. */
const SIDE_MM = 240;
/** Relief that suits a hand, mm: a flatter terrain is exaggerated up to it. */
const RELIEF_MM = 26;
/** Relief if the size of the cells is unknown, mm. */
const UNKNOWN_RELIEF_MM = 32;

/**
 * Scales heights to the hand. `raw`: `name`, `nx`, `ny`, `heights` (its own unit, south row first,
 * NaN where there is none), `cellM` (metres of a cell's side, or of its sides east and north) and `unitM`
 * (metres), both null if the file does not state them.
 * Throws if no part can be touched.
 */
export function fit(raw) {
  if (raw.nx < 2 || raw.ny < 2) throw new Error(`${raw.name}: ${raw.nx} × ${raw.ny} samples are no surface. Drop a grid of at least 2 × 2 heights.`);
  const squares = toSquareCells(raw);
  const { nx, ny } = squares;
  const [low, high] = range(squares.heights);
  if (!(high >= low)) throw new Error(`${raw.name}: no height is in it, only no-data. Check which value means no data.`);
  const cellMm = SIDE_MM / (Math.max(nx, ny) - 1);
  const relief = high - low || 1;
  const trueMm = squares.cellM === null ? null : (cellMm / squares.cellM) * (raw.unitM ?? 1);
  const times = trueMm === null ? null : Math.max(1, Math.round((10 * RELIEF_MM) / (relief * trueMm)) / 10);
  const mmPerUnit = trueMm === null ? UNKNOWN_RELIEF_MM / relief : trueMm * times;
  return {
    name: raw.name,
    of: raw.of ?? [raw.nx, raw.ny],
    isSquare: squares.isSquare,
    nx,
    ny,
    cellMm,
    heights: squares.heights.map((height) => (height - low) * mmPerUnit),
    widthMm: (nx - 1) * cellMm,
    depthMm: (ny - 1) * cellMm,
    topMm: (high - low) * mmPerUnit,
    exaggeration: times,
    metresPerMm: squares.cellM === null ? null : squares.cellM / cellMm,
    range: [low, high].map((height) => height * (raw.unitM ?? 1)),
  };
}

/** Returns the lowest and the highest height. */
function range(heights) {
  let [low, high] = [Infinity, -Infinity];
  for (const height of heights) {
    if (height < low) low = height;
    if (height > high) high = height;
  }
  return [low, high];
}

/**
 * Returns square cells over the field: the finer axis keeps its samples, or every n-th of them if
 * there would be too many, and the other is interpolated. Nearly square cells keep their heights.
 */
function toSquareCells(raw) {
  const [east, north = east] = [raw.cellM ?? 1].flat();
  const isSquare = Math.abs(east - north) <= SQUARE * Math.min(east, north);
  const [width, depth] = isSquare ? [1, 1] : [east, north];
  const side = Math.min(width, depth);
  const size = (n) => [width * (raw.nx - 1), depth * (raw.ny - 1)].map((length) => Math.floor(length / (side * n) + ON_SAMPLE) + 1);
  let step = 1;
  while (size(step)[0] * size(step)[1] > MAX_SAMPLES) step += 1;
  const cellM = raw.cellM === null ? null : (isSquare ? Math.sqrt(east * north) : side) * step;
  if (isSquare && step === 1) return { ...raw, cellM, isSquare };
  const [nx, ny] = size(step);
  const heights = new Float32Array(nx * ny);
  const between = (a, b, share) => (share < ON_SAMPLE ? a : a + (b() - a) * share);
  for (let row = 0; row < ny; row++) {
    const [j, v] = split((row * step * side) / depth);
    for (let i = 0; i < nx; i++) {
      const [column, u] = split((i * step * side) / width);
      const at = (j) => between(raw.heights[j * raw.nx + column], () => raw.heights[j * raw.nx + column + 1], u);
      heights[row * nx + i] = between(at(j), () => at(j + 1), v);
    }
  }
  return { ...raw, nx, ny, heights, cellM, isSquare };
}

/** Returns the sample before a position and the weight of the next one. */
function split(place) {
  const sample = Math.floor(place + ON_SAMPLE);
  return [sample, place - sample];
}

/** Returns the step between samples under a ball: a power of two, for at most 8 cells of radius. */
export function stepOf(cellMm, tipMm) {
  const times = tipMm / (MAX_TIP_CELLS * cellMm);
  return times > 1 ? 2 ** Math.ceil(Math.log2(times)) : 1;
}

/** Returns every `step`-th sample from the south-west. */
export function everyNth({ nx, ny, heights, cellMm }, step) {
  if (step === 1) return { nx, ny, heights, cellMm };
  const [columns, rows] = [nx, ny].map((count) => Math.floor((count - 1) / step) + 1);
  const thinned = new Float32Array(columns * rows);
  for (let row = 0; row < rows; row++) {
    for (let i = 0; i < columns; i++) thinned[row * columns + i] = heights[row * step * nx + i * step];
  }
  return { nx: columns, ny: rows, heights: thinned, cellMm: cellMm * step };
}

/** Returns the rows in the opposite order: most files begin in the north. */
export function reverseRows(heights, nx, ny) {
  const rows = new Float32Array(nx * ny);
  for (let row = 0; row < ny; row++) rows.set(heights.subarray(row * nx, (row + 1) * nx), (ny - 1 - row) * nx);
  return rows;
}

/** Returns a mountain range by formula, for a page without a file; the same for the same seed. */
export function generate(seed, size = 512) {
  const heights = new Float32Array(size * size);
  for (let row = 0; row < size; row++) {
    for (let i = 0; i < size; i++) heights[row * size + i] = rangeHeight((i / size) * 3.4, (row / size) * 3.4, seed);
  }
  return { name: "a made mountain range", nx: size, ny: size, heights, cellM: 24, unitM: 1 };
}

/** Returns ridges on ridges, metres: high ground is rough, valleys are smooth. */
function rangeHeight(x, y, seed) {
  // Distorted, so that ridges wind.
  const bentX = x + 0.35 * noise(x * 0.9, y * 0.9, seed + 71);
  const bentY = y + 0.35 * noise(x * 0.9, y * 0.9, seed + 72);
  let [sum, weight, scale, reach] = [0, 1, 1, 1];
  for (let octave = 0; octave < 8; octave++) {
    const ridge = (1 - Math.abs(noise(bentX * scale, bentY * scale, seed + octave))) ** 2;
    sum += reach * weight * ridge;
    weight = Math.min(1, Math.max(0, ridge * 1.7 * weight));
    reach *= 0.47;
    scale *= 2.03;
  }
  return 300 + 640 * sum ** 1.35;
}

/** Returns smooth noise from −1 to 1 (Perlin's gradients on a grid). */
function noise(x, y, seed) {
  const [column, row] = [Math.floor(x), Math.floor(y)];
  const [u, v] = [x - column, y - row];
  const fade = (t) => t * t * t * (t * (6 * t - 15) + 10);
  const corner = (i, j) => {
    let hash = Math.imul(column + i, 374761393) ^ Math.imul(row + j, 668265263) ^ Math.imul(seed, 2147483647 - 58);
    hash = Math.imul(hash ^ (hash >>> 13), 1274126177);
    const angle = (((hash ^ (hash >>> 16)) >>> 0) / 4294967296) * 2 * Math.PI;
    return Math.cos(angle) * (u - i) + Math.sin(angle) * (v - j);
  };
  const mix = (a, b, t) => a + (b - a) * t;
  const south = mix(corner(0, 0), corner(1, 0), fade(u));
  return 1.5 * mix(south, mix(corner(0, 1), corner(1, 1), fade(u)), fade(v));
}
