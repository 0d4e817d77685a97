// Texts of the page during touch: numbers, captions, cursor.

const element = (id) => document.getElementById(id);
const set = (id, values) => Object.entries(values).forEach(([name, value]) => element(id).setAttribute(name, value));

/** Values beside the sliders. */
export function showValues({ friction, stiffness, texture }, pressN, tipMm) {
  element("tip-is").textContent = tipMm > 0 ? `ball of ${tipMm} mm` : "point";
  element("press-is").textContent = pressN > 0 ? `${pressN.toFixed(1)} N` : "lifted";
  element("friction-is").textContent = friction > 0 ? friction.toFixed(2) : "none";
  element("stiffness-is").textContent = `${stiffness.toFixed(2)} N/mm`;
  element("texture-is").textContent = texture > 0 ? `${texture.toFixed(2)} mm` : "smooth";
}

/** Name and size of the terrain. */
export function showTitle({ name, nx, ny, of, isSquare, range, exaggeration, metresPerMm }) {
  const samples = !isSquare ? `${nx} × ${ny} square cells out of ${of[0]} × ${of[1]} heights` : nx === of[0] && ny === of[1] ? `${nx} × ${ny} heights` : `${nx} × ${ny} of ${of[0]} × ${of[1]} heights`;
  const unit = metresPerMm === null ? "" : " m";
  const heights = `${range.map((height) => Math.round(height).toLocaleString("en")).join(" to ")}${unit}`;
  const steep = exaggeration === null ? "height scale unknown" : exaggeration === 1 ? "true to scale" : `${exaggeration} times as steep as true`;
  element("name").textContent = `${name}: ${samples}, ${heights}, ${steep}`;
}

/** A bar of a round length: `mm` in the hand, `text` on the ground. */
export function scaleBar({ widthMm, metresPerMm }) {
  const perMm = metresPerMm ?? 1;
  const maxLength = 0.45 * widthMm * perMm;
  const ten = 10 ** Math.floor(Math.log10(maxLength));
  const round = [5, 2, 1].find((n) => n * ten <= maxLength) * ten;
  const [value, unit] = metresPerMm === null ? [round, "mm in the hand"] : round < 1000 ? [round, "m"] : [round / 1000, "km"];
  return { mm: round / perMm, text: `${value} ${unit}` };
}

/** Returns the loaded size of page and kernel, kB, without the terrain. */
function loadedKb() {
  const loaded = performance.getEntriesByType("resource").filter(({ name }) => !/terrain\.|geotiff/.test(name));
  return Math.round(loaded.reduce((sum, { decodedBodySize }) => sum + decodedBodySize, 0) / 1000);
}

/** Shows a frame's numbers, and the cursor at the proxy. */
export function showFacts({ camera, canvas, scaleAt }, { arm, proxy, force, state, path }, clock, bar) {
  const px = (at) => {
    const [left, top] = camera.project(at);
    return [left * canvas.clientWidth, top * canvas.clientHeight];
  };
  const [hx, hy] = px([...arm.hand, proxy[2]]);
  const [cx, cy] = px(proxy);
  set("hand", { cx: hx, cy: hy });
  set("band", { x1: hx, y1: hy, x2: cx, y2: cy });
  set("cursor", { transform: `translate(${cx} ${cy})` });
  const newtons = Math.hypot(...force);
  const [ax, ay] = px(proxy.map((mm, axis) => mm + 14 * force[axis]));
  set("newtons", { x: ax + 9, y: ay + 4 });
  element("newtons").textContent = newtons > 0.02 ? `${newtons.toFixed(1)} N` : "";
  const [sx, sy] = px([scaleAt[0] + bar.mm / 2, scaleAt[1], scaleAt[2]]);
  set("scale", { x: sx, y: sy + 20 });
  element("scale").textContent = bar.text;
  const lostText = clock.lostMs >= 1 ? `${(clock.lostMs / 1000).toFixed(1)} s not run: this machine was busy` : "no time lost";
  const pathText = path.isFull ? "path full at 5 minutes" : `${(path.rows / 1000).toFixed(0)} s of path`;
  element("facts").textContent = `${state} · 1,000 steps a second, ${lostText} · ${pathText} · ${loadedKb()} kB of page and kernel · drag or arrow keys turn the view, shift and wheel zoom`;
}
