//! One run on a sequence.

use std::borrow::Cow;
use std::sync::Arc;
use std::thread::sleep;
use std::time::{Duration, Instant};

use clap::ValueEnum;
use estimation::ScopedThreads;
use evaluation::trajectory::{
    Alignment, AssociationConfig, Trajectory, TrajectoryScoreConfig, score_trajectory,
};
use geometry::{CameraModel, Stamp};
use nalgebra::Isometry3;
use pose::frame::{Frame, FrameExtractor};
use pose::image::{Rectification, gray_from_raw};
use pose::mapping::Mapper;
use pose::shell::BackgroundMapping;
use pose::slam::{InlineMapping, Mapping, Slam, SlamConfig};
use pose::tracking::{Hints, Tracker, TrackerConfig};
use report::DurationStatistics;
use serde::Serialize;

use super::sequence::{Images, Sequence, raw};
use robot::Failure;

/// The mode of a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Mode {
    /// Odometry without a map
    Odometry,
    /// SLAM with mapping between two images: the same images and seed give the same poses
    Inline,
    /// SLAM with mapping in a separate thread, with the images at the rate of the recording
    Background,
}

/// The estimator of a run.
enum Follower {
    Odometry(Box<Tracker>, Vec<(Stamp, Isometry3<f64>)>),
    Inline(Box<Slam<InlineMapping>>),
    Background(Box<Slam<BackgroundMapping>>),
}

/// The result of a run. Errors in metres, of all images with a pose; times in seconds, of all images.
#[derive(Clone, Serialize, Debug)]
pub(super) struct Run {
    /// From 1 on; the seed of the random numbers.
    pub(super) run: u64,
    pub(super) poses: usize,
    /// The share of the ground truth's time that is covered by poses.
    pub(super) covered_share: f64,
    pub(super) rmse_m: f64,
    pub(super) mean_m: f64,
    pub(super) median_m: f64,
    pub(super) std_m: f64,
    pub(super) min_m: f64,
    pub(super) max_m: f64,
    pub(super) median_tracking_s: f64,
    pub(super) mean_tracking_s: f64,
    pub(super) p99_tracking_s: f64,
    pub(super) keyframes: usize,
    pub(super) loops: usize,
    /// The memory of the map.
    pub(super) map_bytes: usize,
    /// The same per metre of the ground truth's path between the first and the last pose.
    pub(super) map_bytes_per_m: f64,
}

/// The state at the end of a run.
struct Ended {
    /// The pose of each image, `camera_from_map`, in the final map.
    poses: Vec<(Stamp, Isometry3<f64>)>,
    keyframes: usize,
    map_bytes: usize,
    /// Loops that were closed after the last image.
    late_loops: usize,
}

/// The longest wait for the mapping after the last image.
const LONGEST_END: Duration = Duration::from_secs(600);
/// How often its end is checked.
const LOOK_AGAIN: Duration = Duration::from_millis(5);

/// Runs on a sequence, with the run's number as the seed. Reports each image.
pub(super) fn follow(
    sequence: &Sequence,
    mode: Mode,
    run: u64,
    max_difference_s: f64,
    each: impl Fn(),
) -> Result<Run, Failure> {
    let mut tracker = TrackerConfig::default();
    tracker.sets.ransac.seed = run;
    let failed = |error: &dyn std::fmt::Display| Failure::new(error.to_string());
    let mut follower = Follower::new(mode, tracker.clone())?;
    let extractor = FrameExtractor::new(tracker.frame).map_err(|error| failed(&error))?;
    let mut extractor = extractor.with_executor(Arc::new(ScopedThreads::of_machine()));
    let mut rectification: Option<(CameraModel, Rectification)> = None;
    let (mut times_s, mut loops) = (Vec::with_capacity(sequence.pairs()), 0);
    let mut begun: Option<(Instant, Stamp)> = None;
    // Each image is read before it is due.
    for images in sequence.images()? {
        let images = images?;
        if mode == Mode::Background {
            let (start, first) = *begun.get_or_insert_with(|| (Instant::now(), images.stamp));
            let due = Duration::try_from_secs_f64(images.stamp.seconds_since(first));
            sleep((start + due.unwrap_or_default()).saturating_duration_since(Instant::now()));
        }
        let Images { camera, .. } = images;
        if !camera.distortion.is_none()
            && rectification.as_ref().is_none_or(|(of, _)| *of != camera)
        {
            // Once per camera: a table, which is not part of the tracking time.
            let table = Rectification::new(&camera).map_err(|error| failed(&error))?;
            rectification = Some((camera, table));
        }
        let start = Instant::now();
        let rectification = rectification.as_ref().map(|(_, table)| table);
        let (frame, camera) = seen(&images, rectification, &mut extractor)
            .map_err(|failure| failure.within(&sequence.name))?;
        loops += follower.step(&frame, &camera);
        times_s.push(start.elapsed().as_secs_f64());
        each();
    }
    let ended = follower.end()?;
    scored(sequence, (run, loops), &ended, times_s, max_difference_s)
}

/// The features of a pair of images, and the rectified camera.
fn seen(
    images: &Images,
    rectification: Option<&Rectification>,
    extractor: &mut FrameExtractor,
) -> Result<(Frame, CameraModel), Failure> {
    let failed = |error: &dyn std::fmt::Display| Failure::new(error.to_string());
    let gray = gray_from_raw(&images.color.raw()?).map_err(|error| failed(&error))?;
    let (gray, depth, camera) = match rectification {
        Some(table) => {
            let gray = table.rectify(&gray).map_err(|error| failed(&error))?;
            let depth = table.rectify_depth(&images.depth).map_err(|error| failed(&error))?;
            (gray, Cow::Owned(depth), *table.target())
        }
        None => (gray, Cow::Borrowed(&images.depth), images.camera),
    };
    let frame = extractor.extract(&gray, &depth, &camera).map_err(|error| failed(&error))?;
    Ok((frame, camera))
}

impl Follower {
    fn new(mode: Mode, tracker: TrackerConfig) -> Result<Self, Failure> {
        let failed = |error: &dyn std::fmt::Display| Failure::new(error.to_string());
        let config = SlamConfig { tracker, ..SlamConfig::default() };
        let mapper = || Mapper::new(config.mapping).map_err(|error| failed(&error));
        Ok(match mode {
            Mode::Odometry => {
                let tracker = Tracker::new(config.tracker).map_err(|error| failed(&error))?;
                Self::Odometry(Box::new(tracker), Vec::new())
            }
            Mode::Inline => {
                let slam = Slam::new(&config, InlineMapping::of(mapper()?));
                Self::Inline(Box::new(slam.map_err(|error| failed(&error))?.with_trajectory()))
            }
            Mode::Background => {
                let mapping = BackgroundMapping::new(mapper()?).map_err(|error| failed(&error))?;
                let slam = Slam::new(&config, mapping).map_err(|error| failed(&error))?;
                Self::Background(Box::new(slam.with_trajectory()))
            }
        })
    }

    /// Processes the next image; returns the number of closed loops.
    fn step(&mut self, frame: &Frame, camera: &CameraModel) -> usize {
        let hints = Hints::default();
        let steps = match self {
            Self::Odometry(tracker, poses) => {
                let tracked = tracker.step(frame, camera, &hints);
                poses.extend(tracked.pose.map(|pose| (pose.stamp, pose.camera_from_map)));
                return 0;
            }
            Self::Inline(slam) => slam.step(frame, camera, &hints).steps,
            Self::Background(slam) => slam.step(frame, camera, &hints).steps,
        };
        steps.iter().filter(|step| step.closed.is_some()).count()
    }

    /// Waits until the mapping has finished.
    fn end(self) -> Result<Ended, Failure> {
        match self {
            Self::Odometry(_, poses) => {
                Ok(Ended { poses, keyframes: 0, map_bytes: 0, late_loops: 0 })
            }
            Self::Inline(slam) => Ok(ended(*slam, 0)),
            Self::Background(mut slam) => {
                let start = Instant::now();
                while !slam.mapping().is_idle() {
                    if start.elapsed() > LONGEST_END {
                        let waited_s = LONGEST_END.as_secs();
                        return Err(Failure::new(format!(
                            "the map was not ready {waited_s} s after the last image"
                        )));
                    }
                    sleep(LOOK_AGAIN);
                }
                let steps = slam.catch_up();
                let loops = steps.iter().filter(|step| step.closed.is_some()).count();
                Ok(ended(*slam, loops))
            }
        }
    }
}

fn ended<M: Mapping>(slam: Slam<M>, late_loops: usize) -> Ended {
    let map = slam.mapping().map();
    let poses = slam.trajectory().map(|trajectory| trajectory.in_map(&map)).unwrap_or_default();
    let (keyframes, map_bytes) = (map.keyframes().len(), map.memory().bytes());
    Ended { poses, keyframes, map_bytes, late_loops }
}

fn scored(
    sequence: &Sequence,
    (run, loops): (u64, usize),
    ended: &Ended,
    times_s: Vec<f64>,
    max_difference_s: f64,
) -> Result<Run, Failure> {
    let estimate =
        Trajectory::stamped(ended.poses.iter().map(|(stamp, pose)| (*stamp, raw(&pose.inverse()))));
    let config = TrajectoryScoreConfig {
        alignment: Alignment::Se3,
        association: AssociationConfig { max_difference_s, offset_s: 0.0 },
        ..TrajectoryScoreConfig::default()
    };
    let scored = score_trajectory(&estimate, &sequence.truth, &config).map_err(|error| {
        Failure::new(format!("{} images have a pose: {error}", ended.poses.len()))
            .within(&sequence.name)
    })?;
    let errors = scored.score.absolute.translation_m;
    let mean_tracking_s = times_s.iter().sum::<f64>() / times_s.len().max(1) as f64;
    let times = DurationStatistics::of_seconds(times_s);
    Ok(Run {
        run,
        poses: ended.poses.len(),
        covered_share: scored.score.coverage.share,
        rmse_m: errors.rmse,
        mean_m: errors.mean,
        median_m: errors.median,
        std_m: errors.std,
        min_m: errors.min,
        max_m: errors.max,
        median_tracking_s: times.map_or(0.0, |times| times.median_ms * 1e-3),
        mean_tracking_s,
        p99_tracking_s: times.map_or(0.0, |times| times.p99_ms * 1e-3),
        keyframes: ended.keyframes,
        loops: loops + ended.late_loops,
        map_bytes: ended.map_bytes,
        map_bytes_per_m: ended.map_bytes as f64 / scored.score.reference.path_m,
    })
}
