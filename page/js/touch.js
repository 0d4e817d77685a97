// A terrain being touched: kernel, arm and path, one tick at a time.

import { Arm } from "./arm.js";
import { Path } from "./path.js";

/** How far above the ground a path begins, mm: a point that begins below it has no force. */
const ABOVE_MM = 0.05;
/** How far a lifted arm is above the highest ground, mm. */
const HOVER_MM = 8;
/** How far the hand keeps from the terrain's edges, mm. */
const EDGE_MM = 4;

export class Touch {
  arm = new Arm();
  path = new Path();
  force = [0, 0, 0];
  proxy = [0, 0, 0];
  state = "free";

  /** `kernel` as in kernel.js; `tipMm`: radius of the ball that touches, 0 for a point. */
  constructor(kernel, terrain, surface, tipMm) {
    this.kernel = kernel;
    this.surface = surface;
    this.tipMm = tipMm;
    this.setTerrain(terrain);
  }

  /** Begins in the middle of another terrain, above its ground. */
  setTerrain(terrain) {
    this.kernel.setTerrain(terrain, this.tipMm);
    this.terrain = terrain;
    const middle = [terrain.widthMm / 2, terrain.depthMm / 2];
    this.arm.hoverMm = terrain.topMm + this.tipMm + HOVER_MM;
    this.arm.putHand(middle);
    this.arm.put([...middle, this.arm.hoverMm]);
    this.#begin();
  }

  /** Another surface under the same contact: the proxy stays, and the next force is the other's. */
  setSurface(surface) {
    this.kernel.setSurface(surface);
    this.surface = surface;
    this.path.isMixed = this.path.rows > 0;
  }

  /** Another ball, for which the ground is another: contact and path begin anew where the hand is, and
   * an arm inside the ground is lifted out. Where it throws all is as before. */
  setTip(tipMm) {
    try {
      this.kernel.setTerrain(this.terrain, tipMm);
    } catch (why) {
      this.kernel.setTerrain(this.terrain, this.tipMm);
      throw why;
    }
    this.tipMm = tipMm;
    this.arm.hoverMm = this.terrain.topMm + tipMm + HOVER_MM;
    this.#lift();
    this.#begin();
  }

  /** Puts an arm inside the ground right above it. */
  #lift() {
    const [x, y, z] = this.arm.at;
    const above = this.kernel.heightAt(x, y) + ABOVE_MM;
    if (z <= above) this.arm.put([x, y, above]);
  }

  /** Where the ball is above the ground, or the point: the proxy without the radius. */
  get foot() {
    const [x, y, z] = this.proxy;
    return [x, y, z - this.tipMm];
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
    // A step that is not possible has no force.
    this.force = [0, 0, 0];
    const step = this.kernel.step(this.arm.at);
    this.force = step.force;
    this.proxy = step.proxy;
    this.state = step.state;
    this.path.add(this.arm.at, step.force);
    // Contact was lost: a ball's proxy is more than 15 radii behind, or at no-data.
    if (step.state === "unseeded") this.#lift();
  }
}
