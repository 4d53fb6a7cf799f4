//! Runs the cores of the suite on the tour, and times every cycle.

use std::sync::Arc;
use std::time::{Duration, Instant};

use detection::{CycleInput, DetectionConfig, Detector, MatchEvent, Matched, Matcher, View};
use geometry::{DepthImage, DepthProjector, RayTable, Scan, Stamp};
use reconstruction::Map;
use segmentation::Segmenter;
use simulator::Sample;

use super::super::usage::{Usage, own_cpu};
use super::building::{LAP_S, lap};
use super::minute::{Counts, CycleCost, Minute, MinuteRow};
use super::{TourArgs, failure};
use geometry::Method;
use robot::Failure;
use robot::Progress;
use robot::run::parameters::PipelineParameters;

/// The tour begins at a time in 2023, as drivers stamp with the wall clock.
const START: Stamp = Stamp::from_secs_nanos(1_700_000_000, 0);
const MINUTE_S: f64 = 60.0;
/// A subscriber of the map gets its changes after this many cycles: about twice a second, as from the node.
const CYCLES_PER_UPDATE: u64 = 4;
/// The maximum number of points of one update, the default of the node.
const UPDATE_POINTS: usize = 10_000;

/// Runs the tour with one method.
pub(super) fn drive(
    args: &TourArgs,
    method: Method,
    progress: &Progress,
) -> Result<Vec<MinuteRow>, Failure> {
    let mut tour = Tour::new(args, method)?;
    let (duration_s, size_px) = (args.minutes * MINUTE_S, args.size_px());
    let mut driven_s = 0.0;
    let mut number = 0;
    while driven_s < duration_s {
        let lap_s = LAP_S.min(duration_s - driven_s);
        let scenario = lap(number, START.plus_seconds(driven_s), lap_s, size_px);
        for sample in scenario.samples().map_err(failure)? {
            tour.take(sample)?;
            progress.set(tour.rows.len() as u64);
        }
        driven_s += lap_s;
        number += 1;
    }
    tour.end_minute();
    Ok(tour.rows)
}

/// The cores, and their times so far.
struct Tour {
    matcher: Matcher<Scan, Arc<DepthImage>>,
    detector: Detector,
    projector: Option<DepthProjector>,
    segmenter: Segmenter,
    map: Map,
    cycles: u64,
    /// The time for the inputs of the next cycle so far.
    spent: Spent,
    minute: Minute,
    rows: Vec<MinuteRow>,
}

impl Tour {
    fn new(args: &TourArgs, method: Method) -> Result<Self, Failure> {
        let parameters = PipelineParameters::of_method(method, None);
        let detection: DetectionConfig = parameters.detection().clone();
        let mut map = args.map(parameters.reconstruction().clone())?;
        map.follow_changes();
        Ok(Self {
            matcher: Matcher::new(&detection),
            detector: Detector::new(detection).map_err(failure)?,
            projector: None,
            segmenter: Segmenter::new(parameters.segmentation_node().config.clone())
                .map_err(failure)?,
            map,
            cycles: 0,
            spent: Spent::default(),
            minute: Minute::default(),
            rows: Vec::new(),
        })
    }

    /// The processing of a sample is timed, its simulation is not.
    fn take(&mut self, sample: Sample) -> Result<(), Failure> {
        let clock = Clock::start();
        let events = match sample {
            Sample::Pose(pose) => self.matcher.push_pose(pose),
            Sample::Depth { image, .. } => self.matcher.push_cloud(image.stamp, Arc::new(image)),
            Sample::Scan { scan, .. } => self.matcher.push_scan(scan.stamp, scan),
            Sample::CameraInfo { camera, .. } => {
                let known = self.projector.as_ref().map(|projector| projector.rays().camera());
                if known != Some(&camera) {
                    let rays = RayTable::new(&camera).map_err(failure)?;
                    self.projector = Some(self.detector.depth_projector(rays));
                }
                return Ok(());
            }
            // The ground truth, and sensors that the rig of the tour does not have.
            _ => return Ok(()),
        };
        self.spent += clock.spent();
        for event in events {
            match event {
                MatchEvent::Matched(matched) => self.cycle(&matched)?,
                MatchEvent::Dropped(_) => self.minute.scans_dropped += 1,
                _ => {}
            }
        }
        Ok(())
    }

    fn cycle(&mut self, matched: &Matched<Scan, Arc<DepthImage>>) -> Result<(), Failure> {
        let time_s = matched.scan_stamp.seconds_since(START);
        if time_s >= (self.rows.len() + 1) as f64 * MINUTE_S {
            self.end_minute();
        }
        let (Some(projector), Some(pose)) = (&self.projector, &matched.pose) else {
            return Ok(());
        };
        let depth = projector.image(&matched.cloud).map_err(failure)?;
        let input = CycleInput {
            scan: &matched.scan,
            view: View::Depth(depth),
            map_from_rig: &pose.map_from_rig,
            map_frame_id: &pose.frame_id,
        };
        let clock = Clock::start();
        let detected = self.detector.step(&input, |_| ()).map_err(failure)?;
        let detection = clock.spent();
        let clock = Clock::start();
        let segmented = self.segmenter.step(&detected.cycle, |_| ()).map_err(failure)?;
        let segmentation = clock.spent();
        let clock = Clock::start();
        let addition = self.map.integrate(&segmented.cycle).map_err(failure)?;
        self.cycles += 1;
        if self.cycles.is_multiple_of(CYCLES_PER_UPDATE) {
            let _told = self.map.take_changes(UPDATE_POINTS);
        }
        let map = clock.spent();

        let mut whole = std::mem::take(&mut self.spent);
        whole += detection;
        whole += segmentation;
        whole += map;
        self.minute.push(
            CycleCost {
                wall_ms: whole.wall_ms(),
                cpu_ms: whole.cpu_ms(),
                detection_ms: detection.wall_ms(),
                segmentation_ms: segmentation.wall_ms(),
                map_ms: map.wall_ms(),
            },
            segmented.tracks.len(),
            &addition,
        );
        Ok(())
    }

    fn end_minute(&mut self) {
        let counts = Counts {
            voxels: self.map.len(),
            map_bytes: self.map.memory_bytes(),
            spill: self.map.spill_counts(),
            evidence_blocks: self.segmenter.evidence_blocks(),
            waiting: self.matcher.waiting_scans() + self.matcher.waiting_clouds(),
            rss_bytes: Usage::of_this_process().rss_bytes,
        };
        let number = self.rows.len() + 1;
        self.rows.extend(std::mem::take(&mut self.minute).row(number, counts));
    }
}

/// The start of a measurement, in wall time and CPU time.
struct Clock {
    wall: Instant,
    cpu: Duration,
}

/// The elapsed times.
#[derive(Clone, Copy, Default)]
struct Spent {
    wall: Duration,
    cpu: Duration,
}

impl Clock {
    fn start() -> Self {
        Self { cpu: own_cpu(), wall: Instant::now() }
    }

    fn spent(&self) -> Spent {
        Spent { wall: self.wall.elapsed(), cpu: own_cpu().saturating_sub(self.cpu) }
    }
}

impl Spent {
    fn wall_ms(self) -> f64 {
        self.wall.as_secs_f64() * 1e3
    }

    fn cpu_ms(self) -> f64 {
        self.cpu.as_secs_f64() * 1e3
    }
}

impl std::ops::AddAssign for Spent {
    fn add_assign(&mut self, other: Self) {
        self.wall += other.wall;
        self.cpu += other.cpu;
    }
}
