//! The parameters of segmentation, their defaults, and where these come from.

use geometry::{ParameterError, VoxelEdgeError, VoxelGrid, parameter};
use serde::{Deserialize, Serialize};

/// How the object is cut out of its zone.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The two stages as Rec-HV publishes them.
    RecHv,
    /// What stands where free space was seen, grown from the zones and followed over the cycles.
    #[default]
    Stillmap,
}

/// The parameters of [`crate::Segmenter`].
///
/// Every default stands in [`SegmentationConfig::default`] and nowhere else. All but the first two concern
/// [`Method::Stillmap`] alone.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct SegmentationConfig {
    /// How the object is cut out of its zone.
    pub method: Method,
    /// The width of a cell of the depth histogram: t_vg, the edge of the reduction's voxels. Also the edge
    /// of the evidence's voxels.
    pub depth_cell_m: f64,
    /// Voxels of evidence kept at most; this bounds the memory.
    pub max_evidence_voxels: usize,
    /// Farther from the camera than this nothing is learned and nothing moves.
    pub evidence_reach_m: f64,
    /// What has stood in its place for less than this is not background yet.
    pub min_background_s: f64,
    /// The height of the scanner's plane in the rig frame.
    pub scan_height_in_rig_m: f64,
    /// The largest horizontal extent of an object, where nothing is known of the space around it.
    pub max_object_width_m: f64,
    /// The largest height of an object above the floor, where nothing is known of the space around it.
    pub max_object_height_m: f64,
    /// Points that have come into free space are an object even without a zone when they are so many.
    pub min_unzoned_points: usize,
    /// The standard deviation of an object's acceleration.
    pub acceleration_m_per_s2: f64,
    /// Of its first three cycles, an object must be seen in so many to become a track.
    pub min_seen_cycles: u32,
    /// A track ends after so many cycles in which it should have been seen and was not.
    pub max_unseen_cycles: u32,
    /// An object that stays in its place is taken for static after this time.
    pub max_stop_s: f64,
    /// Objects followed at most.
    pub max_tracks: usize,
}

impl Default for SegmentationConfig {
    fn default() -> Self {
        Self {
            // All improvements; the published method is there to be compared with.
            method: Method::Stillmap,
            // Rec-HV 3.3.3.1: the cells have the edge t_vg of the voxel grid, which experiment 4 chose.
            depth_cell_m: 0.08,
            // 24 MiB, and as much again for a moment while the table is rebuilt. A room of 5 x 6 x 2.6 m has 152,000 voxels.
            max_evidence_voxels: 500_000,
            // A Kinect measures to some 6 m; beyond, its depth error is wider than the voxel.
            evidence_reach_m: 8.0,
            // At 1 m/s, the slower speed of Rec-HV 3.4.1, something 0.64 m wide leaves a place in 0.65 s.
            min_background_s: 1.0,
            // Rec-HV 3.4.2: the scanner is 5 cm below the camera.
            scan_height_in_rig_m: -0.05,
            // A person with arms and legs astride; a robot with its screen is half of that.
            max_object_width_m: 1.2,
            // A tall person with an arm raised.
            max_object_height_m: 2.2,
            // 0.13 m2 of surface at the thesis' edge: a head and shoulders.
            min_unzoned_points: 20,
            // A walker who stops, starts or turns does so within half a second: 1.4 m/s / 0.5 s.
            acceleration_m_per_s2: 2.8,
            min_seen_cycles: 2,
            // A second and a half of the RPLIDAR A1.
            max_unseen_cycles: 10,
            // Long enough for a talk; a chair that was moved is furniture again after a minute.
            max_stop_s: 60.0,
            // More than a room holds.
            max_tracks: 32,
        }
    }
}

/// A parameter of segmentation has a value that means nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum ConfigError {
    /// The depth cell is no length.
    #[error("parameter depth_cell_m: {0}")]
    DepthCell(#[from] VoxelEdgeError),
    /// A number lies outside its range.
    #[error(transparent)]
    Range(#[from] ParameterError),
    /// A ray through the evidence would take too many steps.
    #[error(
        "parameter evidence_reach_m is {reach_m}: with depth_cell_m of {cell_m} a ray would pass more than \
         {} voxels",
        SegmentationConfig::MAX_RAY_VOXELS
    )]
    RaySteps {
        /// The reach.
        reach_m: f64,
        /// The edge of a voxel.
        cell_m: f64,
    },
}

impl SegmentationConfig {
    /// The most voxels along a ray: a cycle's time goes with them.
    pub const MAX_RAY_VOXELS: u32 = 2_000;

    /// Checks every parameter.
    ///
    /// # Errors
    /// When the depth cell is not a positive finite number, or another parameter is outside its range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        /// 100 million voxels of evidence are some 6 GB.
        const MOST_VOXELS: f64 = 1e8;
        /// A length or a time beyond this is a mistake.
        const MUCH: f64 = 1e6;
        /// Less than this is as good as nothing, and would divide by it.
        const LITTLE: f64 = 1e-3;
        VoxelGrid::new(self.depth_cell_m)?;
        for (name, value, least, most) in [
            ("max_evidence_voxels", self.max_evidence_voxels as f64, 1_000.0, MOST_VOXELS),
            ("evidence_reach_m", self.evidence_reach_m, LITTLE, MUCH),
            ("min_background_s", self.min_background_s, 0.0, MUCH),
            ("scan_height_in_rig_m", self.scan_height_in_rig_m, -MUCH, MUCH),
            ("max_object_width_m", self.max_object_width_m, LITTLE, MUCH),
            ("max_object_height_m", self.max_object_height_m, LITTLE, MUCH),
            ("min_unzoned_points", self.min_unzoned_points as f64, 1.0, MUCH),
            ("acceleration_m_per_s2", self.acceleration_m_per_s2, LITTLE, MUCH),
            ("min_seen_cycles", f64::from(self.min_seen_cycles), 1.0, 3.0),
            ("max_unseen_cycles", f64::from(self.max_unseen_cycles), 0.0, MUCH),
            ("max_stop_s", self.max_stop_s, 0.0, MUCH),
            ("max_tracks", self.max_tracks as f64, 1.0, 200.0),
        ] {
            parameter::between(name, value, least, most)?;
        }
        let (reach_m, cell_m) = (self.evidence_reach_m, self.depth_cell_m);
        if self.method == Method::Stillmap && reach_m / cell_m > f64::from(Self::MAX_RAY_VOXELS) {
            return Err(ConfigError::RaySteps { reach_m, cell_m });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_for_both_methods() {
        for method in [Method::RecHv, Method::Stillmap] {
            let config = SegmentationConfig { method, ..SegmentationConfig::default() };
            assert_eq!(config.validate(), Ok(()));
        }
    }

    #[test]
    fn each_bad_parameter_is_named() {
        let good = SegmentationConfig { method: Method::Stillmap, ..SegmentationConfig::default() };
        for (name, bad) in [
            ("depth_cell_m", SegmentationConfig { depth_cell_m: -1.0, ..good }),
            ("max_evidence_voxels", SegmentationConfig { max_evidence_voxels: 0, ..good }),
            ("evidence_reach_m", SegmentationConfig { evidence_reach_m: f64::NAN, ..good }),
            ("evidence_reach_m", SegmentationConfig { depth_cell_m: 1e-9, ..good }),
            ("min_background_s", SegmentationConfig { min_background_s: -0.1, ..good }),
            (
                "scan_height_in_rig_m",
                SegmentationConfig { scan_height_in_rig_m: f64::INFINITY, ..good },
            ),
            ("max_object_width_m", SegmentationConfig { max_object_width_m: 0.0, ..good }),
            ("max_object_height_m", SegmentationConfig { max_object_height_m: -2.0, ..good }),
            ("min_unzoned_points", SegmentationConfig { min_unzoned_points: 0, ..good }),
            ("acceleration_m_per_s2", SegmentationConfig { acceleration_m_per_s2: 0.0, ..good }),
            ("min_seen_cycles", SegmentationConfig { min_seen_cycles: 4, ..good }),
            ("max_unseen_cycles", SegmentationConfig { max_unseen_cycles: u32::MAX, ..good }),
            ("max_stop_s", SegmentationConfig { max_stop_s: f64::NAN, ..good }),
            ("max_tracks", SegmentationConfig { max_tracks: 0, ..good }),
        ] {
            let message = bad.validate().unwrap_err().to_string();
            assert!(message.contains(name), "{message} does not name {name}");
        }
    }
}
