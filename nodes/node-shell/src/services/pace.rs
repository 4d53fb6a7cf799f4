//! Whether a stage keeps up with its input.

use std::time::{Duration, Instant};

/// After this long without a drop a stage keeps up again: 50 cycles of the RPLIDAR A1. It is a time and no number of cycles, for there are
/// none when the input has ended or the node is paused.
const TIME_TO_RECOVER: Duration = Duration::from_secs(7);

/// How a stage keeps up.
#[derive(Default, Debug)]
pub(super) struct Pace {
    dropped: u64,
    /// When the last drop was noted; `None` where there was none.
    last_drop: Option<Instant>,
    /// The longest step of the last cycle.
    last: Option<Step>,
    /// The longest step of the cycle after which there was a drop and of the one before: others wait during both.
    at_drop: Option<Step>,
}

/// A step of a cycle, and how long it took.
type Step = (&'static str, Duration);

/// That a stage is too slow.
#[derive(PartialEq, Eq, Debug)]
pub(super) struct Behind {
    /// What is wrong, and what helps.
    pub(super) text: String,
    /// Without another drop it keeps up from then on.
    pub(super) until: Instant,
}

impl Pace {
    /// How many were dropped for newer ones by the last note.
    pub(super) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Notes, after a cycle with these steps, how many were dropped for newer ones so far. Returns what is wrong.
    pub(super) fn note(
        &mut self,
        now: Instant,
        dropped: u64,
        steps: &[Step],
        remedy: &str,
    ) -> Option<Behind> {
        let longest = |steps: &mut dyn Iterator<Item = Step>| steps.max_by_key(|(_, took)| *took);
        let this = longest(&mut steps.iter().copied());
        let before = std::mem::replace(&mut self.last, this);
        if dropped > self.dropped {
            self.dropped = dropped;
            self.last_drop = Some(now);
            self.at_drop = longest(&mut before.into_iter().chain(this));
        }
        let until = self.last_drop?.checked_add(TIME_TO_RECOVER).filter(|until| now < *until)?;
        let (step, took) = self.at_drop?;
        let (dropped, milliseconds) = (self.dropped, took.as_secs_f64() * 1e3);
        let cycles = if dropped == 1 { "cycle was" } else { "cycles were" };
        let text = format!(
            "too slow for its input: {dropped} {cycles} dropped for newer ones so far; meanwhile the step `{step}` took \
             {milliseconds:.0} ms: {remedy}"
        );
        Some(Behind { text, until })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEPS: [(&str, Duration); 2] =
        [("convert", Duration::from_millis(3)), ("observe", Duration::from_millis(700))];

    #[test]
    fn the_step_named_is_of_the_cycles_around_the_drop_and_no_later_one() {
        let mut pace = Pace::default();
        let now = Instant::now();
        let steps = |decode_ms, add_ms| {
            [("decode", Duration::from_millis(decode_ms)), ("add", Duration::from_millis(add_ms))]
        };
        assert_eq!(pace.note(now, 0, &steps(400, 9), "raise x"), None);
        for dropped in [1, 1, 1] {
            let text = pace.note(now, dropped, &steps(2, 11), "raise x").unwrap().text;
            assert!(text.contains("`decode` took 400 ms"), "{text}");
        }
        let text = pace.note(now, 2, &steps(2, 12), "raise x").unwrap().text;
        assert!(text.contains("`add` took 12 ms"), "{text}");
    }

    #[test]
    fn a_stage_that_loses_cycles_names_its_slowest_step_until_it_keeps_up() {
        let mut pace = Pace::default();
        let start = Instant::now();
        assert_eq!(pace.note(start, 0, &STEPS, "raise x"), None);
        let behind = pace.note(start, 3, &STEPS, "raise x").unwrap();
        for part in ["3 cycles", "`observe`", "700 ms", "raise x"] {
            assert!(behind.text.contains(part), "{}", behind.text);
        }
        assert_eq!(behind.until, start + TIME_TO_RECOVER);
        let after = |seconds| start + Duration::from_secs(seconds);
        assert!(pace.note(after(6), 3, &STEPS, "raise x").is_some());
        assert_eq!(pace.note(after(7), 3, &STEPS, "raise x"), None);
        assert!(pace.note(after(8), 4, &STEPS, "raise x").is_some());
    }
}
