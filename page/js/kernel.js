// The kernel: the C library (c/include/hapterra.h), compiled to WebAssembly, by its C names.

import { TICK_HZ } from "./clock.js";
import { everyNth, stepOf } from "./terrain.js";

/** Sizes of the header's structures, bytes. */
const SURFACE_BYTES = 48;
const HIP_BYTES = 24;
const STEP_BYTES = 64;
const STATE_AT = 56;
const SOUTH_FIRST = 1;
const GRAIN = 1;
const STATES = ["free", "touching", "releasing", "unseeded", "unseeded"];

/** Loads the kernel from an address, or from bytes. */
export async function load(from) {
  const bytes = typeof from === "string" ? await (await fetch(from)).arrayBuffer() : from;
  const { instance } = await WebAssembly.instantiate(bytes, {}).catch((why) => {
    throw new Error(`The kernel cannot be loaded (${why.message}). Use a browser of the last five years, or make the page again: cargo xtask demo --touch.`);
  });
  return new Kernel(instance.exports);
}

export class Kernel {
  #c;
  #contact;
  #terrain;
  #surface;
  #hip;
  #step;
  #buffer = null;

  constructor(exports) {
    this.#c = exports;
    this.#contact = exports.hapterra_contact_new();
    this.#terrain = exports.hapterra_terrain_new();
    [this.#surface, this.#hip, this.#step] = [SURFACE_BYTES, HIP_BYTES, STEP_BYTES].map((bytes) => this.#alloc(bytes));
  }

  #alloc(bytes) {
    const at = this.#c.hapterra_alloc(bytes);
    if (at === 0) throw new Error(`There is no memory for ${bytes} bytes. Close other pages, or use a smaller terrain.`);
    return at;
  }

  /** Returns its memory as numbers; the buffer changes when the memory grows. */
  get #memory() {
    const { buffer } = this.#c.memory;
    if (this.#buffer?.bytes !== buffer) {
      this.#buffer = { bytes: buffer, f32: new Float32Array(buffer), f64: new Float64Array(buffer), u32: new Uint32Array(buffer), u8: new Uint8Array(buffer) };
    }
    return this.#buffer;
  }

  #check(status, message) {
    if (status === 0) return;
    const text = (at) => new TextDecoder().decode(this.#memory.u8.subarray(at, this.#memory.u8.indexOf(0, at)));
    throw new Error(text(message()) || text(this.#c.hapterra_error_text(status)));
  }

  #checkContact(status) {
    this.#check(status, () => this.#c.hapterra_contact_message(this.#contact));
  }

  #checkTerrain(status) {
    this.#check(status, () => this.#c.hapterra_terrain_message(this.#terrain));
  }

  /** Sets the terrain of later contacts, as returned by `fit` of terrain.js, under a ball of
   * `tipMm`, or a point for 0. If the ball's radius is more than 8 cells, it is rendered on every
   * second, fourth, … sample, as in the command. */
  setTerrain(terrain, tipMm) {
    const step = stepOf(terrain.cellMm, tipMm);
    const { heights, nx, ny, cellMm } = everyNth(terrain, step);
    const c = this.#c;
    const at = this.#alloc(heights.byteLength);
    this.#memory.f32.set(heights, at / 4);
    const status = c.hapterra_terrain_set_f32(this.#terrain, at, nx, ny, cellMm, SOUTH_FIRST);
    c.hapterra_free(at, heights.byteLength);
    this.#checkTerrain(status);
    this.#checkTerrain(c.hapterra_terrain_set_tip(this.#terrain, tipMm));
  }

  /** Returns the height of the ground at a position, or of the ball's centre, mm; 0 for no-data. */
  heightAt(x, y) {
    return this.#c.hapterra_terrain_height_mm(this.#terrain, x, y) || 0;
  }

  /** Begins a contact: the next step is its first. */
  begin(surface) {
    this.#writeSurface(surface);
    this.#checkContact(this.#c.hapterra_contact_begin(this.#contact, this.#terrain, this.#surface, 1, TICK_HZ));
  }

  /** Changes the surface between two steps; the contact continues. */
  setSurface(surface) {
    this.#writeSurface(surface);
    this.#checkContact(this.#c.hapterra_contact_set_surface(this.#contact, this.#surface, 1));
  }

  /** Writes the forces of a surface into a path, as computed by a new contact. */
  recompute(surface, path) {
    const now = this.#contact;
    this.#contact = this.#c.hapterra_contact_new();
    try {
      this.begin(surface);
      for (let i = 0; i < path.rows; i++) path.row(i).set(this.step(path.row(i).subarray(0, 3)).force, 3);
    } finally {
      this.#c.hapterra_contact_free(this.#contact);
      this.#contact = now;
    }
  }

  #writeSurface({ friction, stiffness, texture, wavelength }) {
    this.#c.hapterra_surface_default(this.#surface);
    const { f32, u32 } = this.#memory;
    const first = this.#surface / 4;
    f32[first] = stiffness;
    f32[first + 2] = friction;
    f32[first + 3] = friction;
    if (texture > 0) {
      u32[first + 7] = GRAIN;
      f32[first + 8] = texture;
      f32[first + 9] = wavelength;
    }
  }

  /** Runs one tick with the HIP at a position, mm. Returns `force`, N, `proxy`, mm, and `state`. */
  step(hip) {
    this.#memory.f64.set(hip, this.#hip / 8);
    this.#checkContact(this.#c.hapterra_contact_step(this.#contact, this.#hip, this.#step));
    const { f64, u32 } = this.#memory;
    const at = this.#step / 8;
    return {
      force: [f64[at], f64[at + 1], f64[at + 2]],
      proxy: [f64[at + 3], f64[at + 4], f64[at + 5]],
      state: STATES[u32[(this.#step + STATE_AT) / 4]],
    };
  }
}
