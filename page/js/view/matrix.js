// 4 × 4 matrices, column by column as in WebGL, and vectors of three.

export const add = (a, b) => a.map((x, i) => x + b[i]);
export const minus = (a, b) => a.map((x, i) => x - b[i]);
export const times = (a, s) => a.map((x) => x * s);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(...a);
export const unit = (a) => times(a, 1 / (length(a) || 1));

export function product(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      for (let k = 0; k < 4; k++) out[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return out;
}

export const IDENTITY = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);

/** Returns the matrix that moves a shape to `at`, along `axis`, scaled by `wide` and `long`. */
export function placementMatrix(at, axis, wide, long) {
  const z = unit(axis);
  const x = unit(cross(Math.abs(z[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], z));
  const y = cross(z, x);
  return new Float32Array([...times(x, wide), 0, ...times(y, wide), 0, ...times(z, long), 0, ...at, 1]);
}

/** A camera that looks at `centre` from a distance; angles in radians, `yaw` 0 looks north. */
export class Camera {
  yaw = -0.28;
  pitch = 0.66;
  distance = 480;
  centre = [0, 0, 0];
  #tan = Math.tan(0.3);

  /** Updates the values that depend on the canvas' shape. */
  look(aspect) {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    this.forward = [sy * cp, cy * cp, -sp];
    this.right = [cy, -sy, 0];
    this.up = cross(this.right, this.forward);
    this.eye = minus(this.centre, times(this.forward, this.distance));
    // In a narrow window the sides must also be visible.
    this.tan = this.#tan * Math.max(1, 1.25 / aspect);
    this.aspect = aspect;
    const [near, far] = [this.distance / 20, this.distance * 4];
    const lens = new Float32Array([1 / (this.tan * aspect), 0, 0, 0, 0, 1 / this.tan, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0]);
    const axes = [this.right, this.up, times(this.forward, -1)];
    const turn = new Float32Array(16);
    axes.forEach((axis, row) => {
      axis.forEach((part, column) => (turn[4 * column + row] = part));
      turn[12 + row] = -dot(axis, this.eye);
    });
    turn[15] = 1;
    this.matrix = product(lens, turn);
  }

  /** Returns a position on the canvas: 0 to 1 from the left and from the top. */
  project(at) {
    const to = minus(at, this.eye);
    const depth = dot(to, this.forward) * this.tan;
    return [0.5 + dot(to, this.right) / (2 * depth * this.aspect), 0.5 - dot(to, this.up) / (2 * depth)];
  }

  /** Returns the point at height `z` seen at a position of the canvas; null in the sky. */
  pick([left, top], z) {
    const across = times(this.right, (2 * left - 1) * this.tan * this.aspect);
    const ray = add(this.forward, add(across, times(this.up, (1 - 2 * top) * this.tan)));
    const reach = (z - this.eye[2]) / ray[2];
    return ray[2] < -0.02 && reach > 0 ? add(this.eye, times(ray, reach)) : null;
  }
}
