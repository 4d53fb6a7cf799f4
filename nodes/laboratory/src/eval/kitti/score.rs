//! The score of a trajectory against the ground truth.

use std::path::Path;

use estimation::quantile::median_of_sorted;
use evaluation::trajectory::{
    Alignment, Plane, RawPose, SegmentLengths, Times, Trajectory, TrajectoryScoreConfig,
    parse_trajectory, road_score, score_trajectory,
};
use geometry::Stamp;
use nalgebra::Isometry3;
use serde::Serialize;

use robot::Failure;

/// The score of one trajectory.
#[derive(Clone, Serialize, Debug)]
pub(super) struct Figures {
    pub(super) name: String,
    pub(super) poses: usize,
    /// Scans without a measured pose.
    pub(super) troubles: usize,
    pub(super) milliseconds_median: Option<f64>,
    pub(super) milliseconds_mean: Option<f64>,
    pub(super) translation_percent: Option<f64>,
    pub(super) rotation_deg_per_100m: Option<f64>,
    pub(super) ate_rmse_m: f64,
    pub(super) rms_2d_m: Option<f64>,
    pub(super) rms_3d_m: Option<f64>,
    pub(super) end_error_percent: Option<f64>,
    pub(super) precision_percent: Option<f64>,
}

/// The trajectory.
pub(super) struct Candidate {
    pub(super) name: String,
    pub(super) poses: Vec<(Stamp, Isometry3<f64>)>,
    pub(super) troubles: usize,
    pub(super) times_ms: Vec<f64>,
}

/// A trajectory from a file; one without stamps has a pose for each scan.
pub(super) fn given(path: &Path, scans: &[Stamp]) -> Result<Candidate, Failure> {
    let within = |error: String| Failure::new(error).within(path.display());
    let bytes = std::fs::read(path)
        .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))?;
    let trajectory =
        parse_trajectory(&bytes).map_err(|error| within(error.to_string()))?.trajectory;
    let poses = match trajectory.times() {
        Times::Stamps(stamps) => {
            stamps.iter().copied().zip(trajectory.poses().iter().copied()).collect()
        }
        _ if trajectory.len() == scans.len() => {
            scans.iter().copied().zip(trajectory.poses().iter().copied()).collect()
        }
        _ => {
            return Err(within(format!("{} poses, but {} scans", trajectory.len(), scans.len()))
                .fix("a file without stamps needs a pose for each scan"));
        }
    };
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    Ok(Candidate { name, poses, troubles: 0, times_ms: Vec::new() })
}

/// The ground truth at a time, interpolated.
pub(super) fn at(truth: &[(Stamp, Isometry3<f64>)], stamp: Stamp) -> Option<Isometry3<f64>> {
    let after = truth.partition_point(|(of, _)| *of < stamp);
    let (to_stamp, to) = truth.get(after)?;
    if *to_stamp == stamp {
        return Some(*to);
    }
    let (from_stamp, from) = truth.get(after.checked_sub(1)?)?;
    let share = stamp.seconds_since(*from_stamp) / to_stamp.seconds_since(*from_stamp);
    from.try_lerp_slerp(to, share, f64::EPSILON)
}

pub(super) fn scored(
    candidate: &Candidate,
    truth: &[(Stamp, Isometry3<f64>)],
) -> Result<Figures, Failure> {
    let pairs: Vec<(Stamp, Isometry3<f64>, Isometry3<f64>)> = candidate
        .poses
        .iter()
        .filter_map(|(stamp, pose)| Some((*stamp, *pose, at(truth, *stamp)?)))
        .collect();
    let failed = |error: String| Failure::new(error).within(&candidate.name);
    let stamped = |poses: &mut dyn Iterator<Item = (Stamp, Isometry3<f64>)>| {
        let raw = |(stamp, pose): (Stamp, Isometry3<f64>)| {
            let position_m = pose.translation.vector.into();
            (stamp, RawPose { position_m, quaternion_xyzw: pose.rotation.coords.into() })
        };
        Trajectory::stamped(poses.map(raw).collect::<Vec<_>>())
    };
    let estimate = stamped(&mut pairs.iter().map(|(stamp, pose, _)| (*stamp, *pose)));
    let reference = stamped(&mut pairs.iter().map(|(stamp, _, truth)| (*stamp, *truth)));
    let mut config = TrajectoryScoreConfig { alignment: Alignment::Origin, ..Default::default() };
    // The path is too short for KITTI's rules.
    const SHORTEST_SEGMENT_M: f64 = 100.0;
    if reference.path_m() <= SHORTEST_SEGMENT_M {
        config.segments.lengths = SegmentLengths::Scaled;
    }
    let by_kitti = score_trajectory(&estimate, &reference, &config)
        .map_err(|error| failed(error.to_string()))?;
    let aligned = TrajectoryScoreConfig { alignment: Alignment::Se3, ..config };
    let ate = score_trajectory(&estimate, &reference, &aligned)
        .map_err(|error| failed(error.to_string()))?;
    // The scanner's frame has z up.
    let road = road_score(&by_kitti.pairs, Plane::Xy);
    let segments = &by_kitti.score.segments;
    let mut times_ms = candidate.times_ms.clone();
    times_ms.sort_by(f64::total_cmp);
    let mean = times_ms.iter().sum::<f64>() / times_ms.len().max(1) as f64;
    Ok(Figures {
        name: candidate.name.clone(),
        poses: pairs.len(),
        troubles: candidate.troubles,
        milliseconds_median: median_of_sorted(&times_ms),
        milliseconds_mean: (!times_ms.is_empty()).then_some(mean),
        translation_percent: segments.translation_percent,
        rotation_deg_per_100m: segments.rotation_deg_per_m.map(|per_m| 100.0 * per_m),
        ate_rmse_m: ate.score.absolute.translation_m.rmse,
        rms_2d_m: road.map(|road| road.rms_2d_m),
        rms_3d_m: road.map(|road| road.rms_3d_m),
        end_error_percent: road.map(|road| road.end_error_percent),
        precision_percent: road.map(|road| road.precision_percent),
    })
}
