import assert from "node:assert/strict";
import test from "node:test";
import { deflateSync } from "node:zlib";

import { read } from "../js/read/file.js";
import { everyNth, fit, generate, stepOf } from "../js/terrain.js";

const bytes = (text) => new TextEncoder().encode(text);

function npy(descr, shape, data, order = "False") {
  const head = `{'descr': '${descr}', 'fortran_order': ${order}, 'shape': (${shape}), }\n`;
  return Uint8Array.from([0x93, ...bytes("NUMPY"), 1, 0, head.length, 0, ...bytes(head), ...data]);
}

/** A PNG of rows, each with the number of its filter and filtered bytes. */
function png(width, height, depth, rows, colour = 0) {
  const part = (kind, data) => {
    const length = new Uint8Array(new Uint32Array([data.length]).buffer).reverse();
    return [...length, ...bytes(kind), ...data, 0, 0, 0, 0];
  };
  const head = [0, 0, 0, width, 0, 0, 0, height, depth, colour, 0, 0, 0];
  return Uint8Array.from([0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10, ...part("IHDR", head), ...part("IDAT", deflateSync(Uint8Array.from(rows.flat()))), ...part("IEND", [])]);
}

test("npy of 16 bits, most significant byte first, begins in the north", async () => {
  const raw = await read("a.npy", npy(">i2", "2, 3", [0, 1, 0, 2, 0, 3, 255, 255, 0, 5, 0, 6]));
  assert.deepEqual([raw.nx, raw.ny, raw.cellM], [3, 2, null]);
  assert.deepEqual([...raw.heights], [-1, 5, 6, 1, 2, 3]);
});

test("asc has its no-data, cell and order", async () => {
  const raw = await read("a.asc", bytes("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9999\n1 2 3\n4 -9999 6\n"));
  assert.deepEqual([...raw.heights], [4, NaN, 6, 1, 2, 3]);
  assert.equal(raw.cellM, 10);
});

test("png of 16 bits keeps them through all filters", async () => {
  // Filters none, left, up, mean, Paeth.
  const rows = [[0, 1, 0, 1, 2], [1, 1, 1, 0, 2], [2, 1, 0, 1, 0], [3, 1, 1, 0, 2], [4, 1, 0, 0, 6]];
  const raw = await read("a.png", png(2, 5, 16, rows));
  assert.deepEqual([...raw.heights], [769, 778, 513, 516, 513, 515, 257, 259, 256, 258]);
});

test("png of 8 bits and hgt are read", async () => {
  const raw = await read("a.png", png(2, 2, 8, [[0, 7, 8], [0, 9, 250]]));
  assert.deepEqual([...raw.heights], [9, 250, 7, 8]);
  const hgt = await read("N46E007.hgt", Uint8Array.from([0, 1, 0, 2, 128, 0, 1, 4]));
  assert.deepEqual([...hgt.heights], [NaN, 260, 1, 2]);
  // Metres of a degree on WGS 84 at 46.5° north.
  [76_762, 111_161].forEach((metres, axis) => assert.ok(Math.abs(hgt.cellM[axis] - metres) < 5, `${hgt.cellM}`));
});

test("error of a bad file names the file and a remedy", async () => {
  const bad = [
    ["a.txt", bytes("hello"), /its format is not supported.*cargo xtask demo/],
    ["a.hgt", new Uint8Array(6), /6 bytes are no square.*unpacked/],
    ["a.npy", npy("<f4", "2, 3", [0, 0]), /cut off.*Copy it again/],
    ["a.npy", npy("<c8", "2, 3", []), /type c8.*32-bit floats/],
    ["a.npy", npy("<f4", "6,", []), /1 dimensions.*2/],
    ["a.npy", npy("<f4", "2, 3", [], "True"), /Fortran/],
    ["a.asc", bytes("ncols 3\nnrows 2\n1 2 3\n"), /3 × 2 heights are announced, and 3 are there/],
    ["a.asc", bytes("ncols 2\nnrows 2\n1 2 3 x\n"), /"x" in row 2/],
    ["a.png", png(2, 2, 8, [[0, 1]]), /cut off/],
    ["a.png", png(2, 2, 8, [[0, 1, 2], [0, 1, 2]], 2), /in colours.*grey/],
  ];
  for (const [name, content, why] of bad) await assert.rejects(read(name, content), { message: why });
});

test("terrain is fitted into the hand, true to scale where it can be", () => {
  const flat = (nx, ny, cellM, top) => ({ name: "a", nx, ny, heights: Float32Array.from({ length: nx * ny }, (_, i) => (i === 0 ? top : 0)), cellM, unitM: 1 });
  const steep = fit(flat(241, 121, 10, 400));
  assert.deepEqual([steep.cellMm, steep.widthMm, steep.depthMm, steep.exaggeration], [1, 240, 120, 1]);
  assert.ok(Math.abs(steep.topMm - 40) < 1e-9);
  const low = fit(flat(241, 121, 10, 26));
  assert.equal(low.exaggeration, 10);
  assert.equal(fit(flat(241, 121, null, 7)).exaggeration, null);
  assert.throws(() => fit({ ...flat(2, 2, 1, 1), heights: new Float32Array(4).fill(NaN) }), /only no-data/);
  assert.throws(() => fit(flat(1, 9, 1, 1)), /no surface/);
});

test("terrain of too many samples is thinned evenly", () => {
  const [nx, ny] = [4001, 2001];
  const heights = new Float32Array(nx * ny).map((_, i) => (i % nx) + 2 * Math.floor(i / nx));
  const { of, ...thin } = fit({ name: "a", nx, ny, heights, cellM: 1, unitM: 1 });
  assert.deepEqual([of, thin.nx, thin.ny], [[4001, 2001], 2001, 1001]);
  const slope = (thin.heights[1] - thin.heights[0]) / thin.cellMm;
  assert.ok(Math.abs(slope - 1) < 1e-4, `${slope}`);
});

test("cells of degrees become squares of true slopes", () => {
  // 1 m up for each metre east and 0.5 m for each metre north, with a no-data area.
  const [nx, ny, cellM] = [41, 31, [20, 29]];
  const heights = Float32Array.from({ length: nx * ny }, (_, i) => (i % nx) * cellM[0] + 0.5 * Math.floor(i / nx) * cellM[1]);
  heights[15 * nx + 20] = NaN;
  const terrain = fit({ name: "a", nx, ny, heights, cellM, unitM: 1 });
  assert.deepEqual([terrain.nx, terrain.ny, terrain.of, terrain.isSquare], [41, 44, [41, 31], false]);
  assert.equal(terrain.exaggeration, 1);
  let slopes = 0;
  for (let at = 0; at < 41 * 43; at++) {
    if (at % 41 === 40) continue;
    const [east, north] = [1, 41].map((step) => (terrain.heights[at + step] - terrain.heights[at]) / terrain.cellMm);
    if (Number.isNaN(east) || Number.isNaN(north)) continue;
    assert.ok(Math.abs(east - 1) < 1e-4 && Math.abs(north - 0.5) < 1e-4, `${east} ${north} at ${at}`);
    slopes += 1;
  }
  assert.ok(slopes > 1700, `${slopes}`);
});

test("large ball has fewer samples, as in the command", () => {
  assert.deepEqual([-1, 0, 2, 8, 8.1, 16, 40].map((tip) => stepOf(1, tip)), [1, 1, 1, 1, 2, 2, 8]);
  const heights = Float32Array.from({ length: 35 }, (_, i) => i);
  assert.deepEqual(everyNth({ nx: 7, ny: 5, heights, cellMm: 2 }, 4), { nx: 2, ny: 2, heights: Float32Array.from([0, 4, 28, 32]), cellMm: 8 });
});

test("made terrain is the same for a seed, and has heights everywhere", () => {
  const [a, b, c] = [generate(7, 40), generate(7, 40), generate(8, 40)];
  assert.deepEqual(a.heights, b.heights);
  assert.notDeepEqual(a.heights, c.heights);
  assert.ok(a.heights.every(Number.isFinite));
  assert.ok(fit(a).heights.every((height) => height >= 0));
});
