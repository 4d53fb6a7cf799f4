//! The pose of an RGB-D camera by points and line segments (PL-SLAM, sections 2.1 to 2.3).
//!
//! | room | what is in it |
//! |---|---|
//! | [`image`] | gray images, pyramids, gradients, rectification |
//! | [`frame`] | the features of a pair of images, how far they are, and which lie on moving things |
//! | [`feature`] | corners with descriptors, line segments with descriptors |
//! | [`matching`] | which feature of one image is which of another |
//! | [`keyframing`] | which frames the map keeps, what it takes from them, and what it lets go |
//! | [`local_map`] | the points and lines that the camera has seen |
//! | [`bundle_adjustment`] | poses, points and lines that explain together what keyframes saw |
//! | [`loop_closing`] | a camera that is back where it was, and what follows from that |
//! | [`map`] | keyframes, points, lines, and their observations |
//! | [`place_recognition`] | which keyframes show the same place, by descriptors alone |
//! | [`saved_map`] | the map as bytes, to be found again another day |
//! | [`mapping`] | what a new keyframe brings about, from landmarks to loops |
//! | [`slam`] | tracking, mapping and loop closing put together: the camera in a map that stays right |
//! | [`tracking`] | the camera's pose, frame by frame |
//! | [`motion`] | the prediction of the camera's pose, by its motion so far, a gyroscope or wheels |
//! | [`solve`] | the pose that explains matches, its covariance, and its unobservable directions |
//!
//! The core knows no ROS, no files, no clock, no randomness but what a seed gives. With the feature `ros` there is the node
//! around it, `shell`.
//!
//! A camera that moves along a wall, frame by frame; images of a lens are rectified before ([`image::Rectification`]):
//!
//! ```
//! use geometry::{CameraModel, DepthImage, DepthPixels, Distortion, Stamp};
//! use pose::frame::{FrameConfig, FrameExtractor};
//! use pose::image::GrayImage;
//! use pose::tracking::{Hints, Tracker, TrackerConfig};
//!
//! let (width_px, height_px, distance_m) = (320, 240, 2.0);
//! let camera = CameraModel {
//!     width_px,
//!     height_px,
//!     fx_px: 300.0,
//!     fy_px: 300.0,
//!     cx_px: 159.5,
//!     cy_px: 119.5,
//!     distortion: Distortion::None,
//! };
//! // Tiles of different grey.
//! let wall = |x: usize, y: usize| ((x / 9 * 7919 + y / 7 * 104_729 + x / 9 * (y / 7) * 31) % 251) as u8;
//! let mut extractor = FrameExtractor::new(FrameConfig::default())?;
//! let mut tracker = Tracker::new(TrackerConfig::default())?;
//! let mut last = None;
//! for index in 0..10 {
//!     // Three pixels an image to the right.
//!     let pixel = |at: usize| wall(at % width_px + 3 * index, at / width_px);
//!     let gray = GrayImage::new(width_px, height_px, (0..width_px * height_px).map(pixel).collect())?;
//!     let depths = DepthPixels::Metres(vec![distance_m; width_px * height_px]);
//!     let stamp = Stamp::from_nanos(index as i64 * 33_333_333);
//!     let depth = DepthImage::new(stamp, "camera".to_owned(), (width_px, height_px), depths)?;
//!     let frame = extractor.extract(&gray, &depth, &camera)?;
//!     last = tracker.step(&frame, &camera, &Hints::default()).pose;
//! }
//! let map_from_camera = last.ok_or("the camera is lost")?.camera_from_map.inverse();
//! let moved_m = 9.0 * 3.0 * f64::from(distance_m) / camera.fx_px;
//! assert!((map_from_camera.translation.x - moved_m).abs() < 0.02, "{map_from_camera}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Of what it is made, an example:
//!
//! ```
//! use nalgebra::{Isometry3, Point3, Vector3};
//! use pose::solve::rigid_alignment;
//!
//! // Four points that were seen twice, and the motion of the camera in between.
//! let seen_first_m = [[0.0, 0.0, 1.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0], [1.0, 1.0, 3.0]].map(Point3::from);
//! let second_from_first = Isometry3::new(Vector3::new(0.1, 0.0, 0.0), Vector3::new(0.0, 0.2, 0.0));
//! let seen_second_m = seen_first_m.map(|point_m| second_from_first * point_m);
//!
//! let alignment = rigid_alignment(&seen_first_m, &seen_second_m)?;
//! let error = second_from_first.inverse() * alignment.target_from_source;
//! assert!(error.translation.vector.norm() < 1e-9 && error.rotation.angle() < 1e-9);
//! # Ok::<(), pose::solve::AlignmentError>(())
//! ```

pub mod bundle_adjustment;
pub mod feature;
pub mod frame;
pub mod image;
pub mod keyframing;
pub mod local_map;
pub mod loop_closing;
pub mod map;
pub mod mapping;
pub mod matching;
pub mod motion;
pub mod place_recognition;
pub mod saved_map;
#[cfg(feature = "ros")]
pub mod shell;
pub mod slam;
pub mod solve;
#[cfg(test)]
mod testing;
pub mod tracking;
