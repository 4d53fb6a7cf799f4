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
//!
//! ```
//! use estimation::Serial;
//! use nalgebra::{Isometry3, Point3, Vector3};
//! use registration::{PreparationConfig, PreparedCloud, RegistrationConfig, register};
//!
//! // The corner of a room, and what a sensor sees of it that is 20 cm beside its origin and turned by 6 degrees.
//! let steps = || (0..40).map(|step| 0.1 * step as f32);
//! let on_faces = |u, v| [[u, v, 0.0], [u, 0.0, v], [0.0, u, v]].map(Point3::from);
//! let corner_m: Vec<Point3<f32>> =
//!     steps().flat_map(|u| steps().flat_map(move |v| on_faces(u, v))).collect();
//! let corner_from_sensor = Isometry3::new(Vector3::new(0.2, 0.0, 0.0), Vector3::z() * 0.1);
//! let sensor_from_corner = corner_from_sensor.inverse();
//! let seen_m: Vec<Point3<f32>> =
//!     corner_m.iter().map(|point_m| (sensor_from_corner * point_m.cast::<f64>()).cast()).collect();
//!
//! // Each cloud is made ready once, however often it is registered.
//! let prepared = |points_m| PreparedCloud::new(points_m, &PreparationConfig::default(), &Serial);
//! let (source, target) = (prepared(&seen_m)?, prepared(&corner_m)?);
//! let config = RegistrationConfig::default();
//! let found = register(&source, &target, &Isometry3::identity(), &config, &Serial)?;
//! let error = corner_from_sensor.inverse() * found.target_from_source;
//! assert!(found.converged && error.translation.vector.norm() < 0.01 && error.rotation.angle() < 0.01);
//! # Ok::<(), registration::RegistrationError>(())
//! ```

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
