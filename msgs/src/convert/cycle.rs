//! The messages of one cycle.

use std::sync::Arc;

use geometry::{
    Cloud, CycleSetup, DetectedCycle, Method, MovingBeam, RigMounts, RobotBox, ScanRay,
    SegmentedCycle, is_finite,
};
use nalgebra::Point3;

use super::depth_frame::{
    bits_from_mask, depth_frame_from_messages, masked_depth_from_messages,
    messages_from_depth_frame,
};
use super::error::excerpt;
use super::pose::header_of;
use super::zone::{messages_from_zones, zones_from_messages};
use super::{
    ConvertError, cloud_from_message, isometry_from_pose, message_from_cloud, pose_from_isometry,
    stamp_from_time, time_from_stamp,
};
use crate::std_msgs::Header;
use crate::stillmap_msgs::{self, ReducedCloud, SegmentedCloud};

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
    let depth = depth_frame_from_messages(&message.depth, reduced_cloud.stamp)?;
    Ok(DetectedCycle {
        index: message.cycle,
        setup: setup_from_message(&message.setup)?,
        scan_stamp: stamp_from_time(message.scan_stamp),
        reduced_cloud,
        voxel_points: message.voxel_points.clone(),
        points_before_reduction: usize::try_from(points)
            .map_err(|_| ConvertError::PointCount { points })?,
        map_from_rig: isometry_from_pose(&message.map_from_rig)?,
        map_from_continuous: match &message.map_from_continuous[..] {
            [] => None,
            [pose] => Some(isometry_from_pose(pose)?),
            poses => return Err(ConvertError::SeveralPoses { poses: poses.len() }),
        },
        map_frame_id: message.map_frame_id.clone(),
        zones: zones_from_messages(&message.zones)?,
        moving_beams: moving_beams_from_message(message)?,
        depth,
        scan_rays: scan_rays_from_numbers(&message.scan_rays, &message.scan_ray_flags)?,
    })
}

/// The message of a cycle.
#[must_use]
pub fn message_from_detected_cycle(cycle: &DetectedCycle) -> ReducedCloud {
    let Cloud { stamp, ref frame_id, .. } = cycle.reduced_cloud;
    ReducedCloud {
        header: header_of(stamp, frame_id),
        cycle: cycle.index,
        setup: message_from_setup(&cycle.setup),
        scan_stamp: time_from_stamp(cycle.scan_stamp),
        points_before_reduction: cycle.points_before_reduction as u64,
        map_frame_id: cycle.map_frame_id.clone(),
        map_from_rig: pose_from_isometry(&cycle.map_from_rig),
        map_from_continuous: cycle.map_from_continuous.iter().map(pose_from_isometry).collect(),
        zones: messages_from_zones(&cycle.zones),
        moving_beams: cycle.moving_beams.iter().map(|beam| beam.index).collect(),
        background_ranges: cycle
            .moving_beams
            .iter()
            .map(|beam| beam.background_m.unwrap_or(f32::NAN))
            .collect(),
        cloud: message_from_cloud(&cycle.reduced_cloud),
        voxel_points: cycle.voxel_points.clone(),
        depth: messages_from_depth_frame(cycle.depth.as_deref()),
        scan_rays: numbers_from_scan_rays(&cycle.scan_rays),
        scan_ray_flags: flags_from_scan_rays(&cycle.scan_rays),
    }
}

/// Bits of `scan_ray_flags`.
const MOVING: u8 = 1;
const JOINS_NEXT: u8 = 2;

fn numbers_from_scan_rays(rays: &[ScanRay]) -> Vec<f32> {
    let numbers = |ray: &ScanRay| [ray.from_m, ray.to_m].map(<[f32; 3]>::from).concat();
    rays.iter().flat_map(numbers).collect()
}

fn flags_from_scan_rays(rays: &[ScanRay]) -> Vec<u8> {
    let bit = |is_set: bool, bit: u8| if is_set { bit } else { 0 };
    let flags = |ray: &ScanRay| bit(ray.is_moving, MOVING) | bit(ray.joins_next, JOINS_NEXT);
    rays.iter().map(flags).collect()
}

fn scan_rays_from_numbers(
    numbers: &[f32],
    flags: &[u8],
) -> Result<Arc<Vec<ScanRay>>, ConvertError> {
    let (rays, rest) = numbers.as_chunks::<6>();
    if !rest.is_empty() || rays.len() != flags.len() {
        return Err(ConvertError::ScanRays { numbers: numbers.len(), flags: flags.len() });
    }
    let ray = |(&[x, y, z, to_x, to_y, to_z], flags): (&[f32; 6], &u8)| ScanRay {
        from_m: [x, y, z].into(),
        to_m: [to_x, to_y, to_z].into(),
        is_moving: flags & MOVING != 0,
        joins_next: flags & JOINS_NEXT != 0,
    };
    Ok(Arc::new(rays.iter().zip(flags).map(ray).collect()))
}

fn moving_beams_from_message(message: &ReducedCloud) -> Result<Vec<MovingBeam>, ConvertError> {
    let (indices, ranges_m) = (&message.moving_beams, &message.background_ranges);
    let (beams, ranges) = (indices.len(), ranges_m.len());
    if beams != ranges {
        return Err(ConvertError::MovingBeams { beams, ranges });
    }
    let beam = |(&index, range_m): (&u32, &f32)| MovingBeam {
        index,
        background_m: (*range_m > 0.0 && range_m.is_finite()).then_some(*range_m),
    };
    Ok(indices.iter().zip(ranges_m).map(beam).collect())
}

/// The two parts of a cycle's cloud.
///
/// # Errors
/// When the static cloud has another stamp or frame than the message itself, or a cloud or the pose is invalid.
pub fn segmented_cycle_from_message(
    message: &SegmentedCloud,
) -> Result<SegmentedCycle, ConvertError> {
    check_own(&message.header, &message.static_cloud.header)?;
    let static_cloud = cloud_from_message(&message.static_cloud)?;
    let (depth, moving) = (&message.depth, &message.moving_pixels);
    Ok(SegmentedCycle {
        index: message.cycle,
        setup: setup_from_message(&message.setup)?,
        depth: masked_depth_from_messages(depth, moving, static_cloud.stamp)?,
        static_cloud,
        dynamic_cloud: cloud_from_message(&message.dynamic_cloud)?,
        map_from_rig: isometry_from_pose(&message.map_from_rig)?,
        scan_rays: scan_rays_from_numbers(&message.scan_rays, &message.scan_ray_flags)?,
        retracted_m: points_from_numbers(&message.retracted),
    })
}

/// Points of three numbers each. What is left over, and points that are none, say nothing.
fn points_from_numbers(numbers: &[f32]) -> Vec<Point3<f32>> {
    let points = numbers.as_chunks().0.iter().map(|point: &[f32; 3]| Point3::from(*point));
    points.filter(is_finite).collect()
}

/// The message of the two parts of a cycle's cloud.
#[must_use]
pub fn message_from_segmented_cycle(cycle: &SegmentedCycle) -> SegmentedCloud {
    let Cloud { stamp, ref frame_id, .. } = cycle.static_cloud;
    SegmentedCloud {
        header: header_of(stamp, frame_id),
        cycle: cycle.index,
        setup: message_from_setup(&cycle.setup),
        map_from_rig: pose_from_isometry(&cycle.map_from_rig),
        static_cloud: message_from_cloud(&cycle.static_cloud),
        dynamic_cloud: message_from_cloud(&cycle.dynamic_cloud),
        depth: messages_from_depth_frame(cycle.depth.as_ref().map(|depth| &**depth.frame())),
        moving_pixels: cycle
            .depth
            .as_ref()
            .map(|depth| bits_from_mask(depth.is_moving()))
            .unwrap_or_default(),
        scan_rays: numbers_from_scan_rays(&cycle.scan_rays),
        scan_ray_flags: flags_from_scan_rays(&cycle.scan_rays),
        retracted: cycle
            .retracted_m
            .iter()
            .flat_map(|point_m| <[f32; 3]>::from(*point_m))
            .collect(),
    }
}

fn setup_from_message(message: &stillmap_msgs::CycleSetup) -> Result<CycleSetup, ConvertError> {
    Ok(CycleSetup {
        method: Method::of_name(&message.method)
            .ok_or_else(|| ConvertError::Method { method: excerpt(&message.method) })?,
        voxel_edge_m: message.voxel_edge,
        map_edge_m: message.map_edge,
        max_stop_s: message.max_stop,
        mounts: RigMounts {
            rig_from_camera: isometry_from_pose(&message.rig_from_camera)?,
            rig_from_lidar: isometry_from_pose(&message.rig_from_lidar)?,
        },
        colour_from_depth: isometry_from_pose(&message.colour_from_depth)?,
        robot: RobotBox::of_corners(&message.robot_box)
            .map_err(|error| ConvertError::RobotBox(Box::new(error)))?,
    })
}

fn message_from_setup(setup: &CycleSetup) -> stillmap_msgs::CycleSetup {
    stillmap_msgs::CycleSetup {
        method: setup.method.name().to_owned(),
        voxel_edge: setup.voxel_edge_m,
        map_edge: setup.map_edge_m,
        max_stop: setup.max_stop_s,
        rig_from_camera: pose_from_isometry(&setup.mounts.rig_from_camera),
        rig_from_lidar: pose_from_isometry(&setup.mounts.rig_from_lidar),
        colour_from_depth: pose_from_isometry(&setup.colour_from_depth),
        robot_box: setup.robot.map_or([0.0; 6], |robot| robot.corners_m()),
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
    use crate::geometry_msgs::{Pose, Quaternion};

    const NO_TURN: Quaternion = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 };

    fn cycle(points_m: Vec<Point3<f32>>, pose: &[f64; 6]) -> DetectedCycle {
        let voxel_points = (1..).take(points_m.len()).collect();
        DetectedCycle {
            index: 7,
            setup: CycleSetup {
                method: Method::RecHv,
                voxel_edge_m: 0.05,
                map_edge_m: 0.02,
                max_stop_s: 40.0,
                mounts: RigMounts {
                    rig_from_camera: pose_from_vector(pose),
                    rig_from_lidar: pose_from_vector(&[0.1, -0.02, -0.8, 0.1, 0.2, 0.3]),
                },
                colour_from_depth: pose_from_vector(&[-0.052, 0.001, 0.002, 0.01, 0.0, -0.01]),
                robot: RobotBox::of_corners(&[-0.3, -0.2, -0.9, 0.25, 0.2, 0.1]).unwrap(),
            },
            scan_stamp: Stamp::from_nanos(1_700_000_000_100_000_000),
            reduced_cloud: Cloud {
                stamp: Stamp::from_nanos(1_700_000_000_133_333_333),
                frame_id: "rig".to_owned(),
                points_m,
            },
            voxel_points,
            points_before_reduction: 307_200,
            map_from_rig: pose_from_vector(pose),
            map_from_continuous: Some(pose_from_vector(pose)),
            map_frame_id: "map".to_owned(),
            moving_beams: vec![
                MovingBeam { index: 3, background_m: Some(2.5) },
                MovingBeam { index: 4, background_m: None },
            ],
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
            depth: None,
            scan_rays: Arc::new(vec![
                ScanRay {
                    from_m: Point3::new(0.1, 0.0, -0.05),
                    to_m: Point3::new(2.5, 0.25, -0.06),
                    is_moving: true,
                    joins_next: false,
                },
                ScanRay {
                    from_m: Point3::new(0.11, 0.01, -0.05),
                    to_m: Point3::new(-2.5, 0.25, -0.07),
                    is_moving: false,
                    joins_next: true,
                },
            ]),
        }
    }

    proptest! {
        /// The nodes exchange the values that the cores computed, to the last bit: the map that grows
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
            setup: cycle.setup,
            static_cloud,
            dynamic_cloud: cycle.reduced_cloud,
            map_from_rig: cycle.map_from_rig,
            depth: None,
            scan_rays: cycle.scan_rays,
            retracted_m: vec![Point3::new(1.5, -2.0, 0.25)],
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
        for spoil in [
            |colour_from_depth: &mut Pose| colour_from_depth.orientation = NO_TURN,
            |colour_from_depth: &mut Pose| colour_from_depth.position.x = f64::NAN,
        ] {
            let mut nowhere = whole.clone();
            spoil(&mut nowhere.setup.colour_from_depth);
            assert!(detected_cycle_from_message(&nowhere).is_err(), "{:?}", nowhere.setup);
        }
        let mut twice = whole.clone();
        twice.map_from_continuous.push(twice.map_from_rig);
        assert!(matches!(
            detected_cycle_from_message(&twice),
            Err(ConvertError::SeveralPoses { poses: 2 })
        ));
        let mut by_another_method = whole.clone();
        by_another_method.setup.method = "median".to_owned();
        let error = detected_cycle_from_message(&by_another_method).unwrap_err();
        assert!(error.to_string().contains("\"median\""), "{error}");
        let mut unequal = whole.clone();
        unequal.background_ranges.pop();
        assert_eq!(
            detected_cycle_from_message(&unequal),
            Err(ConvertError::MovingBeams { beams: 2, ranges: 1 })
        );
        let mut torn = whole.clone();
        torn.scan_rays.pop();
        assert_eq!(
            detected_cycle_from_message(&torn),
            Err(ConvertError::ScanRays { numbers: 11, flags: 2 })
        );
        let mut turned = whole;
        turned.zones[0].azimuth_max_rad = -2.0;
        assert!(matches!(
            detected_cycle_from_message(&turned),
            Err(ConvertError::ZoneBounds { index: 0, .. })
        ));
    }
}
