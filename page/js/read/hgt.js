// SRTM's .hgt: a square degree, 16 bits a sample, north row first.

import { reverseRows } from "../terrain.js";
import { ReadError, metresPerDegree, samples } from "./samples.js";

const NO_DATA = -32768;

export async function hgt(bytes, name) {
  const side = Math.sqrt(bytes.length / 2);
  if (!Number.isInteger(side) || side < 2) throw new ReadError(`${name}: ${bytes.length} bytes are no square of 16-bit heights. Is it unpacked, and whole?`);
  const heights = samples("i2", bytes, false, side * side).map((height) => (height === NO_DATA ? NaN : height));
  const south = /([NS])(\d+)[EW]\d+/i.exec(name);
  const latitude = south ? (south[1].toUpperCase() === "S" ? -1 : 1) * Number(south[2]) + 0.5 : 0;
  const cellM = metresPerDegree(latitude).map((metres) => metres / (side - 1));
  return { nx: side, ny: side, heights: reverseRows(heights, side, side), cellM, unitM: 1 };
}
