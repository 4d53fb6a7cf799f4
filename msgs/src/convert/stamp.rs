//! Moments.

use geometry::Stamp;

use crate::builtin_interfaces::Time;

/// The stamp of a time. Nanoseconds of a second or more count as they stand.
#[must_use]
pub fn stamp_from_time(time: Time) -> Stamp {
    Stamp::from_secs_nanos(time.sec, time.nanosec)
}

/// The time of a stamp; saturates where the seconds leave 32 bits (before 1901, after 2038).
#[must_use]
pub fn time_from_stamp(stamp: Stamp) -> Time {
    let (sec, nanosec) = stamp.secs_nanos();
    Time { sec, nanosec }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_time_comes_back(sec in any::<i32>(), nanosec in 0..1_000_000_000_u32) {
            let time = Time { sec, nanosec };
            prop_assert_eq!(time_from_stamp(stamp_from_time(time)), time);
        }
    }

    #[test]
    fn moments_before_the_epoch_round_towards_the_past() {
        // The example of builtin_interfaces: -1.7 s.
        let time = Time { sec: -2, nanosec: 300_000_000 };
        assert_eq!(stamp_from_time(time), Stamp::from_nanos(-1_700_000_000));
        assert_eq!(time_from_stamp(Stamp::from_nanos(-1_700_000_000)), time);
    }

    #[test]
    fn too_many_nanoseconds_count_as_they_stand() {
        let time = Time { sec: 1, nanosec: 2_500_000_000 };
        assert_eq!(stamp_from_time(time), Stamp::from_nanos(3_500_000_000));
    }
}
