// Time in whole ticks: a thousand a second, at any rate of the screen.

export const TICK_HZ = 1000;
/** Ticks that one frame runs at most: after a pause the page does not freeze to catch up. */
export const MAX_TICKS = 50;

/** Says how many ticks a frame has to run, and counts the time that was given up. */
export class Clock {
  #last = null;
  #owed = 0;
  /** Milliseconds that were not run. */
  lostMs = 0;

  /** Whole ticks since the last call, at most `MAX_TICKS`. `nowMs` is the frame's time. */
  ticks(nowMs) {
    const passed = this.#last === null ? 0 : Math.max(0, nowMs - this.#last);
    this.#last = nowMs;
    this.#owed += (passed * TICK_HZ) / 1000;
    const whole = Math.floor(this.#owed);
    const run = Math.min(whole, MAX_TICKS);
    this.lostMs += ((whole - run) * 1000) / TICK_HZ;
    this.#owed -= whole;
    return run;
  }

  /** A page that was hidden goes on without the time that passed. */
  pause() {
    this.#last = null;
  }
}
