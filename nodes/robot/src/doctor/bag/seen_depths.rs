//! Where beams end in the camera's view: how far the camera sees there, compared with the scanner.

use calibration::{CalibrationConfig, Cycle, DriftConfig, RigMounts};
use estimation::quantile::percentile_of_sorted;
use geometry::CameraModel;

use crate::doctor::checks::Check;
use crate::doctor::finding::Finding;

/// A depth that differs by less than this share of the range may be of the same surface: steps and noise of a stereo camera at 6 m. One sensor
/// has another scale when the middle half of the ratios of depth to range lies as near to their median, and this not to 1: with a wrong
/// mount, or something before the camera, they scatter.
const SAME_SHARE: f64 = 0.1;

/// Compared beams.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct SeenDepths {
    /// Of those that end where the camera measures, the depth there divided by that of the beam's end; in order.
    ratios: Vec<f64>,
    /// Those that end farther before or behind it than what is taken for the same surface.
    contradicting: usize,
}

impl SeenDepths {
    /// The beams of cycles, each with the mounts there.
    pub(super) fn of(cycles: &[(&Cycle, &RigMounts)], camera: &CameraModel) -> Self {
        let most_m = CalibrationConfig::default().max_offset_m;
        let (mut ratios, mut contradicting) = (Vec::new(), 0);
        for (cycle, mounts) in cycles {
            for one in &cycle.returns {
                let end_m =
                    mounts.camera_from_lidar(&one.image_rig_from_rig) * one.point_in_lidar_m();
                let Some(pixel) = camera.project(&end_m) else { continue };
                // Within half a pixel of the image: the cast saturates.
                let (column_px, row_px) = (pixel.x.round() as usize, pixel.y.round() as usize);
                let Some(depth_m) = cycle.image.depth_m(column_px, row_px) else { continue };
                let depth_m = f64::from(depth_m);
                ratios.push(depth_m / end_m.z);
                let most_m = most_m.max(SAME_SHARE * end_m.z);
                contradicting += usize::from((depth_m - end_m.z).abs() > most_m);
            }
        }
        ratios.sort_unstable_by(f64::total_cmp);
        Self { ratios, contradicting }
    }

    /// Whether most of the beams end where the camera sees nothing.
    pub(super) fn contradict(&self) -> bool {
        self.ratios.len() >= DriftConfig::default().min_returns
            && 2 * self.contradicting > self.ratios.len()
    }

    /// That they do: an error where one of the sensors has another scale. `by` says what the mount is by; `fix` is that of a wrong one.
    pub(super) fn finding(
        &self,
        (image, scan): (&str, &str),
        by: &str,
        fix: &str,
    ) -> Option<Finding> {
        if !self.contradict() {
            return None;
        }
        let percentile = |percent| percentile_of_sorted(&self.ratios, percent);
        let [low, median, high] = [percentile(25)?, percentile(50)?, percentile(75)?];
        let beams = format!(
            "of {} beams that end in its view {} end more than {} m and {:.0} % of the depth before or behind what it sees there",
            self.ratios.len(),
            self.contradicting,
            CalibrationConfig::default().max_offset_m,
            1e2 * SAME_SHARE
        );
        let is_scale = high - low <= SAME_SHARE * median && (median - 1.0).abs() > SAME_SHARE;
        Some(if is_scale {
            Finding::error(
                Check::Units,
                format!("{image}: its depths are {median:.2} times the ranges of {scan}: {beams}"),
                "see which of both has a wrong scale, by something at a known distance: 16UC1 has millimetres and 32FC1 metres (REP-118), \
                 LaserScan metres (REP-103)",
            )
        } else {
            Finding::warn(
                Check::Extrinsics,
                format!(
                    "{image}: {by}, {beams} (depth over range: {median:.2} in the median, {low:.2} to {high:.2} for the middle half)"
                ),
                format!(
                    "{fix}; where something hides from the camera what the scanner sees, look at another bag; see that the camera's \
                         calibration is that of its images"
                ),
            )
        })
    }
}
