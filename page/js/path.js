// The path of the haptic interface point (HIP), and its files for `hapterra replay`.

import { TICK_HZ } from "./clock.js";

/** Maximum number of stored ticks: five minutes. */
export const MAX_ROWS = 300 * TICK_HZ;
const COLUMNS = 6;
const BLOCK_ROWS = 10000;

export class Path {
  #blocks = [];
  rows = 0;
  /** True if the surface has changed, so that no single surface has the forces of all rows. */
  isMixed = false;

  clear() {
    this.#blocks = [];
    this.rows = 0;
    this.isMixed = false;
  }

  get isFull() {
    return this.rows === MAX_ROWS;
  }

  /** Stores a tick: the HIP in millimetres, the force in newtons. */
  add(at, force) {
    if (this.isFull) return;
    const row = this.rows % BLOCK_ROWS;
    if (row === 0) this.#blocks.push(new Float64Array(BLOCK_ROWS * COLUMNS));
    this.#blocks.at(-1).set([...at, ...force], row * COLUMNS);
    this.rows += 1;
  }

  /** Returns a tick's numbers: x, y, z, and the force's x, y, z. */
  row(index) {
    const first = (index % BLOCK_ROWS) * COLUMNS;
    return this.#blocks[Math.floor(index / BLOCK_ROWS)].subarray(first, first + COLUMNS);
  }

  /** Returns the path as CSV. Numbers are as short as possible without loss of bits. */
  csv() {
    const lines = ["t_s,x_mm,y_mm,z_mm,force_x_n,force_y_n,force_z_n"];
    for (let i = 0; i < this.rows; i++) lines.push(`${i / TICK_HZ},${this.row(i).join(",")}`);
    return `${lines.join("\n")}\n`;
  }
}

/** Returns the heights as a NumPy array, millimetres, north row first. */
export function npy({ nx, ny, heights }) {
  const words = `{'descr': '<f4', 'fortran_order': False, 'shape': (${ny}, ${nx}), }`;
  const head = `${words.padEnd(117)}\n`;
  const file = new Uint8Array(10 + head.length + 4 * nx * ny);
  file.set([0x93, ...new TextEncoder().encode("NUMPY"), 1, 0, head.length, 0]);
  file.set(new TextEncoder().encode(head), 10);
  const data = new DataView(file.buffer, 10 + head.length);
  for (let row = 0; row < ny; row++) {
    const from = (ny - 1 - row) * nx;
    for (let i = 0; i < nx; i++) data.setFloat32(4 * (row * nx + i), heights[from + i], true);
  }
  return file;
}

/** Returns the texture of a surface as a file for the command, if it has one. */
export function surfaceFile({ texture, wavelength }) {
  if (!(texture > 0)) return null;
  return `[default]\ntexture = "grain"\ntexture_amplitude = ${texture}\ntexture_wavelength = ${wavelength}\n`;
}

/** Returns the command that renders the path again, in the folder of the saved files. */
export function command(terrain, { friction, stiffness, texture }, tipMm) {
  const words = ["hapterra replay terrain.npy path.csv -o forces.csv"];
  words.push(`--scale ${terrain.cellMm}mm/cell --exaggeration 1mm/unit`);
  words.push(`--stiffness ${stiffness} --friction ${friction}`);
  if (texture > 0) words.push("--surface surface.toml");
  if (tipMm > 0) words.push(`--tip ${tipMm}mm`);
  return words.join(" ");
}
