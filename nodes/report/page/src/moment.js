// The moment that all of the page shows: a cycle of the run. It can be played.

/** Steps of the playing speed. */
export const SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 30];

export class Moment {
  /** `times_s` has the time of each cycle, in ascending order. The moment is the last one at first. */
  constructor(times_s) {
    this.times_s = times_s;
    this.index = times_s.length - 1;
    this.speed = 1;
    this.playing = null;
    this.listeners = [];
  }

  get time_s() {
    return this.times_s[this.index];
  }

  get last() {
    return this.times_s.length - 1;
  }

  /** `listener` is called whenever the moment, the speed or the playing changes. */
  listen(listener) {
    this.listeners.push(listener);
    listener(this);
  }

  set(index) {
    const next = Math.min(this.last, Math.max(0, Math.round(index)));
    if (next === this.index) return;
    this.index = next;
    this.tell();
  }

  /** The latest cycle that is not after a time. */
  setTime(time_s) {
    this.set(this.indexAt(time_s));
  }

  indexAt(time_s) {
    let [low, high] = [0, this.last];
    while (low < high) {
      const middle = Math.ceil((low + high) / 2);
      if (this.times_s[middle] <= time_s) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  setSpeed(speed) {
    this.speed = speed;
    if (this.playing) this.start();
    this.tell();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.start();
  }

  start() {
    if (this.index === this.last) this.set(0);
    const from_s = this.time_s;
    let began_ms = null;
    const playing = {};
    this.playing = playing;
    const step = (now_ms) => {
      if (this.playing !== playing) return;
      began_ms ??= now_ms;
      this.setTime(from_s + ((now_ms - began_ms) / 1000) * this.speed);
      if (this.index === this.last) this.pause();
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
    this.tell();
  }

  pause() {
    if (!this.playing) return;
    this.playing = null;
    this.tell();
  }

  tell() {
    for (const listener of this.listeners) listener(this);
  }
}
