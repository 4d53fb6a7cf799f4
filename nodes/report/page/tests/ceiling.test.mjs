// Where maps that are made up have a ceiling.

import assert from "node:assert/strict";
import { test } from "node:test";
import { belowCeiling_m } from "../src/ceiling.js";

/** `count` heights from `low_m` to `high_m`, evenly, which is a wall or, where both are near, a level with its noise. */
const heights = (count, low_m, high_m) => Array.from({ length: count }, (_, n) => low_m + ((high_m - low_m) * (n + 0.5)) / count);
const WALLS = heights(20_000, -1.1, 1.4);
const FLOOR = heights(8_000, -1.12, -1.08);

test("the map is cut right below its ceiling, wherever its heights are counted from", () => {
  for (const shift_m of [0, 1.13, -0.07, 20.5]) {
    const shifted = [...WALLS, ...FLOOR, ...heights(9_000, 1.38, 1.44)].map((height_m) => height_m + shift_m);
    const cut_m = belowCeiling_m(shifted) - shift_m;
    assert.ok(cut_m > 1.2 && cut_m < 1.39, `${cut_m}`);
  }
});

test("nothing is cut of a map without a ceiling", () => {
  const table = heights(4_000, -0.36, -0.34);
  const wardrobe = heights(700, 0.88, 0.92);
  const slope = heights(30_000, -3, 5);
  for (const map of [WALLS, [...WALLS, ...FLOOR], [...WALLS, ...FLOOR, ...table, ...wardrobe], [...FLOOR, ...table], FLOOR, slope, [0], []]) {
    assert.equal(belowCeiling_m(map), null);
  }
});

test("a gallery with walls above it is no ceiling", () => {
  assert.equal(belowCeiling_m([...heights(40_000, -1.1, 4), ...FLOOR, ...heights(9_000, 1.4, 1.44)]), null);
});

test("voxels of 8 cm, which leave steps out, are no ceilings", () => {
  const levels = Array.from({ length: 32 }, (_, n) => n * 0.08);
  assert.equal(belowCeiling_m(levels.flatMap((level_m) => Array(500).fill(level_m))), null);
});
