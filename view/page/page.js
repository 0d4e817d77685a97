// The page: starts rerun's viewer and sends it the stream of hapterra-view.
//
// The stream is read only while the page is visible, because a hidden viewer draws nothing and
// would only accumulate its input. A page that becomes visible again reloads: the history has other
// pieces than the page has received, and the viewer would keep both. A page that is drawn by
// software can handle only few entries a second, and requests the events a second at a time. The
// viewer's memory grows with every sample, so the page reloads at a certain size; but not at once
// if the history alone is larger.
"use strict";

const CHANNEL = "hapterra";
const RETRY_MS = 1000;
const MIN_RELOAD_MS = 20000;
const KEEP_ALIVE = 0xffffffff;
const LOST = 0xfffffffe;

const message = document.getElementById("said");
const pageBytes = Number(message.dataset.pageBytes);

// For tests and statistics.
const state = { pieces: 0, bytes: 0, connections: 0, memory: 0, isOver: false, isLost: false, isStarted: false };
window.hapterra = state;

// The layout is made for a dark sky: the browser's preference is ignored.
const media = window.matchMedia.bind(window);
window.matchMedia = (query) => {
  const scheme = /prefers-color-scheme:\s*(\w+)/.exec(query);
  return media(scheme === null ? query : scheme[1] === "dark" ? "all" : "not all");
};

function showMessage(text) {
  message.textContent = text;
}

function isVisible() {
  return document.visibilityState !== "hidden";
}

function whenVisible() {
  return new Promise((resolve) => {
    const resolveIfVisible = () => {
      if (isVisible()) {
        document.removeEventListener("visibilitychange", resolveIfVisible);
        resolve();
      }
    };
    document.addEventListener("visibilitychange", resolveIfVisible);
    resolveIfVisible();
  });
}

// Returns true if the browser draws with the processor only, by the name of its renderer.
function isDrawnBySoftware() {
  const context = document.createElement("canvas").getContext("webgl2");
  const unmasked = context?.getExtension("WEBGL_debug_renderer_info");
  const name = context?.getParameter(unmasked?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER);
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

// Bytes of a stream, read in blocks of a given size.
class Bytes {
  constructor(reader) {
    this.reader = reader;
    this.parts = [];
    this.length = 0;
  }

  // Returns the next `count` bytes; null if the stream ends before.
  async take(count) {
    while (this.length < count) {
      const { done, value } = await this.reader.read();
      if (done) return null;
      this.parts.push(value);
      this.length += value.length;
    }
    const taken = new Uint8Array(count);
    let filled = 0;
    while (filled < count) {
      const part = this.parts[0];
      const some = part.subarray(0, count - filled);
      taken.set(some, filled);
      filled += some.length;
      if (some.length === part.length) this.parts.shift();
      else this.parts[0] = part.subarray(some.length);
    }
    this.length -= count;
    return taken;
  }
}

// Reads the stream once; returns true if the session has ended.
async function read(viewer, memory, feed) {
  const controller = new AbortController();
  const abortIfHidden = () => isVisible() || controller.abort();
  document.addEventListener("visibilitychange", abortIfHidden);
  try {
    const answer = await fetch(feed, { signal: controller.signal, cache: "no-store" });
    if (!answer.ok) return false;
    if (state.connections > 0) location.reload();
    state.connections += 1;
    const bytes = new Bytes(answer.body.getReader());
    for (;;) {
      const head = await bytes.take(4);
      if (head === null) return false;
      const length = new DataView(head.buffer).getUint32(0, true);
      state.isLost = length === LOST;
      if (length === 0 || state.isLost) return true;
      if (length === KEEP_ALIVE) continue;
      const piece = await bytes.take(length);
      if (piece === null) return false;
      viewer.send_rrd_to_channel(CHANNEL, piece);
      showMessage("");
      state.pieces += 1;
      state.bytes += length;
      state.memory = memory.buffer.byteLength;
      if (state.memory > pageBytes && performance.now() > MIN_RELOAD_MS) location.reload();
    }
  } catch (error) {
    return false;
  } finally {
    document.removeEventListener("visibilitychange", abortIfHidden);
    controller.abort();
  }
}

async function follow(viewer, memory, feed) {
  for (;;) {
    await whenVisible();
    if (await read(viewer, memory, feed)) break;
    if (isVisible() && state.connections > 0) showMessage("hapterra-view has ended, or this page was too slow. Trying again…");
    await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
  }
  state.isOver = true;
  showMessage(state.isLost ? "hapterra ended unexpectedly: it was killed, or it crashed. The page shows its last data." : "");
}

async function main() {
  const program = await wasm_bindgen({ module_or_path: fetch("re_viewer_bg.wasm") });
  const query = new URLSearchParams(location.search);
  const viewer = new wasm_bindgen.WebHandle({
    hide_welcome_screen: true,
    persist: false,
    enable_history: false,
    notebook: false,
    theme: "dark",
    render_backend: query.get("renderer") ?? "webgl",
    panel_state_overrides: { top: "Hidden", blueprint: "Hidden", selection: "Hidden" },
  });
  await viewer.start(document.getElementById("view"));
  state.isStarted = true;
  // The device's second that is shown, if there is one.
  state.shown = () => {
    const recording = viewer.get_active_recording_id();
    return recording ? viewer.get_time_for_timeline(recording, "time") / 1e9 : null;
  };
  viewer.open_channel(CHANNEL, CHANNEL);
  setInterval(() => {
    if (viewer.has_panicked()) location.reload();
  }, 2000);
  const isGathered = query.has("gathered") || isDrawnBySoftware();
  await follow(viewer, program.memory, isGathered ? "feed?gathered" : "feed");
}

main().catch((error) => showMessage(`The viewer cannot start: ${error}`));
