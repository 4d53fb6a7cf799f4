//! The core with its topics: every pair of images ends in a pose, or in a reason why there is none.

mod maps;
mod reporting;

use std::sync::Arc;

use geometry::Stamp;
use msgs::convert;
use msgs::sensor_msgs::Image;
use node_shell::parameters::NodeParameters;
use node_shell::{
    Counters, Node, NodeFailure, Panicked, Publisher, Qos, StageReporter, StepTimer, Throttle,
};

use super::PROGRAM;
use super::cameras::{Cameras, RectifiedPair};
use super::drawing::drawn;
use super::follower::{Followed, Follower, InMap};
use super::hints::Knowledge;
use super::inputs::{Arrival, Inputs};
use super::left_out::{LeftOut, Of};
use super::map_file::MapFile;
use super::map_path::MapPathPublisher;
use super::output::Output;
use super::pairing::{Paired, Pairing};
use super::parameters::PoseParameters;
use super::progress::ProgressReporter;
use crate::frame::FrameExtractor;
use crate::tracking::Hints;

/// A viewer needs the latest picture alone.
const PICTURES_KEPT: usize = 1;

/// What makes a frame take less time.
const REMEDY: &str =
    "let the camera send fewer or smaller images, or lower frame.points.max_corners";

/// The core with its topics.
pub struct Stage {
    inputs: Inputs,
    parameters: PoseParameters,
    pairing: Pairing<Arc<Image>, Arc<Image>>,
    left_out: LeftOut,
    cameras: Cameras,
    knowledge: Knowledge,
    extractor: FrameExtractor,
    follower: Follower,
    output: Output,
    map_path: Option<MapPathPublisher>,
    map_file: Option<MapFile>,
    map_file_on_exit: Option<MapFile>,
    pictures: Publisher<Image>,
    reporter: StageReporter,
    counters: Counters,
    next_frame: u32,
    progress: ProgressReporter,
    /// Why the depth images may be another camera's, as it was reported.
    registration_doubt: Option<String>,
    bad_input: Throttle,
}

impl Stage {
    /// The cause in the diagnostics of colour images to which no depth image belongs.
    pub const IMAGE_WITHOUT_DEPTH: &str = "image without depth";
    /// ... and of depth images to which no colour image belongs.
    pub const DEPTH_WITHOUT_IMAGE: &str = "depth without image";
    /// The count of loops that were closed at a pair of images, with a map.
    pub const CLOSED_LOOPS: &str = "closed_loops";

    /// The stage that `node` is.
    ///
    /// # Errors
    /// When a parameter is out of its range, or a topic cannot be had.
    pub fn new(node: &Node, parameters: &PoseParameters) -> Result<Self, NodeFailure> {
        parameters.validate_node()?;
        let counters = node.counters();
        let progress = ProgressReporter::new(counters.clone());
        let map_file = MapFile::new("map_file", &parameters.map_file)?;
        let map_file_on_exit = MapFile::new("save_map_on_exit", &parameters.save_map_on_exit)?;
        let map_path =
            parameters.slam.then(|| MapPathPublisher::new(node, &parameters.map_frame_id));
        let mut output = Output::new(node, parameters)?;
        let follower = first_follower(parameters, map_file.as_ref(), &mut output)?;
        Ok(Self {
            inputs: Inputs::subscribe(node, parameters)?,
            parameters: parameters.clone(),
            pairing: Pairing::new(parameters.max_pair_gap_s, parameters.max_waiting_images),
            left_out: LeftOut::default(),
            cameras: Cameras::new(parameters),
            knowledge: Knowledge::new(parameters),
            extractor: FrameExtractor::new(parameters.tracker.frame.clone())?
                .with_executor(parameters.executor()),
            follower,
            output,
            map_path: map_path.transpose()?,
            map_file,
            map_file_on_exit,
            pictures: node.publisher("features", &Qos::sensor(PICTURES_KEPT))?,
            reporter: StageReporter::new(node, PROGRAM.name)?,
            counters,
            next_frame: 0,
            progress,
            registration_doubt: None,
            bad_input: Throttle::for_warnings(),
        })
    }

    /// Drops all that has come so far: the next image is the first one again, in the map that the node began with.
    pub(super) fn reset(&mut self) -> Result<(), NodeFailure> {
        self.follower = first_follower(&self.parameters, self.map_file.as_ref(), &mut self.output)?;
        self.reset_trajectory();
        self.forget_inputs();
        Ok(())
    }

    /// There is another map.
    fn reset_trajectory(&mut self) {
        if let Some(map_path) = &mut self.map_path {
            map_path.reset();
        }
    }

    fn forget_inputs(&mut self) {
        let parameters = &self.parameters;
        self.pairing = Pairing::new(parameters.max_pair_gap_s, parameters.max_waiting_images);
        self.left_out.forget();
        self.cameras = Cameras::new(parameters);
        self.knowledge = Knowledge::new(parameters);
        self.progress.reset();
    }

    /// The next message. May be dropped while it waits.
    pub(super) async fn next(&self) -> Arrival {
        self.inputs.next().await
    }

    /// Takes every message that is here already.
    pub fn take_waiting(&mut self) {
        while let Some(arrival) = self.inputs.try_next() {
            self.take(arrival);
        }
    }

    pub(super) fn take(&mut self, arrival: Arrival) {
        let taken = match arrival {
            Arrival::Color(message) => {
                self.take_color(message);
                Ok(())
            }
            Arrival::CompressedColor(message) => {
                match convert::image_from_compressed_message(&message) {
                    Ok(mut image) => {
                        image.header = message.header.clone();
                        self.take_color(Arc::new(image));
                        Ok(())
                    }
                    Err(error) => Err((self.inputs.color_topic().to_owned(), error.into())),
                }
            }
            Arrival::Depth(message) => {
                let stamp = convert::stamp_from_time(message.header.stamp);
                self.left_out.take(Of::Depth, stamp, self.inputs.left_out());
                let paired = self.pairing.push_depth(stamp, message);
                self.handle(paired);
                Ok(())
            }
            Arrival::ColorInfo(message) => {
                convert::camera_of_image(&message, self.inputs.color_topic())
                    .map_err(NodeFailure::from)
                    .and_then(|camera| self.cameras.take_color(camera))
                    .map_err(|error| (self.inputs.color_info_topic().to_owned(), error))
            }
            Arrival::DepthInfo(message) => {
                convert::camera_of_image(&message, self.inputs.depth_topic())
                    .map_err(NodeFailure::from)
                    .and_then(|camera| self.cameras.take_depth(camera))
                    .map_err(|error| (self.inputs.depth_info_topic().to_owned(), error))
            }
            Arrival::Tracks(message) => self
                .knowledge
                .take_tracks(&message, self.output.frames())
                .map_err(|error| (self.inputs.tracks_topic().to_owned(), error)),
            Arrival::Imu(message) => {
                self.knowledge.take_imu(&message).map_err(|error| ("imu".to_owned(), error))
            }
            Arrival::Wheels(message) => {
                self.knowledge.take_wheels(&message).map_err(|error| ("wheels".to_owned(), error))
            }
        };
        if let Err((topic, error)) = taken {
            self.counters.count_drop(&format!("unusable message on {topic}"));
            if let Some(held_back) = self.bad_input.pass() {
                tracing::warn!("{topic}: {error} ({held_back} more since the last warning)");
            }
        }
    }

    fn take_color(&mut self, image: Arc<Image>) {
        let stamp = convert::stamp_from_time(image.header.stamp);
        self.left_out.take(Of::Color, stamp, self.inputs.left_out());
        let paired = self.pairing.push_color(stamp, image);
        self.handle(paired);
    }

    fn handle(&mut self, paired: Vec<Paired<Arc<Image>, Arc<Image>>>) {
        for one in paired {
            match one {
                Paired::Pair(stamp, color, depth) => {
                    // The map stays after a panic: without it the pose would begin at another place.
                    let taken = node_shell::caught(|| self.frame(stamp, &color, &depth));
                    if let Err(panicked) = taken {
                        self.drop_frame(stamp, Panicked::CAUSE, &panicked.to_string());
                    }
                }
                Paired::ColorAlone(stamp) => self.drop_alone(Of::Color, stamp),
                Paired::DepthAlone(stamp) => self.drop_alone(Of::Depth, stamp),
            }
        }
    }

    /// Drops an image without a partner: the camera has taken none then, or the node has left it out.
    fn drop_alone(&mut self, of: Of, stamp: Stamp) {
        if self.left_out.explains(of, stamp) {
            let counts = self.inputs.counts();
            return self.reporter.superseded(self.header(stamp), self.next_frame, &counts);
        }
        let (cause, topic) = match of {
            Of::Color => (Self::IMAGE_WITHOUT_DEPTH, self.inputs.depth_topic()),
            Of::Depth => (Self::DEPTH_WITHOUT_IMAGE, self.inputs.color_topic()),
        };
        self.drop_frame(stamp, cause, &format!("no image of {topic} was taken then"));
    }

    fn frame(&mut self, stamp: Stamp, color: &Image, depth: &Image) {
        let mut timer = StepTimer::start();
        self.check_registration(color, depth);
        if !self.cameras.are_known() {
            let (inputs, is_of_depth) = (&self.inputs, self.cameras.color_is_known());
            let topic =
                if is_of_depth { inputs.depth_info_topic() } else { inputs.color_info_topic() };
            let reason = format!("no calibration on {topic}");
            return self.drop_frame(stamp, "image without a calibration", &reason);
        }
        let pair = match self.cameras.rectified(stamp, color, depth) {
            Ok(pair) => pair,
            Err(error) => return self.drop_frame(stamp, "unusable image", &error.to_string()),
        };
        timer.end_of("convert");
        let RectifiedPair { gray, depth, camera } = pair;
        let frame = match self.extractor.extract(&gray, &depth, &camera) {
            Ok(frame) => frame,
            Err(error) => return self.drop_frame(stamp, "unusable image", &error.to_string()),
        };
        timer.end_of("features");
        let moving = self.knowledge.moving(stamp, self.output.frames());
        let motion = self.follower.tracker().config().motion;
        let last = self.follower.tracker().last_stamp();
        let hints = Hints {
            turn: last.and_then(|last| self.knowledge.turn(last, stamp, &motion)),
            wheels: last.and_then(|last| self.knowledge.wheel_step(last, stamp)),
            moving: &moving,
        };
        let Followed { tracked, in_map } = self.follower.step(&frame, &camera, &hints);
        timer.end_of("tracking");
        self.progress.report(&tracked, in_map.as_ref());
        if let Some(in_map) = &in_map {
            self.publish_trajectory(stamp, in_map);
        }
        match &tracked.pose {
            Some(pose) => self.output.publish(pose, in_map.as_ref()),
            None => self.output.interrupt(),
        }
        if self.pictures.subscriber_count() > 0 {
            let header = color.header.clone();
            self.pictures.publish_or_warn(drawn(&gray, &frame, &tracked, header));
        }
        timer.end_of("publish");
        self.report(stamp, &frame, (&tracked, in_map.as_ref()), &timer);
        self.reporter.keeps_pace(self.left_out.pairs(self.inputs.left_out()), &timer, REMEDY);
    }

    /// Why the depth images may be another camera's, as of the last pair of images; `None` while nothing says so.
    #[must_use]
    pub fn registration_doubt(&self) -> Option<&str> {
        self.registration_doubt.as_deref()
    }

    #[cfg(test)]
    pub(super) fn warnings(&self) -> Vec<String> {
        self.counters.warnings()
    }

    /// Before the first pose in the corrected map, so that a subscriber that takes both in order knows the correction.
    fn publish_trajectory(&mut self, stamp: Stamp, in_map: &InMap) {
        let Some(map_path) = &mut self.map_path else { return };
        if map_path.is_due(stamp, in_map.last_waypoint, in_map.has_changed) {
            let (frames, trajectory) =
                (self.output.frames(), self.follower.waypoints().into_iter());
            map_path.publish(
                stamp,
                trajectory.map(|(stamp, camera)| (stamp, frames.map_from_rig(&camera))),
            );
        }
    }

    /// Where the rig was at each image, in the frame of the map, as the map has it now; `None` without a map, or with one that
    /// is worked on in the background.
    #[must_use]
    pub fn trajectory(&self) -> Option<Vec<geometry::StampedPose>> {
        let frames = self.output.frames();
        let poses = self.follower.trajectory()?.into_iter();
        let poses = poses.map(|(stamp, camera_from_map)| geometry::StampedPose {
            stamp,
            frame_id: frames.map_frame_id.clone(),
            map_from_rig: frames.map_from_rig(&camera_from_map),
        });
        Some(poses.collect())
    }
}

/// The tracker that the node begins with: a map that was saved, or nothing.
fn first_follower(
    parameters: &PoseParameters,
    file: Option<&MapFile>,
    output: &mut Output,
) -> Result<Follower, NodeFailure> {
    let file = file.filter(|_| parameters.begins_with_map());
    let saved = file.map(|file| Ok::<_, NodeFailure>((file, file.load()?))).transpose()?;
    let world_from_map = saved.as_ref().map(|(_, saved)| saved.world_from_map);
    let report = saved.as_ref().map(|(file, saved)| file.loaded(saved));
    let follower = Follower::new(parameters, saved.map(|(_, saved)| saved.map), None)?;
    output.reset(world_from_map.as_ref());
    if let Some(report) = report {
        tracing::info!("{report}");
    }
    Ok(follower)
}
