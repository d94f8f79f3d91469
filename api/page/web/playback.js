// One clock for everything that is drawn: the moment shown, whether it runs, and how fast.

/** Speed factors to choose from. */
export const PLAY_SPEEDS = [1, 2, 5, 10, 30, 60, 120, 300];
/** A moment this close to the end counts as the end, s. */
const AT_THE_END_S = 0.5;

/** The moment that is shown. */
export class Playback {
  /** @param {() => void} moved is called when the moment or its span changes */
  constructor(moved) {
    this.moved = moved;
    this.from = NaN;
    this.to = NaN;
    this.t = NaN;
    this.playing = false;
    this.speed = 30;
    /** Whether it stays at the end while the recording grows. */
    this.atEnd = true;
    this.frame = 0;
  }

  /**
   * Sets the range. At the end the moment follows the end.
   * @param {[number, number]} span
   */
  spans([from, to]) {
    if (from === this.from && to === this.to) return;
    [this.from, this.to] = [from, to];
    if (this.atEnd || !Number.isFinite(this.t)) this.t = to;
    this.moved();
  }

  /** @param {number} t */
  seek(t) {
    if (!Number.isFinite(this.from)) return;
    this.t = Math.min(Math.max(t, this.from), this.to);
    this.atEnd = this.to - this.t < AT_THE_END_S;
    this.moved();
  }

  goToEnd() {
    this.pause();
    this.seek(this.to);
  }

  pause() {
    this.playing = false;
    cancelAnimationFrame(this.frame);
    this.moved();
  }

  play() {
    if (!Number.isFinite(this.from)) return;
    if (this.to - this.t < AT_THE_END_S) this.t = this.from;
    [this.playing, this.atEnd] = [true, false];
    let last = performance.now();
    const step = (/** @type {number} */ now) => {
      this.t = Math.min(this.t + ((now - last) / 1000) * this.speed, this.to);
      last = now;
      if (this.t >= this.to) return this.goToEnd();
      this.frame = requestAnimationFrame(step);
      this.moved();
    };
    this.frame = requestAnimationFrame(step);
    this.moved();
  }

  toggle() {
    if (this.playing) this.pause(); else this.play();
  }
}
