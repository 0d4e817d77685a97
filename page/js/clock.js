// Time in whole ticks: a thousand a second, at any rate of the screen.

export const TICK_HZ = 1000;
/** Maximum ticks of one frame, so that the page does not freeze after a pause. */
export const MAX_TICKS = 50;

/** Computes the number of ticks of a frame, and counts the skipped time. */
export class Clock {
  #last = null;
  #owed = 0;
  /** Skipped milliseconds. */
  lostMs = 0;

  /** Returns the ticks since the last call, at most `MAX_TICKS`. `nowMs` is the frame's time. */
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

  /** Continues after the page was hidden, without the time that has passed. */
  pause() {
    this.#last = null;
  }
}
