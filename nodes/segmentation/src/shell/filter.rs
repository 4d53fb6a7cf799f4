//! The sensors' own messages without what moves: `static_scan`, `static_depth`, `static_rgb`, `static_points`, and their complements.
//!
//! The raw topics are subscribed to only while somebody wants what is made of them. A message waits for the cycle that decides
//! it, as long as the parameters allow; then it goes out by the nearest cycle there is.

mod calibration;
mod colours;
mod lane;
mod raw_topic;

use std::sync::Arc;

use geometry::{BeamFill, CameraModel, ColourFill, VoxelGrid};
use msgs::convert::{self, ConvertError};
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan, PointCloud2};
use node_shell::{Counters, Node, NodeFailure, Qos, Throttle};

use crate::filter::{MotionFilter, Verdict};
use calibration::Calibration;
use colours::Colours;
use lane::{Lane, Wait, stamp_of};

/// Scans and messages of cameras that may wait.
const SCANS_KEPT: usize = 50;
const VIEWS_KEPT: usize = 10;
/// Those that wait for their cycle, where the parameters let them: two seconds of a camera.
const VIEWS_WAITING: usize = 64;
/// Publishers' depths.
const SCANS_SENT: usize = 10;
const VIEWS_SENT: usize = 5;
/// The condition on /diagnostics.
const CONDITION: &str = "filter";

geometry::parameters! {
    /// The parameters of the filtered topics.
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct FilterParameters {
        /// What a beam of static_scan has that hit something moving: no measurement, or the range of the static surface behind it
        /// where that is known.
        static_scan_fill: BeamFill = BeamFill::Nan;
        /// A scan waits so long for the cycle that decides it, by the stamps of later scans; then static_scan is made of it by
        /// the nearest cycle. Longer than a cycle takes.
        // Three turns of the RPLIDAR A1.
        static_scan_max_wait_s: f64 = 0.5, not_negative;
        /// The same for depth images and clouds. 0: each goes out at once, with what the last cycle found carried on by the
        /// velocities of the tracks. With the period of the scanner and more an image has the verdict of its own cycle.
        static_depth_max_wait_s: f64 = 0.0, not_negative;
        /// What a pixel of static_rgb has that shows something moving.
        static_rgb_fill: ColourFill = ColourFill::Black;
    }
}

/// A raw message that arrived.
pub(super) enum RawArrival {
    Scan(Arc<LaserScan>),
    Image(Arc<Image>),
    CameraInfo(Arc<CameraInfo>),
    Colour(Arc<Image>),
    ColourInfo(Arc<CameraInfo>),
    Points(Arc<PointCloud2>),
}

/// The filtered topics with the raw ones that they are made of.
pub(super) struct Filter {
    motion: MotionFilter,
    fill: BeamFill,
    scans: Lane<LaserScan>,
    images: Lane<Image>,
    points: Lane<PointCloud2>,
    calibration: Calibration,
    colours: Colours,
    counters: Counters,
    bad_input: Throttle,
}

impl Filter {
    pub(super) fn new(
        node: &Node,
        parameters: &FilterParameters,
        grid: VoxelGrid,
    ) -> Result<Self, NodeFailure> {
        let FilterParameters {
            static_scan_max_wait_s,
            static_depth_max_wait_s,
            static_scan_fill,
            static_rgb_fill,
        } = *parameters;
        let sent = Qos::sensor(VIEWS_SENT);
        let view = Wait { longest_s: static_depth_max_wait_s, most: VIEWS_WAITING };
        let scan = Wait { longest_s: static_scan_max_wait_s, most: SCANS_KEPT };
        Ok(Self {
            motion: MotionFilter::new(grid),
            fill: static_scan_fill,
            // Subscribers of either kind match: localisers and mappers differ in what they ask for.
            scans: Lane::new(
                node,
                ["scan", "static_scan", "dynamic_scan"],
                &Qos::reliable(SCANS_SENT),
                scan,
            )?,
            images: Lane::new(
                node,
                ["depth/image", "static_depth/image", "dynamic_depth/image"],
                &sent,
                view,
            )?,
            points: Lane::new(node, ["points", "static_points", "dynamic_points"], &sent, view)?,
            calibration: Calibration::new(
                node,
                "depth/image",
                ["depth/camera_info", "static_depth/camera_info", "dynamic_depth/camera_info"],
                &sent,
                view,
            )?,
            colours: Colours::new(node, static_rgb_fill, static_depth_max_wait_s)?,
            counters: node.counters(),
            bad_input: Throttle::for_warnings(),
        })
    }

    /// Subscribes to the raw topics whose filtered ones are wanted, and to no others.
    pub(super) fn follow_subscribers(&mut self, node: &Node) -> Result<(), NodeFailure> {
        self.colours.follow_subscribers(node)?;
        let needs_depth = self.colours.needs_mask();
        self.motion.keep_for_colours(needs_depth);
        self.scans.follow_subscribers(node, &Qos::sensor(SCANS_KEPT), false)?;
        self.images.follow_subscribers(node, &Qos::sensor(VIEWS_KEPT), needs_depth)?;
        // Cameras that compute their own clouds publish depth images, too: one of both is enough.
        let needs_points = needs_depth && !self.images.raw.has_source();
        self.points.follow_subscribers(node, &Qos::sensor(VIEWS_KEPT), needs_points)?;
        self.calibration.follow_subscribers(node, self.images.raw.is_subscribed())?;
        if !self.is_wanted() {
            self.motion.clear();
        }
        Ok(())
    }

    /// Whether anything is filtered.
    pub(super) fn is_wanted(&self) -> bool {
        self.scans.raw.is_subscribed()
            || self.images.raw.is_subscribed()
            || self.points.raw.is_subscribed()
    }

    /// The next raw message. May be dropped while it waits.
    pub(super) async fn next(&self) -> RawArrival {
        tokio::select! {
            biased;
            message = self.scans.raw.next() => RawArrival::Scan(message),
            message = self.calibration.raw.next() => RawArrival::CameraInfo(message),
            message = self.colours.calibration.raw.next() => RawArrival::ColourInfo(message),
            message = self.images.raw.next() => RawArrival::Image(message),
            message = self.points.raw.next() => RawArrival::Points(message),
            message = self.colours.next() => RawArrival::Colour(message),
        }
    }

    /// Takes every raw message that is here already.
    pub(super) fn take_waiting(&mut self) {
        while let Some(message) = self.scans.raw.try_next() {
            self.take(RawArrival::Scan(message));
        }
        while let Some(message) = self.calibration.raw.try_next() {
            self.take(RawArrival::CameraInfo(message));
        }
        while let Some(message) = self.colours.calibration.raw.try_next() {
            self.take(RawArrival::ColourInfo(message));
        }
        while let Some(message) = self.images.raw.try_next() {
            self.take(RawArrival::Image(message));
        }
        while let Some(message) = self.points.raw.try_next() {
            self.take(RawArrival::Points(message));
        }
        while let Some(message) = self.colours.try_next() {
            self.take(RawArrival::Colour(message));
        }
    }

    pub(super) fn take(&mut self, arrival: RawArrival) {
        match arrival {
            // Where the time has jumped back no cycle of before comes any more: what waits for one goes out.
            RawArrival::Scan(message) => {
                self.release_scans(self.scans.is_before(&message));
                self.scans.push(message);
            }
            RawArrival::Image(message) => {
                self.release_images(self.images.is_before(&message));
                self.images.push(message);
            }
            RawArrival::Points(message) => {
                self.release_points(self.points.is_before(&message));
                self.points.push(message);
            }
            RawArrival::Colour(message) => self.take_colour(message),
            RawArrival::CameraInfo(message) => {
                let taken = self.calibration.take(&message);
                self.note_calibration(self.calibration.raw.name(), taken);
            }
            RawArrival::ColourInfo(message) => {
                let taken = self.colours.calibration.take(&message);
                self.note_calibration(self.colours.calibration.raw.name(), taken);
            }
        }
        self.release(false);
    }

    /// Takes what a cycle found; what waited for it goes out.
    pub(super) fn take_verdict(&mut self, verdict: Verdict) {
        self.motion.take(verdict);
        self.release(false);
    }

    /// There is no more input: what waits goes out.
    pub(super) fn give_up_waiting(&mut self) {
        self.release(true);
        self.calibration.give_up_waiting();
        self.colours.calibration.give_up_waiting();
    }

    /// Forgets the cycles and what waits for one.
    pub(super) fn reset(&mut self) {
        self.motion.clear();
        self.scans.clear();
        self.images.clear();
        self.calibration.clear();
        self.points.clear();
        self.colours.clear();
    }

    /// Sends what is decided, or has waited for too long; everything where there is no more input.
    fn release(&mut self, is_over: bool) {
        self.release_scans(is_over);
        self.release_images(is_over);
        self.release_points(is_over);
        self.release_colours(is_over);
    }

    fn release_scans(&mut self, is_over: bool) {
        while let Some(message) = self.scans.pop(is_over, |stamp| self.motion.has_scan(stamp)) {
            if let Err(error) = self.filter_scan(&message) {
                self.refuse("scan", &error);
                self.scans.pass_on(message);
            }
        }
    }

    fn release_images(&mut self, is_over: bool) {
        let Some(camera) = self.calibration.camera().copied() else {
            // An image without the calibration of its camera waits for that, as long as there is room.
            while let Some(message) = self.images.pop_beyond_room(is_over) {
                self.refuse_uncalibrated("depth/image", &self.calibration);
                self.calibration.send_with_image(stamp_of(&*message));
                self.images.pass_on(message);
            }
            return;
        };
        while let Some(message) = self.images.pop(is_over, |stamp| self.motion.has_view(stamp)) {
            self.calibration.send_with_image(stamp_of(&*message));
            if let Err(error) = self.filter_image(&message, &camera) {
                self.refuse("depth/image", error.as_ref());
                self.images.pass_on(message);
            }
            // Before the next one takes its place as the nearest.
            self.release_colours(false);
        }
    }

    fn release_points(&mut self, is_over: bool) {
        while let Some(message) = self.points.pop(is_over, |stamp| self.motion.has_view(stamp)) {
            if let Err(error) = self.filter_points(&message) {
                self.refuse("points", error.as_ref());
                self.points.pass_on(message);
            }
            self.release_colours(false);
        }
    }

    fn filter_scan(&self, message: &Arc<LaserScan>) -> Result<(), ConvertError> {
        let scan = convert::scan_from_message(message)?;
        let beams = self.motion.beams(&scan);
        self.note_verdict(beams.is_some());
        let beams = beams.unwrap_or_default();
        let is_untouched = beams.is_empty();
        self.scans.publish(
            message,
            is_untouched,
            || Ok(convert::static_scan(message, &beams, self.fill)),
            || Ok(convert::dynamic_scan(message, &beams)),
        )
    }

    fn filter_image(
        &mut self,
        message: &Arc<Image>,
        camera: &CameraModel,
    ) -> Result<(), Box<dyn std::error::Error>> {
        let image = Arc::new(convert::depth_from_message(message)?);
        let is_moving = self.motion.pixels(&image, camera)?;
        self.note_verdict(is_moving.is_some());
        let is_moving = is_moving.unwrap_or_else(|| vec![false; image.pixels().len()]);
        Ok(self.images.publish(
            message,
            !is_moving.contains(&true),
            || convert::depth_without(message, &is_moving, true),
            || convert::depth_without(message, &is_moving, false),
        )?)
    }

    fn filter_points(
        &mut self,
        message: &Arc<PointCloud2>,
    ) -> Result<(), Box<dyn std::error::Error>> {
        let cloud = convert::organised_cloud_from_message(message)?;
        let places = message.width as usize * message.height as usize;
        let is_moving = self.motion.points(&cloud, places);
        self.note_verdict(is_moving.is_some());
        let is_moving = is_moving.unwrap_or_else(|| vec![false; places]);
        Ok(self.points.publish(
            message,
            !is_moving.contains(&true),
            || convert::cloud_without(message, &is_moving, true),
            || convert::cloud_without(message, &is_moving, false),
        )?)
    }

    /// Reports whether there is a cycle near enough.
    fn note_verdict(&self, is_there: bool) {
        let text =
            if is_there { "by cycles" } else { "no cycle is near: messages pass as they are" };
        self.counters.note_condition(CONDITION, text, !is_there);
    }

    fn note_calibration(&self, topic: &str, taken: Result<(), ConvertError>) {
        if let Err(error) = taken {
            self.refuse(topic, &error);
        }
    }

    fn refuse_uncalibrated(&self, topic: &str, calibration: &Calibration) {
        let reason = format!("no calibration has come on {}", calibration.raw.name());
        self.refuse(topic, &reason);
    }

    fn refuse(&self, topic: &str, error: &dyn std::fmt::Display) {
        self.counters.count_drop(&format!("not filtered on {topic}"));
        if let Some(held_back) = self.bad_input.pass() {
            tracing::warn!(
                "{topic}: {error}: it passes as it is ({held_back} more since the last warning)"
            );
        }
    }
}

#[cfg(test)]
mod tests;
