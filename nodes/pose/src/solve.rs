//! The pose that explains matches, how sure it is, and what it cannot say.
//!
//! | module | step |
//! |---|---|
//! | [`observation`] | a point or a line of the map, and where the image has it |
//! | [`plucker`] | lines of space: Plücker coordinates, four numbers to correct one by, its image, its ends |
//! | `term` | what an observation is off by, and how that changes with the pose |
//! | [`mod@refine`] | the most likely pose near a guess, its covariance, and which observations it explains |
//! | [`mod@p3p`], [`mod@rigid_alignment`] | the pose by three matches, without and with their depths |
//! | [`ransac`], `line_ransac` | the pose without a guess, by points and by lines in space |
//! | [`rigid_sets`] | what belongs to the room and what to things that move, by the help of a prediction |
//!
//! # Conventions
//!
//! The camera is rectified: a [`geometry::CameraModel`] with lens distortion is refused. A pose is `camera_from_map`. It is
//! corrected on the left, in the camera frame ([`estimation::perturbation::left`]). All covariances of poses are of that
//! correction. Directions that the observations do not constrain keep the guess ([`estimation::observability`]).

pub mod config;
pub(crate) mod line_ransac;
pub mod observation;
pub mod p3p;
pub mod plucker;
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
pub use observation::{LineObservation, PointObservation, Verdict};
pub use plucker::{OrthonormalLine, PluckerLine};
pub use ransac::{MinimalSolver, PnpError, PnpEstimate, pnp_ransac};
pub use refine::{PoseError, PoseEstimate, PoseGuess, information_at, refine_pose};
pub use rigid_alignment::{AlignmentError, RigidAlignment, rigid_alignment};
pub use rigid_sets::{RigidSet, RigidSplit, is_surprising, split_rigid_sets};

/// One of the six directions of a pose, with the standard deviations that are wanted for units.
pub type Direction = estimation::Direction<6>;
/// The directions of a pose that observations constrain.
pub type Observability = estimation::Observability<6>;
