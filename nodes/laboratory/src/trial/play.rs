//! The run of one method on a scenario.

use std::collections::BTreeMap;
use std::sync::Arc;

use detection::shell::CloudInput;
use geometry::{CycleTracks, Stamp};
use msgs::convert;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan};
use node_shell::{Node, PublishError, Qos, ValueSubscription};

use super::*;
use robot::run::parameters::PipelineParameters;
use robot::run::pipeline::{Pipeline, Sensors};

/// The queue of cycles not yet read: longer than one sample can fill.
const WAITING_CYCLES: usize = 64;

/// A sample, as a driver would publish it.
pub(super) enum Message {
    Pose(Arc<PoseStamped>),
    CameraInfo(Arc<CameraInfo>),
    Image(Arc<Image>),
    Scan(Arc<LaserScan>),
}

impl Message {
    /// The message of a sample; `None` for ground truth, which is not published.
    pub(super) fn of(sample: &Sample) -> Option<Self> {
        Some(match sample {
            Sample::Pose(pose) => Self::Pose(Arc::new(convert::message_from_pose(pose))),
            Sample::CameraInfo { stamp, frame_id, camera } => {
                Self::CameraInfo(Arc::new(convert::message_from_camera(camera, *stamp, frame_id)))
            }
            Sample::Depth { image, .. } => {
                Self::Image(Arc::new(convert::message_from_depth(image)))
            }
            Sample::Scan { scan, .. } => Self::Scan(Arc::new(convert::message_from_scan(scan))),
            _ => return None,
        })
    }

    fn publish(&self, sensors: &Sensors) -> Result<(), PublishError> {
        match self {
            Self::Pose(pose) => sensors.poses.publish(Arc::clone(pose)),
            Self::CameraInfo(info) => sensors.camera_infos.publish(Arc::clone(info)),
            Self::Image(image) => sensors.images.publish(Arc::clone(image)),
            Self::Scan(scan) => sensors.scans.publish(Arc::clone(scan)),
        }
    }
}

/// The run of one method.
pub(super) struct Play<'a> {
    method: Method,
    parameters: PipelineParameters,
    pipeline: Pipeline,
    tracks: ValueSubscription<CycleTracks>,
    /// The node of the subscription.
    _listener: Node,
    /// One point per pixel.
    surface_m: &'a [Point3<f32>],
    /// One point per voxel of the map's edge.
    empty_scene_m: Vec<Point3<f32>>,
    options: &'a TrialOptions,
    cycles: BTreeMap<u32, SeenCycle>,
    reached: Option<Stamp>,
}

/// The published results of a cycle.
struct SeenCycle {
    tracks: Vec<Track>,
    correlation: Option<Correlation>,
}

impl<'a> Play<'a> {
    pub(super) fn start(
        method: Method,
        options: &'a TrialOptions,
        surface_m: &'a [Point3<f32>],
    ) -> Result<Self, Failure> {
        let parameters = PipelineParameters::of_method(method, options.voxel_edge_m);
        let pipeline = Pipeline::new(CloudInput::Depth, &[], &parameters).map_err(failure)?;
        let listener = pipeline.listener().map_err(failure)?;
        let tracks = listener
            .value_subscription("tracks", &Qos::reliable(WAITING_CYCLES))
            .map_err(failure)?;
        let grid = VoxelGrid::new(parameters.pipeline().voxel_edge_m).map_err(failure)?;
        Ok(Self {
            method,
            parameters,
            pipeline,
            tracks,
            _listener: listener,
            surface_m,
            empty_scene_m: grid.reduce(surface_m),
            options,
            cycles: BTreeMap::new(),
            reached: None,
        })
    }

    /// Publishes a message and runs the nodes until it is processed.
    pub(super) fn take(&mut self, message: &Message, truth: &mut Truth) -> Result<(), Failure> {
        message.publish(self.pipeline.sensors()).map_err(failure)?;
        self.pipeline.flow();
        self.look(truth)
    }

    /// Ends the input.
    pub(super) fn end(&mut self, truth: &mut Truth) -> Result<(), Failure> {
        self.pipeline.end_of_input();
        self.look(truth)
    }

    /// The stamp of the latest cycle's image.
    pub(super) fn reached(&self) -> Option<Stamp> {
        self.reached
    }

    /// Reads the cycles finished since the last call.
    fn look(&mut self, truth: &mut Truth) -> Result<(), Failure> {
        while let Some(received) = self.tracks.try_next() {
            let cycle = Arc::unwrap_or_clone(received.message.value().map_err(failure)?);
            let CycleTracks { index, stamp, tracks, .. } = cycle;
            truth.claim(stamp);
            self.reached = self.reached.max(Some(stamp));
            let seen = SeenCycle {
                tracks,
                correlation: if self.options.correlate_each_cycle {
                    self.correlation()
                } else {
                    None
                },
            };
            self.cycles.insert(index, seen);
        }
        Ok(())
    }

    fn correlation(&self) -> Option<Correlation> {
        let map_m = self.pipeline.map().points();
        // Before the first cycle there is nothing to compare.
        correlation(&self.empty_scene_m, &map_m, self.edge_m()).ok()
    }

    fn edge_m(&self) -> f64 {
        self.parameters.pipeline().voxel_edge_m
    }

    pub(super) fn finish(mut self, scenario: &Scenario, truth: &Truth) -> Result<Trial, Failure> {
        let edge_m = self.edge_m();
        let record = self.pipeline.finish(&scenario.name);
        let cycles = record
            .cycles
            .iter()
            .map(|cycle| {
                let seen = self.cycles.remove(&cycle.index);
                let truth = truth.objects_at(cycle.cloud_stamp).cloned();
                let (seen, truth) = seen.zip(truth).ok_or_else(|| {
                    Failure::new(format!("cycle {} has no tracks or no ground truth", cycle.index))
                })?;
                let SeenCycle { tracks, correlation } = seen;
                Ok(TrialCycle { truth, tracks, correlation })
            })
            .collect::<Result<_, Failure>>()?;
        let score = if self.options.score_labels {
            let rig_from_camera = self.parameters.pipeline().rig.mounts().rig_from_camera;
            let names = scenario.scene.objects.iter();
            let names = names.map(|object| (object.id, object.name.clone())).collect();
            let rules = DynamicScoreRules::default();
            let at = |stamp| truth.frame_at(stamp, &rig_from_camera);
            let surface_m = Some(self.surface_m);
            let score = evaluation::score_dynamic(&record, &rules, &names, surface_m, at);
            Some(score.map_err(failure)?)
        } else {
            None
        };
        Ok(Trial {
            method: self.method,
            scenario_name: scenario.name.clone(),
            seed: scenario.seed,
            score,
            cycles,
            correlation: correlation(&self.empty_scene_m, &record.static_map, edge_m).ok(),
            empty_scene_m: self.empty_scene_m,
            record,
        })
    }
}
