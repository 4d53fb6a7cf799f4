//! Oriented corners with binary descriptors: FAST on a pyramid, spread evenly, rotated BRIEF (Rublee et al. 2011, ORB;
//! PL-SLAM section 2.2).
//!
//! | module | step | source |
//! |---|---|---|
//! | `levels` | the image at several scales | |
//! | `segment_test` | how strong a corner is at every pixel | Rosten and Drummond 2006 (FAST) |
//! | `detection` | local maxima, by cell above the higher or the lower threshold | Mur-Artal et al. 2015, IV.A |
//! | `spread` | how many of each scale, and which: evenly over the image | the same |
//! | `orientation` | the direction to the centroid of intensity | Rosin 1999; Rublee et al. 2011, 3.2 |
//! | `description` | 256 comparisons of pixel pairs, turned with the corner | Calonder et al. 2010; Rublee et al. 2011, 4 |
//! | `extraction` | all of them in turn | |

mod config;
mod corner;
mod description;
mod detection;
mod extraction;
mod levels;
mod orientation;
mod pattern;
mod segment_test;
mod spread;
#[cfg(test)]
mod tests;

pub use config::{PointConfig, Pyramid};
pub use corner::{Corner, DESCRIPTOR_BITS, Descriptor};
pub use extraction::PointExtractor;
#[cfg(test)]
pub(crate) use pattern::PATTERN;
