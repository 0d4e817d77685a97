// NumPy's .npy, two-dimensional, north row first as in the command.

import { reverseRows } from "../terrain.js";
import { ReadError, samples } from "./samples.js";

export async function npy(bytes, name) {
  const isFirst = bytes[6] === 1;
  const view = new DataView(bytes.buffer, bytes.byteOffset);
  const [start, length] = isFirst ? [10, view.getUint16(8, true)] : [12, view.getUint32(8, true)];
  const head = new TextDecoder("latin1").decode(bytes.subarray(start, start + length));
  const [, order, kind] = /'descr':\s*'([<>|=])([a-z]\d+)'/.exec(head) ?? [];
  const shape = /'shape':\s*\(([^)]*)\)/.exec(head)?.[1].split(",").filter((word) => word.trim()).map(Number);
  if (!kind || !shape) throw new ReadError(`${name}: its header is not that of a plain array. Save it with numpy.save.`);
  if (shape.length !== 2) throw new ReadError(`${name}: it has ${shape.length} dimensions, and a terrain has 2. Save one band: numpy.save(…, a[0]).`);
  if (/'fortran_order':\s*True/.test(head)) throw new ReadError(`${name}: its order is Fortran's. Save numpy.ascontiguousarray(a).`);
  const [ny, nx] = shape;
  const heights = samples(kind, bytes.subarray(start + length), order !== ">", nx * ny);
  return { nx, ny, heights: reverseRows(heights, nx, ny), cellM: null, unitM: null };
}
