//! What the node says of its parameters to those outside, and what its shell makes of them.

use std::time::Duration;

use node_shell::NodeFailure;
use node_shell::parameters::{NodeParameters, Range};

use super::ReconstructionParameters;
use super::map_file::MapFile;
use super::schedule::Periods;

impl NodeParameters for ReconstructionParameters {
    const FILE: &'static str = include_str!("../../../../config/reconstruction.yaml");
    const RANGES: &'static [(&'static str, Range)] = &[
        ("map_publish_period_s", Range::real(SHORTEST_S, LONGEST_S)),
        ("map_update_period_s", Range::real(SHORTEST_S, LONGEST_S)),
        ("map_update_max_points", Range::at_least(1)),
        ("voxel_edge_m", Range::POSITIVE),
        ("max_voxels", Range::at_least(1)),
    ];
    /// What the map is not made by.
    const CHANGEABLE: &'static [&'static str] = &[
        "map_publish_period_s",
        "map_update_period_s",
        "map_update_max_points",
        "save_map_on_exit",
        "map_file",
    ];

    fn validate(&self) -> Result<(), NodeFailure> {
        self.config.validate()?;
        Settings::of(self)?;
        Ok(())
    }
}

/// The shortest period: that of the finest clock.
const SHORTEST_S: f64 = 1e-9;
/// The longest period, some 30 years.
const LONGEST_S: f64 = 1e9;

/// The parameters of the shell, checked.
pub(super) struct Settings {
    pub(super) periods: Periods,
    pub(super) most_update_points: usize,
    /// Where the map goes at the end.
    pub(super) file_on_exit: Option<MapFile>,
    /// Where it goes to and comes from on request.
    pub(super) file: Option<MapFile>,
}

impl Settings {
    /// # Errors
    /// When a parameter is out of its range.
    pub(super) fn of(parameters: &ReconstructionParameters) -> Result<Self, NodeFailure> {
        if parameters.map_update_max_points == 0 {
            return Err("parameter map_update_max_points must be at least 1, not 0".into());
        }
        Ok(Self {
            periods: Periods {
                map: period("map_publish_period_s", parameters.map_publish_period_s)?,
                updates: period("map_update_period_s", parameters.map_update_period_s)?,
            },
            most_update_points: parameters.map_update_max_points,
            file_on_exit: MapFile::new("save_map_on_exit", &parameters.save_map_on_exit)?,
            file: MapFile::new("map_file", &parameters.map_file)?,
        })
    }
}

pub(super) fn period(name: &str, seconds: f64) -> Result<Duration, NodeFailure> {
    if (SHORTEST_S..=LONGEST_S).contains(&seconds) {
        return Ok(Duration::from_secs_f64(seconds));
    }
    Err(format!(
        "parameter {name} must be a positive number of seconds, at most {LONGEST_S}, not {seconds}"
    )
    .into())
}
