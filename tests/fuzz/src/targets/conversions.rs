//! Messages to geometry, and what of it does not come back as it was.

use std::sync::Arc;

use geometry::{BeamFill, MovingBeam, RayTable};
use lidar_odometry::recorded::revolution_from_cloud;
use msgs::geometry_msgs::{PoseStamped, PoseWithCovarianceStamped};
use msgs::nav_msgs::{Odometry, Path};
use msgs::rcl_interfaces::ParameterValue;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan, PointCloud2};
use msgs::stillmap_msgs::{DynamicZones, ReducedCloud, SegmentedCloud, Tracks};
use msgs::{RosMessage, cdr, convert};
use nalgebra::{Point2, Point3};

use super::samples::{self, bytes};
use super::{FAST, VALUES};
use crate::{MemoryBound, Target};

/// The words of images and clouds.
const ENCODINGS: &[&[u8]] = &[
    b"16UC1",
    b"32FC1",
    b"mono16",
    b"mono8",
    b"rgb8",
    b"bgr8",
    b"rgba8",
    b"bgra8",
    b"bayer_rggb8",
    b"yuv422",
    b"uyvy",
    b"yuyv",
];
const FIELDS: &[&[u8]] =
    &[b"x\0", b"y\0", b"z\0", b"rgb\0", b"rgba\0", b"ring\0", b"time\0", b"t\0"];

const fn target(
    name: &'static str,
    body: fn(&[u8]),
    seeds: fn() -> Vec<Vec<u8>>,
    words: &'static [&'static [u8]],
) -> Target {
    Target { name, body, seeds, words, memory: VALUES, gate_cases: FAST }
}

pub(super) const TARGETS: &[Target] = &[
    target("laser_scan", laser_scan, || vec![bytes(&samples::scan())], &[]),
    target("point_cloud", point_cloud, || vec![bytes(&samples::cloud())], FIELDS),
    target(
        "image",
        image,
        || {
            let images =
                [samples::depth_image(), samples::depth_image_in_metres(), samples::colour_image()];
            images.iter().map(bytes).collect()
        },
        ENCODINGS,
    ),
    Target {
        // A picture of one shade is a thousandth of its pixels.
        memory: MemoryBound { base_bytes: 24 << 20, per_byte: 1032 * 16 },
        ..target("compressed_image", compressed_image, compressed_images, ENCODINGS)
    },
    target(
        "camera_info",
        camera_info,
        || vec![bytes(&samples::camera_info())],
        &[b"plumb_bob\0", b"rational_polynomial\0", b"equidistant\0"],
    ),
    target("poses", poses, || vec![bytes(&samples::odometry()), bytes(&samples::pose())], &[]),
    target("map_path", map_path, map_paths, &[]),
    Target {
        // The depth image of a cycle is compressed.
        memory: MemoryBound { base_bytes: 24 << 20, per_byte: 1032 * 16 },
        gate_cases: FAST / 2,
        ..target("cycles", cycles, cycle_messages, &[])
    },
    target("parameter_value", parameter_value, || vec![bytes(&ParameterValue::default())], &[]),
];

fn decoded<M: RosMessage>(bytes: &[u8]) -> Option<M> {
    cdr::decode(bytes).ok()
}

fn laser_scan(bytes: &[u8]) {
    let Some(message) = decoded::<LaserScan>(bytes) else { return };
    let beams = [0, 3, u32::MAX].map(|index| MovingBeam { index, background_m: Some(1.0) });
    for fill in [BeamFill::Nan, BeamFill::Background] {
        let filtered = convert::static_scan(&message, &beams, fill);
        assert_eq!(filtered.ranges.len(), message.ranges.len());
    }
    let _ = convert::dynamic_scan(&message, &beams);
    let Ok(scan) = convert::scan_from_message(&message) else { return };
    for index in 0..scan.ranges_m.len() {
        assert!(scan.azimuth_rad(index).is_finite());
        assert!(scan.measured_range_m(index).is_none_or(f32::is_finite));
    }
    // Times that the driver did not know are 0 from then on.
    let back = convert::message_from_scan(&scan);
    let again = convert::scan_from_message(&back).expect("a scan is a scan again");
    assert_eq!(again.ranges_m.len(), scan.ranges_m.len());
}

fn point_cloud(bytes: &[u8]) {
    let Some(message) = decoded::<PointCloud2>(bytes) else { return };
    let records = message.width as usize * message.height as usize;
    if let Ok(cloud) = convert::cloud_from_message(&message) {
        assert!(cloud.points_m.iter().all(geometry::is_finite));
        let back = convert::message_from_cloud(&cloud);
        let again = convert::cloud_from_message(&back).expect("a cloud is a cloud again");
        assert_eq!(again.points_m.len(), cloud.points_m.len());
        // As many bytes as records, or it would not have been read.
        let mask: Vec<bool> = (0..records).map(|index| index % 3 == 0).collect();
        let _ = convert::cloud_without(&message, &mask, true);
        let _ = convert::cloud_without(&message, &mask, false);
    }
    if let Ok(organised) = convert::organised_cloud_from_message(&message) {
        let (width, height) = (organised.width_px(), organised.height_px());
        assert!(organised.with_pixels().all(|(_, [column, row])| column < width && row < height));
    }
    let _ = convert::coloured_cloud_from_message(&message);
    let _ = convert::colours_from_cloud_message(&message);
    if let Ok(reading) = convert::lidar_cloud_from_message(&message, None) {
        let _ = revolution_from_cloud(&reading.cloud);
    }
}

fn image(bytes: &[u8]) {
    let Some(message) = decoded::<Image>(bytes) else { return };
    if let Ok(depth) = convert::depth_from_message(&message) {
        let pixels = depth.pixels().len();
        assert_eq!(pixels, depth.width_px() * depth.height_px());
        let _ = convert::depth_without(&message, &vec![true; pixels], true);
    }
    if let Ok(colour) = convert::colour_image_from_message(&message) {
        let _ = convert::colour_without(&message, &vec![true; colour.pixels().len()], true);
    }
    let _ = convert::labels_from_message(&message);
}

fn compressed_image(bytes: &[u8]) {
    let Some(message) = decoded::<CompressedImage>(bytes) else { return };
    let _ = convert::compressed_depth_from_message(&message);
    let _ = convert::image_from_compressed_message(&message);
}

fn compressed_images() -> Vec<Vec<u8>> {
    let depth = convert::compressed_message_from_depth(&samples::depth());
    let colour = convert::compressed_message_from_image(
        &samples::colour_image(),
        convert::ImageCodec::Jpeg(convert::JpegQuality::default()),
    );
    [depth, colour].into_iter().flatten().map(|message| bytes(&message)).collect()
}

fn camera_info(bytes: &[u8]) {
    /// A table of more rays would be the image's to warrant.
    const MOST_PIXELS: usize = 10_000;
    let Some(message) = decoded::<CameraInfo>(bytes) else { return };
    let Ok(camera) = convert::camera_from_message(&message) else { return };
    for (x, y) in [(0.0, 0.0), (1e6, -1e6), (f64::MAX, f64::NAN)] {
        let _ = camera.ray(&Point2::new(x, y));
        let seen = camera.project(&Point3::new(x, y, 1.0));
        assert!(seen.is_none_or(|pixel| pixel.iter().all(|along_px| !along_px.is_nan())));
    }
    if camera.width_px.saturating_mul(camera.height_px) <= MOST_PIXELS {
        let _ = RayTable::new(&camera);
    }
    let back = convert::message_from_camera(&camera, samples::STAMP, "camera");
    assert!(convert::camera_from_message(&back).is_ok(), "a camera is a camera again");
}

fn poses(bytes: &[u8]) {
    let read = [
        decoded::<Odometry>(bytes).map(|message| convert::pose_from_odometry(&message)),
        decoded::<PoseStamped>(bytes).map(|message| convert::pose_from_message(&message)),
        decoded::<PoseWithCovarianceStamped>(bytes)
            .map(|message| convert::pose_from_covariance_message(&message)),
    ];
    let mut buffer = geometry::PoseBuffer::new(4);
    for pose in read.into_iter().flatten().flatten() {
        assert!(pose.map_from_rig.translation.vector.iter().all(|along_m| along_m.is_finite()));
        let norm = pose.map_from_rig.rotation.coords.norm();
        assert!((norm - 1.0).abs() < 1e-6, "a rotation of norm {norm}");
        let stamp = pose.stamp;
        let _ = buffer.push(pose);
        let _ = buffer.at(stamp);
    }
}

fn map_path(bytes: &[u8]) {
    let Some(message) = decoded::<Path>(bytes) else { return };
    if let Ok(path) = convert::map_path_from_message(&message) {
        let _ = convert::message_from_map_path(&path);
    }
}

fn map_paths() -> Vec<Vec<u8>> {
    let pose = |nanosec: u32| {
        let mut pose = samples::pose();
        pose.header.stamp.nanosec = nanosec;
        pose
    };
    let path = Path { header: samples::pose().header, poses: vec![pose(1), pose(2), pose(3)] };
    vec![bytes(&path)]
}

fn cycles(bytes: &[u8]) {
    if let Some(message) = decoded::<ReducedCloud>(bytes)
        && let Ok(cycle) = convert::detected_cycle_from_message(&message)
    {
        assert_eq!(cycle.voxel_points.len(), cycle.reduced_cloud.points_m.len());
        let _ = convert::message_from_detected_cycle(&cycle);
        let _ = Arc::strong_count(&cycle.scan_rays);
    }
    if let Some(message) = decoded::<SegmentedCloud>(bytes)
        && let Ok(cycle) = convert::segmented_cycle_from_message(&message)
    {
        let _ = convert::message_from_segmented_cycle(&cycle);
    }
    if let Some(message) = decoded::<DynamicZones>(bytes) {
        let _ = convert::zones_from_message(&message);
    }
    if let Some(message) = decoded::<Tracks>(bytes)
        && let Ok(tracks) = convert::tracks_from_message(&message)
    {
        let _ = convert::message_from_tracks(&tracks);
    }
}

fn cycle_messages() -> Vec<Vec<u8>> {
    let (detected, segmented) = (samples::detected_cycle(), samples::segmented_cycle());
    vec![
        bytes(&convert::message_from_detected_cycle(&detected)),
        bytes(&convert::message_from_segmented_cycle(&segmented)),
        bytes(&convert::message_from_zones(&detected)),
        bytes(&convert::message_from_tracks(&samples::tracks())),
    ]
}

fn parameter_value(bytes: &[u8]) {
    let Some(message) = decoded::<ParameterValue>(bytes) else { return };
    if let Ok(value) = node_shell::parameter_from_message(&message) {
        let _ = node_shell::message_from_parameter(&value, message.r#type);
    }
}
