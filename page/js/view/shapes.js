// Shapes: rotated profiles around the z axis, and the sides of the terrain's block.

/** Returns the corners (position, normal) of a profile of [radius, z], rotated around z. */
export function lathe(profile, sides = 20) {
  const corners = [];
  const ring = (k, i) => {
    const angle = (2 * Math.PI * i) / sides;
    const [radius, z] = profile[k];
    return { at: [radius * Math.cos(angle), radius * Math.sin(angle), z], angle };
  };
  for (let k = 0; k + 1 < profile.length; k++) {
    const along = [profile[k + 1][0] - profile[k][0], profile[k + 1][1] - profile[k][1]];
    for (let i = 0; i < sides; i++) {
      const [a, b, c, d] = [ring(k, i), ring(k, i + 1), ring(k + 1, i), ring(k + 1, i + 1)];
      for (const { at, angle } of [a, b, c, c, b, d]) corners.push(...at, along[1] * Math.cos(angle), along[1] * Math.sin(angle), -along[0]);
    }
  }
  return new Float32Array(corners);
}

const half = (i) => -Math.PI / 2 + (Math.PI * i) / 10;
export const BALL = lathe(Array.from({ length: 11 }, (_, i) => [Math.cos(half(i)), Math.sin(half(i))]));
/** An arrow from 0 to 1. */
export const SHAFT = lathe([[0, 0], [0.4, 0], [0.4, 1]]);
export const POINT = lathe([[0, 0], [1, 0], [0, 1]]);
/** A pen with its tip at 0. */
export const PEN = lathe([[0, 0], [0.5, 0.07], [0.75, 0.16], [0.75, 0.97], [0.5, 1], [0, 1]]);

/** Returns the four sides of the block under the ground, down to `bottom`. */
export function sides({ nx, ny, heights, cellMm }, bottom) {
  const corners = [];
  const wall = (count, texel, normal) => {
    const corner = (i, isTop) => {
      const [column, row] = texel(i);
      const height = heights[row * nx + column];
      corners.push(column * cellMm, row * cellMm, isTop ? height || 0 : bottom, ...normal);
    };
    for (let i = 0; i + 1 < count; i++) {
      [[i, 0], [i + 1, 0], [i, 1], [i, 1], [i + 1, 0], [i + 1, 1]].forEach(([at, top]) => corner(at, top === 1));
    }
  };
  wall(nx, (i) => [i, 0], [0, -1, 0]);
  wall(nx, (i) => [i, ny - 1], [0, 1, 0]);
  wall(ny, (i) => [0, i], [-1, 0, 0]);
  wall(ny, (i) => [nx - 1, i], [1, 0, 0]);
  return new Float32Array(corners);
}
