import assert from "node:assert/strict";
import test from "node:test";

import { MAX_ROWS, Path, command, npy, surfaceFile } from "../js/path.js";
import { read } from "../js/read/file.js";

test("path keeps every bit in CSV", () => {
  const path = new Path();
  const at = [1 / 3, Math.PI * 1e2, -0.1];
  const force = [Math.fround(0.1), 0, -Math.fround(7.3)];
  for (let i = 0; i < 10_001; i++) path.add(at, force);
  const lines = path.csv().trim().split("\n");
  assert.equal(lines[0], "t_s,x_mm,y_mm,z_mm,force_x_n,force_y_n,force_z_n");
  assert.equal(lines.length, 10_002);
  assert.deepEqual(lines.at(-1).split(",").map(Number), [10, ...at, ...force]);
});

test("path ends after five minutes and starts again when cleared", () => {
  const path = new Path();
  for (let i = 0; i < MAX_ROWS + 5; i++) path.add([i, 0, 0], [0, 0, 0]);
  assert.ok(path.isFull);
  assert.equal(path.row(MAX_ROWS - 1)[0], MAX_ROWS - 1);
  path.clear();
  assert.equal(path.rows, 0);
});

test("saved terrain is read again with the same bits", async () => {
  const heights = Float32Array.from([0, 1.1, NaN, 3.3, -4.4, 5.5]);
  const again = await read("terrain.npy", npy({ nx: 3, ny: 2, heights }));
  assert.deepEqual([again.nx, again.ny], [3, 2]);
  assert.deepEqual(again.heights, heights);
});

test("command names the surface of the path", () => {
  const surface = { friction: 0.4, stiffness: 0.7, texture: 0.1, wavelength: 2 };
  const words = command({ cellMm: 0.25 }, surface, 0);
  assert.match(words, /--scale 0.25mm\/cell .*--stiffness 0.7 --friction 0.4 --surface surface.toml$/);
  assert.doesNotMatch(command({ cellMm: 0.25 }, { ...surface, texture: 0 }, 0), /surface|tip/);
  assert.match(surfaceFile(surface), /texture_amplitude = 0.1\ntexture_wavelength = 2\n$/);
  assert.equal(surfaceFile({ ...surface, texture: 0 }), null);
  assert.match(command({ cellMm: 0.25 }, surface, 2.5), / --tip 2.5mm$/);
});
