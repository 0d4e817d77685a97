// Terrain in the hand: heights in millimetres, row 0 the southernmost.

/** Samples that a terrain has at most: of a larger one every second, third, … is taken. */
export const MAX_SAMPLES = 4_000_000;
/** The longer side in the hand, mm. */
const SIDE_MM = 240;
/** Relief that is felt well, mm: a flatter terrain is felt higher than it is. */
const RELIEF_MM = 26;
/** Relief where nothing is known of the cells, mm. */
const UNKNOWN_RELIEF_MM = 32;

/**
 * Fits heights into the hand. `raw`: `name`, `nx`, `ny`, `heights` (its own unit, south row first,
 * NaN where there is none), `cellM` and `unitM` (metres; null where the file does not say).
 * Throws where nothing can be touched.
 */
export function fit(raw) {
  const thin = thinned(raw);
  const { nx, ny } = thin;
  if (nx < 2 || ny < 2) throw new Error(`${raw.name}: ${raw.nx} × ${raw.ny} samples are no surface. Drop a grid of at least 2 × 2 heights.`);
  const [low, high] = range(thin.heights);
  if (!(high >= low)) throw new Error(`${raw.name}: no height is in it, only no-data. Check which value means no data.`);
  const cellMm = SIDE_MM / (Math.max(nx, ny) - 1);
  const relief = high - low || 1;
  const trueMm = thin.cellM === null ? null : (cellMm / thin.cellM) * (raw.unitM ?? 1);
  const times = trueMm === null ? null : Math.max(1, Math.round((10 * RELIEF_MM) / (relief * trueMm)) / 10);
  const mmPerUnit = trueMm === null ? UNKNOWN_RELIEF_MM / relief : trueMm * times;
  return {
    name: raw.name,
    of: raw.of ?? [raw.nx, raw.ny],
    nx,
    ny,
    cellMm,
    heights: thin.heights.map((height) => (height - low) * mmPerUnit),
    widthMm: (nx - 1) * cellMm,
    depthMm: (ny - 1) * cellMm,
    topMm: (high - low) * mmPerUnit,
    exaggeration: times,
    metresPerMm: thin.cellM === null ? null : thin.cellM / cellMm,
    range: [low, high].map((height) => height * (raw.unitM ?? 1)),
  };
}

/** Lowest and highest of the heights. */
function range(heights) {
  let [low, high] = [Infinity, -Infinity];
  for (const height of heights) {
    if (height < low) low = height;
    if (height > high) high = height;
  }
  return [low, high];
}

/** Every n-th sample, so that there are not too many. */
function thinned(raw) {
  const step = Math.ceil(Math.sqrt((raw.nx * raw.ny) / MAX_SAMPLES));
  if (step <= 1) return raw;
  const [nx, ny] = [raw.nx, raw.ny].map((count) => Math.floor((count - 1) / step) + 1);
  const heights = new Float32Array(nx * ny);
  for (let row = 0; row < ny; row++) {
    for (let i = 0; i < nx; i++) heights[row * nx + i] = raw.heights[row * step * raw.nx + i * step];
  }
  return { ...raw, nx, ny, heights, cellM: raw.cellM === null ? null : raw.cellM * step };
}

/** Rows in the opposite order: most files begin in the north. */
export function turned(heights, nx, ny) {
  const rows = new Float32Array(nx * ny);
  for (let row = 0; row < ny; row++) rows.set(heights.subarray(row * nx, (row + 1) * nx), (ny - 1 - row) * nx);
  return rows;
}

/** Height of the highest of the four samples around a place, mm; 0 where there is none. */
export function heightAt({ nx, ny, cellMm, heights }, x, y) {
  const cell = (mm, count) => Math.max(0, Math.min(count - 2, Math.floor(mm / cellMm)));
  const first = cell(y, ny) * nx + cell(x, nx);
  const around = [0, 1, nx, nx + 1].map((i) => heights[first + i]);
  return Math.max(0, ...around.filter((height) => height === height));
}

/** A mountain range by formula, for a page without a file. The same seed gives the same one. */
export function made(seed, size = 512) {
  const heights = new Float32Array(size * size);
  for (let row = 0; row < size; row++) {
    for (let i = 0; i < size; i++) heights[row * size + i] = range_m((i / size) * 3.4, (row / size) * 3.4, seed);
  }
  return { name: "a made mountain range", nx: size, ny: size, heights, cellM: 24, unitM: 1 };
}

/** Ridges on ridges: high ground is rough, valleys are even. Metres. */
function range_m(x, y, seed) {
  // Bent, so that ridges wind.
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

/** Even noise from −1 to 1 (gradients on a grid, Perlin's way). */
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
