//! The parameters of the registration, their defaults, and where these come from.

use std::f64::consts::PI;

use estimation::RobustKernel;
use geometry::ParameterError;
use geometry::parameter::{check, positive};
use serde::{Deserialize, Serialize};

/// The error to minimise, point by point.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The distance to the nearest point (Besl and McKay 1992).
    PointToPoint,
    /// The distance to the plane of the nearest point (Chen and Medioni 1991).
    PointToPlane,
    /// The distance to the nearest point, measured by the planes of both (Segal, Haehnel and Thrun 2009).
    Generalised,
    /// The same to the mean of the points of a voxel (Koide et al. 2021, "Voxelized GICP").
    VoxelisedGeneralised,
}

/// How a cloud is made ready.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PreparationConfig {
    /// Points of one cube of this edge become their mean; 0 keeps them all.
    pub voxel_edge_m: f64,
    /// The plane of a point is that of this many neighbours, the point itself among them.
    pub neighbours: usize,
}

impl Default for PreparationConfig {
    fn default() -> Self {
        Self {
            // small_gicp's default (Koide 2024).
            voxel_edge_m: 0.25,
            // Segal et al. 2009, section III.B. Ten are two thirds of the time; of a sensor of 16 rays they mostly lie along one.
            neighbours: 20,
        }
    }
}

/// The first steps of a registration: with a part of the points, and from farther away.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CoarseConfig {
    /// One of this many points takes part; 1 for all, 0 for no coarse steps.
    pub every: usize,
    /// Points farther apart do not correspond.
    pub max_correspondence_m: f64,
    /// It is left when a step is shorter than this.
    pub settled_m: f64,
    /// ... and turns by less.
    pub settled_rad: f64,
}

impl Default for CoarseConfig {
    fn default() -> Self {
        Self {
            // Of 15,000 points 2,000 are left: they place a scan to a centimetre.
            every: 8,
            // A car at 110 km/h moves this far in a tenth of a second.
            max_correspondence_m: 3.0,
            settled_m: 0.03,
            settled_rad: 0.1 * PI / 180.0,
        }
    }
}

/// The parameters of [`super::register`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RegistrationConfig {
    /// The error to minimise.
    pub method: Method,
    /// Points farther apart do not correspond.
    pub max_correspondence_m: f64,
    /// The first steps.
    pub coarse: CoarseConfig,
    /// The edge of a voxel of [`Method::VoxelisedGeneralised`].
    pub target_voxel_edge_m: f64,
    /// How much a correspondence counts that does not fit.
    pub kernel: RobustKernel,
    /// From this distance on (across the surface, where there is one) it is doubted.
    pub kernel_width_m: f64,
    /// Steps, at most.
    pub max_iterations: usize,
    /// It has converged when a step is shorter than this ...
    pub settled_m: f64,
    /// ... and turns by less.
    pub settled_rad: f64,
    /// Fewer correspondences place nothing.
    pub min_correspondences: usize,
    /// A direction is estimated when the correspondences determine it as well as if this share of them looked straight along
    /// it, with surfaces that both clouds agree upon. Otherwise it keeps the guess.
    pub min_constrained_share: f64,
}

impl Default for RegistrationConfig {
    fn default() -> Self {
        Self {
            // The thesis' choice (Road LiDAR 4.1): the others did not align its clouds.
            method: Method::Generalised,
            // small_gicp's default.
            max_correspondence_m: 1.0,
            coarse: CoarseConfig::default(),
            // As in Koide et al. 2021, section IV.
            target_voxel_edge_m: 1.0,
            kernel: RobustKernel::None,
            // Three standard deviations of a range and as much again for what is no plane.
            kernel_width_m: 0.1,
            max_iterations: 50,
            // A tenth of what is asked of a pair: 1 cm and 0.05 degrees.
            settled_m: 0.001,
            settled_rad: 0.005 * PI / 180.0,
            // Ten for each number that is sought.
            min_correspondences: 60,
            // Normals of noise agree in one of a few thousand; a street's crosswise surfaces are a few in a hundred.
            min_constrained_share: 0.001,
        }
    }
}

/// That each of the values is a positive number.
///
/// # Errors
/// The first one that is not, by its name.
pub fn check_positive(values: &[(&'static str, f64)]) -> Result<(), ParameterError> {
    values.iter().try_for_each(|(name, value)| positive(name, *value))
}

/// That an edge of voxels is between a millimetre and ten metres: it holds a surface, and their number fits an integer.
///
/// # Errors
/// When it is not, by its name.
pub fn check_voxel_edge(name: &'static str, edge_m: f64) -> Result<(), ParameterError> {
    check(name, "in 0.001 .. 10 metres", edge_m, (0.001..=10.0).contains(&edge_m))
}

impl PreparationConfig {
    /// No plane is fitted to more points.
    pub const MOST_NEIGHBOURS: usize = super::kd_tree::MOST_NEIGHBOURS;

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        // At 0 all points are kept.
        if self.voxel_edge_m != 0.0 {
            check_voxel_edge("voxel_edge_m", self.voxel_edge_m)?;
        }
        let neighbours = self.neighbours;
        let holds = (4..=Self::MOST_NEIGHBOURS).contains(&neighbours);
        check("neighbours", "in 4 .. 32", neighbours as f64, holds)
    }
}

impl RegistrationConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        check_positive(&[
            ("max_correspondence_m", self.max_correspondence_m),
            ("coarse.max_correspondence_m", self.coarse.max_correspondence_m),
            ("coarse.settled_m", self.coarse.settled_m),
            ("coarse.settled_rad", self.coarse.settled_rad),
            ("kernel_width_m", self.kernel_width_m),
            ("settled_m", self.settled_m),
            ("settled_rad", self.settled_rad),
        ])?;
        check_voxel_edge("target_voxel_edge_m", self.target_voxel_edge_m)?;
        let share = self.min_constrained_share;
        check("min_constrained_share", "in [0, 1)", share, (0.0..1.0).contains(&share))?;
        let iterations = self.max_iterations;
        check(
            "max_iterations",
            "in 1 .. 1000",
            iterations as f64,
            (1..=1000).contains(&iterations),
        )?;
        let least = self.min_correspondences;
        check("min_correspondences", "at least 6", least as f64, least >= 6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_each_bad_parameter_is_named() {
        type Spoil = fn(&mut RegistrationConfig);
        assert_eq!(RegistrationConfig::default().validate(), Ok(()));
        let cases: [(&str, Spoil); 7] = [
            ("max_correspondence_m", |c| c.max_correspondence_m = 0.0),
            ("coarse.settled_m", |c| c.coarse.settled_m = f64::NAN),
            ("kernel_width_m", |c| c.kernel_width_m = f64::INFINITY),
            ("min_constrained_share", |c| c.min_constrained_share = 1.0),
            ("max_iterations", |c| c.max_iterations = 0),
            // Regression: it was accepted, and the result said to have converged 2 m off.
            ("target_voxel_edge_m", |c| c.target_voxel_edge_m = 1e-9),
            ("min_correspondences", |c| c.min_correspondences = 5),
        ];
        for (name, spoil) in cases {
            let mut config = RegistrationConfig::default();
            spoil(&mut config);
            assert!(config.validate().unwrap_err().to_string().contains(name), "{name}");
        }
        assert_eq!(PreparationConfig::default().validate(), Ok(()));
        let preparation = PreparationConfig::default();
        assert!(PreparationConfig { neighbours: 33, ..preparation }.validate().is_err());
        for voxel_edge_m in [-0.1, 1e-9, 1e9, f64::NAN] {
            assert!(PreparationConfig { voxel_edge_m, ..preparation }.validate().is_err());
        }
        assert_eq!(PreparationConfig { voxel_edge_m: 0.0, ..preparation }.validate(), Ok(()));
    }
}
