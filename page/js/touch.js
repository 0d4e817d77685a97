// A terrain being touched: kernel, arm and path, a tick at a time.

import { Arm } from "./arm.js";
import { Path } from "./path.js";
import { heightAt } from "./terrain.js";

/** How far above the ground a path begins, mm: a point that begins below it is not felt. */
const ABOVE_MM = 0.05;
/** How far the hand keeps from the terrain's edges, mm. */
const EDGE_MM = 4;

export class Touch {
  arm = new Arm();
  path = new Path();
  force = [0, 0, 0];
  proxy = [0, 0, 0];
  state = "free";

  /** `kernel` as in kernel.js. */
  constructor(kernel, terrain, surface) {
    this.kernel = kernel;
    this.surface = surface;
    this.setTerrain(terrain);
  }

  /** Begins in the middle of another terrain, above its ground. */
  setTerrain(terrain) {
    this.terrain = terrain;
    this.kernel.setTerrain(terrain);
    const middle = [terrain.widthMm / 2, terrain.depthMm / 2];
    this.arm.hoverMm = terrain.topMm + 8;
    this.arm.putHand(middle);
    this.arm.put([...middle, this.arm.hoverMm]);
    this.#begin();
  }

  /** Another surface. The contact begins anew right above where it was, and so does the path. */
  setSurface(surface) {
    this.surface = surface;
    this.begin();
  }

  /** Begins path and contact anew where the arm is, above the ground. */
  begin() {
    const [x, y, z] = this.arm.at;
    const ground = heightAt(this.terrain, x, y);
    if (z <= ground + ABOVE_MM) this.arm.put([x, y, ground + ABOVE_MM]);
    this.#begin();
  }

  #begin() {
    this.kernel.begin(this.surface);
    this.path.clear();
    this.force = [0, 0, 0];
  }

  /** Moves the pointer to a place, kept from the edges. */
  point([x, y]) {
    const inside = (mm, length) => Math.max(EDGE_MM, Math.min(length - EDGE_MM, mm));
    this.arm.pointer = [inside(x, this.terrain.widthMm), inside(y, this.terrain.depthMm)];
  }

  tick() {
    this.arm.step(this.force);
    const felt = this.kernel.step(this.arm.at);
    this.force = felt.force;
    this.proxy = felt.proxy;
    this.state = felt.state;
    this.path.add(this.arm.at, felt.force);
  }
}
