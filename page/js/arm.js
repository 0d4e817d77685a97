// The arm and the hand.
//
// The hand is the pointer. It pulls the arm sideways through a spring and a damper, and presses
// straight down with a constant force. The arm is a small mass: the ground's force pushes it back,
// so that it is behind the hand uphill and ahead of it downhill. Frame as everywhere: millimetres,
// x east, y north, z up, origin at the south-west sample.

import { TICK_HZ } from "./clock.js";

const TICK_S = 1 / TICK_HZ;
/** Mass of the arm, kg. */
const MASS = 0.06;
/** The hand's spring, N/mm, and its maximum force, N. */
const PULL = 0.12;
const MAX_PULL = 5;
/** The hand's damper, N·s/mm: the spring's motion dies out without a swing. */
const DAMPING = (2 * Math.sqrt(PULL * 1000 * MASS)) / 1000;
/** The spring that keeps a lifted arm above the ground, N/mm. */
const LIFT = 0.05;
/** Time constant of the hand behind the pointer, s: pointers move in steps, hands do not. */
const FOLLOW_S = 0.015;

export class Arm {
  /** Position of the haptic interface point (HIP), mm, and its speed, mm/s. */
  at = [0, 0, 0];
  speed = [0, 0, 0];
  /** Positions of the pointer, and of the hand that follows it. */
  pointer = [0, 0];
  hand = [0, 0];
  /** Force with which the hand presses down, N; 0 lifts the arm to `hoverMm`. */
  pressN = 1;
  hoverMm = 40;

  /** Sets the arm to rest at a position, with the hand above it. */
  put([x, y, z]) {
    this.at = [x, y, z];
    this.speed = [0, 0, 0];
  }

  /** Moves the hand and the pointer at once. */
  putHand([x, y]) {
    this.pointer = [x, y];
    this.hand = [x, y];
  }

  /** Runs one tick under the ground's force, N. */
  step(force) {
    const follow = TICK_S / FOLLOW_S;
    const pull = [0, 0];
    const moved = [0, 0];
    for (const axis of [0, 1]) {
      moved[axis] = (this.pointer[axis] - this.hand[axis]) * follow;
      this.hand[axis] += moved[axis];
      pull[axis] = PULL * (this.hand[axis] - this.at[axis]);
    }
    const size = Math.hypot(pull[0], pull[1]);
    const share = size > MAX_PULL ? MAX_PULL / size : 1;
    for (const axis of [0, 1]) {
      const ahead = Math.max(-300, Math.min(300, moved[axis] / TICK_S)) - this.speed[axis];
      this.#push(axis, pull[axis] * share + DAMPING * ahead + force[axis]);
    }
    const down = this.pressN > 0 ? -this.pressN : LIFT * (this.hoverMm - this.at[2]);
    this.#push(2, down - DAMPING * this.speed[2] + force[2]);
  }

  #push(axis, newtons) {
    this.speed[axis] += (newtons / MASS) * 1000 * TICK_S;
    this.at[axis] += this.speed[axis] * TICK_S;
  }
}
