// What the sensors saw in a cycle: the scan, the reduced cloud in its two parts, the depth image with its mask.

import { Reader, readBlock } from "./payload.js";

/** Groups of views that stay in memory: those around the moment. */
const GROUPS_KEPT = 4;

/** The views, read group by group when one is wanted. */
export class Views {
  constructor(header) {
    this.header = header;
    this.groups = new Map();
  }

  /** View number `index`. */
  async at(index) {
    const group = Math.floor(index / this.header.views_per_group);
    if (!this.groups.has(group)) {
      this.groups.set(group, this.readGroup(group));
      if (this.groups.size > GROUPS_KEPT) this.groups.delete(this.groups.keys().next().value);
    }
    return (await this.groups.get(group))[index % this.header.views_per_group];
  }

  async readGroup(group) {
    const reader = new Reader(await readBlock(`views-${group}`));
    const views = [];
    while (reader.at < reader.bytes.length) views.push(this.readView(reader));
    return views;
  }

  readView(reader) {
    return { scan: this.readScan(reader), cloud: this.readCloud(reader), depth: readDepth(reader) };
  }

  /** The points of the scan in the rig's frame, x y z; null where there is no scan. */
  readScan(reader) {
    const beams = reader.u16();
    const [first_rad, step_rad] = [reader.f32(), reader.f32()];
    const ranges = new Uint16Array(beams);
    reader.differences16(beams, ranges);
    if (beams === 0) return null;
    const points_m = [];
    ranges.forEach((range, beam) => {
      if (range === 0) return;
      const [range_m, azimuth_rad] = [range * this.header.range_step_m, first_rad + beam * step_rad];
      points_m.push(range_m * Math.cos(azimuth_rad), range_m * Math.sin(azimuth_rad), 0);
    });
    return new Float32Array(points_m);
  }

  /** The points of the reduced cloud in the rig's frame, x y z; the last `dynamic` of them move. */
  readCloud(reader) {
    const [count, dynamic] = [reader.u32(), reader.u32()];
    const steps = new Int16Array(3 * count);
    for (const axis of [0, 1, 2]) reader.differences16(count, steps, axis, 3);
    const points_m = Float32Array.from(steps, (step) => step * this.header.cloud_step_m);
    return { points_m, count, dynamic };
  }
}

/** The depth image: a code a pixel, 0 where nothing came back, and whether it shows something that moves; or null. */
function readDepth(reader) {
  const [width, height] = [reader.u16(), reader.u16()];
  if (width === 0) return null;
  const codes = reader.image8(width, height);
  const bits = reader.take(Math.ceil((width * height) / 8));
  const moves = (pixel) => (bits[pixel >> 3] >> (pixel & 7)) & 1;
  return { width, height, codes, moves };
}
