//! Splits a reduced cloud into its static and dynamic parts (Rec-HV 3.2.5 to 3.2.7, 3.3.3).
//!
//! | module | step | source |
//! |---|---|---|
//! | [`angular`] | points within a dynamic zone | 3.2.5, eq. 6 |
//! | [`depth_clustering`] | of these, the nearest group along x: the object | 3.2.6, 3.3.3.1 |
//! | [`segmenter`] | both in turn, then the static part in the map frame | eq. 7, 8 |
//!
//! The method `stillmap` tells what moves by what earlier cycles saw:
//!
//! | module | step |
//! |---|---|
//! | [`evidence`] | which places of the map were seen free, and where something has stood for long |
//! | [`recent_views`] | which places the last cycles would have shown taken |
//! | [`view`] | what the camera can see |
//! | [`floor`] | the lowest horizontal plane |
//! | [`seeds`] | where objects are known to be: by zones, by tracks, by what has come into free space |
//! | [`growth`] | the objects grown from the seeds through the cloud |
//! | [`tracking`] | the objects followed over the cycles |
//! | `steady` | all of them in a frame that does not jump when the map is corrected |
//! | [`stillmap`] | all of them in turn |
//!
//! This crate without its feature `ros` is the core: it knows no ROS, no clock and no file.

pub mod angular;
pub mod config;
pub mod depth_clustering;
pub mod evidence;
pub mod floor;
pub mod growth;
pub mod recent_views;
pub mod seeds;
pub mod segmenter;
#[cfg(feature = "ros")]
pub mod shell;
mod steady;
pub mod stillmap;
pub mod tracking;
pub mod view;

pub use config::{ConfigError, Method, SegmentationConfig};
pub use segmenter::{SegmentationError, Segmented, Segmenter, Step};
