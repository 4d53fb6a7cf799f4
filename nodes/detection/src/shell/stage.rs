//! The core with its topics: every message that arrives ends in a cycle, a drop that is reported, or a
//! warning.

mod detecting;
mod reporting;
#[cfg(test)]
mod tests;
mod waiting;

use geometry::{CameraModel, Scan, Stamp, StampedPose, pose_from_vector};
use msgs::convert;
use node_shell::{
    Counters, GrantedBuffer, Node, NodeFailure, Panicked, StepTimer, Throttle, TransformWait,
};

use super::backlog::Backlog;
use super::camera::Camera;
use super::colour::Colours;
use super::extrinsics::ExtrinsicsCheck;
use super::inputs::{Arrival, Inputs, PoseMessage, ViewMessage};
use super::output::Output;
use super::rendering::RenderingReport;
use super::restarts::RestartReport;
use super::rig_pose::{UnusablePoseMessage, pose_of_message};
use super::sensor_frame::SensorFrame;
use super::transforms::{Transforms, WAITING_FOR_TRANSFORM};
use super::{DetectionParameters, PoseInput};
use crate::{Detector, Input, MatchEvent, Matched, Matcher};
use waiting::frames_of;

/// The cause of a drop of a message that drops no scan; the topic's name follows, and for a calibration `: ` and the reason.
pub const UNUSABLE_MESSAGE_ON: &str = "unusable message on ";

/// The cause of a drop of a scan of a second scanner on the topic.
const ANOTHER_SCANNER: &str = "scan of another scanner";

/// The core with its topics.
pub struct Stage {
    inputs: Inputs,
    matcher: Matcher<Scan, ViewMessage>,
    detector: Detector,
    camera: Camera,
    scanner_frame: SensorFrame,
    camera_frame: SensorFrame,
    /// Why its first calibration of those that cannot be used is none.
    camera_refused: Option<String>,
    extrinsics: Option<ExtrinsicsCheck>,
    /// None where the cycles have no colours.
    colours: Option<Colours>,
    /// What comes from tf; none if nothing does.
    transforms: Option<Transforms>,
    /// Matched cycles that wait for their transforms.
    unlocated: TransformWait<Matched<Scan, ViewMessage>>,
    /// The first of these that lack nothing, where the newest cycles count; none where each does, which is processed at once.
    backlog: Option<Backlog>,
    /// Whether something has come since the first of them lacked something.
    may_go_on: bool,
    rendering: RenderingReport,
    restarts: RestartReport,
    output: Output,
    counters: Counters,
    granted: Option<GrantedBuffer>,
    bad_input: Throttle,
    jumps: Throttle,
}

impl Stage {
    /// The stage of `node`.
    ///
    /// # Errors
    /// When a parameter is out of its range, or a publisher or subscription cannot be created.
    pub fn new(node: &Node, parameters: &DetectionParameters) -> Result<Self, NodeFailure> {
        let config = &parameters.config;
        let mut detector = Detector::new(config.clone())?;
        detector.set_colour_from_depth(&pose_from_vector(&parameters.colour_from_depth))?;
        Ok(Self {
            extrinsics: ExtrinsicsCheck::new(parameters, detector.mounts(), node.counters())?,
            camera: Camera::new(parameters, &detector, node.counters())?,
            camera_refused: None,
            scanner_frame: SensorFrame::default(),
            camera_frame: SensorFrame::default(),
            detector,
            matcher: match parameters.pose_source {
                PoseInput::Tf => Matcher::without_poses(config),
                _ => Matcher::new(config),
            },
            colours: Colours::new(parameters, node.takes_every_cycle(), node.counters()),
            transforms: Transforms::new(node, parameters)?,
            unlocated: TransformWait::new(config.max_wait_s, config.max_waiting_clouds),
            backlog: node.max_waiting_cycles().map(Backlog::new),
            may_go_on: false,
            rendering: RenderingReport::new(node.counters(), Throttle::for_warnings()),
            restarts: RestartReport::new(config, node.counters(), Throttle::for_warnings()),
            output: Output::new(node, &config.pipeline.rig.rig_frame_id)?,
            counters: node.counters(),
            granted: node.granted_buffer(),
            bad_input: Throttle::for_warnings(),
            jumps: Throttle::for_warnings(),
            inputs: Inputs::subscribe(node, parameters)?,
        })
    }

    /// Applies changed parameters, of those that may change.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub(super) fn change(&mut self, parameters: &DetectionParameters) -> Result<(), NodeFailure> {
        self.extrinsics =
            ExtrinsicsCheck::new(parameters, self.detector.mounts(), self.counters.clone())?;
        Ok(())
    }

    /// The next message. May be dropped while it waits.
    pub(super) async fn next(&self) -> Arrival {
        match &self.transforms {
            None => self.inputs.next().await,
            // Transforms before scans, since a scan needs them.
            Some(transforms) => tokio::select! {
                biased;
                arrival = transforms.next() => Arrival::Transforms(arrival),
                arrival = self.inputs.next() => arrival,
            },
        }
    }

    fn try_next(&self) -> Option<Arrival> {
        let transforms = self.transforms.as_ref().and_then(Transforms::try_next);
        transforms.map(Arrival::Transforms).or_else(|| self.inputs.try_next())
    }

    /// Takes every message that has arrived.
    pub fn take_waiting(&mut self) {
        while let Some(arrival) = self.try_next() {
            self.take(arrival);
        }
    }

    /// Whether scans wait for their image, pose or transform.
    pub(super) fn is_waiting(&self) -> bool {
        self.matcher.waiting_scans() > 0 || !self.unlocated.is_empty()
    }

    /// Whether there may be more images or clouds: somebody publishes them.
    pub(super) fn has_view_publishers(&self) -> bool {
        self.inputs.has_view_publishers()
    }

    pub(super) fn take(&mut self, arrival: Arrival) {
        self.may_go_on = true;
        let events = match arrival {
            Arrival::Scan(message) => match convert::scan_from_message(&message) {
                Ok(scan) => match self.scanner_frame.take(&scan.frame_id, scan.stamp) {
                    Ok(renamed) => {
                        self.report_renamed(Input::Scan, renamed);
                        self.matcher.push_scan(scan.stamp, scan)
                    }
                    Err(other) => {
                        return self.drop_scan(scan.stamp, ANOTHER_SCANNER, &other.to_string());
                    }
                },
                Err(error) => {
                    let stamp = convert::stamp_from_time(message.header.stamp);
                    return self.drop_scan(stamp, "malformed scan", &error.to_string());
                }
            },
            Arrival::Pose(message) => match self.pose_of_message(&message) {
                Ok(pose) => self.matcher.push_pose(pose),
                Err(error) => return self.refuse(Input::Pose, &error.to_string()),
            },
            Arrival::CameraInfo(message) => {
                match convert::camera_of_image(&message, self.inputs.view_topic()) {
                    Ok(camera) => return self.take_camera(camera),
                    Err(error) => return self.refuse_camera(error.to_string()),
                }
            }
            Arrival::View(message) => {
                self.output.view_taken(message.stamp());
                match self.camera_frame.take(message.frame_id(), message.stamp()) {
                    Ok(renamed) => self.report_renamed(Input::Cloud, renamed),
                    Err(other) => return self.refuse(Input::Cloud, &other.to_string()),
                }
                return self.take_view(message);
            }
            Arrival::Path(message) => match convert::map_path_from_message(&message) {
                Ok(path) => return self.detector.follow_path(path),
                Err(error) => return self.refuse_on(self.inputs.path_topic(), &error.to_string()),
            },
            Arrival::Colour(message) => {
                if let Some(colours) = &mut self.colours {
                    colours.take(message);
                }
                return self.something_came();
            }
            Arrival::ColourInfo(message) => {
                let [images, topic] = self.inputs.colour_topics();
                let colours = self.colours.as_mut();
                let taken = colours.map(|colours| colours.take_camera(&message, images));
                if let Some(Err(error)) = taken {
                    self.refuse_on(topic, &error.to_string());
                }
                return;
            }
            Arrival::Transforms(transforms) => {
                if let Some(known) = &mut self.transforms {
                    known.take(&transforms);
                }
                return self.something_came();
            }
        };
        self.handle(events);
    }

    fn take_view(&mut self, view: ViewMessage) {
        let Some(view) = self.camera.usable(view) else { return };
        let events = self.matcher.push_cloud(view.stamp(), view);
        self.handle(events);
    }

    fn take_camera(&mut self, camera: CameraModel) {
        match self.camera.take(camera, &self.detector) {
            Ok(true) => {}
            Ok(false) => return,
            Err(error) => return self.refuse_camera(error.to_string()),
        }
        if self.inputs.has_raw_images() {
            // A depth image has at least two bytes a pixel.
            let image_bytes = camera.width_px.saturating_mul(camera.height_px).saturating_mul(2);
            let topic = self.inputs.view_topic();
            if let Some(Err(too_large)) =
                self.granted.map(|granted| granted.check(topic, image_bytes))
            {
                tracing::warn!("{too_large}");
            }
        }
        for view in self.camera.take_uncalibrated() {
            self.take_view(view);
        }
    }

    /// The clock was set back to `now`: data with later stamps belong to the run before.
    pub(super) fn set_back(&mut self, now: Stamp) {
        // If the stamps have shown it already, there is nothing more to do.
        if let Some(events) = self.matcher.set_back(now) {
            tracing::warn!("the time of /clock jumped back: the node is reset");
            self.camera.drop_uncalibrated();
            self.handle(events);
            self.forget();
        }
    }

    /// Drops waiting messages, observations, and the camera's calibration unless it is of a file. Static transforms stay: they
    /// are published once.
    pub(super) fn reset(&mut self) {
        self.matcher.flush();
        self.start_anew();
        self.camera.reset();
        self.forget();
    }

    /// Forgets the observations of earlier cycles, and drops cycles that wait for a transform of the time before.
    fn forget(&mut self) {
        for matched in self.start_anew() {
            let reason = "the time jumped back before its transform was received";
            self.drop_scan(matched.scan_stamp, WAITING_FOR_TRANSFORM, reason);
        }
        self.detector.forget();
        if let Some(colours) = &mut self.colours {
            colours.forget();
        }
        if let Some(check) = &mut self.extrinsics {
            check.forget();
        }
        if let Some(transforms) = &mut self.transforms {
            transforms.forget_timed();
        }
    }

    /// Drops the waiting scans: there is no more input.
    pub fn give_up_waiting(&mut self) {
        let events = self.matcher.flush();
        self.handle(events);
        while let Some((_, matched)) = self.pop() {
            match self.locate(&matched) {
                Ok(pose) => self.cycle(&matched, &pose),
                Err(error) => self.drop_unlocated(&matched, error.as_ref()),
            }
        }
    }

    fn handle(&mut self, events: Vec<MatchEvent<Scan, ViewMessage>>) {
        self.handle_each(events);
        self.drop_superseded();
    }

    fn handle_each(&mut self, events: Vec<MatchEvent<Scan, ViewMessage>>) {
        for event in events {
            match event {
                MatchEvent::Matched(matched) => {
                    self.unlocated.push(matched.scan_stamp, matched);
                    if self.backlog.is_none() {
                        self.process_matched();
                    }
                }
                MatchEvent::Dropped(dropped) => {
                    let cause = dropped.of_inputs(&self.missing_topics(&dropped));
                    let reason = format!("{cause}; {}", dropped.cause);
                    self.drop_scan(dropped.stamp, &cause, &reason);
                }
                MatchEvent::Ignored { input: Input::Scan, stamp, .. } => {
                    let reason = "its stamp is not later than that of the previous scan";
                    self.drop_scan(stamp, "scan out of order", reason);
                }
                MatchEvent::Ignored { input, stamp, latest } => {
                    let back_s = latest.seconds_since(stamp);
                    self.refuse(
                        input,
                        &format!("its stamp lies {back_s:.3} s before the last one"),
                    );
                }
                MatchEvent::PoseRefused(error) => self.refuse(Input::Pose, &error.to_string()),
                MatchEvent::PoseFrameChanged { from, to } => tracing::warn!(
                    "{}: the frame changed from {from} to {to}; a map begun in {from} cannot go on: \
                     restart reconstruction, or let the pose source keep its frame",
                    self.inputs.topic(Input::Pose)
                ),
                MatchEvent::ClockJumpedBack { input, from, to } => {
                    tracing::warn!(
                        "the stamps of {} jumped back by {:.3} s: the node is reset",
                        self.inputs.topic(input),
                        from.seconds_since(to)
                    );
                    self.forget();
                }
            }
        }
    }

    fn pose_of_message(&self, message: &PoseMessage) -> Result<StampedPose, UnusablePoseMessage> {
        match &self.transforms {
            Some(transforms) => transforms.pose_of_message(message),
            None => pose_of_message(message, None),
        }
    }

    fn cycle(&mut self, matched: &Matched<Scan, ViewMessage>, pose: &StampedPose) {
        let mut timer = StepTimer::start();
        match node_shell::caught(|| self.detect(matched, pose, &mut timer)) {
            Ok(Ok(detected)) => {
                self.rendering.take(self.inputs.view_topic(), detected.statistics.not_pinhole);
                let topic = self.inputs.topic(Input::Scan);
                self.restarts.take(topic, detected.statistics.window_restarted);
                if let Some(jump) = detected.statistics.pose_jump {
                    self.report_jump(jump);
                }
                let superseded = self.backlog.as_ref().map_or(0, Backlog::dropped);
                self.output.publish(detected, &self.inputs, &mut timer, superseded);
            }
            Ok(Err(error)) => {
                let reason = format!("{}: {error}", self.inputs.view_topic());
                self.drop_scan(matched.scan_stamp, "detection failed", &reason);
            }
            Err(panicked) => {
                // What the step left half done is dropped.
                self.forget();
                self.drop_scan(matched.scan_stamp, Panicked::CAUSE, &panicked.to_string());
            }
        }
    }

    /// The pose of the rig in a matched cycle, and the mounts of its sensors brought up to date, as far as tf gives them.
    fn locate(&mut self, matched: &Matched<Scan, ViewMessage>) -> Result<StampedPose, NodeFailure> {
        let mut by_tf = None;
        if let Some(transforms) = &mut self.transforms {
            let frames = frames_of(matched);
            if let Some(changed) = transforms.changed_mounts(frames)? {
                let mounts = &changed.mounts;
                if changed.by_joint {
                    self.detector.follow_mounts(mounts)?;
                } else {
                    self.detector.mount(mounts)?;
                }
                self.camera.mount(&self.detector);
                transforms.set_in_use(&changed, frames);
                if let Some(check) = &mut self.extrinsics {
                    check.mount(mounts);
                }
            }
            by_tf = transforms.pose_at(matched.cloud_stamp)?;
        }
        by_tf.or_else(|| matched.pose.clone()).ok_or_else(|| "the cycle has no pose".into())
    }
}
