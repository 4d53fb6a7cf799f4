//! Puts a run's record together out of what the stages say, in whatever order it arrives.

mod partial_cycle;

use std::collections::{BTreeMap, VecDeque};

use detection::shell::{IMAGE_WITHOUT_CALIBRATION, UNUSABLE_MESSAGE_ON};
use geometry::{
    Cloud, DetectedCycle, MapPath, Method, PipelineConfig, SegmentationCounts, Stamp, Track,
};
use nalgebra::Point3;
use reconstruction::{AtMaxVoxels, ConfigError, ReconstructionConfig, StaticMap};
use report::{DropCount, RunRecord};

use self::partial_cycle::PartialCycle;
use super::way::Way;

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
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Detection => "detection",
            Self::Segmentation => "segmentation",
            Self::Reconstruction => "reconstruction",
        }
    }
}

/// What took how long, in the order of the steps.
type StepDurations = Vec<(String, f64)>;

/// The names of a stage's steps begin with the stage's own.
fn of_stage<'a>(
    stage: Stage,
    durations: impl IntoIterator<Item = (&'a str, f64)>,
) -> StepDurations {
    let named = |(step, duration_s)| (format!("{}/{step}", stage.name()), duration_s);
    durations.into_iter().map(named).collect()
}

/// What reconstruction says of a cycle.
struct MapAddition {
    cloud_stamp: Stamp,
    map_points: usize,
    durations: StepDurations,
}

/// Collects what the stages say of each cycle.
pub(crate) struct Recorder {
    pipeline: PipelineConfig,
    unfiltered_map: StaticMap,
    cycles: BTreeMap<u32, PartialCycle>,
    way: Way,
    drops: BTreeMap<(String, String), u64>,
    blind_scans: usize,
    unclaimed_clouds: VecDeque<Cloud>,
    unclaimed_additions: VecDeque<MapAddition>,
}

impl Recorder {
    /// A recorder of a run whose map has these parameters.
    pub(crate) fn new(map: &ReconstructionConfig) -> Result<Self, ConfigError> {
        // What is never removed: points stay, whatever is seen through them.
        let unfiltered = ReconstructionConfig {
            pipeline: PipelineConfig {
                method: Method::RecHv,
                map_edge_m: 0.0,
                ..map.pipeline.clone()
            },
            // It is a figure of the report, and not worth a folder of tiles of its own.
            at_max_voxels: match map.at_max_voxels {
                AtMaxVoxels::Spill => AtMaxVoxels::Refuse,
                kept => kept,
            },
            ..map.clone()
        };
        Ok(Self {
            pipeline: map.pipeline.clone(),
            unfiltered_map: StaticMap::new(unfiltered)?,
            cycles: BTreeMap::new(),
            way: Way::default(),
            drops: BTreeMap::new(),
            blind_scans: 0,
            unclaimed_clouds: VecDeque::new(),
            unclaimed_additions: VecDeque::new(),
        })
    }

    /// Detection's result. All of its points go into the map that shows what no removal would give.
    pub(crate) fn detected(&mut self, mut cycle: DetectedCycle) {
        let in_map = cycle.reduced_cloud.transformed(&cycle.map_from_rig, &cycle.map_frame_id);
        // Another frame than before is reconstruction's to refuse and to report.
        let _ = self.unfiltered_map.add(&in_map);
        let told_map_from_rig = cycle.map_from_rig;
        self.way.bring_over(&mut cycle);
        // A run's images are not to stay in memory.
        cycle.depth = None;
        let partial = self.partial(cycle.index);
        partial.told_map_from_rig = told_map_from_rig;
        partial.detected = Some(cycle);
        self.claim();
    }

    /// The way of the rig has been corrected, or has gone on: what was told before goes along, as it does in the map.
    pub(crate) fn path(&mut self, path: MapPath) {
        // Another frame is reconstruction's to refuse and to report.
        let _ = self.unfiltered_map.follow_path(&path);
        let cycles = self.cycles.values_mut().filter_map(|partial| partial.detected.as_mut());
        self.way.take(path, cycles);
    }

    /// The points that segmentation took for moving. A cloud carries its stamp but not its cycle's
    /// number, and may come before detection's own word of the cycle.
    pub(crate) fn dynamic_cloud(&mut self, cloud: Cloud) {
        self.unclaimed_clouds.push_back(cloud);
        self.claim();
    }

    /// The tracks of a cycle, in the map as it was told with the cycle.
    pub(crate) fn tracks(&mut self, index: u32, tracks: &[Track]) {
        let positions = tracks.iter().map(|track| (track.id, track.position_m));
        self.partial(index).tracks_m = Some(positions.collect());
    }

    /// The map after the cycle whose cloud has this stamp; reconstruction does not know its number.
    pub(crate) fn reconstructed<'a>(
        &mut self,
        cloud_stamp: Stamp,
        map_points: usize,
        durations: impl IntoIterator<Item = (&'a str, f64)>,
    ) {
        let durations = of_stage(Stage::Reconstruction, durations);
        let addition = MapAddition { cloud_stamp, map_points, durations };
        self.unclaimed_additions.push_back(addition);
        self.claim();
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

    /// A scan in which nothing could be found, since it had no or hardly any returns.
    pub(crate) fn blind_scan(&mut self) {
        self.blind_scans += 1;
    }

    /// Scans in which nothing could be found for want of returns.
    pub(crate) fn blind_scans(&self) -> usize {
        self.blind_scans
    }

    /// Something was lost.
    pub(crate) fn dropped(&mut self, topic_or_stage: &str, reason: &str, count: u64) {
        if count > 0 {
            *self.drops.entry((topic_or_stage.to_owned(), reason.to_owned())).or_default() += count;
        }
    }

    /// What detection counted as of no use, by the cause that it gave. Other causes come with a report of
    /// the scan that they cost.
    pub(crate) fn unusable(&mut self, cause: &str, count: u64) {
        if let Some(topic) = cause.strip_prefix(UNUSABLE_MESSAGE_ON) {
            self.dropped(topic, "unusable message", count);
        } else if cause == IMAGE_WITHOUT_CALIBRATION {
            self.dropped(Stage::Detection.name(), cause, count);
        }
    }

    /// Cycles that some stage has yet to speak of.
    pub(crate) fn incomplete_cycles(&self) -> usize {
        self.cycles.values().filter(|partial| partial.first_silent_stage().is_some()).count()
    }

    /// The frame of the map, once a cycle has named it.
    pub(crate) fn map_frame_id(&self) -> String {
        let detected = self.cycles.values().find_map(|partial| partial.detected.as_ref());
        detected.map(|cycle| cycle.map_frame_id.clone()).unwrap_or_default()
    }

    /// The record of the run. A cycle that a stage never spoke of is counted as dropped by it.
    pub(crate) fn finish(mut self, static_map: Vec<Point3<f32>>, run: RunName) -> RunRecord {
        let mut cycles = Vec::new();
        for (index, partial) in std::mem::take(&mut self.cycles) {
            let silent = partial.first_silent_stage();
            match (partial.into_record(index), silent) {
                (Some(cycle), _) => cycles.push(cycle),
                (None, stage) => {
                    let stage = stage.unwrap_or(Stage::Segmentation);
                    self.dropped(stage.name(), "the cycle never came out of this stage", 1);
                }
            }
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
            map_frame_id: run.map_frame_id,
            cycles,
            drops,
            static_map,
            unfiltered_map: self.unfiltered_map.points(),
        }
    }

    /// Gives what carries a stamp only to the first cycle of that stamp that lacks it. Several cycles
    /// have one stamp where the scanner is faster than the camera; what is theirs comes in their order.
    fn claim(&mut self) {
        for cloud in std::mem::take(&mut self.unclaimed_clouds) {
            let lacks = |partial: &PartialCycle| partial.dynamic_points_m.is_none();
            match self.first_of(cloud.stamp, lacks) {
                Some(partial) => partial.dynamic_points_m = Some(cloud.points_m),
                None => self.unclaimed_clouds.push_back(cloud),
            }
        }
        for addition in std::mem::take(&mut self.unclaimed_additions) {
            let lacks = |partial: &PartialCycle| partial.map_points.is_none();
            match self.first_of(addition.cloud_stamp, lacks) {
                Some(partial) => {
                    partial.map_points = Some(addition.map_points);
                    partial.durations[Stage::Reconstruction as usize] = addition.durations;
                }
                None => self.unclaimed_additions.push_back(addition),
            }
        }
    }

    fn first_of(
        &mut self,
        cloud_stamp: Stamp,
        lacks: impl Fn(&PartialCycle) -> bool,
    ) -> Option<&mut PartialCycle> {
        self.cycles.values_mut().find(|partial| {
            let stamp = partial.detected.as_ref().map(|cycle| cycle.reduced_cloud.stamp);
            stamp == Some(cloud_stamp) && lacks(partial)
        })
    }

    fn partial(&mut self, index: u32) -> &mut PartialCycle {
        self.cycles.entry(index).or_default()
    }
}

/// What a run is called in its record.
pub(crate) struct RunName {
    pub(crate) bag_name: String,
    pub(crate) transport: report::Transport,
    pub(crate) map_frame_id: String,
}

#[cfg(test)]
mod tests;
