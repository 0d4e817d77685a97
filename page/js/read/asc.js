// Esri's ASCII grid: a header of six lines, then heights, north row first.

import { reverseRows } from "../terrain.js";
import { ReadError, metresPerDegree } from "./samples.js";

export async function asc(bytes, name) {
  const text = new TextDecoder("latin1").decode(bytes);
  const lines = /^(?:\s*[a-z]\w*[^\S\n]+\S+[^\S\n]*\n)+/i.exec(text)?.[0] ?? "";
  const pairs = lines.trim().split("\n").map((line) => line.trim().split(/\s+/));
  const head = Object.fromEntries(pairs.map(([key, value]) => [key.toLowerCase(), Number(value)]));
  const { ncols: nx, nrows: ny, cellsize, nodata_value: noData } = head;
  if (!(nx > 0 && ny > 0)) throw new ReadError(`${name}: the header has no ncols and nrows above zero. It begins with lines as "ncols 400".`);
  const words = text.slice(lines.length).trim().split(/\s+/);
  if (words.length < nx * ny) throw new ReadError(`${name}: ${nx} × ${ny} heights are announced, and ${words.length} are there: the file is cut off. Copy it again.`);
  const heights = new Float32Array(nx * ny);
  for (let i = 0; i < nx * ny; i++) {
    const height = Number(words[i]);
    if (Number.isNaN(height) && !/^nan$/i.test(words[i])) throw new ReadError(`${name}: "${words[i].slice(0, 20)}" in row ${Math.floor(i / nx) + 1} is no number. Mend that row.`);
    heights[i] = height === noData ? NaN : height;
  }
  // A cell size below a hundredth is in degrees.
  const south = head.yllcorner ?? head.yllcenter ?? 0;
  const degrees = () => metresPerDegree(south + (cellsize * ny) / 2).map((metres) => metres * cellsize);
  const cellM = cellsize > 0 ? (cellsize < 0.01 ? degrees() : cellsize) : null;
  return { nx, ny, heights: reverseRows(heights, nx, ny), cellM, unitM: 1 };
}
