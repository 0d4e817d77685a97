// Mouse, finger, pen, keys and gamepad as the hand.

/** Newtons for a step of the wheel. */
const WHEEL_N = 0.2;
/** Force of a finger, N. */
const FINGER_N = 1;
/** A stick's speed, mm/s. */
const STICK_MM_S = 120;

export class Pointer {
  /** Position, 0 to 1 from the left and from the top of the canvas; null before the first input. */
  at = null;

  /** `hand`: `press(newtons)`, `pressN`, `turn(yaw, pitch)`, `zoom(times)`, `move(mm)`. */
  constructor(canvas, hand) {
    this.hand = hand;
    canvas.addEventListener("pointermove", (event) => this.#move(canvas, event));
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.#move(canvas, event);
      if (event.pointerType === "touch") hand.press(FINGER_N);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => event.pointerType === "touch" && hand.press(0));
    }
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    canvas.addEventListener("keydown", (event) => this.#key(event));
  }

  #move(canvas, event) {
    // Any button turns the view, and the hand does not move.
    if (event.buttons !== 0 && event.pointerType === "mouse") return this.hand.turn(event.movementX * 0.006, event.movementY * 0.005);
    const box = canvas.getBoundingClientRect();
    this.at = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  }

  #wheel(event) {
    event.preventDefault();
    const direction = Math.sign(event.deltaY);
    if (event.ctrlKey || event.shiftKey) this.hand.zoom(1 + 0.08 * direction);
    else this.hand.press(this.hand.pressN - WHEEL_N * direction);
  }

  #key(event) {
    const turns = { ArrowLeft: [-0.08, 0], ArrowRight: [0.08, 0], ArrowUp: [0, 0.06], ArrowDown: [0, -0.06] }[event.key];
    const presses = { "+": WHEEL_N, "-": -WHEEL_N }[event.key];
    if (turns) this.hand.turn(...turns);
    if (presses) this.hand.press(this.hand.pressN + presses);
  }

  /** Handles a gamepad: the left stick moves, the right one turns, the right trigger presses. */
  poll(seconds) {
    const pad = navigator.getGamepads?.().find((pad) => pad?.connected);
    if (!pad) return;
    const [x, y, yaw, pitch] = pad.axes.map((axis) => (Math.abs(axis) < 0.12 ? 0 : axis));
    if (x || y) this.hand.move([x * STICK_MM_S * seconds, -y * STICK_MM_S * seconds]);
    if (yaw || pitch) this.hand.turn((yaw ?? 0) * 1.5 * seconds, (pitch ?? 0) * seconds);
    const trigger = pad.buttons[7]?.value ?? 0;
    if (trigger > 0) this.hand.press(4 * trigger);
  }
}
