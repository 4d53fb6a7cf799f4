// The time line: a slider over the cycles, with what was found in each drawn behind it.

import { button, choice, element } from "./dom.js";
import { SPEEDS } from "./moment.js";

export function timeLine(moment, cycles) {
  const play = button("Play", () => moment.toggle(), { class: "play" });
  const input = element("input", {
    type: "range", min: 0, max: moment.last, step: 1, value: moment.index, class: "moment", "aria-label": "moment",
    oninput: () => {
      moment.pause();
      moment.set(input.valueAsNumber);
    },
  });
  const text = element("output", { class: "time" });
  const speeds = SPEEDS.map((speed) => [String(speed), `${speed} ×`]);
  const speed = choice("Speed", speeds, "1", (value) => moment.setSpeed(Number(value)));
  const step = (by) => () => {
    moment.pause();
    moment.set(moment.index + by);
  };
  moment.listen(() => {
    play.textContent = moment.playing ? "Pause" : "Play";
    input.value = moment.index;
    const cycle = cycles[moment.index];
    text.textContent = `${moment.time_s.toFixed(2)} s, cycle ${cycle.index}`;
    input.setAttribute("aria-valuetext", text.textContent);
  });
  return element("div", { class: "time-line" },
    play, button("◀", step(-1), { "aria-label": "one cycle back" }), button("▶", step(1), { "aria-label": "one cycle on" }),
    element("div", { class: "track" }, foundStrip(cycles), input), text, speed);
}

/** A strip that marks the cycles with a zone (upper half) and with points that move (lower half). */
function foundStrip(cycles) {
  const width = Math.min(cycles.length, 2000);
  const canvas = element("canvas", { class: "found", width, height: 2, "aria-hidden": "true" });
  const context = canvas.getContext("2d");
  const style = getComputedStyle(document.documentElement);
  cycles.forEach((cycle, index) => {
    const x = Math.floor((index * width) / cycles.length);
    const mark = (row, name) => {
      context.fillStyle = style.getPropertyValue(name).trim();
      context.fillRect(x, row, 1, 1);
    };
    if (cycle.zones.length > 0) mark(0, "--in-zone");
    if (cycle.counts.dynamic > 0) mark(1, "--dynamic");
  });
  return canvas;
}
