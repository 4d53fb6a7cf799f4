//! Clocks that are other ones after a gap: a driver that was restarted, a device that was connected anew.

use std::ops::Range;

use geometry::Stamp;

use crate::doctor::bag::reading::TopicFacts;
use crate::doctor::checks::Check;
use crate::doctor::finding::Finding;

/// Who walks is 15 cm farther then, five times the limit of a mount's error. What the times of arrival scatter has no part in medians.
const MOST_STEP_S: f64 = 0.1;
/// Of fewer messages between two gaps nothing is concluded.
const LEAST_MESSAGES: usize = 10;

/// The largest step of a topic's clock at a gap of its stamps, one of more than `gap_s`, if it is too large: from the stamps to the arrivals.
pub(super) fn finding(name: &str, facts: &TopicFacts, gap_s: f64) -> Option<Finding> {
    let delays: Vec<(usize, f64)> = parts(facts, gap_s)
        .filter_map(|part| Some((part.start, facts.delay_s.median_of(part)?)))
        .collect();
    let first_s = delays.first()?.1;
    let steps = delays.windows(2).filter_map(|pair| match pair {
        [(_, before_s), (at, after_s)] => Some((*at, *after_s, after_s - before_s)),
        _ => None,
    });
    let (at, after_s, step_s) = steps.max_by(|one, other| one.2.abs().total_cmp(&other.2.abs()))?;
    // By the times of arrival.
    let into_s = facts.stamps.get(at)?.seconds_since(*facts.stamps.first()?) + after_s - first_s;
    (step_s.abs() > MOST_STEP_S).then(|| {
        let direction = if step_s > 0.0 { "behind" } else { "ahead of" };
        Finding::warn(
            Check::Clocks,
            format!(
                "{name}: after the gap that ends {into_s:.1} s after the first message its stamps are {:.3} s {direction} those before it (by \
                 their times of arrival)",
                step_s.abs()
            ),
            "let the driver stamp with the time of the measurement after a restart, too; of this bag use the part before the gap, or that after it",
        )
    })
}

/// The messages between gaps, in the order of the recording.
fn parts(facts: &TopicFacts, gap_s: f64) -> impl Iterator<Item = Range<usize>> {
    let is_gap = move |pair: &[Stamp]| match pair {
        [one, next] => next.seconds_since(*one).abs() > gap_s,
        _ => false,
    };
    let gaps = facts.stamps.windows(2).enumerate().filter(move |(_, pair)| is_gap(pair));
    let ends = gaps.map(|(before, _)| before + 1).chain([facts.stamps.len()]);
    let parts = ends.scan(0, |start, end| Some(std::mem::replace(start, end)..end));
    parts.filter(|part| part.len() >= LEAST_MESSAGES)
}
