//! The pose that explains matches, how sure it is, and what it cannot say.
//!
//! | module | step |
//! |---|---|
//! | [`observation`] | a point or a line of the map, and where the image has it |
//! | [`perturbation`] | the six numbers that a pose is corrected by |
//! | [`plucker`] | lines of space: Plücker coordinates, four numbers to correct one by, its image, its ends |
//! | `term` | what an observation is off by, and how that changes with the pose |
//! | [`mod@refine`] | the most likely pose near a guess, its covariance, and which observations it explains |
//! | [`observability`] | which directions of the pose the observations tell of |
//! | [`mod@p3p`], [`mod@rigid_alignment`] | the pose by three matches, without and with their depths |
//! | [`ransac`], `line_ransac` | the pose without a guess, by points and by lines in space |
//! | [`rigid_sets`] | what belongs to the room and what to things that move, by the help of a prediction |
//!
//! # Conventions
//!
//! The camera is rectified: a [`geometry::CameraModel`] with lens distortion is refused. A pose is `camera_from_map`. It is
//! corrected on the left, in the camera frame: see [`perturbation`]. All covariances of poses are of that correction.

pub(crate) mod chi_square;
pub mod config;
mod information;
pub(crate) mod line_ransac;
pub mod observability;
pub mod observation;
pub mod p3p;
pub mod perturbation;
pub mod plucker;
mod random;
pub mod ransac;
pub mod refine;
pub mod rigid_alignment;
pub mod rigid_sets;
pub(crate) mod term;
#[cfg(test)]
pub(crate) mod testing;

pub use config::{
    FirstRound, NoiseScale, RansacConfig, RefineConfig, RigidSetsConfig, RobustKernel,
};
pub use observability::{Direction, Observability};
pub use observation::{LineObservation, PointObservation, Verdict};
pub use plucker::{OrthonormalLine, PluckerLine};
pub use ransac::{MinimalSolver, PnpError, PnpEstimate, pnp_ransac};
pub use refine::{PoseError, PoseEstimate, PoseGuess, information_at, refine_pose};
pub use rigid_alignment::{AlignmentError, RigidAlignment, rigid_alignment};
pub use rigid_sets::{RigidSet, RigidSplit, is_surprising, split_rigid_sets};
