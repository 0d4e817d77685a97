// The page: loads the kernel and a terrain, and runs frame by frame.

import { Clock, TICK_HZ } from "./clock.js";
import { load } from "./kernel.js";
import { command, npy, surfaceFile } from "./path.js";
import { Pointer } from "./pointer.js";
import { read } from "./read/file.js";
import { Sound } from "./sound.js";
import { fit, generate } from "./terrain.js";
import { Touch } from "./touch.js";
import { Scene } from "./view/scene.js";
import { scaleBar, showFacts, showTitle, showValues } from "./words.js";

const MAX_PRESS_N = 4;
const WAVELENGTH_MM = 2;
/** Radians a tick of the pen's automatic path until the first input. */
const WANDER = 0.0006;
const PRESETS = { Ice: [0, 0.5, 0], Wood: [0.35, 1, 0.05], Rubber: [1, 0.25, 0], Gravel: [0.5, 0.8, 0.22] };
const element = (id) => document.getElementById(id);
const sliders = ["friction", "stiffness", "texture"];

function surface() {
  const [friction, stiffness, texture] = sliders.map((id) => Number(element(id).value));
  return { friction, stiffness, texture, wavelength: WAVELENGTH_MM };
}

function showMessage(text) {
  element("said").textContent = text;
}

/** Returns the server's terrain, or one by formula. */
async function firstTerrain() {
  const about = await fetch("terrain.json").then((answer) => (answer.ok ? answer.json() : null));
  if (about === null || !about.file) return generate(7);
  const answer = await fetch(about.file);
  if (!answer.ok) throw new Error(`The terrain ${about.file} is not beside this page (${answer.status}). Make the folder again: cargo xtask demo --touch FILE.`);
  return { ...(await read(about.file, new Uint8Array(await answer.arrayBuffer()))), ...about };
}

function save(name, content) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content]));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

async function main() {
  const scene = new Scene(element("view"));
  const kernel = await load("kernel.wasm");
  const touch = new Touch(kernel, fit(await firstTerrain()), surface(), Number(element("tip").value));
  const [clock, sound] = [new Clock(), new Sound()];
  let bar = null;
  let seed = 7;

  const setTerrain = (raw) => {
    const terrain = fit(raw);
    touch.setTerrain(terrain);
    display(terrain);
  };
  const display = (terrain) => {
    scene.setTerrain(terrain);
    bar = scaleBar(terrain);
    showTitle(terrain);
  };
  const updateValues = () => showValues(surface(), touch.arm.pressN, Number(element("tip").value));
  const hand = {
    get pressN() { return touch.arm.pressN; },
    press(newtons) {
      touch.arm.pressN = Math.round(Math.max(0, Math.min(MAX_PRESS_N, newtons)) * 10) / 10;
      element("press").value = touch.arm.pressN;
      updateValues();
    },
    turn(yaw, pitch) {
      scene.camera.yaw += yaw;
      scene.camera.pitch = Math.max(0.25, Math.min(1.5, scene.camera.pitch + pitch));
    },
    zoom(times) { scene.camera.distance = Math.max(120, Math.min(800, scene.camera.distance * times)); },
    move(mm) {
      pointer.at = pointer.at ?? [];
      touch.point(touch.arm.pointer.map((at, axis) => at + mm[axis]));
    },
  };
  const pointer = new Pointer(element("view"), hand);

  const applySurface = () => {
    touch.setSurface(surface());
    updateValues();
  };
  element("tip").addEventListener("input", updateValues);
  element("tip").addEventListener("change", () => {
    try {
      touch.setTip(Number(element("tip").value));
    } catch (why) {
      showMessage(why.message);
      element("tip").value = touch.tipMm;
      updateValues();
    }
  });
  for (const id of sliders) element(id).addEventListener("input", applySurface);
  element("press").addEventListener("input", (event) => hand.press(Number(event.target.value)));
  for (const [name, values] of Object.entries(PRESETS)) {
    const button = document.createElement("button");
    button.textContent = name;
    button.addEventListener("click", () => {
      sliders.forEach((id, i) => (element(id).value = values[i]));
      applySurface();
    });
    element("presets").append(button);
  }
  element("sound").addEventListener("click", () => {
    sound.toggle();
    element("sound").textContent = sound.isOn ? "Sound off" : "Sound on";
  });
  element("new").addEventListener("click", () => setTerrain(generate((seed += 1))));
  element("save").addEventListener("click", () => {
    const { isMixed } = touch.path;
    if (isMixed) kernel.recompute(touch.surface, touch.path);
    save("path.csv", touch.path.csv());
    save("terrain.npy", npy(touch.terrain));
    const surface = surfaceFile(touch.surface);
    if (surface) save("surface.toml", surface);
    element("saved").hidden = false;
    element("mixed").hidden = !isMixed;
    element("command").textContent = command(touch.terrain, touch.surface, touch.tipMm);
  });
  const openFile = async (file) => {
    if (!file) return;
    try {
      showMessage(`Reading ${file.name}…`);
      setTerrain(await read(file.name, new Uint8Array(await file.arrayBuffer())));
      showMessage("");
    } catch (why) {
      showMessage(why.message);
    }
  };
  element("open").addEventListener("click", () => element("file").click());
  element("file").addEventListener("change", (event) => openFile(event.target.files[0]));
  const drop = (name, is) => addEventListener(name, (event) => {
    event.preventDefault();
    document.body.classList.toggle("dropping", is);
    if (name === "drop") openFile(event.dataTransfer.files[0]);
  });
  drop("dragover", true);
  drop("dragleave", false);
  drop("drop", false);
  element("said").addEventListener("click", () => showMessage(""));
  document.addEventListener("visibilitychange", () => clock.pause());

  let phase = 0;
  const frame = (now) => {
    const ticks = clock.ticks(now);
    pointer.poll(ticks / TICK_HZ);
    const at = pointer.at?.length ? scene.camera.pick(pointer.at, touch.terrain.topMm * 0.3) : null;
    if (at) touch.point(at);
    let change = 0;
    for (let i = 0; i < ticks; i++) {
      phase += WANDER;
      if (pointer.at === null) touch.point([touch.terrain.widthMm * (0.5 + 0.3 * Math.sin(2 * phase)), touch.terrain.depthMm * (0.5 + 0.3 * Math.sin(3 * phase + 1))]);
      const before = touch.force;
      try {
        touch.tick();
      } catch (why) {
        showMessage(why.message);
        break;
      }
      change += Math.hypot(...touch.force.map((n, axis) => n - before[axis])) / ticks;
    }
    sound.update(Math.hypot(...touch.force), change);
    scene.draw(touch, bar.mm);
    showFacts(scene, touch, clock, bar);
    requestAnimationFrame(frame);
  };
  display(touch.terrain);
  hand.press(1);
  showMessage("");
  // For tests.
  globalThis.hapterra = { touch, clock, scene, pointer, sound };
  requestAnimationFrame(frame);
}

main().catch((why) => showMessage(why.message));
