//! Whether the stamp of a message of a sensor follows the last one's, or belongs to another time.
//!
//! A recording that begins anew and a clock that is set change the stamps of all later messages; a single wrong stamp (a
//! clock that is set while a scan is taken, a zero) changes no other. Two messages decide. Where time goes back a node begins
//! anew, and a recording ends: two drives are not put upon each other.

use geometry::Stamp;

/// A message that is earlier by this much belongs to another time. One that is a little late does not.
const BACK_IN_TIME_S: f64 = 0.5;
/// So does one that is later by this much: a hundred scans are not lost together, and after a longer pause one scan more is not
/// missed.
const AHEAD_IN_TIME_S: f64 = 10.0;
/// Of a sensor that measures less often: so many times what is usual between its messages, of which one may be lost.
const AHEAD_IN_INTERVALS: f64 = 2.0;

/// Judges the stamps of the messages of one sensor.
#[derive(Clone, Copy, Debug, Default)]
pub struct StampCheck {
    /// The stamp of the message before, if it was of another time.
    doubtful: Option<Stamp>,
    /// How far the last two messages that agreed were apart.
    usual_s: f64,
    /// Whether time ends where it goes back.
    ends: bool,
    /// By how much it went back where it ended.
    gone_back_s: Option<f64>,
}

/// What a stamp says.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum StampOrder {
    /// The message follows the last one.
    Follows,
    /// It is this much later, or earlier, than the last one, and no message before agrees.
    Doubtful {
        /// Below 0 where it is earlier.
        later_s: f64,
    },
    /// Time has gone back.
    BeginsAnew {
        /// How much later than the last one it is: below 0.
        later_s: f64,
    },
    /// It comes after the end.
    Ended,
}

impl StampCheck {
    /// One for a recording, whose time ends where it goes back.
    #[must_use]
    pub fn of_a_recording() -> Self {
        Self { ends: true, ..Self::default() }
    }

    /// By how much time has gone back, where it has ended.
    #[must_use]
    pub fn gone_back_s(&self) -> Option<f64> {
        self.gone_back_s
    }

    /// Judges the stamp of a message by that of the last one that was taken.
    pub fn judge(&mut self, stamp: Stamp, last: Option<Stamp>) -> StampOrder {
        if self.gone_back_s.is_some() {
            return StampOrder::Ended;
        }
        let before = self.doubtful.take();
        let Some(later_s) = last.map(|last| stamp.seconds_since(last)) else {
            return StampOrder::Follows;
        };
        let ahead_s = AHEAD_IN_TIME_S.max(AHEAD_IN_INTERVALS * self.usual_s);
        if (-BACK_IN_TIME_S..=ahead_s).contains(&later_s) {
            return StampOrder::Follows;
        }
        // The one before is of the same time if it is nearer than the last one is.
        let since_s = before.map(|before| stamp.seconds_since(before));
        let agreeing_s = since_s.filter(|since_s| *since_s > 0.0 && *since_s < later_s.abs());
        let Some(agreeing_s) = agreeing_s else {
            self.doubtful = Some(stamp);
            return StampOrder::Doubtful { later_s };
        };
        self.usual_s = agreeing_s;
        if later_s < 0.0 { self.go_back(later_s) } else { StampOrder::Follows }
    }

    /// Time has gone back: messages are this much later than the last one, below 0.
    pub fn go_back(&mut self, later_s: f64) -> StampOrder {
        if !self.ends {
            return StampOrder::BeginsAnew { later_s };
        }
        self.gone_back_s = Some(-later_s);
        StampOrder::Ended
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said of messages at these times, in seconds, each judged by the last one that was taken.
    fn said(times_s: &[f64]) -> String {
        said_by(&mut StampCheck::default(), times_s)
    }

    fn said_by(check: &mut StampCheck, times_s: &[f64]) -> String {
        let mut last = None;
        let said = times_s.iter().map(|time_s| {
            let stamp = Stamp::from_nanos(2_000_000_000_000).plus_seconds(*time_s);
            let time = check.judge(stamp, last);
            if !matches!(time, StampOrder::Doubtful { .. } | StampOrder::Ended) {
                last = Some(stamp);
            }
            match time {
                StampOrder::Follows => 'f',
                StampOrder::Doubtful { .. } => 'd',
                StampOrder::BeginsAnew { .. } => 'a',
                StampOrder::Ended => 'e',
            }
        });
        said.collect()
    }

    #[test]
    fn one_wrong_stamp_is_left_out_and_two_that_agree_are_another_time() {
        assert_eq!(said(&[0.0, 0.1, 0.2, 0.1]), "ffff");
        assert_eq!(said(&[0.0, 0.1, 3600.0, 0.2, 0.3]), "ffdff");
        assert_eq!(said(&[0.0, 0.1, -1700.0, 0.2, 0.3]), "ffdff");
        // Zeros are no time that goes on.
        assert_eq!(said(&[0.0, -1700.0, -1700.0, -1700.0, 0.1]), "fdddf");
        // Anew, and a pause.
        assert_eq!(said(&[100.0, 100.1, 0.0, 0.1, 0.2]), "ffdaf");
        assert_eq!(said(&[0.0, 0.1, 60.0, 60.1, 60.2]), "ffdff");
    }

    #[test]
    fn a_recording_ends_where_its_time_goes_back() {
        let mut check = StampCheck::of_a_recording();
        assert_eq!(said_by(&mut check, &[0.0, 0.1, 60.0, 60.1, 3.0, 60.2]), "ffdfdf");
        assert_eq!(check.gone_back_s(), None);
        // What comes after the end may be of the first time again: it is not known of what.
        assert_eq!(said_by(&mut check, &[100.0, 100.1, 0.0, 0.1, 0.2, 100.2]), "ffdeee");
        assert_eq!(check.gone_back_s(), Some(100.0));
    }

    /// Regression: of scans that are more than ten seconds apart every other one was left out.
    #[test]
    fn two_scans_that_agree_tell_how_far_scans_are_apart() {
        assert_eq!(said(&[0.0, 20.0, 40.0, 60.0, 80.0, 120.0]), "fdffff");
        assert_eq!(said(&[0.0, 20.0, 40.0, 3600.0, 60.0, 80.0]), "fdfdff");
    }
}
