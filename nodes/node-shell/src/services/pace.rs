//! Whether a stage keeps up with its input.

use std::time::Duration;

/// After this many cycles without a drop a stage keeps up again: seven seconds of the RPLIDAR A1.
const CYCLES_TO_RECOVER: u32 = 50;

/// How a stage keeps up.
#[derive(Default, Debug)]
pub(super) struct Pace {
    dropped: u64,
    /// Cycles since the last drop; `None` where there was none.
    cycles_since: Option<u32>,
    /// The longest step of the last cycle.
    last: Option<Step>,
    /// The longest step of the cycle after which there was a drop and of the one before: others wait during both.
    at_drop: Option<Step>,
}

/// A step of a cycle, and how long it took.
type Step = (&'static str, Duration);

impl Pace {
    /// How many were dropped for newer ones by the last note.
    pub(super) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Notes, after a cycle with these steps, how many were dropped for newer ones so far. Returns what is wrong.
    pub(super) fn note(&mut self, dropped: u64, steps: &[Step], remedy: &str) -> Option<String> {
        let longest = |steps: &mut dyn Iterator<Item = Step>| steps.max_by_key(|(_, took)| *took);
        let now = longest(&mut steps.iter().copied());
        let before = std::mem::replace(&mut self.last, now);
        if dropped > self.dropped {
            self.dropped = dropped;
            self.cycles_since = Some(0);
            self.at_drop = longest(&mut before.into_iter().chain(now));
        } else {
            self.cycles_since = self.cycles_since.map(|count| count.saturating_add(1));
        }
        if self.cycles_since? > CYCLES_TO_RECOVER {
            self.cycles_since = None;
        }
        self.cycles_since?;
        let (step, took) = self.at_drop?;
        let (dropped, milliseconds) = (self.dropped, took.as_secs_f64() * 1e3);
        let cycles = if dropped == 1 { "cycle was" } else { "cycles were" };
        Some(format!(
            "too slow for its input: {dropped} {cycles} dropped for newer ones so far; meanwhile the step `{step}` took \
             {milliseconds:.0} ms: {remedy}"
        ))
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
        let steps = |decode_ms, add_ms| {
            [("decode", Duration::from_millis(decode_ms)), ("add", Duration::from_millis(add_ms))]
        };
        assert_eq!(pace.note(0, &steps(400, 9), "raise x"), None);
        for dropped in [1, 1, 1] {
            let text = pace.note(dropped, &steps(2, 11), "raise x").unwrap();
            assert!(text.contains("`decode` took 400 ms"), "{text}");
        }
        let text = pace.note(2, &steps(2, 12), "raise x").unwrap();
        assert!(text.contains("`add` took 12 ms"), "{text}");
    }

    #[test]
    fn a_stage_that_loses_cycles_names_its_slowest_step_until_it_keeps_up() {
        let mut pace = Pace::default();
        assert_eq!(pace.note(0, &STEPS, "raise x"), None);
        let text = pace.note(3, &STEPS, "raise x").unwrap();
        for part in ["3 cycles", "`observe`", "700 ms", "raise x"] {
            assert!(text.contains(part), "{text}");
        }
        for _ in 0..CYCLES_TO_RECOVER {
            assert!(pace.note(3, &STEPS, "raise x").is_some());
        }
        assert_eq!(pace.note(3, &STEPS, "raise x"), None);
        assert_eq!(pace.note(3, &STEPS, "raise x"), None);
        assert!(pace.note(4, &STEPS, "raise x").is_some());
    }
}
