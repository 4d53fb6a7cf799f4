//! The loops known of a drive, independent of the searcher.

use geometry::Stamp;
use nalgebra::Isometry3;

/// The loops of a drive known at a moment.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct KnownLoops {
    /// Where the odometry's frame is in the map: the identity until a loop was closed.
    pub map_from_odom: Isometry3<f64>,
    /// The keyframes that are remembered, in the order of the drive.
    pub keyframes: Vec<KeyframePose>,
    /// How often a loop was closed.
    pub closed: usize,
}

/// Where the vehicle was at a keyframe.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct KeyframePose {
    /// When.
    pub stamp: Stamp,
    /// By the odometry.
    pub odom_from_vehicle: Isometry3<f64>,
    /// With all loops that are known now.
    pub map_from_vehicle: Isometry3<f64>,
}

impl KnownLoops {
    /// Where a pose of the odometry is in the map, by the keyframes before and after it.
    #[must_use]
    pub fn map_from_vehicle(
        &self,
        stamp: Stamp,
        odom_from_vehicle: &Isometry3<f64>,
    ) -> Isometry3<f64> {
        let by = |keyframe: &KeyframePose| {
            keyframe.map_from_vehicle * keyframe.odom_from_vehicle.inverse() * odom_from_vehicle
        };
        let after = self.keyframes.partition_point(|keyframe| keyframe.stamp <= stamp);
        let before = after.checked_sub(1).and_then(|before| self.keyframes.get(before));
        match (before, self.keyframes.get(after)) {
            (Some(before), Some(after)) => {
                let whole_s = after.stamp.seconds_since(before.stamp);
                let share = stamp.seconds_since(before.stamp) / whole_s.max(f64::MIN_POSITIVE);
                let (from, to) = (by(before), by(after));
                // Half a turn between neighbours is none that a vehicle makes.
                from.try_lerp_slerp(&to, share.clamp(0.0, 1.0), f64::EPSILON).unwrap_or(from)
            }
            (Some(only), None) | (None, Some(only)) => by(only),
            (None, None) => *odom_from_vehicle,
        }
    }
}
