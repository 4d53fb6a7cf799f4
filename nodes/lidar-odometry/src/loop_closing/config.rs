//! The parameters of loop closing, their defaults, and where these come from.

use nalgebra::Isometry3;
use pose_graph::GraphConfig;
use serde::{Deserialize, Serialize};

use crate::registration::{
    CoarseConfig, ParameterError, PreparationConfig, RegistrationConfig, check, check_positive,
    is_rigid,
};

/// The parameters of [`super::LoopCloser`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LoopClosingConfig {
    /// From one keyframe to the next.
    pub keyframe_distance_m: f64,
    /// A keyframe keeps the points of a scan that are nearer than this ...
    pub keyframe_range_m: f64,
    /// ... one in each cube of this edge.
    pub keyframe_voxel_edge_m: f64,
    /// This many keyframes are remembered, the latest; some 80 kB each of a sensor of 64 rays.
    pub max_keyframes: usize,
    /// How far the odometry may have drifted after a kilometre: a standard deviation, which grows with the root of the distance.
    pub drift_m_per_km: f64,
    /// Likewise its turn.
    pub drift_deg_per_km: f64,
    /// A vehicle that has travelled less since a place has not returned to it.
    pub min_travelled_m: f64,
    /// Places that lie nearer together than this, beside the drift, are the same: the width of a road.
    pub search_radius_m: f64,
    /// Places whose scan contexts differ by more do not look alike: 0 for the same, 1 for nothing in common.
    pub max_context_distance: f64,
    /// This many places are looked at closely.
    pub max_candidates: usize,
    /// Candidates lie this far apart; and two results that lie farther apart are two places.
    pub distinct_m: f64,
    /// A place is what this many keyframes before and after it saw.
    pub neighbours: usize,
    /// How a scan is prepared for registration to a place.
    pub preparation: PreparationConfig,
    /// How it is registered to it.
    pub registration: RegistrationConfig,
    /// This share of the upright surfaces must have a counterpart ...
    pub min_fit_share: f64,
    /// ... as near as this.
    pub fit_distance_m: f64,
    /// A second place that fits by this share of the first's is as good: then none is accepted.
    pub ambiguous_share: f64,
    /// Two loops that agree this well confirm each other: a shift ...
    pub agreement_m: f64,
    /// ... and a turn.
    pub agreement_deg: f64,
    /// A loop waits this distance for one that confirms it.
    pub confirmation_m: f64,
    /// After a loop was closed the next one is searched for after this distance.
    pub closure_distance_m: f64,
    /// How sure a scan lies on an earlier place, beside what the registration knows of it: a standard deviation.
    pub loop_deviation_m: f64,
    /// Likewise its turn.
    pub loop_deviation_deg: f64,
    /// How the graph is optimised.
    pub graph: GraphConfig,
}

impl Default for LoopClosingConfig {
    fn default() -> Self {
        Self {
            // Kim and Kim 2018 ("Scan Context", section IV) take a node of each metre or two.
            keyframe_distance_m: 2.0,
            // Beyond, the rings of a sensor of 64 rays lie a metre apart.
            keyframe_range_m: 80.0,
            // That of the odometry's own scans.
            keyframe_voxel_edge_m: 0.5,
            // 8 km; the longest drive of KITTI's odometry benchmark has 5 km.
            max_keyframes: 4000,
            // A percent of the distance, the least that the LiDAR odometries of KITTI's table stay below, all in one direction.
            drift_m_per_km: 10.0,
            // Half a degree over 100 m, likewise.
            drift_deg_per_km: 5.0,
            // Longer than a long submap and shorter than the path round a block.
            min_travelled_m: 50.0,
            // Two lanes in each direction.
            search_radius_m: 8.0,
            // Kim and Kim 2018 find most loops below 0.2, and the first false ones there; here more tests follow.
            max_context_distance: 0.4,
            max_candidates: 3,
            // More than a lane and less than from house to house.
            distinct_m: 4.0,
            neighbours: 5,
            preparation: PreparationConfig { voxel_edge_m: 0.5, neighbours: 10 },
            registration: RegistrationConfig {
                // From a lane, or half a sector at 60 m.
                coarse: CoarseConfig {
                    every: 4,
                    max_correspondence_m: 4.0,
                    ..CoarseConfig::default()
                },
                ..RegistrationConfig::default()
            },
            // Half of it may have driven away, or be hidden from the other side of the road.
            min_fit_share: 0.5,
            // The spacing of the points.
            fit_distance_m: 0.5,
            ambiguous_share: 0.9,
            // A tenth of what two different places lie apart at least.
            agreement_m: 0.5,
            agreement_deg: 2.0,
            confirmation_m: 30.0,
            closure_distance_m: 20.0,
            // A moving scan, and points half a metre apart.
            loop_deviation_m: 0.1,
            loop_deviation_deg: 0.3,
            graph: GraphConfig::default(),
        }
    }
}

impl LoopClosingConfig {
    /// Whether a vehicle has gone far enough since the last keyframe, where there is one, for another.
    pub(crate) fn is_far_enough(
        &self,
        last: Option<&Isometry3<f64>>,
        odom_from_vehicle: &Isometry3<f64>,
    ) -> bool {
        let step_m = |last: &Isometry3<f64>| {
            (odom_from_vehicle.translation.vector - last.translation.vector).norm()
        };
        is_rigid(odom_from_vehicle)
            && last.is_none_or(|last| step_m(last) >= self.keyframe_distance_m)
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range.
    pub fn validate(&self) -> Result<(), ParameterError> {
        check_positive(&[
            ("keyframe_distance_m", self.keyframe_distance_m),
            ("keyframe_range_m", self.keyframe_range_m),
            ("keyframe_voxel_edge_m", self.keyframe_voxel_edge_m),
            ("drift_m_per_km", self.drift_m_per_km),
            ("drift_deg_per_km", self.drift_deg_per_km),
            ("min_travelled_m", self.min_travelled_m),
            ("search_radius_m", self.search_radius_m),
            ("distinct_m", self.distinct_m),
            ("fit_distance_m", self.fit_distance_m),
            ("agreement_m", self.agreement_m),
            ("agreement_deg", self.agreement_deg),
            ("confirmation_m", self.confirmation_m),
            ("closure_distance_m", self.closure_distance_m),
            ("loop_deviation_m", self.loop_deviation_m),
            ("loop_deviation_deg", self.loop_deviation_deg),
        ])?;
        for (name, share) in [
            ("max_context_distance", self.max_context_distance),
            ("min_fit_share", self.min_fit_share),
            ("ambiguous_share", self.ambiguous_share),
        ] {
            check(name, "in 0 .. 1", share, (0.0..=1.0).contains(&share))?;
        }
        let (keyframes, candidates) = (self.max_keyframes, self.max_candidates);
        check("max_keyframes", "at least 10", keyframes as f64, keyframes >= 10)?;
        check("max_candidates", "at least 1", candidates as f64, candidates >= 1)?;
        self.preparation.validate()?;
        self.registration.validate()?;
        self.graph.validate().or_else(|error| check(error.name, error.accepted, error.value, false))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_bad_values_are_named() {
        assert_eq!(LoopClosingConfig::default().validate(), Ok(()));
        type Spoil = fn(&mut LoopClosingConfig);
        let cases: [(&str, Spoil); 7] = [
            ("keyframe_distance_m", |config| config.keyframe_distance_m = 0.0),
            ("drift_m_per_km", |config| config.drift_m_per_km = f64::NAN),
            ("min_fit_share", |config| config.min_fit_share = 1.5),
            ("max_keyframes", |config| config.max_keyframes = 3),
            ("max_candidates", |config| config.max_candidates = 0),
            ("neighbours", |config| config.preparation.neighbours = 1),
            ("max_rise_chi2", |config| config.graph.max_rise_chi2 = -1.0),
        ];
        for (name, spoil) in cases {
            let mut config = LoopClosingConfig::default();
            spoil(&mut config);
            assert!(config.validate().unwrap_err().to_string().contains(name), "{name}");
        }
    }
}
