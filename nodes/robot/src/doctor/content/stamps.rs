//! The stamps of a topic's messages.

use geometry::Stamp;

use super::{Check, Finding};

/// A stamp of 0 is that of a clock that begins there if another follows within this time. Other clocks count from 1970.
const LONGEST_BEGIN_S: f64 = 10.0;

/// What is wrong with stamps, which are in the order in which they were received.
pub(in crate::doctor) fn findings(topic: &str, is_read: bool, stamps: &[Stamp]) -> Vec<Finding> {
    const FIX: &str = "the driver must stamp each message with the time of its measurement";
    let count = stamps.len();
    let zeros = stamps.iter().filter(|stamp| is_zero(stamp)).count();
    if zeros > 0 && !begins_at_zero(stamps) {
        let what = format!("{topic}: {zeros} of {count} messages have the stamp 0");
        return vec![Finding::grave_if(is_read, Check::Stamps, what, FIX)];
    }
    let (Some(first), Some(last)) = (stamps.iter().min(), stamps.iter().max()) else {
        return Vec::new();
    };
    if first == last && count > 1 {
        let what = format!("{topic}: all {count} messages have the stamp {:.3} s", seconds(*first));
        return vec![Finding::error(Check::Stamps, what, FIX)];
    }
    let steps = || stamps.windows(2).map(|pair| pair[1].seconds_since(pair[0]));
    let late = steps().filter(|step_s| *step_s < 0.0).count();
    if late == 0 {
        return Vec::new();
    }
    let farthest_s = steps().fold(0.0, f64::min).abs();
    vec![Finding::warn(
        Check::Stamps,
        format!(
            "{topic}: {late} of {count} messages are stamped before the one before, by up to {farthest_s:.3} s"
        ),
        "see that one driver alone publishes the topic, and that no clock was set back meanwhile (chronyc tracking)",
    )]
}

/// Whether the clock begins at 0, as that of a simulation: the first message alone has that stamp, and the others follow.
fn begins_at_zero(stamps: &[Stamp]) -> bool {
    let Some((first, others)) = stamps.split_first() else { return false };
    let earliest = others.iter().min();
    let follows = |stamp: &Stamp| !is_zero(stamp) && seconds(*stamp) < LONGEST_BEGIN_S;
    is_zero(first) && earliest.is_some_and(follows)
}

/// Whether the stamp was not set.
pub(in crate::doctor) fn is_zero(stamp: &Stamp) -> bool {
    stamp.as_nanos() == 0
}

/// The usual time from a stamp to the next, of stamps in their order.
pub(in crate::doctor) fn period_s(sorted: &[Stamp]) -> Option<f64> {
    let mut steps_s: Vec<f64> =
        sorted.windows(2).map(|pair| pair[1].seconds_since(pair[0])).collect();
    estimation::quantile::upper_median(&mut steps_s)
}

fn seconds(stamp: Stamp) -> f64 {
    stamp.seconds_since(Stamp::from_nanos(0))
}
