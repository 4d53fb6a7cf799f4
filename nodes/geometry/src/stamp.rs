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
        let clamped = secs.clamp(i64::from(i32::MIN), i64::from(i32::MAX));
        (clamped as i32, nanos as u32)
    }

    /// Seconds from `earlier` to `self`; negative when `earlier` is the later one.
    #[must_use]
    pub fn seconds_since(self, earlier: Self) -> f64 {
        self.0.saturating_sub(earlier.0) as f64 / NANOS_PER_SECOND as f64
    }

    /// The stamp `seconds` later (earlier when negative), rounded to the nanosecond.
    #[must_use]
    pub fn plus_seconds(self, seconds: f64) -> Self {
        Self(self.0.saturating_add((seconds * NANOS_PER_SECOND as f64).round() as i64))
    }
}
