// Grey PNG, 8 or 16 bits a sample. The browser's own decoder would keep only 8 of 16 bits.

import { reverseRows } from "../terrain.js";
import { ReadError } from "./samples.js";

const GREY = 0;
const GREY_AND_ALPHA = 4;

export async function png(bytes, name) {
  const view = new DataView(bytes.buffer, bytes.byteOffset);
  const [nx, ny] = [view.getUint32(16), view.getUint32(20)];
  const [depth, colour, interlaced] = [bytes[24], bytes[25], bytes[28]];
  if (![GREY, GREY_AND_ALPHA].includes(colour)) throw new ReadError(`${name}: it is a picture in colours. Save it as grey, 16 bits: gdal_translate -of PNG -ot UInt16.`);
  if (![8, 16].includes(depth)) throw new ReadError(`${name}: it has ${depth} bits a sample. Save it with 8 or 16.`);
  if (interlaced) throw new ReadError(`${name}: it is interlaced. Save it without.`);
  const parts = [];
  for (let at = 8; at + 12 <= bytes.length; at += 12 + view.getUint32(at)) {
    const kind = new TextDecoder("latin1").decode(bytes.subarray(at + 4, at + 8));
    if (kind === "IDAT") parts.push(bytes.subarray(at + 8, at + 8 + view.getUint32(at)));
  }
  const stream = new Blob(parts).stream().pipeThrough(new DecompressionStream("deflate"));
  const packed = new Uint8Array(await new Response(stream).arrayBuffer());
  const step = (depth / 8) * (colour === GREY ? 1 : 2);
  if (packed.length < ny * (1 + nx * step)) throw new ReadError(`${name}: the picture is cut off. Copy it again.`);
  const pixels = unfilter(packed, nx * step, ny, step);
  const heights = new Float32Array(nx * ny);
  for (let i = 0; i < heights.length; i++) heights[i] = depth === 8 ? pixels[i * step] : pixels[i * step] * 256 + pixels[i * step + 1];
  return { nx, ny, heights: reverseRows(heights, nx, ny), cellM: null, unitM: null };
}

/** Undoes the filters of the PNG specification: each row begins with the number of its filter. */
function unfilter(packed, width, rows, step) {
  const out = new Uint8Array(width * rows);
  for (let row = 0; row < rows; row++) {
    const [from, to] = [row * (width + 1), row * width];
    const filter = packed[from];
    for (let i = 0; i < width; i++) {
      const left = i >= step ? out[to + i - step] : 0;
      const up = row > 0 ? out[to + i - width] : 0;
      const corner = row > 0 && i >= step ? out[to + i - width - step] : 0;
      const guess = [0, left, up, (left + up) >> 1, paeth(left, up, corner)][filter];
      out[to + i] = packed[from + 1 + i] + guess;
    }
  }
  return out;
}

function paeth(left, up, corner) {
  const [a, b, c] = [up - corner, left - corner, left + up - 2 * corner].map(Math.abs);
  if (a <= b && a <= c) return left;
  return b <= c ? up : corner;
}
