// The messages of the live view, as `message.rs` and `moment.rs` of the crate live-view write them.

import { inflated, Reader } from "./payload.js";
import { Views } from "./views.js";

export const KINDS = { map: 1, moment: 2, status: 3, mesh: 4 };

/** The kind of a message, and a reader of its body. */
export async function openMessage(bytes) {
  const body = bytes.subarray(2);
  return { kind: bytes[0], reader: new Reader(bytes[1] ? await inflated(body) : body) };
}

/** Blocks of the map, each whole; one without points has gone. */
export function readMap(reader) {
  const [epoch, voxel_m, block_m, step_m] = [reader.u32(), reader.f32(), reader.f32(), reader.f32()];
  const [tileBlocks, hasColours, total, count] = [reader.u16(), reader.u16() === 1, reader.u32(), reader.u32()];
  const blocks = Array.from({ length: count }, () => ({ key: [reader.i32(), reader.i32(), reader.i32()], count: reader.u32() }));
  for (const block of blocks) {
    block.steps = new Uint16Array(3 * block.count);
    for (const axis of [0, 1, 2]) reader.differences16(block.count, block.steps, axis, 3);
    block.colours = hasColours ? reader.colours(block.count) : null;
  }
  return { epoch, voxel_m, block_m, step_m, tileBlocks, hasColours, total, blocks };
}

/** Triangles by blocks, each whole; a block without has none any more, and the first message takes the place of all. Three corners a triangle, in steps from an origin. */
export function readTriangles(reader) {
  const [isFirst, total, refused, count] = [reader.u32() === 1, reader.u32(), reader.u32(), reader.u32()];
  const blocks = Array.from({ length: count }, () => {
    const block = { key: [reader.i32(), reader.i32(), reader.i32()], count: 3 * reader.u32() };
    if (block.count === 0) return block;
    block.origin_m = [reader.f32(), reader.f32(), reader.f32()];
    block.step_m = reader.f32();
    const hasColours = reader.u16() === 1;
    block.steps = new Uint16Array(3 * block.count);
    for (const axis of [0, 1, 2]) reader.differences16(block.count, block.steps, axis, 3);
    block.colours = hasColours ? reader.colours(block.count) : null;
    return block;
  });
  return { isFirst, total, refused, blocks };
}

/** The latest cycle with what the sensors saw in it. */
export function readMoment(reader, header) {
  const cycle = readText(reader, reader.u32());
  return { cycle, view: new Views(header).readView(reader) };
}

/** The state of the nodes. */
export function readStatus(reader) {
  return readText(reader, reader.bytes.length);
}

function readText(reader, length) {
  return JSON.parse(new TextDecoder().decode(reader.take(length)));
}
