// Where a map has a ceiling, which hides the rooms from above.

/** The heights are counted in steps of this: a ceiling and its noise fill one or two. */
const STEP_M = 0.1;
/** A ceiling is a height at which there are so many times the points of a usual one, where walls are ... */
const PEAK = 4;
/** ... with this share of all points at least, and no more than this share above: of a floor, a table or a gallery more is above. */
const LEAST_SHARE = 0.05;
const MOST_ABOVE = 0.05;
/** A room is higher than this. */
const ROOM_M = 1.5;
/** Share of the points below which a height is noise. */
const NOISE_SHARE = 0.005;

/** The height under which the map shows its rooms, of the heights of some of its points; null where there is no ceiling. */
export function belowCeiling_m(heights_m) {
  const counts = new Map();
  for (const height_m of heights_m) {
    const step = Math.floor(height_m / STEP_M);
    counts.set(step, (counts.get(step) ?? 0) + 1);
  }
  const total = heights_m.length;
  const steps = [...counts.keys()].filter((step) => counts.get(step) > NOISE_SHARE * total).sort((one, other) => one - other);
  if (steps.length === 0) return null;
  const usual = steps.map((step) => counts.get(step)).sort((one, other) => one - other)[Math.floor(steps.length / 2)];
  const isPeak = (step, times) => (counts.get(step) ?? 0) > times * usual;
  const top = steps.findLast((step) => isPeak(step, PEAK));
  if (top === undefined) return null;
  let lowest = top;
  while (isPeak(lowest - 1, PEAK / 2)) lowest -= 1;
  const share = (from, to) => [...counts].reduce((sum, [step, count]) => sum + (step >= from && step <= to ? count : 0), 0) / total;
  const isCeiling = share(lowest, top) >= LEAST_SHARE && share(top + 1, Infinity) <= MOST_ABOVE && (lowest - steps[0]) * STEP_M >= ROOM_M;
  return isCeiling ? lowest * STEP_M : null;
}
