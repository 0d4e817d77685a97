// A terrain being touched: kernel, arm and path, one tick at a time.

import { Arm } from "./arm.js";
import { Path } from "./path.js";

/** Height of a path's beginning above the ground, mm: a point that begins below it has no force. */
const CLEARANCE_MM = 0.05;
/** Height of a lifted arm above the highest ground, mm. */
const HOVER_MM = 8;
/** Minimum distance of the hand from the terrain's edges, mm. */
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

  /** Changes the surface under the same contact: the proxy stays where it is. */
  setSurface(surface) {
    this.kernel.setSurface(surface);
    this.surface = surface;
    this.path.isMixed = this.path.rows > 0;
  }

  /** Changes the ball and thereby the ground: contact and path restart at the hand, and an arm
   * inside the ground is lifted out. Nothing changes if it throws. */
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

  /** Lifts an arm inside the ground to just above it. */
  #lift() {
    const [x, y, z] = this.arm.at;
    const above = this.kernel.heightAt(x, y) + CLEARANCE_MM;
    if (z <= above) this.arm.put([x, y, above]);
  }

  /** Returns the lowest point of the ball, or the point: the proxy without the radius. */
  get foot() {
    const [x, y, z] = this.proxy;
    return [x, y, z - this.tipMm];
  }

  #begin() {
    this.kernel.begin(this.surface);
    this.path.clear();
    this.force = [0, 0, 0];
  }

  /** Moves the pointer to a position, at a distance from the edges. */
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
