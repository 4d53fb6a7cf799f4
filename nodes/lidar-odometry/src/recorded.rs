//! Clouds that were recorded as clouds, not as packets: organised again, so that the odometry treats them as its own.
//!
//! | file | what |
//! |---|---|
//! | `columns` | points of a row to columns by azimuth, without losing one |
//! | `kitti` | the `.bin` files of KITTI and KITTI-360 |
//! | `cloud` | what any driver lists, by its rings |
//! | `csv` | the files that Road LiDAR's section 2.4, option C, exports |
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

mod cloud;
mod columns;
mod csv;
mod kitti;

pub(crate) use cloud::middle_elevation_rad;
pub use cloud::revolution_from_cloud;
pub use csv::{CsvError, CsvFile, revolutions_from_csv};
pub use kitti::{KittiError, revolution_from_kitti};
