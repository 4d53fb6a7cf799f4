//! When points were measured, in any unit and by any clock of the driver.

use std::fmt;
use std::ops::RangeInclusive;

use geometry::{Stamp, span_without_strays};

/// The unit of a field of times.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TimeUnit {
    /// Seconds, as Velodyne's and Hesai's drivers have it.
    Seconds,
    /// Milliseconds.
    Milliseconds,
    /// Microseconds.
    Microseconds,
    /// Nanoseconds, as Ouster's and Livox' drivers have it.
    Nanoseconds,
}

/// The origin of times.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TimeOrigin {
    /// The stamp of the message.
    Stamp,
    /// 1970, as the stamp itself.
    Epoch,
    /// Neither: the stamp is taken for the moment of the earliest point.
    EarliestPoint,
}

/// How the times of a cloud's points were understood.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum PointTimes {
    /// There is no field of times.
    NoField,
    /// All points have the same: as if all were measured at once.
    AllTheSame {
        /// The field.
        field: &'static str,
    },
    /// No unit makes a revolution of the field: its times are left out.
    NoRevolution {
        /// The field.
        field: &'static str,
        /// From the earliest to the latest, in the field's unit.
        span: f64,
    },
    /// The times are known.
    Known {
        /// The field.
        field: &'static str,
        /// Its unit.
        unit: TimeUnit,
        /// Their origin.
        origin: TimeOrigin,
    },
}

impl TimeUnit {
    const ALL: [Self; 4] =
        [Self::Seconds, Self::Milliseconds, Self::Microseconds, Self::Nanoseconds];

    /// How long it is.
    #[must_use]
    pub fn seconds(self) -> f64 {
        match self {
            Self::Seconds => 1.0,
            Self::Milliseconds => 1e-3,
            Self::Microseconds => 1e-6,
            Self::Nanoseconds => 1e-9,
        }
    }
}

impl fmt::Display for TimeUnit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Seconds => "seconds",
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
        })
    }
}

impl fmt::Display for PointTimes {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoField => {
                formatter.write_str("points have no times: the motion within a scan stays in it")
            }
            Self::AllTheSame { field } => {
                write!(
                    formatter,
                    "{field} is the same for all points: they are taken as measured at once"
                )
            }
            Self::NoRevolution { field, span } => write!(
                formatter,
                "{field} spans {span}, in no unit a revolution: the motion within a scan stays in it"
            ),
            Self::Known { field, unit, origin } => {
                let from = match origin {
                    TimeOrigin::Stamp => "the stamp",
                    TimeOrigin::Epoch => "1970",
                    TimeOrigin::EarliestPoint => "a clock of its own",
                };
                write!(formatter, "{field} is in {unit}, from {from}")
            }
        }
    }
}

/// A scan lasts about a tenth of a second: 5 to 20 turns a second. Units are a thousand apart, so that each has the spans from
/// a thirtieth of this to thirty times of it.
const SHORTEST_S: f64 = 0.003_162;
const LONGEST_S: f64 = 3.162;
/// Clocks of a scanner and its computer that both count from 1970 are no farther apart.
const SAME_CLOCK_S: f64 = 10.0;

/// How `times` are meant, whatever single ones say; if they are, they are in seconds since the stamp afterwards.
pub(super) fn understood(
    field: &'static str,
    times: &mut [f64],
    stamp: Stamp,
    unit: Option<TimeUnit>,
) -> PointTimes {
    let Some((earliest, latest)) = span_without_strays(times.iter().copied())
        .map(RangeInclusive::into_inner)
        .filter(|(earliest, latest)| earliest < latest)
    else {
        return PointTimes::AllTheSame { field };
    };
    let span = latest - earliest;
    let is_scan = |unit: &TimeUnit| (SHORTEST_S..LONGEST_S).contains(&(span * unit.seconds()));
    let Some(unit) = unit.or_else(|| TimeUnit::ALL.into_iter().find(is_scan)) else {
        return PointTimes::NoRevolution { field, span };
    };
    let scale_s = unit.seconds();
    let stamp_s = stamp.as_nanos() as f64 * 1e-9;
    let (first_s, last_s) = (earliest * scale_s, latest * scale_s);
    let (origin, from_s) = if first_s >= -LONGEST_S && last_s <= LONGEST_S {
        (TimeOrigin::Stamp, 0.0)
    } else if (first_s - stamp_s).abs() <= SAME_CLOCK_S {
        (TimeOrigin::Epoch, stamp_s)
    } else {
        (TimeOrigin::EarliestPoint, first_s)
    };
    for time in times {
        *time = *time * scale_s - from_s;
    }
    PointTimes::Known { field, unit, origin }
}
