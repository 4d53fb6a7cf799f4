// How many points a frame draws, on machines that are made up: what a frame takes is computed, and no clock is read.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Detail, LEAST_POINTS } from "../src/detail.js";

const TOTAL = 10_000_000;

/** A view that rests until it is complete, and is turned then. A frame takes `frame_ms`, and `point_ns` more a point. */
function turned({ frame_ms, point_ns, frames = 100, hiccup_ms = 0 }) {
  const detail = new Detail(false);
  const took_ms = (points) => Math.max(1000 / 60, frame_ms + points * point_ns * 1e-6);
  let now_ms = 0;
  for (let drawn = 0; drawn < TOTAL; ) {
    detail.begin(false, now_ms, TOTAL);
    const points = Math.min(detail.points(false), TOTAL - drawn);
    detail.drew(points);
    drawn += points;
    now_ms += took_ms(points);
  }
  detail.pause();
  const shown = [];
  for (let frame = 0; frame < frames; frame += 1) {
    detail.begin(true, now_ms, TOTAL);
    const points = Math.min(detail.points(true), TOTAL);
    detail.drew(points);
    const frame_ms = took_ms(points) + (frame % 10 === 5 ? hiccup_ms : 0);
    now_ms += frame_ms;
    shown.push({ points, frame_ms });
  }
  return shown;
}

test("a slow machine draws so few points that a view turns smoothly, from the first frames on", () => {
  const shown = turned({ frame_ms: 18, point_ns: 1300 });
  assert.ok(shown.slice(3).every(({ frame_ms }) => frame_ms <= 42), JSON.stringify(shown.slice(0, 8)));
  assert.ok(shown.every(({ points }) => points >= LEAST_POINTS && points < 60_000));
});

test("a machine that is too slow with any number of points draws the least that shows something", () => {
  assert.equal(turned({ frame_ms: 80, point_ns: 1300 }).at(-1).points, LEAST_POINTS);
});

test("a fast machine draws more and more, up to all", () => {
  assert.equal(turned({ frame_ms: 2, point_ns: 1 }).at(-1).points, TOTAL);
});

test("single slow frames leave out nothing", () => {
  const [with_hiccups, without] = [300, 0].map((hiccup_ms) => turned({ frame_ms: 4, point_ns: 20, hiccup_ms }));
  assert.ok(with_hiccups.at(-1).points >= 0.8 * without.at(-1).points, `${with_hiccups.at(-1).points} of ${without.at(-1).points}`);
});
