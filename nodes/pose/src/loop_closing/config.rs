//! The parameters of loop closing.

use geometry::{ParameterError, parameter};
use pose_graph::GraphConfig;
use serde::{Deserialize, Serialize};

use crate::keyframing::KeyframingConfig;
use crate::matching::points::MatchConfig;
use crate::solve::{RansacConfig, RefineConfig};

/// Parameters of loop closing and relocalisation.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LoopConfig {
    /// How corners are matched where nothing is known of the pose.
    pub matching: MatchConfig,
    /// A keyframe with fewer matches is not looked at.
    pub least_matches: usize,
    /// How the pose is found that they agree on; its `min_inliers` counts here.
    pub ransac: RansacConfig,
    /// How it is refined.
    pub refine: RefineConfig,
    /// How far around its place a point may be found when the pose is known so well, in pixels of level 0.
    pub search_radius_px: f32,
    /// A pose must explain this many points ...
    pub least_inliers: usize,
    /// ... and this large a share of those that were matched near their places.
    pub least_inlier_share: f64,
    /// Keyframes that see at least this many of the same landmarks are tied in the essential graph.
    pub essential_shared: u32,
    /// How sure the motion between two keyframes is that follow each other, where odometry has none
    /// (`keyframing.window.motions`): a shift, and a turn.
    pub edge_std_dev_m: f64,
    /// The turn.
    pub edge_std_dev_rad: f64,
    /// How sure that of a loop is: a shift, and a turn.
    pub loop_std_dev_m: f64,
    /// The turn.
    pub loop_std_dev_rad: f64,
    /// How the graph is optimised.
    pub graph: GraphConfig,
    /// How landmarks are looked for and fused.
    pub keyframing: KeyframingConfig,
}

impl Default for LoopConfig {
    fn default() -> Self {
        Self {
            matching: MatchConfig::default(),
            // ORB-SLAM2: 20 matches, 20 inliers, then 10 pixels around, and 40 matches in all.
            least_matches: 20,
            ransac: RansacConfig { min_inliers: 20, ..RansacConfig::default() },
            refine: RefineConfig::default(),
            search_radius_px: 10.0,
            least_inliers: 40,
            // Two places that look alike agree in a part only.
            least_inlier_share: 0.5,
            // The essential graph of ORB-SLAM (Mur-Artal et al. 2015, section III-D).
            essential_shared: 100,
            // What a step of some decimetres is off by, with all that is wrong with calibration and depth; it decides how a
            // loop's error is shared out, and how large one may be.
            edge_std_dev_m: 0.02,
            edge_std_dev_rad: 0.01,
            // Of 40 points a pose is known to half of that.
            loop_std_dev_m: 0.01,
            loop_std_dev_rad: 0.005,
            // Odometry drifts in the same direction with each step, not at random: this is a loop of two hundred steps, each off by a
            // standard deviation. It refuses impossible loops.
            graph: GraphConfig { max_rise_chi2: 200.0, ..GraphConfig::default() },
            keyframing: KeyframingConfig::default(),
        }
    }
}

impl LoopConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let radius_px = f64::from(self.search_radius_px);
        parameter::positive("search_radius_px", radius_px)?;
        parameter::between("least_inlier_share", self.least_inlier_share, 0.0, 1.0)?;
        parameter::positive("edge_std_dev_m", self.edge_std_dev_m)?;
        parameter::positive("edge_std_dev_rad", self.edge_std_dev_rad)?;
        parameter::positive("loop_std_dev_m", self.loop_std_dev_m)?;
        parameter::positive("loop_std_dev_rad", self.loop_std_dev_rad)?;
        self.ransac.validate()?;
        self.refine.validate()?;
        self.keyframing.validate()
    }
}
