//! Whether the stamps of all sensors are of one clock.

use super::{Check, Finding};

/// Clocks of one robot differ by less, ...
const MOST_SKEW_S: f64 = 0.25;
/// ... but computed data may come later than measurements.
const MOST_LATE_S: f64 = 0.5;
/// Beyond this the cause is a wrong clock, not a late driver.
const GRAVE_SKEW_S: f64 = 1.0;

/// A topic's clock.
#[derive(Clone, Copy, Debug)]
pub(in crate::doctor) struct Clock<'a> {
    pub(in crate::doctor) topic: &'a str,
    pub(in crate::doctor) is_read: bool,
    /// How much its stamps are ahead of a clock that all topics share.
    pub(in crate::doctor) offset_s: f64,
}

/// The clocks that differ from those of the most topics. `evidence` says how that is known.
pub(in crate::doctor) fn findings(clocks: &[Clock<'_>], evidence: &str) -> Vec<Finding> {
    let usual_s = typical_offset(clocks.iter().map(|clock| clock.offset_s));
    let is_usual =
        |clock: &&Clock<'_>| (-MOST_LATE_S..=MOST_SKEW_S).contains(&(clock.offset_s - usual_s));
    let others: Vec<&str> = clocks.iter().filter(is_usual).map(|clock| clock.topic).collect();
    clocks
        .iter()
        .filter(|clock| !is_usual(clock))
        .map(|clock| {
            let skew_s = clock.offset_s - usual_s;
            let direction = if skew_s > 0.0 { "ahead of" } else { "behind" };
            Finding::grave_if(
                clock.is_read && skew_s.abs() > GRAVE_SKEW_S,
                Check::Clocks,
                format!(
                    "{}: its stamps are {:.3} s {direction} those of {} ({evidence})",
                    clock.topic,
                    skew_s.abs(),
                    others.join(", ")
                ),
                "set the clocks of the hosts alike (chrony or PTP), and let the driver stamp with the time of the \
                 measurement, not of the publication",
            )
        })
        .collect()
}

/// The offset that the most have, within what clocks may differ by; the lowest of several.
pub(in crate::doctor) fn typical_offset(offsets_s: impl Iterator<Item = f64>) -> f64 {
    let offsets_s: Vec<f64> = offsets_s.collect();
    let near = |centre_s: f64| {
        offsets_s.iter().filter(|offset_s| (**offset_s - centre_s).abs() <= MOST_SKEW_S).count()
    };
    let mut best = (0, 0.0);
    for offset_s in &offsets_s {
        let count = near(*offset_s);
        if count > best.0 || (count == best.0 && *offset_s < best.1) {
            best = (count, *offset_s);
        }
    }
    best.1
}
