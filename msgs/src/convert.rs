//! The only place where a message becomes geometry or back; one file for each type of geometry.
//!
//! A conversion from a message checks every field: a value that does not fit is a
//! [`ConvertError`] that names the field and carries its numbers. A conversion to a message cannot
//! fail; a cloud or image beyond the 32 bits of the message's counts keeps its data whole, so that
//! encoding it is the error ([`crate::cdr::CdrFault::TooLong`]) and nothing is lost in silence.
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

mod angular_velocity;
mod camera;
mod cloud;
mod colour;
mod compressed_depth;
mod compressed_error;
mod compressed_image;
mod cycle;
mod depth;
mod depth_frame;
mod distance;
mod error;
mod filtered;
mod labels;
mod lidar_cloud;
mod map_path;
mod marker;
mod mesh_markers;
mod occupancy_grid;
mod picture;
mod pose;
mod revolution;
mod rows;
mod scan;
mod stamp;
mod track;
mod zone;

pub use angular_velocity::angular_velocity_from_message;
pub use camera::{
    calibration_of_image, camera_from_message, camera_of_image, is_rectified, message_from_camera,
};
use cloud::organised_points_from_message;
pub use cloud::{cloud_from_message, message_from_cloud, organised_cloud_from_message};
pub use colour::{
    colour_image_from_message, coloured_cloud_from_message, colours_from_cloud_message,
    message_from_colour_image, message_from_coloured_cloud,
};
pub use compressed_depth::{
    COMPRESSED_DEPTH_TOPIC, DepthCodec, InverseDepth, MetresAs, RvlError,
    compressed_depth_from_message, compressed_message_from_depth,
    compressed_message_from_depth_with,
};
pub use compressed_error::CompressedImageError;
pub use compressed_image::{
    COMPRESSED_IMAGE_TOPIC, ImageCodec, compressed_message_from_image,
    image_from_compressed_message,
};
pub use cycle::{
    detected_cycle_from_message, message_from_detected_cycle, message_from_segmented_cycle,
    segmented_cycle_from_message,
};
pub use depth::{depth_from_message, message_from_depth};
pub use distance::{field_from_distances, message_from_distances};
pub use error::ConvertError;
pub use filtered::{cloud_without, colour_without, depth_without, dynamic_scan, static_scan};
pub use labels::{labels_from_message, message_from_labels};
pub use lidar_cloud::{
    LidarCloudReading, PointTimes, TimeOrigin, TimeUnit, lidar_cloud_from_message,
};
pub use map_path::{map_path_from_message, message_from_map_path};
pub use marker::markers_from_tracks;
pub use mesh_markers::{markers_from_mesh, mesh_from_markers};
pub use occupancy_grid::{message_from_grid, update_of_grid};
pub use picture::{JpegQuality, JpegQualityError};
pub use pose::{
    covariance_by_rows, header_of, isometry_from_pose, isometry_from_transform, message_from_pose,
    pose_from_covariance_message, pose_from_isometry, pose_from_message, pose_from_odometry,
    transform_from_isometry,
};
pub use revolution::{LidarShot, message_from_lidar_shots, message_from_revolution};
pub use scan::{message_from_scan, scan_from_message};
pub use stamp::{stamp_from_time, time_from_stamp};
pub use track::{message_from_tracks, tracks_from_message};
pub use zone::{message_from_zones, zones_from_message};
