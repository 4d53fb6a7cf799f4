// How many points a frame draws: as many as the machine draws in time, by how long its frames take.

/** A frame of a moving view is to take so long, give or take a share: 25 to 40 frames a second. */
const GOAL_MS = 33;
const TOLERANCE = 0.2;
/** By what the points of a frame change at most from one frame to the next. */
const MOST_LESS = 0.3;
const MOST_MORE = 1.1;
/** Points of a frame of a moving view: at first, on a phone at first, and the least, in which a room is recognised just so. */
const POINTS_AT_FIRST = 500_000;
const POINTS_AT_FIRST_ON_PHONE = 150_000;
export const LEAST_POINTS = 5_000;
/** A frame of a view that rests may have so many times the points, up to this number. */
const LONGER_AT_REST = 10;
const POINTS_AT_REST = 500_000;

/** The points a frame, steered by the times of the frames before. */
export class Detail {
  constructor(isPhone) {
    this.moving = isPhone ? POINTS_AT_FIRST_ON_PHONE : POINTS_AT_FIRST;
    /** The mean time of the last frames of a moving view, 0 before the first. */
    this.frame_ms = 0;
    this.last = null;
  }

  /** Points that a frame draws. */
  points(moves) {
    return moves ? this.moving : Math.max(this.moving, Math.min(LONGER_AT_REST * this.moving, POINTS_AT_REST));
  }

  /** A frame begins at `now_ms`. The view moves or rests, and `total` points would be drawn at most. */
  begin(moves, now_ms, total) {
    const { last } = this;
    this.last = { moves, now_ms, drawn: 0 };
    if (last?.moves !== moves) return;
    const took_ms = now_ms - last.now_ms;
    if (moves) this.steer(took_ms, last.took_ms ?? took_ms, total);
    // What a resting view draws in its longer time says what a moving one can.
    else if (took_ms > LONGER_AT_REST * GOAL_MS) this.moving = Math.min(this.moving, Math.max(LEAST_POINTS, (last.drawn * GOAL_MS) / took_ms));
  }

  steer(took_ms, before_ms, total) {
    this.last.took_ms = took_ms;
    this.frame_ms = this.frame_ms === 0 ? took_ms : 0.7 * this.frame_ms + 0.3 * took_ms;
    // A slow frame beside a fast one has other causes.
    const share = Math.min(took_ms, before_ms) / GOAL_MS;
    if (Math.abs(share - 1) < TOLERANCE || (share < 1 && this.moving >= total)) return;
    this.moving = Math.max(LEAST_POINTS, this.moving * Math.min(Math.max(1 / share, MOST_LESS), MOST_MORE));
  }

  /** The frame has drawn so many points. */
  drew(points) {
    this.last.drawn = points;
  }

  /** No frame follows: the time until the next one is none of the machine's. */
  pause() {
    this.last = null;
  }
}
