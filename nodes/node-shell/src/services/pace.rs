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
}

impl Pace {
    /// How many were dropped for newer ones by the last note.
    pub(super) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Notes, after a cycle with these steps, how many were dropped for newer ones so far. Returns what is wrong.
    pub(super) fn note(
        &mut self,
        dropped: u64,
        steps: &[(&'static str, Duration)],
        remedy: &str,
    ) -> Option<String> {
        if dropped > self.dropped {
            self.dropped = dropped;
            self.cycles_since = Some(0);
        } else {
            self.cycles_since = self.cycles_since.map(|count| count.saturating_add(1));
        }
        if self.cycles_since? > CYCLES_TO_RECOVER {
            self.cycles_since = None;
        }
        self.cycles_since?;
        let (step, longest) = steps.iter().max_by_key(|(_, duration)| *duration)?;
        let (dropped, milliseconds) = (self.dropped, longest.as_secs_f64() * 1e3);
        let cycles = if dropped == 1 { "cycle was" } else { "cycles were" };
        Some(format!(
            "too slow for its input: {dropped} {cycles} dropped for newer ones so far; the step `{step}` took {milliseconds:.0} ms of \
             the last one: {remedy}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEPS: [(&str, Duration); 2] =
        [("convert", Duration::from_millis(3)), ("observe", Duration::from_millis(700))];

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
