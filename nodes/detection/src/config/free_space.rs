//! The parameters that only the method `free_space` reads.

use std::f64::consts::PI;

use geometry::{BeamOrder, ParameterError, parameter};

geometry::parameters! {
    /// The parameters of the method `free_space`.
    #[derive(Clone, PartialEq, Debug)]
    pub struct FreeSpaceConfig {
        /// Edge of the cells that hold the evidence of free space.
        // About the distance of two 1 degree beams at 3 m, and the 2.5 sigma of a range there.
        evidence_cell_m: f64 = 0.05, positive;
        /// Side of the square around the scanner in which evidence is kept: 8 to 4096 cells. With the cell's edge it bounds the
        /// memory, 16 bytes a cell: by default 2.6 MB.
        // The reach to all sides, and 2 m for the platform to go before cells are renewed.
        evidence_extent_m: f64 = 20.0, positive;
        /// Beams are evidence up to this distance; at most half of evidence_extent_m.
        // The reach of the thesis' RPLIDAR A1 (Rec-HV 3.2.1).
        evidence_reach_m: f64 = 8.0, positive;
        /// Evidence that has not been renewed for this long is forgotten.
        // Twice max_stop_s, so that the evidence lasts longer than the object counts as moving.
        evidence_memory_s: f64 = 120.0, above_to(0.0, LONGEST_S);
        /// Standard deviation of a range, in quadrature with range_noise_ratio.
        // Rec-HV 4.3: deviations of up to 0.042 m over three scans of an empty room of 4 m.
        range_noise_m: f64 = 0.02, not_negative;
        /// Standard deviation of a range as a share of it, in quadrature with range_noise_m.
        range_noise_ratio: f64 = 0.005, from_below(0.0, 1.0);
        /// Standard deviation of a pose's position while the platform moves.
        // Visual odometry on a small robot: a centimetre and half a degree.
        pose_noise_m: f64 = 0.01, not_negative;
        /// Standard deviation of a pose's heading while the platform moves: half a degree.
        pose_noise_rad: f64 = 0.5 * PI / 180.0, between(0.0, PI);
        /// Narrower things are no objects: fewer beams than such a thing has are noise.
        // A forearm or a shin, a little thinner.
        smallest_object_m: f64 = 0.08, not_negative;
        /// The order in which the scanner measures its beams.
        beam_order: BeamOrder = BeamOrder::Unknown;
        /// A pose that needs a higher speed of the platform is a jump, and the evidence starts anew.
        // Twice a walking pace, and half a turn a second: beyond what indoor platforms do.
        max_platform_speed_m_per_s: f64 = 3.0, positive;
        /// A pose that needs a faster rotation of the platform is a jump, and the evidence starts anew: half a turn a second.
        max_platform_turn_rad_per_s: f64 = PI, positive;
    }
    check = Self::check_extent;
}

/// The evidence grid has no more cells than this along a side: 4096^2 cells of 16 bytes are 268 MB.
const MOST_CELLS_A_SIDE: f64 = 4096.0;
/// ... and no fewer than this: with a reach of a few cells no free space is observed.
const LEAST_CELLS_A_SIDE: f64 = 8.0;
/// Times are counted in milliseconds of 32 bits.
const LONGEST_S: f64 = 1e6;

impl FreeSpaceConfig {
    /// Cells along a side of the evidence grid.
    #[must_use]
    pub fn evidence_cells_a_side(&self) -> usize {
        (self.evidence_extent_m / self.evidence_cell_m).ceil() as usize
    }

    /// The memory of the evidence, which does not grow.
    #[must_use]
    pub fn evidence_bytes(&self) -> usize {
        size_of::<volume::Cell>() * self.evidence_cells_a_side().pow(2)
    }

    fn check_extent(&self) -> Result<(), ParameterError> {
        let (extent_m, cell_m) = (self.evidence_extent_m, self.evidence_cell_m);
        let holds = (LEAST_CELLS_A_SIDE..=MOST_CELLS_A_SIDE).contains(&(extent_m / cell_m));
        let accepted = ("8 to 4096 times evidence_cell_m", cell_m);
        parameter::check("evidence_extent_m", accepted, extent_m, holds)?;
        let reach_m = self.evidence_reach_m;
        let accepted = ("at most half of evidence_extent_m", extent_m);
        parameter::check("evidence_reach_m", accepted, reach_m, reach_m <= 0.5 * extent_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_bound_the_memory() {
        let config = FreeSpaceConfig::default();
        assert_eq!(config.validate(), Ok(()));
        assert_eq!(config.evidence_bytes(), 400 * 400 * 16);
    }

    #[test]
    fn each_bad_parameter_is_named() {
        type Spoil = fn(&mut FreeSpaceConfig);
        let cases: [(&str, Spoil); 12] = [
            ("evidence_cell_m", |c| c.evidence_cell_m = 0.0),
            ("evidence_extent_m", |c| c.evidence_extent_m = 1e6),
            ("evidence_extent_m", |c| c.evidence_extent_m = f64::NAN),
            ("evidence_reach_m", |c| c.evidence_reach_m = 11.0),
            ("evidence_memory_s", |c| c.evidence_memory_s = f64::INFINITY),
            ("range_noise_m", |c| c.range_noise_m = -0.1),
            ("range_noise_ratio", |c| c.range_noise_ratio = 1.0),
            ("pose_noise_m", |c| c.pose_noise_m = f64::NAN),
            ("pose_noise_rad", |c| c.pose_noise_rad = 4.0),
            ("smallest_object_m", |c| c.smallest_object_m = f64::INFINITY),
            ("max_platform_speed_m_per_s", |c| c.max_platform_speed_m_per_s = 0.0),
            ("max_platform_turn_rad_per_s", |c| c.max_platform_turn_rad_per_s = -1.0),
        ];
        for (name, spoil) in cases {
            let mut config = FreeSpaceConfig::default();
            spoil(&mut config);
            let message = config.validate().unwrap_err().to_string();
            assert!(message.contains(name), "{message} does not name {name}");
        }
    }
}
