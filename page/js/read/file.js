// Dropped files: recognised by their first bytes, else by their extensions.
//
// Each reader returns the argument of `fit` in terrain.js, and throws an `Error` with the fault,
// its place, and the remedy.

import { asc } from "./asc.js";
import { hgt } from "./hgt.js";
import { npy } from "./npy.js";
import { png } from "./png.js";
import { ReadError } from "./samples.js";
import { tiff } from "./tiff.js";

const KINDS = "GeoTIFF, .hgt, Esri ASCII (.asc), grey PNG or NumPy (.npy)";

/** Returns the bytes of a file named `name` as a terrain. */
export async function read(name, bytes) {
  const raw = await reader(name, bytes)(bytes, name).catch((why) => {
    throw why instanceof ReadError ? why : new ReadError(`${name}: it cannot be read: ${why.message}. Is the file whole? Try to open it with gdalinfo.`);
  });
  return { name, ...raw };
}

function reader(name, bytes) {
  const begins = (...codes) => codes.every((code, i) => bytes[i] === code);
  if (begins(0x89, 0x50, 0x4e, 0x47)) return png;
  if (begins(0x93, 0x4e, 0x55, 0x4d)) return npy;
  if (begins(0x49, 0x49, 0x2a) || begins(0x49, 0x49, 0x2b) || begins(0x4d, 0x4d, 0x00)) return tiff;
  if (/\.hgt$/i.test(name)) return hgt;
  const text = new TextDecoder("latin1").decode(bytes.subarray(0, 64));
  if (/^\s*(ncols|nrows)\s/i.test(text)) return asc;
  throw new ReadError(`${name}: its format is not supported. Drop a ${KINDS}; \`cargo xtask demo --touch FILE\` opens many more.`);
}
