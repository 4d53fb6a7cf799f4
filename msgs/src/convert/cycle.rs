//! What belongs to one cycle.

use geometry::{Cloud, DetectedCycle, SegmentedCycle};

use super::error::excerpt;
use super::pose::{header_of, message_from_point, point_from_message};
use super::zone::{messages_from_zones, zones_from_messages};
use super::{
    ConvertError, cloud_from_message, isometry_from_pose, message_from_cloud, pose_from_isometry,
    stamp_from_time, time_from_stamp,
};
use crate::std_msgs::Header;
use crate::stillmap_msgs::{ReducedCloud, SegmentedCloud};

/// The cycle of a message.
///
/// # Errors
/// When its cloud has another stamp or frame than the message itself, or its cloud, pose or zones are
/// none.
pub fn detected_cycle_from_message(message: &ReducedCloud) -> Result<DetectedCycle, ConvertError> {
    check_own(&message.header, &message.cloud.header)?;
    let points = message.points_before_reduction;
    let reduced_cloud = cloud_from_message(&message.cloud)?;
    let (counts, means) = (message.voxel_points.len(), reduced_cloud.points_m.len());
    if counts != means {
        return Err(ConvertError::VoxelPoints { counts, means });
    }
    Ok(DetectedCycle {
        index: message.cycle,
        scan_stamp: stamp_from_time(message.scan_stamp),
        reduced_cloud,
        voxel_points: message.voxel_points.clone(),
        points_before_reduction: usize::try_from(points)
            .map_err(|_| ConvertError::PointCount { points })?,
        map_from_rig: isometry_from_pose(&message.map_from_rig)?,
        map_frame_id: message.map_frame_id.clone(),
        camera_in_rig_m: point_from_message(&message.camera_in_rig)?,
        zones: zones_from_messages(&message.zones)?,
    })
}

/// The message of a cycle.
#[must_use]
pub fn message_from_detected_cycle(cycle: &DetectedCycle) -> ReducedCloud {
    let Cloud { stamp, ref frame_id, .. } = cycle.reduced_cloud;
    ReducedCloud {
        header: header_of(stamp, frame_id),
        cycle: cycle.index,
        scan_stamp: time_from_stamp(cycle.scan_stamp),
        points_before_reduction: cycle.points_before_reduction as u64,
        map_frame_id: cycle.map_frame_id.clone(),
        map_from_rig: pose_from_isometry(&cycle.map_from_rig),
        camera_in_rig: message_from_point(&cycle.camera_in_rig_m),
        zones: messages_from_zones(&cycle.zones),
        cloud: message_from_cloud(&cycle.reduced_cloud),
        voxel_points: cycle.voxel_points.clone(),
    }
}

/// The two parts of a cycle's cloud.
///
/// # Errors
/// When the static cloud has another stamp or frame than the message itself, or a cloud or the pose is none.
pub fn segmented_cycle_from_message(
    message: &SegmentedCloud,
) -> Result<SegmentedCycle, ConvertError> {
    check_own(&message.header, &message.static_cloud.header)?;
    Ok(SegmentedCycle {
        index: message.cycle,
        static_cloud: cloud_from_message(&message.static_cloud)?,
        dynamic_cloud: cloud_from_message(&message.dynamic_cloud)?,
        map_from_rig: isometry_from_pose(&message.map_from_rig)?,
        camera_in_rig_m: point_from_message(&message.camera_in_rig)?,
    })
}

/// The message of the two parts of a cycle's cloud.
#[must_use]
pub fn message_from_segmented_cycle(cycle: &SegmentedCycle) -> SegmentedCloud {
    let Cloud { stamp, ref frame_id, .. } = cycle.static_cloud;
    SegmentedCloud {
        header: header_of(stamp, frame_id),
        cycle: cycle.index,
        map_from_rig: pose_from_isometry(&cycle.map_from_rig),
        camera_in_rig: message_from_point(&cycle.camera_in_rig_m),
        static_cloud: message_from_cloud(&cycle.static_cloud),
        dynamic_cloud: message_from_cloud(&cycle.dynamic_cloud),
    }
}

/// Refuses the cloud of another cycle.
fn check_own(own: &Header, cloud: &Header) -> Result<(), ConvertError> {
    if own == cloud {
        return Ok(());
    }
    Err(ConvertError::ForeignCloud {
        cloud_stamp_ns: stamp_from_time(cloud.stamp).as_nanos(),
        cloud_frame_id: excerpt(&cloud.frame_id),
        cycle_stamp_ns: stamp_from_time(own.stamp).as_nanos(),
        cycle_frame_id: excerpt(&own.frame_id),
    })
}

#[cfg(test)]
mod tests {
    use geometry::{DynamicZone, ReturnSpan, Stamp, ZoneSource, pose_from_vector};
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;
    use crate::cdr;
    use crate::convert::{message_from_zones, zones_from_message};

    fn cycle(points_m: Vec<Point3<f32>>, pose: &[f64; 6]) -> DetectedCycle {
        let voxel_points = (1..).take(points_m.len()).collect();
        DetectedCycle {
            index: 7,
            scan_stamp: Stamp::from_nanos(1_700_000_000_100_000_000),
            reduced_cloud: Cloud {
                stamp: Stamp::from_nanos(1_700_000_000_133_333_333),
                frame_id: "rig".to_owned(),
                points_m,
            },
            voxel_points,
            points_before_reduction: 307_200,
            map_from_rig: pose_from_vector(pose),
            map_frame_id: "map".to_owned(),
            camera_in_rig_m: Point3::new(0.1, -0.02, 0.3),
            zones: vec![
                DynamicZone {
                    azimuth_min_rad: -0.1,
                    azimuth_max_rad: 0.25,
                    peak_std_dev_m: 0.57,
                    source: ZoneSource::Measured,
                    returns: None,
                },
                DynamicZone {
                    azimuth_min_rad: 3.0,
                    azimuth_max_rad: 3.5,
                    peak_std_dev_m: 0.41,
                    source: ZoneSource::Held { cycles: 3 },
                    returns: Some(ReturnSpan { nearest_m: 1.5, farthest_m: 2.25 }),
                },
            ],
        }
    }

    proptest! {
        /// What the nodes exchange is what the cores computed, to the last bit: the map that grows
        /// over DDS is the one that grows within one process.
        #[test]
        fn a_cycle_comes_back_bit_by_bit_from_the_wire(
            points in proptest::collection::vec(proptest::array::uniform3(-9.0..9.0_f32), 0..50),
            pose in proptest::array::uniform6(-3.0..3.0_f64),
        ) {
            let cycle = cycle(points.into_iter().map(Point3::from).collect(), &pose);
            let bytes = cdr::encode(&message_from_detected_cycle(&cycle)).unwrap();
            let message: ReducedCloud = cdr::decode(&bytes).unwrap();
            prop_assert_eq!(detected_cycle_from_message(&message), Ok(cycle));
        }
    }

    #[test]
    fn the_zones_of_a_cycle_name_their_cycle() {
        let cycle = cycle(Vec::new(), &[0.0; 6]);
        let message = message_from_zones(&cycle);
        assert_eq!(message.cycle, 7);
        assert_eq!(message.header, message_from_detected_cycle(&cycle).header);
        assert_eq!(zones_from_message(&message), Ok(cycle.zones));
    }

    #[test]
    fn the_two_parts_of_a_cycle_come_back_from_the_wire() {
        let cycle = cycle(vec![Point3::new(1.0, 2.0, 0.5)], &[0.1, 0.2, 0.3, 0.4, 0.0, 0.0]);
        let static_cloud = Cloud { frame_id: "map".to_owned(), ..cycle.reduced_cloud.clone() };
        let segmented = SegmentedCycle {
            index: cycle.index,
            static_cloud,
            dynamic_cloud: cycle.reduced_cloud,
            map_from_rig: cycle.map_from_rig,
            camera_in_rig_m: cycle.camera_in_rig_m,
        };
        let bytes = cdr::encode(&message_from_segmented_cycle(&segmented)).unwrap();
        let mut message: SegmentedCloud = cdr::decode(&bytes).unwrap();
        assert_eq!(segmented_cycle_from_message(&message), Ok(segmented));
        message.header.stamp.nanosec += 1;
        let error = segmented_cycle_from_message(&message).unwrap_err();
        assert!(matches!(error, ConvertError::ForeignCloud { .. }), "{error}");
    }

    #[test]
    fn a_cloud_of_another_cycle_is_refused() {
        let whole = message_from_detected_cycle(&cycle(Vec::new(), &[0.0; 6]));
        let mut other_stamp = whole.clone();
        other_stamp.cloud.header.stamp.nanosec += 1;
        let mut other_frame = whole.clone();
        other_frame.cloud.header.frame_id = "map".to_owned();
        for message in [other_stamp, other_frame] {
            let error = detected_cycle_from_message(&message).unwrap_err();
            assert!(matches!(error, ConvertError::ForeignCloud { .. }), "{error}");
        }
    }

    #[test]
    fn faults_of_the_parts_are_faults_of_the_whole() {
        let whole = message_from_detected_cycle(&cycle(vec![Point3::origin()], &[0.0; 6]));
        let mut cut = whole.clone();
        cut.cloud.data.pop();
        assert!(matches!(
            detected_cycle_from_message(&cut),
            Err(ConvertError::DataTooShort { .. })
        ));
        let mut shrunk = whole.clone();
        shrunk.map_from_rig.orientation.w = 0.0;
        assert!(matches!(
            detected_cycle_from_message(&shrunk),
            Err(ConvertError::Quaternion { .. })
        ));
        let mut turned = whole;
        turned.zones[0].azimuth_max_rad = -2.0;
        assert!(matches!(
            detected_cycle_from_message(&turned),
            Err(ConvertError::ZoneBounds { index: 0, .. })
        ));
    }
}
