// The page's charts follow the moment, and pointing at one sets it.

const SVG = "http://www.w3.org/2000/svg";

/** Links every chart whose axis to the right is the time. */
export function linkCharts(moment) {
  for (const svg of document.querySelectorAll("svg[data-time]")) link(svg, moment);
}

function link(svg, moment) {
  const [x0, x1, from_s, to_s, top, bottom] = svg.dataset.time.split(" ").map(Number);
  const cursor = document.createElementNS(SVG, "line");
  cursor.setAttribute("class", "cursor");
  cursor.setAttribute("y1", top);
  cursor.setAttribute("y2", bottom);
  svg.append(cursor);
  moment.listen(() => {
    const x = x0 + ((moment.time_s - from_s) / Math.max(to_s - from_s, 1e-9)) * (x1 - x0);
    cursor.setAttribute("x1", x);
    cursor.setAttribute("x2", x);
  });
  const point = (event) => {
    const box = svg.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * svg.viewBox.baseVal.width;
    if (x < x0 || x > x1) return;
    moment.pause();
    moment.setTime(from_s + ((x - x0) / (x1 - x0)) * (to_s - from_s) + 1e-6);
  };
  svg.addEventListener("pointermove", point);
  svg.addEventListener("pointerdown", point);
}
