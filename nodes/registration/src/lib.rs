//! How one cloud lies to another: from a guess, the points that are nearest to each other are taken to be the same, the
//! pose is corrected by what they miss, and again (Road LiDAR, section 3.1.3; Besl and McKay 1992).
//!
//! | file | the idea |
//! |---|---|
//! | `prepared_cloud` | thinning out by voxels, the order, the normals: once for each cloud |
//! | `kd_tree` | neighbours in a cloud |
//! | `normal` | the plane of a point's neighbours |
//! | `surface`, `voxel_surface` | the target of a registration: points, or means of voxels |
//! | `factor` | how a distance is measured: all in which the methods differ |
//! | `correspondences`, `normal_equations` | the corresponding points, and their sums |
//! | `alignment` | the steps |
//!
//! A pose is corrected along the axes of the target, about the source's origin ([`estimation::perturbation::composite`]);
//! directions that the clouds do not constrain keep the guess ([`estimation::observability`]).
//!
//! Points are single precision in the frame of their sensor; everything that is summed is double. The number of threads
//! changes no bit: chunks have a fixed size, and their sums are added in their order.

mod alignment;
mod config;
mod correspondences;
mod error;
mod factor;
mod kd_tree;
mod normal;
mod normal_equations;
mod prepared_cloud;
mod surface;
pub mod testing;
#[cfg(test)]
mod tests;
mod voxel_surface;

use estimation::Executor;
pub use estimation::RobustKernel;
pub use estimation::perturbation::{is_rigid, is_rotation};
use nalgebra::Isometry3;

pub use self::alignment::Registration;
pub use self::config::{CoarseConfig, Method, PreparationConfig, RegistrationConfig};
pub use self::error::RegistrationError;
pub use self::prepared_cloud::PreparedCloud;

/// One of the six directions of a pose: shifts count in metres, turns in the metres that they move the points by.
pub type Direction = estimation::Direction<6>;
/// The directions that the correspondences constrain. The information along a direction is a share: as if this share of
/// the correspondences looked straight along it. In place of the bare eigenvalue this makes it a matter of the scene, not of
/// how many points it is seen with.
pub type Observability = estimation::Observability<6>;

pub use self::alignment::align;
pub use self::config::{check_positive, check_voxel_edge};
pub use self::surface::{Surface, SurfaceElement};
pub use self::voxel_surface::VoxelSurface;
pub use geometry::ParameterError;
pub use geometry::parameter::check;

/// Registers a cloud to another: the pose of the source in the target's frame, from a guess.
///
/// Directions that the clouds do not constrain keep the guess ([`Registration::observability`]). The same clouds give the
/// same result to the bit, whatever the number of threads.
///
/// # Errors
/// When a parameter is out of its range, the guess is not finite, or the clouds do not overlap where it puts them.
pub fn register(
    source: &PreparedCloud,
    target: &PreparedCloud,
    guess: &Isometry3<f64>,
    config: &RegistrationConfig,
    executor: &dyn Executor,
) -> Result<Registration, RegistrationError> {
    if config.method == Method::VoxelisedGeneralised {
        config.validate()?;
        let target = voxelised(target, config.target_voxel_edge_m);
        return align(source, &target, guess, config, executor);
    }
    align(source, target, guess, config, executor)
}

/// A cloud as the means of its voxels.
fn voxelised(cloud: &PreparedCloud, edge_m: f64) -> VoxelSurface {
    let mut surface = VoxelSurface::new(edge_m);
    for number in 0..cloud.len() {
        let (place_m, normal) = cloud.point(number);
        surface.add(&place_m, &normal, u32::MAX, 0);
    }
    surface
}
