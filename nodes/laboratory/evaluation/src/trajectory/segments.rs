//! The measure of the KITTI odometry benchmark (Geiger et al. 2012, section 3.2, and its page): the mean drift
//! over stretches of 100 to 800 m of the reference's path, in percent of the distance and in degrees per metre.

use serde::{Deserialize, Serialize};

use super::absolute::MatchedPose;
use super::path::path_lengths_m;
use super::relative::relative_error;

/// The lengths of the benchmark.
const KITTI_LENGTHS_M: [f64; 8] = [100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0];
/// Scaled lengths, in tenths of the path: for a path of 1000 m they are the benchmark's.
const SCALED_TENTHS: [f64; 8] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];

/// The lengths of the segments.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SegmentLengths {
    /// 100, 200, ... 800 m.
    #[default]
    Kitti,
    /// One to eight tenths of the reference's path, for short ones.
    Scaled,
    /// The given lengths.
    Metres(Vec<f64>),
}

/// The parameters of the segments.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentConfig {
    /// The lengths.
    pub lengths: SegmentLengths,
    /// From the start of one to that of the next, in poses.
    pub step_poses: usize,
}

impl Default for SegmentConfig {
    fn default() -> Self {
        // The benchmark's: a second of its recordings.
        Self { lengths: SegmentLengths::default(), step_poses: 10 }
    }
}

/// The drift over segments.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct SegmentScore {
    /// The number of segments.
    pub count: usize,
    /// The mean drift in percent of the distance; absent when the path is shorter than every segment.
    pub translation_percent: Option<f64>,
    /// The mean rotation error in degrees per metre.
    pub rotation_deg_per_m: Option<f64>,
    /// The same by length, those without a segment left out.
    pub by_length: Vec<SegmentLengthScore>,
}

/// The drift over segments of one length.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct SegmentLengthScore {
    /// Their length.
    pub length_m: f64,
    /// The number of segments.
    pub count: usize,
    /// The mean drift in percent of the distance.
    pub translation_percent: f64,
    /// The mean rotation error in degrees per metre.
    pub rotation_deg_per_m: f64,
}

#[derive(Clone, Copy, Default)]
struct Sum {
    count: usize,
    translation: f64,
    rotation_rad_per_m: f64,
}

/// The score over the pairs, in their order.
pub(super) fn score(poses: &[MatchedPose], config: &SegmentConfig) -> SegmentScore {
    let reference: Vec<_> = poses.iter().map(|pose| pose.reference).collect();
    let path_m = path_lengths_m(&reference);
    let lengths_m = match &config.lengths {
        SegmentLengths::Kitti => KITTI_LENGTHS_M.to_vec(),
        SegmentLengths::Scaled => {
            let whole_m = path_m.last().copied().unwrap_or(0.0);
            SCALED_TENTHS.map(|tenths| whole_m * tenths / 10.0).to_vec()
        }
        SegmentLengths::Metres(lengths_m) => lengths_m.clone(),
    };
    let mut all = Sum::default();
    let mut by_length = Vec::new();
    for length_m in lengths_m.into_iter().filter(|length_m| *length_m > 0.0) {
        let mut sum = Sum::default();
        for from in (0..poses.len()).step_by(config.step_poses.max(1)) {
            // In the benchmark, the end lies beyond the length, not at it.
            let to = path_m.partition_point(|at_m| *at_m <= path_m[from] + length_m);
            let Some(end) = poses.get(to) else { break };
            let error = relative_error(&poses[from], end);
            sum.count += 1;
            sum.translation += error.translation.vector.norm() / length_m;
            sum.rotation_rad_per_m += error.rotation.angle() / length_m;
        }
        all.count += sum.count;
        all.translation += sum.translation;
        all.rotation_rad_per_m += sum.rotation_rad_per_m;
        if let Some((translation_percent, rotation_deg_per_m)) = sum.means() {
            let count = sum.count;
            by_length.push(SegmentLengthScore {
                length_m,
                count,
                translation_percent,
                rotation_deg_per_m,
            });
        }
    }
    let means = all.means();
    SegmentScore {
        count: all.count,
        translation_percent: means.map(|means| means.0),
        rotation_deg_per_m: means.map(|means| means.1),
        by_length,
    }
}

impl Sum {
    fn means(self) -> Option<(f64, f64)> {
        let count = self.count as f64;
        let translation_percent = 100.0 * self.translation / count;
        let rotation_deg_per_m = self.rotation_rad_per_m.to_degrees() / count;
        (self.count > 0).then_some((translation_percent, rotation_deg_per_m))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::super::testing::pose;
    use super::*;

    /// A drive along x in steps of a metre; the estimate turns by `turn_deg_per_m` and is `scale` too long.
    fn drive(poses: usize, scale: f64, turn_deg_per_m: f64) -> Vec<MatchedPose> {
        let step = pose([scale, 0.0, 0.0], [0.0, 0.0, turn_deg_per_m.to_radians()]);
        let mut estimate = Isometry3::identity();
        (0..poses)
            .map(|index| {
                let reference = Isometry3::translation(index as f64, 0.0, 0.0);
                let pair = MatchedPose::new(None, index as f64, estimate, reference);
                estimate *= step;
                pair
            })
            .collect()
    }

    #[test]
    fn a_scale_off_by_a_hundredth_is_a_percent() {
        let score = score(&drive(1000, 1.01, 0.0), &SegmentConfig::default());
        // A segment ends at the first pose beyond its length: 101 m of way for 100 m.
        for of_length in &score.by_length {
            let percent = (of_length.length_m + 1.0) / of_length.length_m;
            assert!((of_length.translation_percent - percent).abs() < 1e-9, "{of_length:?}");
            assert!(of_length.rotation_deg_per_m < 1e-9);
        }
        // Starts at 0, 10, ... of which the last segment still ends at pose 999 or before.
        assert_eq!(score.by_length[0].count, 90);
        assert_eq!(score.by_length[7].count, 20);
        assert_eq!(score.count, (20..=90).step_by(10).sum::<usize>());
    }

    #[test]
    fn a_turn_is_told_in_degrees_a_metre() {
        let score = score(&drive(300, 1.0, 0.01), &SegmentConfig::default());
        let expected = 0.01 * 101.0 / 100.0;
        assert!((score.by_length[0].rotation_deg_per_m - expected).abs() < 1e-9);
        // Half of the turn over the segment, as a share of it: about 0.88 %.
        assert!((score.by_length[0].translation_percent - 0.89).abs() < 0.02, "{score:?}");
        assert_eq!(score.by_length.len(), 2);
    }

    #[test]
    fn the_mean_is_over_segments_not_over_lengths() {
        let score = score(&drive(300, 1.0, 0.01), &SegmentConfig::default());
        let [one, two] = [score.by_length[0], score.by_length[1]];
        let weighted = (one.count as f64 * one.translation_percent
            + two.count as f64 * two.translation_percent)
            / (one.count + two.count) as f64;
        assert!((score.translation_percent.unwrap() - weighted).abs() < 1e-12);
    }

    #[test]
    fn a_short_path_has_scaled_segments() {
        let poses = drive(41, 1.01, 0.0);
        assert_eq!(score(&poses, &SegmentConfig::default()).translation_percent, None);
        let config = SegmentConfig { lengths: SegmentLengths::Scaled, step_poses: 1 };
        let scaled = score(&poses, &config);
        assert_eq!(scaled.by_length.len(), 8);
        assert_eq!(scaled.by_length[0].length_m, 4.0);
        assert!((scaled.by_length[0].translation_percent - 5.0 / 4.0).abs() < 1e-9);
        let given =
            SegmentConfig { lengths: SegmentLengths::Metres(vec![7.0, f64::NAN]), ..config };
        assert_eq!(score(&poses, &given).by_length.len(), 1);
    }
}
