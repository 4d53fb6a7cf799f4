//! Splits a reduced cloud into its static and dynamic parts (Rec-HV 3.2.5 to 3.2.7, 3.3.3).
//!
//! | module | step | source |
//! |---|---|---|
//! | [`angular`] | points within a dynamic zone | 3.2.5, eq. 6 |
//! | [`depth_clustering`] | of these, the nearest group along x: the object | 3.2.6, 3.3.3.1 |
//! | `two_stages` | both in turn | 3.3.3 |
//! | [`segmenter`] | the method chosen, then the static part in the map frame | eq. 7, 8 |
//!
//! The method `free_space` finds what moves by what earlier cycles saw:
//!
//! | module | step |
//! |---|---|
//! | [`cycle_points`] | the points of a cycle: each in the map, its voxel, distance and slopes |
//! | `volume::Occupancy` (another crate) | which places of the map were seen free, and where something has been for long |
//! | [`recent_views`] | which places the last cycles would have shown taken |
//! | [`view`] | how far the camera sees to the sides |
//! | [`floor`] | the lowest horizontal plane |
//! | [`seeds`] | where objects are known to be: by zones, by tracks, by what is in observed free space |
//! | [`growth`] | the objects grown from the seeds through the cloud |
//! | [`earlier_cycles`] | what an object left in the cycles before it was found |
//! | [`tracking`] | the objects followed over the cycles |
//! | `continuous` | all of them in a frame that does not jump when the map is corrected |
//! | [`free_space`] | all of them in turn |
//! | `moving_pixels` | the verdict as a mask on the depth image, where the map is made of depth images |
//! | `moving_view` | what the mask shows, pixel by pixel with depth and velocity, in the images of another camera |
//! | [`filter`] | the verdict at the moments of scans, images and clouds, between the cycles too |
//!
//! This crate without its feature `ros` is the core: it knows no ROS, no clock and no file.
//!
//! ```
//! use geometry::{DynamicZone, ZoneSource};
//! use nalgebra::Point3;
//! use segmentation::angular::{azimuths_rad, points_in_zone};
//! use segmentation::depth_clustering::{depth_groups, nearest_group};
//!
//! // A zone of 20 degrees ahead: an object at 1.5 m before a wall at 3 m. The last point is beside the zone.
//! let zone = DynamicZone {
//!     azimuth_min_rad: -0.17,
//!     azimuth_max_rad: 0.17,
//!     peak_std_dev_m: 0.7,
//!     source: ZoneSource::Measured,
//!     returns: None,
//! };
//! let points_m = [[1.5, 0.0, 0.0], [1.52, 0.1, 0.2], [3.0, 0.1, 0.0], [3.0, 2.0, 0.0]].map(Point3::from);
//! let in_zone = points_in_zone(&azimuths_rad(&points_m, &[zone]), &zone);
//! assert_eq!(in_zone, [0, 1, 2]);
//!
//! let groups = depth_groups(in_zone.iter().map(|&index| points_m[index].x), 0.08);
//! let object = nearest_group(&groups).unwrap();
//! assert!((object.centroid_x_m - 1.51).abs() < 1e-3);
//! ```

pub mod angular;
pub mod config;
mod continuous;
pub mod cycle_points;
pub mod depth_clustering;
pub mod earlier_cycles;
pub mod filter;
pub mod floor;
pub mod free_space;
pub mod growth;
mod moving_in_place;
mod moving_pixels;
mod moving_view;
pub mod recent_views;
pub mod seeds;
pub mod segmenter;
#[cfg(feature = "ros")]
pub mod shell;
pub mod tracking;
mod two_stages;
pub mod view;

pub use config::{FreeSpaceConfig, SegmentationConfig};
pub use segmenter::{Judged, SegmentationError, Segmented, Segmenter, SegmenterError, Step};
