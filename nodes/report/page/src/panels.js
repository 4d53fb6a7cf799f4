// What the sensors saw at the moment, as flat pictures: the scan with its zones from above, the depth image with its mask.

import { element, grouped } from "./dom.js";
import { COLOURS, trackColour } from "./colours.js";
import { poseMatrix } from "./overlay.js";
import { Vector3 } from "three";

const SCAN_PX = 480;
/** The scan's picture reaches at least so far; more where its returns do. */
const LEAST_REACH_M = 4;

/** The panels of a run: an element, and `show` for a moment. */
export class Panels {
  constructor(header, run) {
    this.header = header;
    this.run = run;
    this.scan = element("canvas", { width: SCAN_PX, height: SCAN_PX, role: "img", "aria-label": "the scan" });
    this.depth = element("canvas", { width: 160, height: 120, class: "depth", role: "img", "aria-label": "the depth image" });
    this.scanNote = element("figcaption");
    this.depthNote = element("figcaption");
    this.facts = element("table", { class: "moment-facts" });
    this.depthFigure = element("figure", {}, this.depth, this.depthNote);
    this.element = element("div", { class: "panels" },
      element("figure", {}, this.scan, this.scanNote), this.depthFigure, element("div", { class: "scroll", tabindex: "0" }, this.facts));
  }

  show(index, view, viewIndex) {
    const cycle = this.run.cycles[index];
    this.showFacts(cycle);
    const late = viewIndex === null || viewIndex === index ? "" : ` (of ${this.run.cycles[viewIndex].t_s.toFixed(2)} s)`;
    this.drawScan(cycle, view);
    this.scanNote.textContent = `Scan and zones${late}`;
    this.scan.setAttribute("aria-label", `The scan from above with ${cycle.zones.length} zones and ${cycle.tracks.length} tracks.`);
    this.depthFigure.hidden = !view?.depth;
    if (view?.depth) {
      const moving = drawDepth(this.depth, view.depth);
      this.depthNote.textContent = `Depth image${late}: bright is near, orange moves (${(100 * moving).toFixed(1)} %), dark blue has no return`;
      this.depth.setAttribute("aria-label", `The depth image; ${(100 * moving).toFixed(1)} percent of it is masked as moving.`);
    }
  }

  showFacts(cycle) {
    const degrees = (rad) => ((rad * 180) / Math.PI).toFixed(0);
    const zones = cycle.zones.map((zone) => `${degrees(zone.from_rad)} to ${degrees(zone.to_rad)}°${zone.held ? ` (held ${zone.held})` : ""}`);
    const tracks = cycle.tracks.map(([id]) => `#${id}`);
    const rows = [
      ["time", `${cycle.t_s.toFixed(2)} s`],
      ["cycle", cycle.index],
      ["zones", zones.join(", ") || "none"],
      ["tracks", tracks.join(", ") || "none"],
      ["points of the cloud", counted(cycle.counts.before)],
      ["reduced", counted(cycle.counts.reduced)],
      ["in a zone", counted(cycle.counts.in_zone)],
      ["taken for moving", grouped(cycle.counts.dynamic)],
      [`map, ${this.header.map_unit}`, grouped(cycle.counts.map)],
    ].filter(([, value]) => value !== null);
    this.facts.replaceChildren(element("caption", {}, "At this moment"),
      element("tbody", {}, ...rows.map(([name, value]) => element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, String(value))))));
  }

  drawScan(cycle, view) {
    const context = this.scan.getContext("2d");
    const middle = SCAN_PX / 2;
    const scan = view?.scan ?? null;
    const reach_m = scan ? reachOf(scan) : LEAST_REACH_M;
    const px = (middle - 8) / reach_m;
    // Ahead is up, left is left.
    const place = (x, y) => [middle - y * px, middle - x * px];
    context.fillStyle = "#0f141b";
    context.fillRect(0, 0, SCAN_PX, SCAN_PX);
    drawRings(context, middle, px, reach_m);
    for (const zone of cycle.zones) drawZone(context, middle, px, reach_m, zone);
    if (view) {
      const moving = view.cloud.points_m.subarray(3 * (view.cloud.count - view.cloud.dynamic));
      dots(context, moving, place, COLOURS.moving, 3);
    }
    if (scan) dots(context, placedScan(scan, this.header.rig_from_lidar), place, COLOURS.scan, 3);
    const rigFromMap = poseMatrix(cycle.pose).invert();
    for (const [id, ...at_m] of cycle.tracks) {
      const at = new Vector3(...at_m).applyMatrix4(rigFromMap);
      const [x, y] = place(at.x, at.y);
      context.strokeStyle = trackColour(id);
      context.lineWidth = 2;
      context.beginPath();
      context.arc(x, y, 9, 0, 2 * Math.PI);
      context.stroke();
      label(context, `#${id}`, x + 12, y + 4, trackColour(id));
    }
    context.fillStyle = COLOURS.path;
    context.beginPath();
    context.moveTo(middle, middle - 9);
    context.lineTo(middle + 6, middle + 6);
    context.lineTo(middle - 6, middle + 6);
    context.fill();
  }
}

/** A count as text; null where it is not known. */
function counted(count) {
  return count === undefined || count === null ? null : grouped(count);
}

/** The range within which 98 % of the returns are, in whole metres. */
function reachOf(scan) {
  const ranges = [];
  for (let n = 0; n < scan.length; n += 3) ranges.push(Math.hypot(scan[n], scan[n + 1]));
  ranges.sort((one, other) => one - other);
  return Math.max(LEAST_REACH_M, Math.ceil(ranges[Math.floor(ranges.length * 0.98)] ?? 0));
}

function placedScan(scan, rigFromLidar) {
  const placed = new Float32Array(scan.length);
  const [matrix, at] = [poseMatrix(rigFromLidar), new Vector3()];
  for (let n = 0; n < scan.length; n += 3) at.fromArray(scan, n).applyMatrix4(matrix).toArray(placed, n);
  return placed;
}

function dots(context, points_m, place, colour, size) {
  context.fillStyle = colour;
  for (let n = 0; n < points_m.length; n += 3) {
    const [x, y] = place(points_m[n], points_m[n + 1]);
    context.fillRect(x - size / 2, y - size / 2, size, size);
  }
}

function drawRings(context, middle, px, reach_m) {
  const step_m = reach_m > 12 ? 5 : reach_m > 6 ? 2 : 1;
  context.strokeStyle = COLOURS.grid;
  context.lineWidth = 1;
  for (let radius_m = step_m; radius_m <= reach_m; radius_m += step_m) {
    context.beginPath();
    context.arc(middle, middle, radius_m * px, 0, 2 * Math.PI);
    context.stroke();
    label(context, `${radius_m} m`, middle + 3, middle - radius_m * px + 13, COLOURS.soft);
  }
}

function drawZone(context, middle, px, reach_m, { from_rad, to_rad, held }) {
  // Canvas angles go clockwise from the right; azimuths counter-clockwise from ahead, which is up.
  const angle = (azimuth) => -azimuth - Math.PI / 2;
  context.fillStyle = held > 0 ? `${COLOURS.held}55` : `${COLOURS.zone}66`;
  context.beginPath();
  context.moveTo(middle, middle);
  context.arc(middle, middle, reach_m * px, angle(to_rad), angle(from_rad));
  context.fill();
}

function label(context, text, x, y, colour) {
  context.fillStyle = colour;
  context.font = "13px system-ui, sans-serif";
  context.fillText(text, x, y);
}

/** Draws a depth image with its mask; returns the share of the pixels that move. */
function drawDepth(canvas, { width, height, codes, moves }) {
  Object.assign(canvas, { width, height });
  const context = canvas.getContext("2d");
  const image = context.createImageData(width, height);
  const grey = greys(codes);
  let moving = 0;
  codes.forEach((code, pixel) => {
    const light = grey[code];
    const stripe = ((pixel % width) + Math.floor(pixel / width)) % 4 < 2 ? 1 : 0.8;
    const isMoving = moves(pixel);
    moving += isMoving;
    const colour = isMoving ? [255 * stripe, (0.35 * light + 60) * stripe, 0.15 * light] : code === 0 ? [14, 22, 48] : [light, light, light];
    image.data.set([...colour, 255], 4 * pixel);
  });
  context.putImageData(image, 0, 0);
  return moving / codes.length;
}

/** The grey of each code: from the nearest depth of the image, bright, to its farthest; one in a hundred at each end aside. */
function greys(codes) {
  const sorted = codes.filter((code) => code > 0).sort();
  const [near, far] = [0.01, 0.99].map((share) => sorted[Math.floor(share * (sorted.length - 1))] ?? 1);
  return Array.from({ length: 256 }, (_, code) => {
    const share = (code - near) / Math.max(far - near, 1);
    return code === 0 ? 0 : 245 - 165 * Math.min(1, Math.max(0, share));
  });
}
