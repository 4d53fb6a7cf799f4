//! The parameters of the odometry, their defaults, and where these come from.

use geometry::FARTHEST_POSE_M;
use serde::{Deserialize, Serialize};

use crate::registration::{
    CoarseConfig, ParameterError, PreparationConfig, RegistrationConfig, RobustKernel, check,
    check_positive, check_voxel_edge,
};

/// The parameters of [`super::LidarOdometry`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LidarOdometryConfig {
    /// Points nearer than this may be the vehicle itself, and are left out.
    pub min_range_m: f64,
    /// Farther points are left out, and the map reaches as far.
    pub max_range_m: f64,
    /// How a scan is made ready.
    pub preparation: PreparationConfig,
    /// How it is registered to the map. The reach of the correspondences and the width of the kernel are the threshold's.
    pub registration: RegistrationConfig,
    /// The edge of the map's voxels.
    pub map_voxel_edge_m: f64,
    /// A voxel of the map is the running mean of this many points: what it has seen before fades.
    pub map_memory_points: u32,
    /// The map holds no more voxels than this; those that were not seen for longest go first.
    pub max_map_voxels: usize,
    /// The threshold before anything is known of how well motions are predicted.
    pub first_deviation_m: f64,
    /// Deviations smaller than this say nothing of how well motions are predicted.
    pub min_deviation_m: f64,
    /// After this many scans that do not fit the map, it begins anew at the predicted pose.
    pub max_held_scans: usize,
}

impl Default for LidarOdometryConfig {
    fn default() -> Self {
        Self {
            // KISS-ICP (Vizzo et al. 2023) leaves out what is nearer than 5 m and farther than 100 m; a scanner on a low
            // vehicle sees most within 5 m.
            min_range_m: 2.0,
            max_range_m: 100.0,
            // Half of the map's voxels. At this spacing twenty neighbours reach round corners: on simulated drives ten drift
            // by a quarter less.
            preparation: PreparationConfig { voxel_edge_m: 0.5, neighbours: 10 },
            registration: RegistrationConfig {
                kernel: RobustKernel::GemanMcClure,
                coarse: CoarseConfig { every: 4, ..CoarseConfig::default() },
                ..RegistrationConfig::default()
            },
            // A hundredth of the range, as in KISS-ICP.
            map_voxel_edge_m: 1.0,
            // Some ten scans that see ten points of it each.
            map_memory_points: 100,
            // 30 MB. A street of 200 m has some 20,000.
            max_map_voxels: 200_000,
            // KISS-ICP, section III.D.
            first_deviation_m: 2.0,
            min_deviation_m: 0.1,
            max_held_scans: 5,
        }
    }
}

impl LidarOdometryConfig {
    /// No map is larger: 1.5 GB.
    pub(crate) const MOST_VOXELS: usize = 10_000_000;

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        self.preparation.validate()?;
        self.registration.validate()?;
        check_positive(&[
            ("first_deviation_m", self.first_deviation_m),
            ("min_deviation_m", self.min_deviation_m),
        ])?;
        check_voxel_edge("map_voxel_edge_m", self.map_voxel_edge_m)?;
        let farthest = self.max_range_m;
        check(
            "max_range_m",
            "above 0, and no farther than a pose may be (100000)",
            farthest,
            farthest > 0.0 && farthest <= FARTHEST_POSE_M,
        )?;
        let nearest = self.min_range_m;
        check(
            "min_range_m",
            "in [0, max_range_m)",
            nearest,
            (0.0..self.max_range_m).contains(&nearest),
        )?;
        let memory = self.map_memory_points;
        check("map_memory_points", "at least 1", f64::from(memory), memory > 0)?;
        let most = self.max_map_voxels;
        check(
            "max_map_voxels",
            "in 1000 .. 10000000",
            most as f64,
            (1000..=Self::MOST_VOXELS).contains(&most),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_each_bad_parameter_is_named() {
        type Spoil = fn(&mut LidarOdometryConfig);
        assert_eq!(LidarOdometryConfig::default().validate(), Ok(()));
        let cases: [(&str, Spoil); 9] = [
            ("min_range_m", |c| c.min_range_m = 100.0),
            ("max_range_m", |c| c.max_range_m = f64::NAN),
            ("map_voxel_edge_m", |c| c.map_voxel_edge_m = 0.0),
            // Regression: they were accepted, and scans matched a hundred metres off.
            ("map_voxel_edge_m", |c| c.map_voxel_edge_m = 1e9),
            ("max_range_m", |c| c.max_range_m = 1e300),
            ("map_memory_points", |c| c.map_memory_points = 0),
            ("max_map_voxels", |c| c.max_map_voxels = 10),
            ("neighbours", |c| c.preparation.neighbours = 1),
            ("settled_m", |c| c.registration.settled_m = -1.0),
        ];
        for (name, spoil) in cases {
            let mut config = LidarOdometryConfig::default();
            spoil(&mut config);
            assert!(config.validate().unwrap_err().to_string().contains(name), "{name}");
        }
    }
}
