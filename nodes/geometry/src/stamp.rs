//! A moment of the clock that stamps the data.

use serde::{Deserialize, Serialize};

const NANOS_PER_SECOND: i64 = 1_000_000_000;

/// Nanoseconds since the epoch of the clock in use (wall clock, or the bag's own).
#[derive(
    Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct Stamp(i64);

impl Stamp {
    /// A stamp from nanoseconds since the epoch.
    #[must_use]
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// A stamp from the two fields of `builtin_interfaces/Time`.
    #[must_use]
    pub const fn from_secs_nanos(secs: i32, nanos: u32) -> Self {
        Self(secs as i64 * NANOS_PER_SECOND + nanos as i64)
    }

    /// Nanoseconds since the epoch.
    #[must_use]
    pub const fn as_nanos(self) -> i64 {
        self.0
    }

    /// The two fields of `builtin_interfaces/Time`; saturates where the seconds leave 32 bits.
    #[must_use]
    pub fn secs_nanos(self) -> (i32, u32) {
        let secs = self.0.div_euclid(NANOS_PER_SECOND);
        let nanos = self.0.rem_euclid(NANOS_PER_SECOND);
        match i32::try_from(secs) {
            Ok(secs) => (secs, nanos as u32),
            // The order of stamps is kept: nothing lies beyond these two.
            Err(_) if secs < 0 => (i32::MIN, 0),
            Err(_) => (i32::MAX, NANOS_PER_SECOND as u32 - 1),
        }
    }

    /// Seconds from `earlier` to `self`; negative when `earlier` is the later one.
    #[must_use]
    pub fn seconds_since(self, earlier: Self) -> f64 {
        self.0.saturating_sub(earlier.0) as f64 / NANOS_PER_SECOND as f64
    }

    /// The stamp `seconds` later (earlier when negative), rounded to the nanosecond. Saturates; a NaN
    /// adds nothing.
    #[must_use]
    pub fn plus_seconds(self, seconds: f64) -> Self {
        Self(self.0.saturating_add((seconds * NANOS_PER_SECOND as f64).round() as i64))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_two_fields_of_a_message_are_kept(secs in any::<i32>(), nanos in 0..1_000_000_000_u32) {
            prop_assert_eq!(Stamp::from_secs_nanos(secs, nanos).secs_nanos(), (secs, nanos));
        }

        #[test]
        fn the_two_fields_keep_the_order(a in any::<i64>(), b in any::<i64>()) {
            let (a, b) = (Stamp::from_nanos(a.min(b)), Stamp::from_nanos(a.max(b)));
            prop_assert!(a.secs_nanos() <= b.secs_nanos());
        }

        #[test]
        fn adding_a_difference_leads_there(from in -1_i64 << 60..1 << 60, nanos in -1_i64 << 50..1 << 50) {
            // Some two weeks: the seconds still distinguish nanoseconds.
            let (from, to) = (Stamp::from_nanos(from), Stamp::from_nanos(from + nanos));
            prop_assert_eq!(from.plus_seconds(to.seconds_since(from)), to);
        }

        #[test]
        fn no_numbers_overflow(a in any::<i64>(), b in any::<i64>(), seconds in any::<f64>(), nanos in any::<u32>()) {
            let (a, b) = (Stamp::from_nanos(a), Stamp::from_nanos(b));
            let _ = (a.seconds_since(b), a.plus_seconds(seconds), Stamp::from_secs_nanos(i32::MAX, nanos));
        }
    }

    #[test]
    fn before_the_epoch_the_nanoseconds_still_count_forwards() {
        assert_eq!(Stamp::from_nanos(-1).secs_nanos(), (-1, 999_999_999));
        assert_eq!(Stamp::from_secs_nanos(-1, 999_999_999).as_nanos(), -1);
        assert_eq!(Stamp::from_nanos(-1_500_000_000).secs_nanos(), (-2, 500_000_000));
    }

    #[test]
    fn seconds_are_exact_around_a_wall_clock() {
        let stamp = Stamp::from_secs_nanos(1_700_000_000, 123_456_789);
        assert_eq!(stamp.plus_seconds(0.05).seconds_since(stamp), 0.05);
        assert_eq!(stamp.plus_seconds(-1e-9).as_nanos(), stamp.as_nanos() - 1);
        assert_eq!(stamp.plus_seconds(f64::NAN), stamp);
        assert_eq!(stamp.plus_seconds(f64::INFINITY), Stamp::from_nanos(i64::MAX));
        assert_eq!(stamp.seconds_since(stamp.plus_seconds(2.0)), -2.0);
    }

    #[test]
    fn what_a_message_cannot_hold_becomes_its_limits() {
        assert_eq!(Stamp::from_nanos(i64::MAX).secs_nanos(), (i32::MAX, 999_999_999));
        assert_eq!(Stamp::from_nanos(i64::MIN).secs_nanos(), (i32::MIN, 0));
    }
}
