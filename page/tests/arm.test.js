import assert from "node:assert/strict";
import test from "node:test";

import { Arm } from "../js/arm.js";
import { Clock, MAX_TICKS } from "../js/clock.js";

const NONE = [0, 0, 0];

test("clock runs a thousand ticks a second at any frame rate", () => {
  for (const hz of [30, 60, 144]) {
    const clock = new Clock();
    let ticks = clock.ticks(0);
    for (let frame = 1; frame <= 10 * hz; frame++) ticks += clock.ticks((frame * 1000) / hz);
    assert.ok(Math.abs(ticks - 10_000) <= 1, `${ticks} at ${hz} Hz`);
    assert.equal(clock.lostMs, 0);
  }
});

test("clock drops late time and counts it", () => {
  const clock = new Clock();
  clock.ticks(0);
  assert.equal(clock.ticks(300), MAX_TICKS);
  assert.equal(clock.lostMs, 300 - MAX_TICKS);
  clock.pause();
  assert.equal(clock.ticks(90_000), 0);
  assert.equal(clock.lostMs, 300 - MAX_TICKS);
});

function settled(arm, force, ticks = 3000) {
  for (let i = 0; i < ticks; i++) arm.step(typeof force === "function" ? force(arm) : force);
  return arm.at;
}

test("arm comes to rest at the hand in the air", () => {
  const arm = new Arm();
  arm.pressN = 0;
  arm.pointer = [30, -20];
  const [x, y, z] = settled(arm, NONE);
  for (const [found, expected] of [[x, 30], [y, -20], [z, arm.hoverMm]]) assert.ok(Math.abs(found - expected) < 0.01);
});

test("force holds the arm back by its size over the spring", () => {
  const arm = new Arm();
  arm.pressN = 0;
  const [x] = settled(arm, [-0.6, 0, 0]);
  assert.ok(Math.abs(x + 5) < 0.01, `${x}`);
});

test("press sinks into a floor by force over stiffness", () => {
  const arm = new Arm();
  arm.pressN = 1.5;
  arm.put([0, 0, 5]);
  const floor = ({ at }) => [0, 0, at[2] < 0 ? -0.5 * at[2] : 0];
  const [, , z] = settled(arm, floor);
  assert.ok(Math.abs(z + 3) < 0.01, `${z}`);
});

test("stiffest surface does not make the arm swing", () => {
  const arm = new Arm();
  arm.put([0, 0, 10]);
  arm.pressN = 4;
  const floor = ({ at }) => [0, 0, at[2] < 0 ? -1.5 * at[2] : 0];
  settled(arm, floor, 2000);
  assert.ok(Math.abs(arm.speed[2]) < 0.01, `${arm.speed}`);
});
