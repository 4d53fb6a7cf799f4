//! Builds the record of a run from the messages of the stages, in whatever order they arrive.

mod partial_cycle;
mod views;

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use detection::shell::{IMAGE_WITHOUT_CALIBRATION, UNUSABLE_MESSAGE_ON};
use estimation::quantile::upper_median;
use geometry::{
    Cloud, CycleTracks, DetectedCycle, MapPath, Method, PipelineConfig, Scan, SegmentationCounts,
    Stamp,
};
use msgs::convert;
use msgs::sensor_msgs::CameraInfo;
use reconstruction::{
    AtMaxVoxels, BoundReached, ConfigError, KeptOut, ReconstructionConfig, StaticMap,
};
use report::{DropCount, RunRecord};

use self::partial_cycle::{DetectedPart, PartialCycle};
use self::views::Views;
use super::findings::DoubtfulInput;
use super::trajectory::{CyclePlace, Trajectory};
use crate::doctor::{CalibrationFault, FARTHEST_M};
use crate::map_file::MapFile;

/// The three stages of the pipeline.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Stage {
    Detection,
    Segmentation,
    Reconstruction,
}

impl Stage {
    /// All of them, in the order of the flow.
    pub(crate) const ALL: [Self; 3] = [Self::Detection, Self::Segmentation, Self::Reconstruction];

    /// The name of the stage and of its node.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Detection => "detection",
            Self::Segmentation => "segmentation",
            Self::Reconstruction => "reconstruction",
        }
    }
}

/// How the reason of drops of messages that cannot be used begins.
pub(super) const UNUSABLE: &str = "unusable message";

/// The name and the duration of each step, in the order of the steps.
type StepDurations = Vec<(String, f64)>;

/// The names of a stage's steps begin with the stage's own.
fn of_stage<'a>(
    stage: Stage,
    durations: impl IntoIterator<Item = (&'a str, f64)>,
) -> StepDurations {
    let named = |(step, duration_s)| (format!("{}/{step}", stage.name()), duration_s);
    durations.into_iter().map(named).collect()
}

/// Reconstruction's report of a cycle.
struct MapAddition {
    cloud_stamp: Stamp,
    map_points: usize,
    durations: StepDurations,
}

/// Collects what the stages publish of each cycle.
pub(crate) struct Recorder {
    pipeline: PipelineConfig,
    unfiltered_map: StaticMap,
    cycles: BTreeMap<u32, PartialCycle>,
    views: Views,
    trajectory: Trajectory,
    drops: BTreeMap<(String, String), u64>,
    /// Messages of a topic that did not come to a node, and why the first did not.
    unusable: BTreeMap<String, (u64, String)>,
    doubtful: DoubtfulInput,
    map: ReconstructionConfig,
    kept_out: KeptOut,
    unassigned_clouds: VecDeque<Arc<Cloud>>,
    unassigned_additions: VecDeque<MapAddition>,
}

impl Recorder {
    /// A recorder of a run whose map has these parameters.
    pub(crate) fn new(map: &ReconstructionConfig) -> Result<Self, ConfigError> {
        // A map that is never cleared: points stay even if the camera sees through them.
        let unfiltered = ReconstructionConfig {
            pipeline: PipelineConfig { method: Method::RecHv, ..map.pipeline.clone() },
            at_max_voxels: AtMaxVoxels::Refuse,
            ..map.clone()
        };
        Ok(Self {
            pipeline: map.pipeline.clone(),
            unfiltered_map: StaticMap::new(unfiltered)?,
            cycles: BTreeMap::new(),
            views: Views::default(),
            trajectory: Trajectory::default(),
            drops: BTreeMap::new(),
            unusable: BTreeMap::new(),
            doubtful: DoubtfulInput::default(),
            map: map.clone(),
            kept_out: KeptOut::default(),
            unassigned_clouds: VecDeque::new(),
            unassigned_additions: VecDeque::new(),
        })
    }

    /// Detection's result. All of its points are added to the unfiltered map.
    pub(crate) fn detected(&mut self, cycle: &DetectedCycle) {
        let in_map =
            cycle.reduced_cloud.clone().transformed(&cycle.map_from_rig, &cycle.map_frame_id);
        // Reconstruction refuses and reports a change of the frame.
        let _ = self.unfiltered_map.add(&in_map);
        self.views.detected(cycle);
        // The clouds and images of a run are not kept in memory but for the views.
        let mut place = CyclePlace::of(cycle);
        self.trajectory.correct_late(&mut place);
        let partial = self.partial(cycle.index);
        partial.detected = Some(DetectedPart {
            place,
            reported_map_from_rig: cycle.map_from_rig,
            scan_stamp: cycle.scan_stamp,
            zones: cycle.zones.clone(),
            points_in: cycle.points_before_reduction,
        });
        self.assign();
    }

    /// A scan, which may arrive before or after detection's result of its cycle.
    pub(crate) fn scan(&mut self, scan: &Scan) {
        let beams = 0..scan.ranges_m.len();
        let mut ranges_m: Vec<f64> =
            beams.filter_map(|beam| scan.measured_range_m(beam)).map(f64::from).collect();
        let is_out_of_reach =
            upper_median(&mut ranges_m).is_some_and(|range_m| range_m > FARTHEST_M);
        self.doubtful.scans_out_of_reach += usize::from(is_out_of_reach);
        self.views.scan(scan);
    }

    /// A calibration of the depth camera. Detection reports one that it cannot use.
    pub(crate) fn calibration(&mut self, info: &CameraInfo) {
        if self.doubtful.calibration.is_none() && convert::camera_from_message(info).is_ok() {
            self.doubtful.calibration = CalibrationFault::of(&info.k, (info.width, info.height));
        }
    }

    /// A corrected or extended trajectory of the rig: earlier cycles are corrected, as in the map.
    pub(crate) fn path(&mut self, path: MapPath) {
        // Reconstruction refuses and reports another frame.
        let _ = self.unfiltered_map.follow_path(&path);
        let detected = self.cycles.values_mut().filter_map(|partial| partial.detected.as_mut());
        self.trajectory.take(path, detected.map(|detected| &mut detected.place));
    }

    /// The points that segmentation classified as dynamic. A cloud has a stamp but no cycle number, and may arrive before
    /// detection's message of the cycle.
    pub(crate) fn dynamic_cloud(&mut self, cloud: Arc<Cloud>) {
        self.unassigned_clouds.push_back(cloud);
        self.assign();
    }

    /// The tracks of a cycle, in the map frame as it was when the cycle was published.
    pub(crate) fn tracks(&mut self, cycle: &CycleTracks) {
        let positions = cycle.tracks.iter().map(|track| (track.id, track.position_m));
        self.partial(cycle.index).tracks_m = Some(positions.collect());
    }

    /// The map after the cycle whose cloud has this stamp; reconstruction does not report its number.
    pub(crate) fn reconstructed<'a>(
        &mut self,
        cloud_stamp: Stamp,
        map_points: usize,
        durations: impl IntoIterator<Item = (&'a str, f64)>,
    ) {
        let durations = of_stage(Stage::Reconstruction, durations);
        let addition = MapAddition { cloud_stamp, map_points, durations };
        self.unassigned_additions.push_back(addition);
        self.assign();
    }

    /// Points of each stage of the segmentation.
    pub(crate) fn counts(&mut self, index: u32, counts: SegmentationCounts) {
        self.partial(index).counts = Some(counts);
    }

    /// How long the steps of a stage took.
    pub(crate) fn durations<'a>(
        &mut self,
        index: u32,
        stage: Stage,
        durations: impl IntoIterator<Item = (&'a str, f64)>,
    ) {
        self.partial(index).durations[stage as usize] = of_stage(stage, durations);
    }

    /// A scan with too few returns to find motion in.
    pub(crate) fn blind_scan(&mut self) {
        self.doubtful.blind_scans += 1;
    }

    /// A pose that no platform reaches from the one before.
    pub(crate) fn pose_jump(&mut self) {
        self.doubtful.pose_jumps += 1;
    }

    /// How often the input of a cycle is doubtful.
    pub(crate) fn doubtful(&self) -> DoubtfulInput {
        self.doubtful.clone()
    }

    /// Whether the map lacks parts of a cycle's depth image, how many points or blocks it had no room for, and how many it dropped.
    pub(crate) fn kept_out(&mut self, is_view_cut: bool, refused: usize, dropped: usize) {
        self.kept_out.note_counts(is_view_cut, refused, dropped);
    }

    /// The bounds that have kept something out of the map.
    pub(crate) fn bounds_reached(&self) -> Vec<BoundReached> {
        self.kept_out.bounds_reached(&self.map)
    }

    /// Counts lost messages or cycles.
    pub(crate) fn dropped(&mut self, topic_or_stage: &str, reason: &str, count: u64) {
        if count > 0 {
            *self.drops.entry((topic_or_stage.to_owned(), reason.to_owned())).or_default() += count;
        }
    }

    /// A message of the bag that cannot be passed on. They are counted by topic, however many reasons there are.
    pub(crate) fn unusable_message(&mut self, topic: &str, reason: String) {
        let (count, _first) = self.unusable.entry(topic.to_owned()).or_insert((0, reason));
        *count += 1;
    }

    /// The messages that detection counted as unusable, by their cause. Other causes come with the report of a dropped
    /// scan.
    pub(crate) fn unusable(&mut self, cause: &str, count: u64) {
        if let Some(cause) = cause.strip_prefix(UNUSABLE_MESSAGE_ON) {
            match cause.split_once(": ") {
                Some((topic, reason)) => {
                    self.dropped(topic, &format!("{UNUSABLE}: {reason}"), count);
                }
                None => self.dropped(cause, UNUSABLE, count),
            }
        } else if cause == IMAGE_WITHOUT_CALIBRATION {
            self.dropped(Stage::Detection.name(), cause, count);
        }
    }

    /// The number of cycles that some stage has not reported yet.
    pub(crate) fn incomplete_cycles(&self) -> usize {
        self.cycles.values().filter(|partial| partial.first_missing_stage().is_some()).count()
    }

    /// The number of cycles after the last one that every stage has reported: they are on their way.
    pub(crate) fn cycles_ahead(&self) -> usize {
        let newest_first = self.cycles.values().rev();
        newest_first.take_while(|partial| partial.first_missing_stage().is_some()).count()
    }

    /// The frame of the map, once a cycle has named it.
    pub(crate) fn map_frame_id(&self) -> String {
        let detected = self.cycles.values().find_map(|partial| partial.detected.as_ref());
        detected.map(|detected| detected.place.map_frame_id.clone()).unwrap_or_default()
    }

    /// The record of the run. A cycle that a stage never reported is counted as dropped by that stage.
    pub(crate) fn finish(mut self, map: MapFile, run: RunName) -> RunRecord {
        let mut cycles = Vec::new();
        for (index, partial) in std::mem::take(&mut self.cycles) {
            let missing = partial.first_missing_stage();
            match (partial.into_record(index, self.views.take(index)), missing) {
                (Some(cycle), _) => cycles.push(cycle),
                (None, stage) => {
                    let stage = stage.unwrap_or(Stage::Segmentation);
                    self.dropped(stage.name(), "the cycle never came out of this stage", 1);
                }
            }
        }
        for (topic, (count, first)) in std::mem::take(&mut self.unusable) {
            self.dropped(&topic, &format!("{UNUSABLE}; the first: {first}"), count);
        }
        let drops = self
            .drops
            .into_iter()
            .map(|((topic_or_stage, reason), count)| DropCount { topic_or_stage, reason, count })
            .collect();
        RunRecord {
            bag_name: run.bag_name,
            transport: run.transport,
            method: self.pipeline.method.name().to_owned(),
            voxel_edge_m: self.pipeline.voxel_edge_m,
            map_edge_m: self.pipeline.depth_map_edge_m(),
            camera: self.views.camera(),
            rig_from_lidar: self.views.rig_from_lidar(),
            rig_from_camera: self.views.rig_from_camera(),
            map_frame_id: run.map_frame_id,
            cycles,
            drops,
            static_map: map.points.points_m,
            map_normals: map.points.normals,
            map_colours: map.points.colours,
            map_views: map.views,
            dropped_blocks: self.kept_out.dropped(),
            lacked_room: self.kept_out.lacked_room(&self.map),
            mesh: None,
            unfiltered_map: self.unfiltered_map.points(),
        }
    }

    /// Assigns each message that has only a stamp to the first cycle of that stamp without one. If the scanner is faster than
    /// the camera, several cycles have the same stamp; their messages arrive in their order.
    fn assign(&mut self) {
        for cloud in std::mem::take(&mut self.unassigned_clouds) {
            let lacks = |partial: &PartialCycle| partial.dynamic_cloud.is_none();
            match self.first_of(cloud.stamp, lacks) {
                Some(partial) => partial.dynamic_cloud = Some(cloud),
                None => self.unassigned_clouds.push_back(cloud),
            }
        }
        for addition in std::mem::take(&mut self.unassigned_additions) {
            let lacks = |partial: &PartialCycle| partial.map_points.is_none();
            match self.first_of(addition.cloud_stamp, lacks) {
                Some(partial) => {
                    partial.map_points = Some(addition.map_points);
                    partial.durations[Stage::Reconstruction as usize] = addition.durations;
                }
                None => self.unassigned_additions.push_back(addition),
            }
        }
    }

    fn first_of(
        &mut self,
        cloud_stamp: Stamp,
        lacks: impl Fn(&PartialCycle) -> bool,
    ) -> Option<&mut PartialCycle> {
        self.cycles.values_mut().find(|partial| {
            let stamp = partial.detected.as_ref().map(|detected| detected.place.cloud_stamp);
            stamp == Some(cloud_stamp) && lacks(partial)
        })
    }

    fn partial(&mut self, index: u32) -> &mut PartialCycle {
        self.cycles.entry(index).or_default()
    }
}

/// What identifies a run in its record.
pub(crate) struct RunName {
    pub(crate) bag_name: String,
    pub(crate) transport: report::Transport,
    pub(crate) map_frame_id: String,
}

#[cfg(test)]
mod tests;
