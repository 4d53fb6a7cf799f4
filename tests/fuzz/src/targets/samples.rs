//! Small valid messages, as drivers and the nodes send them.

use std::sync::Arc;

use geometry::{
    CameraModel, Cloud, CycleSetup, CycleTracks, DepthFrame, DepthImage, DepthPixels,
    DetectedCycle, Distortion, DynamicZone, MaskedDepth, Method, MovingBeam, ReturnSpan, RigMounts,
    RobotBox, ScanRay, SegmentedCycle, Stamp, Track, ZoneSource, pose_from_vector,
};
use msgs::convert;
use msgs::geometry_msgs::{PoseStamped, Transform, TransformStamped};
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan, PointCloud2, PointField};
use msgs::tf2_msgs::TFMessage;
use msgs::velodyne_msgs::{VelodynePacket, VelodyneScan};
use msgs::{RosMessage, cdr};
use nalgebra::{Matrix6, Point3, Vector3};

/// When all of them were made.
pub(super) const STAMP: Stamp = Stamp::from_nanos(1_700_000_000_100_000_000);

/// A message in CDR.
pub(super) fn bytes<M: RosMessage>(message: &M) -> Vec<u8> {
    cdr::encode(message).expect("a small message can be written")
}

/// The type and the bytes of the messages of this module.
pub(super) fn every_message() -> Vec<(&'static str, Vec<u8>)> {
    fn of<M: RosMessage>(message: &M) -> (&'static str, Vec<u8>) {
        (M::TYPE_NAME, bytes(message))
    }
    let (detected, segmented) = (detected_cycle(), segmented_cycle());
    vec![
        of(&scan()),
        of(&cloud()),
        of(&depth_image()),
        of(&colour_image()),
        of(&camera_info()),
        of(&odometry()),
        of(&pose()),
        of(&transforms()),
        of(&convert::message_from_detected_cycle(&detected)),
        of(&convert::message_from_segmented_cycle(&segmented)),
        of(&convert::message_from_zones(&detected)),
        of(&convert::message_from_tracks(&tracks())),
        of(&velodyne_scan()),
    ]
}

pub(super) fn scan() -> LaserScan {
    LaserScan {
        header: convert::header_of(STAMP, "laser"),
        angle_min: -3.0,
        angle_max: 3.0,
        angle_increment: 0.75,
        time_increment: 0.001,
        scan_time: 0.1,
        range_min: 0.15,
        range_max: 12.0,
        ranges: vec![1.0, 2.0, f32::INFINITY, 0.2, 8.0, f32::NAN, 3.0, 3.5, 4.0],
        intensities: vec![47.0; 9],
    }
}

fn field(name: &str, offset: u32, datatype: u8) -> PointField {
    PointField { name: name.to_owned(), offset, datatype, count: 1 }
}

/// An organised cloud of six points with colour, intensity, ring and time.
pub(super) fn cloud() -> PointCloud2 {
    let fields = vec![
        field("x", 0, PointField::FLOAT32),
        field("y", 4, PointField::FLOAT32),
        field("z", 8, PointField::FLOAT32),
        field("rgb", 12, PointField::FLOAT32),
        field("intensity", 16, PointField::FLOAT32),
        field("ring", 20, PointField::UINT16),
        field("time", 24, PointField::FLOAT32),
    ];
    let mut data = Vec::new();
    for point in 0..6_u16 {
        for along_m in [1.0 + 0.1 * f32::from(point), 0.5, 2.0] {
            data.extend(along_m.to_le_bytes());
        }
        data.extend([10, 20, 30, 0]);
        data.extend(7.5_f32.to_le_bytes());
        data.extend([point as u8, 0, 0, 0]);
        data.extend((0.015 * f32::from(point)).to_le_bytes());
    }
    PointCloud2 {
        header: convert::header_of(STAMP, "camera"),
        height: 2,
        width: 3,
        fields,
        is_bigendian: false,
        point_step: 28,
        row_step: 84,
        data,
        is_dense: false,
    }
}

pub(super) fn depth() -> DepthImage {
    let pixels =
        DepthPixels::Millimetres(vec![0, 900, 1000, 1100, 0, 0, 65_535, 1, 2000, 2001, 0, 7]);
    DepthImage::new(STAMP, "camera".to_owned(), (4, 3), pixels).expect("12 pixels")
}

pub(super) fn depth_image() -> Image {
    convert::message_from_depth(&depth())
}

pub(super) fn depth_image_in_metres() -> Image {
    let pixels = DepthPixels::Metres(vec![0.0, 0.9, f32::NAN, 1.1, 2.0, f32::INFINITY]);
    let image = DepthImage::new(STAMP, "camera".to_owned(), (3, 2), pixels).expect("6 pixels");
    convert::message_from_depth(&image)
}

pub(super) fn colour_image() -> Image {
    Image {
        header: convert::header_of(STAMP, "camera"),
        height: 3,
        width: 4,
        encoding: "rgb8".to_owned(),
        is_bigendian: 0,
        step: 12,
        data: (0..36).collect(),
    }
}

pub(super) fn camera() -> CameraModel {
    CameraModel {
        width_px: 4,
        height_px: 3,
        fx_px: 4.5,
        fy_px: 4.25,
        cx_px: 1.5,
        cy_px: 1.0,
        distortion: Distortion::PlumbBob([0.1, -0.2, 0.001, 0.002, 0.05]),
    }
}

pub(super) fn camera_info() -> CameraInfo {
    convert::message_from_camera(&camera(), STAMP, "camera")
}

pub(super) fn pose() -> PoseStamped {
    convert::message_from_pose(&geometry::StampedPose {
        stamp: STAMP,
        frame_id: "map".to_owned(),
        map_from_rig: pose_from_vector(&[1.0, 2.0, 0.1, 0.0, 0.1, 1.0]),
    })
}

pub(super) fn odometry() -> Odometry {
    let mut odometry =
        Odometry { header: convert::header_of(STAMP, "odom"), ..Odometry::default() };
    odometry.child_frame_id = "base_link".to_owned();
    odometry.pose.pose = pose().pose;
    odometry
}

pub(super) fn transforms() -> TFMessage {
    let transform = |parent: &str, child: &str| TransformStamped {
        header: convert::header_of(STAMP, parent),
        child_frame_id: child.to_owned(),
        transform: Transform {
            ..convert::transform_from_isometry(&pose_from_vector(&[0.1, 0.2, 0.3, 0.0, 0.0, 0.5]))
        },
    };
    TFMessage {
        transforms: vec![
            transform("map", "odom"),
            transform("odom", "base_link"),
            transform("base_link", "laser"),
        ],
    }
}

pub(super) fn compressed(image: &Image, format: &str, data: Vec<u8>) -> CompressedImage {
    CompressedImage { header: image.header.clone(), format: format.to_owned(), data }
}

pub(super) fn detected_cycle() -> DetectedCycle {
    let pose = pose_from_vector(&[1.0, 2.0, 0.1, 0.0, 0.1, 1.0]);
    let points_m = vec![Point3::new(1.0, 0.5, 2.0), Point3::new(1.1, 0.5, 2.0)];
    DetectedCycle {
        index: 7,
        setup: CycleSetup {
            method: Method::FreeSpace,
            voxel_edge_m: 0.05,
            map_edge_m: 0.02,
            max_stop_s: 60.0,
            mounts: RigMounts { rig_from_camera: pose, rig_from_lidar: pose },
            colour_from_depth: pose,
            robot: RobotBox::of_corners(&[-0.4, -0.3, -0.9, 0.5, 0.3, 0.2]).ok().flatten(),
        },
        scan_stamp: STAMP,
        reduced_cloud: Cloud { stamp: STAMP, frame_id: "rig".to_owned(), points_m },
        voxel_points: vec![1, 2],
        points_before_reduction: 12,
        map_from_rig: pose,
        map_from_continuous: Some(pose),
        map_frame_id: "map".to_owned(),
        zones: vec![DynamicZone {
            azimuth_min_rad: -0.1,
            azimuth_max_rad: 0.25,
            peak_std_dev_m: 0.57,
            source: ZoneSource::Held { cycles: 3 },
            returns: Some(ReturnSpan { nearest_m: 1.5, farthest_m: 2.25 }),
        }],
        moving_beams: vec![
            MovingBeam { index: 3, background_m: Some(2.5) },
            MovingBeam { index: 4, background_m: None },
        ],
        depth: Some(depth_frame()),
        scan_rays: Arc::new(vec![ScanRay {
            from_m: Point3::new(0.1, 0.0, -0.05),
            to_m: Point3::new(2.5, 0.25, -0.06),
            is_moving: true,
            joins_next: false,
        }]),
    }
}

fn depth_frame() -> Arc<DepthFrame> {
    let frame = DepthFrame::new(depth(), camera()).expect("the camera is the image's");
    Arc::new(frame.with_colours(vec![[1, 2, 3]; 12]).expect("12 colours"))
}

pub(super) fn segmented_cycle() -> SegmentedCycle {
    let cycle = detected_cycle();
    SegmentedCycle {
        index: cycle.index,
        setup: cycle.setup,
        static_cloud: Cloud { frame_id: "map".to_owned(), ..cycle.reduced_cloud.clone() },
        dynamic_cloud: cycle.reduced_cloud,
        map_from_rig: cycle.map_from_rig,
        depth: MaskedDepth::new(depth_frame(), vec![true; 12]).ok(),
        scan_rays: cycle.scan_rays,
        retracted_m: vec![Point3::new(1.5, -2.0, 0.25)],
    }
}

pub(super) fn tracks() -> CycleTracks {
    let cycle = detected_cycle();
    let track = Track {
        id: 3,
        position_m: Point3::new(1.5, -2.0, 0.9),
        velocity_m_per_s: Vector3::new(0.5, 1.0, 0.0),
        extent_m: Vector3::new(0.4, 0.5, 1.8),
        covariance: Matrix6::identity(),
        age_s: 2.5,
        unseen_cycles: 1,
    };
    CycleTracks {
        index: cycle.index,
        stamp: cycle.reduced_cloud.stamp,
        map_frame_id: cycle.map_frame_id,
        tracks: vec![track],
    }
}

/// A data packet of a VLP-16: 12 blocks of a flag, an azimuth and 32 returns, the time, the return mode and the model.
pub(super) fn velodyne_packet() -> Vec<u8> {
    let mut packet = Vec::new();
    for block in 0..12_u16 {
        packet.extend([0xff, 0xee]);
        packet.extend((block * 40).to_le_bytes());
        for laser in 0..32_u16 {
            packet.extend((2_000 + 10 * laser).to_le_bytes());
            packet.push(100);
        }
    }
    packet.extend(1_000_000_u32.to_le_bytes());
    packet.extend([0x37, 0x22]);
    packet
}

pub(super) fn velodyne_scan() -> VelodyneScan {
    let mut data = [0; 1206];
    data.copy_from_slice(&velodyne_packet());
    let packet = VelodynePacket { stamp: convert::time_from_stamp(STAMP), data };
    VelodyneScan {
        header: convert::header_of(STAMP, "velodyne"),
        packets: vec![packet.clone(), packet],
    }
}
