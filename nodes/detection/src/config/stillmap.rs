//! The parameters that only the method `stillmap` reads.

use std::f64::consts::PI;

use geometry::{BeamOrder, ParameterError, parameter};
use serde::{Deserialize, Serialize};

/// The parameters of the method `stillmap`; their names share the file with those of the other method.
///
/// Every default stands in [`StillmapConfig::default`] and nowhere else.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct StillmapConfig {
    /// Edge of the cells that hold the evidence of free space.
    pub evidence_cell_m: f64,
    /// Side of the square around the scanner in which evidence is kept. With the cell's edge it bounds the
    /// memory: [`StillmapConfig::evidence_bytes`].
    pub evidence_extent_m: f64,
    /// Beams are evidence up to this distance.
    pub evidence_reach_m: f64,
    /// Evidence that has not been renewed for so long is forgotten.
    pub evidence_memory_s: f64,
    /// What came into free space and stands still counts as moving for so long; then it is background.
    pub stopped_object_s: f64,
    /// In so many cycles a place must have been seen free before a return there counts as moving.
    pub min_passes: u32,
    /// Standard deviation of a range: this much, in quadrature with ...
    pub range_noise_m: f64,
    /// ... this share of the range.
    pub range_noise_ratio: f64,
    /// Standard deviation of a pose's position while the platform moves.
    pub pose_noise_m: f64,
    /// Standard deviation of a pose's heading while the platform moves.
    pub pose_noise_rad: f64,
    /// Narrower things are no objects: fewer beams than such a thing would take are noise.
    pub smallest_object_m: f64,
    /// The order in which the scanner measures.
    pub beam_order: BeamOrder,
    /// A platform cannot go faster: a pose beyond is a jump, and the evidence starts anew.
    pub max_platform_speed_m_per_s: f64,
    /// A platform cannot turn faster.
    pub max_platform_turn_rad_per_s: f64,
}

impl Default for StillmapConfig {
    fn default() -> Self {
        Self {
            // About the distance of two 1 degree beams at 3 m, and the 2.5 sigma of a range there.
            evidence_cell_m: 0.05,
            // The reach to all sides, and 2 m for the platform to go before cells are renewed.
            evidence_extent_m: 20.0,
            // The reach of the thesis' RPLIDAR A1 (Rec-HV 3.2.1).
            evidence_reach_m: 8.0,
            // Twice the time of a stopped object, so that it does not outlive the evidence it stands on.
            evidence_memory_s: 120.0,
            // Longer than a conversation's pause; furniture that was moved joins the map after it.
            stopped_object_s: 60.0,
            // Two may be one outlier seen by two cycles; three are not.
            min_passes: 3,
            // Rec-HV 4.3: deviations of up to 0.042 m over three scans of an empty room of 4 m.
            range_noise_m: 0.02,
            range_noise_ratio: 0.005,
            // Visual odometry on a small robot: a centimetre and half a degree.
            pose_noise_m: 0.01,
            pose_noise_rad: 0.5 * PI / 180.0,
            // A forearm or a shin, a little thinner.
            smallest_object_m: 0.08,
            beam_order: BeamOrder::Unknown,
            // Twice a walking pace, and half a turn a second: beyond what indoor platforms do.
            max_platform_speed_m_per_s: 3.0,
            max_platform_turn_rad_per_s: PI,
        }
    }
}

/// The evidence grid has no more cells than this along a side: 4096^2 cells of 16 bytes are 268 MB.
const MOST_CELLS_A_SIDE: f64 = 4096.0;
/// ... and no fewer than this: a reach of a few cells shows nothing.
const LEAST_CELLS_A_SIDE: f64 = 8.0;
/// Bytes of a cell of the evidence grid.
const BYTES_OF_A_CELL: usize = 16;
/// Times are counted in milliseconds of 32 bits.
const LONGEST_S: f64 = 1e6;

impl StillmapConfig {
    /// Cells along a side of the evidence grid.
    #[must_use]
    pub fn evidence_cells_a_side(&self) -> usize {
        (self.evidence_extent_m / self.evidence_cell_m).ceil() as usize
    }

    /// What the evidence takes of memory, however long it runs.
    #[must_use]
    pub fn evidence_bytes(&self) -> usize {
        BYTES_OF_A_CELL * self.evidence_cells_a_side().pow(2)
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::positive("evidence_cell_m", self.evidence_cell_m)?;
        let extent = self.evidence_extent_m;
        let cells = extent / self.evidence_cell_m;
        parameter::check(
            "evidence_extent_m",
            "8 .. 4096 times evidence_cell_m",
            extent,
            (LEAST_CELLS_A_SIDE..=MOST_CELLS_A_SIDE).contains(&cells),
        )?;
        let reach = self.evidence_reach_m;
        parameter::check(
            "evidence_reach_m",
            "above 0 and at most half of evidence_extent_m",
            reach,
            reach > 0.0 && reach <= 0.5 * extent,
        )?;
        for (name, value) in [
            ("evidence_memory_s", self.evidence_memory_s),
            ("stopped_object_s", self.stopped_object_s),
        ] {
            let holds = value > 0.0 && value <= LONGEST_S;
            parameter::check(name, "in (0, 1000000] seconds", value, holds)?;
        }
        let passes = self.min_passes;
        parameter::check(
            "min_passes",
            "in 1 .. 50",
            f64::from(passes),
            (1..=50).contains(&passes),
        )?;
        parameter::not_negative("range_noise_m", self.range_noise_m)?;
        parameter::below_one("range_noise_ratio", self.range_noise_ratio)?;
        parameter::not_negative("pose_noise_m", self.pose_noise_m)?;
        let noise_rad = self.pose_noise_rad;
        parameter::check(
            "pose_noise_rad",
            "in [0, pi]",
            noise_rad,
            (0.0..=PI).contains(&noise_rad),
        )?;
        parameter::not_negative("smallest_object_m", self.smallest_object_m)?;
        parameter::positive("max_platform_speed_m_per_s", self.max_platform_speed_m_per_s)?;
        parameter::positive("max_platform_turn_rad_per_s", self.max_platform_turn_rad_per_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_bound_the_memory() {
        let config = StillmapConfig::default();
        assert_eq!(config.validate(), Ok(()));
        assert_eq!(config.evidence_bytes(), 400 * 400 * 16);
    }

    #[test]
    fn each_bad_parameter_is_named() {
        type Spoil = fn(&mut StillmapConfig);
        let cases: [(&str, Spoil); 14] = [
            ("evidence_cell_m", |c| c.evidence_cell_m = 0.0),
            ("evidence_extent_m", |c| c.evidence_extent_m = 1e6),
            ("evidence_extent_m", |c| c.evidence_extent_m = f64::NAN),
            ("evidence_reach_m", |c| c.evidence_reach_m = 11.0),
            ("evidence_memory_s", |c| c.evidence_memory_s = f64::INFINITY),
            ("stopped_object_s", |c| c.stopped_object_s = 0.0),
            ("min_passes", |c| c.min_passes = 0),
            ("range_noise_m", |c| c.range_noise_m = -0.1),
            ("range_noise_ratio", |c| c.range_noise_ratio = 1.0),
            ("pose_noise_m", |c| c.pose_noise_m = f64::NAN),
            ("pose_noise_rad", |c| c.pose_noise_rad = 4.0),
            ("smallest_object_m", |c| c.smallest_object_m = f64::INFINITY),
            ("max_platform_speed_m_per_s", |c| c.max_platform_speed_m_per_s = 0.0),
            ("max_platform_turn_rad_per_s", |c| c.max_platform_turn_rad_per_s = -1.0),
        ];
        for (name, spoil) in cases {
            let mut config = StillmapConfig::default();
            spoil(&mut config);
            let message = config.validate().unwrap_err().to_string();
            assert!(message.contains(name), "{message} does not name {name}");
        }
    }
}
