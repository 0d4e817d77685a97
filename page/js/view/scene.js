// The picture: ground with its light, pen, proxy, force.

import { SUN, shade } from "./light.js";
import { IDENTITY, Camera, add, length, placementMatrix, times } from "./matrix.js";
import { GROUND, SOLID, TRAIL } from "./shaders.js";
import { BALL, PEN, POINT, SHAFT, sides } from "./shapes.js";

/** Maximum vertices along a side of the ground's mesh; fewer on a slow machine. */
const MAX_MESH = 320;
const MIN_MESH = 80;
/** Duration of a slow frame, ms, and the number of them after which the picture gets coarser. */
const SLOW_MS = 60;
const SLOW_FRAMES = 4;
const MIN_PIXELS = 0.5;
/** Height of the block under the lowest sample, mm. */
const BLOCK_MM = 14;
/** Length of the arrow for a newton, mm. */
const ARROW_MM = 14;
/** Radius of the ball that marks a point, mm. */
const POINT_MM = 1.6;
const TRAIL_POINTS = 240;
const COLOURS = { proxy: [1, 0.5, 0.12, 1], hip: [0.25, 0.65, 1, 1], force: [1, 0.85, 0.2, 1], pen: [0.82, 0.85, 0.9, 1], block: [0.37, 0.33, 0.31, 1], scale: [0.9, 0.93, 0.96, 1] };

export class Scene {
  camera = new Camera();
  #trail = [];
  #pixels = Math.min(2, devicePixelRatio);
  #side = MAX_MESH;
  #last = 0;
  #slow = 0;

  /** Throws if the browser has no WebGL 2. */
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: false });
    if (!gl) throw new Error("This browser draws no WebGL 2, which the picture needs. Allow hardware acceleration in its settings, or use another browser.");
    this.gl = gl;
    [this.ground, this.solid, this.trail] = [GROUND, SOLID, TRAIL].map((sources) => program(gl, sources));
    this.shapes = Object.fromEntries(Object.entries({ BALL, PEN, POINT, SHAFT }).map(([name, corners]) => [name, shape(gl, corners)]));
    this.indices = gl.createBuffer();
    this.trailBuffer = gl.createBuffer();
    this.textures = [gl.createTexture(), gl.createTexture()];
    this.empty = gl.createVertexArray();
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }

  setTerrain(terrain) {
    const gl = this.gl;
    this.terrain = terrain;
    this.#trail = [];
    this.camera.centre = [terrain.widthMm / 2, terrain.depthMm / 2, terrain.topMm * 0.3 - BLOCK_MM];
    const drawn = shade(terrain);
    const texture = (unit, filter, ...image) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, this.textures[unit]);
      gl.texImage2D(gl.TEXTURE_2D, 0, image[0], drawn.nx, drawn.ny, 0, ...image.slice(1));
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, unit ? gl.LINEAR : gl.NEAREST);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
      for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
    };
    texture(0, gl.NEAREST, gl.R32F, gl.RED, gl.FLOAT, drawn.heights);
    texture(1, gl.LINEAR_MIPMAP_LINEAR, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, drawn.texels);
    gl.generateMipmap(gl.TEXTURE_2D);
    this.drawn = [drawn.nx, drawn.ny];
    this.#setMesh();
    this.shapes.SIDES = shape(gl, sides(drawn, -BLOCK_MM));
    this.size = [(drawn.nx - 1) * drawn.cellMm, (drawn.ny - 1) * drawn.cellMm];
    this.contour = Math.max(0.5, terrain.topMm / 10);
  }

  #setMesh() {
    const gl = this.gl;
    this.mesh = this.drawn.map((count) => Math.min(this.#side, count));
    const indices = strips(...this.mesh);
    this.count = indices.length;
    gl.bindVertexArray(this.empty);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indices);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
  }

  /** Draws the state of touch.js: `arm`, `proxy`, `force`, …; `scaleMm` is the bar's length. */
  draw({ arm, proxy, foot, force, state, tipMm }, scaleMm) {
    const { gl, camera, canvas } = this;
    this.#adaptQuality();
    const ratio = this.#pixels;
    const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(Math.round);
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    camera.look(width / Math.max(1, height));
    this.#drawGround(foot);
    this.#use(this.solid, { camera: camera.matrix, sun: SUN });
    this.#drawShape("SIDES", IDENTITY, COLOURS.block, 1);
    this.#drawScale(scaleMm);
    const ball = tipMm || POINT_MM;
    const pen = [0.25, -0.35, 1];
    this.#drawShape("PEN", placementMatrix(add(proxy, times(pen, 1.6)), pen, 3.2, 62), COLOURS.pen);
    this.#drawShape("BALL", placementMatrix(proxy, [0, 0, 1], ball, ball), COLOURS.proxy);
    if (state !== "free") this.#drawForce(arm.at, proxy, force);
    this.#drawTrail(foot, state, ratio);
  }

  /** Makes the picture coarser while frames take too long: its mesh first, then its pixels. */
  #adaptQuality() {
    const elapsed = performance.now() - this.#last;
    this.#last += elapsed;
    this.#slow = elapsed > SLOW_MS && elapsed < 2000 ? this.#slow + 1 : 0;
    if (this.#slow < SLOW_FRAMES) return;
    this.#slow = 0;
    if (this.#side > MIN_MESH) {
      this.#side /= 2;
      this.#setMesh();
    } else this.#pixels = Math.max(MIN_PIXELS, this.#pixels * 0.8);
  }

  #drawGround(foot) {
    const { gl, terrain } = this;
    this.#use(this.ground, { camera: this.camera.matrix, heights: 0, slopes: 1, mesh: this.mesh, size: this.size, sun: SUN, foot, top: terrain.topMm, contour: this.contour });
    gl.bindVertexArray(this.empty);
    gl.drawElements(gl.TRIANGLE_STRIP, this.count, gl.UNSIGNED_INT, 0);
  }

  /** Draws the HIP inside the ground and the force as an arrow, in front of everything else. */
  #drawForce(hip, proxy, force) {
    const gl = this.gl;
    const size = length(force);
    const reach = ARROW_MM * size;
    const head = Math.min(6, reach * 0.5);
    gl.depthRange(0, 0.05);
    this.#drawShape("BALL", placementMatrix(hip, [0, 0, 1], 1.5, 1.5), COLOURS.hip);
    if (size > 0.02) {
      this.#drawShape("SHAFT", placementMatrix(proxy, force, 2.4, reach - head), COLOURS.force);
      this.#drawShape("POINT", placementMatrix(add(proxy, times(force, (reach - head) / size)), force, 2.6, head), COLOURS.force);
    }
    gl.depthRange(0, 1);
  }

  /** Draws a bar along the front edge. */
  #drawScale(scaleMm) {
    const at = this.scaleAt = [this.terrain.widthMm / 2 - scaleMm / 2, -5, -BLOCK_MM];
    this.#drawShape("SHAFT", placementMatrix(at, [1, 0, 0], 2, scaleMm), COLOURS.scale);
    for (const end of [0, scaleMm]) this.#drawShape("SHAFT", placementMatrix(add(at, [end, 0, -2]), [0, 0, 1], 1.6, 4), COLOURS.scale);
  }

  #drawTrail(foot, state, ratio) {
    const gl = this.gl;
    const last = this.#trail.at(-1);
    if (state === "touching" && (!last || length(last.map((x, i) => x - foot[i])) > 0.6)) this.#trail.push(foot);
    if (this.#trail.length > TRAIL_POINTS) this.#trail.shift();
    const points = this.#trail.flatMap((at, i) => [...at, (i + 1) / this.#trail.length]);
    this.#use(this.trail, { camera: this.camera.matrix, sizePx: 6 * ratio });
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.trailBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points), gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 4, gl.FLOAT, false, 0, 0);
    gl.enable(gl.BLEND);
    gl.drawArrays(gl.POINTS, 0, this.#trail.length);
    gl.disable(gl.BLEND);
  }

  #use({ handle, uniforms }, values) {
    const gl = this.gl;
    gl.useProgram(handle);
    for (const [name, value] of Object.entries(values)) set(gl, uniforms[name], value);
  }

  #drawShape(name, model, tint, strata = 0) {
    const gl = this.gl;
    const { array, count } = this.shapes[name];
    for (const [key, value] of Object.entries({ model, tint, strata })) set(gl, this.solid.uniforms[key], value);
    gl.bindVertexArray(array);
    gl.drawArrays(gl.TRIANGLES, 0, count);
  }
}

function set(gl, uniform, value) {
  if (!uniform) return;
  const { at, type } = uniform;
  const kinds = { [gl.FLOAT]: "1f", [gl.FLOAT_VEC2]: "2fv", [gl.FLOAT_VEC3]: "3fv", [gl.FLOAT_VEC4]: "4fv", [gl.INT_VEC2]: "2iv" };
  if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(at, false, value);
  else gl[`uniform${kinds[type] ?? "1i"}`](at, value);
}

function program(gl, sources) {
  const handle = gl.createProgram();
  sources.forEach((source, i) => {
    const shader = gl.createShader(i === 0 ? gl.VERTEX_SHADER : gl.FRAGMENT_SHADER);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(handle, shader);
  });
  gl.linkProgram(handle);
  if (!gl.getProgramParameter(handle, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(handle));
  const count = gl.getProgramParameter(handle, gl.ACTIVE_UNIFORMS);
  const active = Array.from({ length: count }, (_, i) => gl.getActiveUniform(handle, i));
  return { handle, uniforms: Object.fromEntries(active.map(({ name, type }) => [name, { at: gl.getUniformLocation(handle, name), type }])) };
}

function shape(gl, corners) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW);
  for (const index of [0, 1]) {
    gl.enableVertexAttribArray(index);
    gl.vertexAttribPointer(index, 3, gl.FLOAT, false, 24, 12 * index);
  }
  return { array, count: corners.length / 6 };
}

/** Returns a strip of triangles a row, each ended by the restart index of WebGL 2. */
function strips(columns, rows) {
  const indices = [];
  for (let row = 0; row + 1 < rows; row++) {
    for (let i = 0; i < columns; i++) indices.push((row + 1) * columns + i, row * columns + i);
    indices.push(0xffffffff);
  }
  return new Uint32Array(indices);
}
