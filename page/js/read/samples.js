// Shared by all readers: errors and samples.

/** Throws an error with a message for the user. */
export class ReadError extends Error {}

/** Returns the metres of a degree east and north at a latitude, on WGS 84 (to 1 part in 10⁵). */
export function metresPerDegree(latitude) {
  const at = (times) => Math.cos((times * latitude * Math.PI) / 180);
  return [111_412.84 * at(1) - 93.5 * at(3) + 0.118 * at(5), 111_132.954 - 559.822 * at(2) + 1.175 * at(4)];
}

/** Readers by type, in the file's byte order, which may differ from this machine's. */
const isLittle = new Uint8Array(new Uint16Array([1]).buffer)[0] === 1;

/** Returns the samples of a type (`f4`, `i2`, …) in `bytes` as 32-bit floats. */
export function samples(kind, bytes, isLittleEndian, count) {
  const Kind = { f4: Float32Array, f8: Float64Array, i1: Int8Array, u1: Uint8Array, i2: Int16Array, u2: Uint16Array, i4: Int32Array, u4: Uint32Array }[kind];
  if (!Kind) throw new ReadError(`samples of type ${kind} are not read here: store them as 32-bit floats (numpy: a.astype("f4"))`);
  const size = Kind.BYTES_PER_ELEMENT;
  if (bytes.length < count * size) throw new ReadError(`${count * size} bytes of heights are expected, and ${bytes.length} are there: the file is cut off. Copy it again.`);
  const own = bytes.slice(0, count * size);
  if (isLittleEndian !== isLittle) {
    for (let i = 0; i < own.length; i += size) own.subarray(i, i + size).reverse();
  }
  return Float32Array.from(new Kind(own.buffer));
}
