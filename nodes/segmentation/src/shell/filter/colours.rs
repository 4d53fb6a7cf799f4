//! The colour images without what moves.
//!
//! What moves is known of depth images: a colour image waits for the one of its own moment, or a later one.

#[cfg(test)]
mod tests;

use std::error::Error;
use std::sync::Arc;

use geometry::{CameraModel, ColourFill, ColourRegistrationError};
use msgs::convert;
use msgs::sensor_msgs::Image;
use node_shell::{Node, NodeFailure, Qos};

use super::calibration::Calibration;
use super::lane::{Lane, Wait, stamp_of};
use super::{Filter, VIEWS_KEPT, VIEWS_SENT};

/// Those that wait: 100 MB of a Kinect's second camera, and half a second at 30 Hz.
const COLOURS_WAITING: usize = 16;
/// A depth image may come so much later than the colour image of its moment, by the stamps of colour images: the period of a slow
/// camera. After that it has stopped.
const LATEST_DEPTH_S: f64 = 0.2;

/// The topics of the colour camera.
pub(super) struct Colours {
    lane: Lane<Image>,
    pub(super) calibration: Calibration,
    fill: ColourFill,
    /// Whether what moves is to be known in them.
    needs_mask: bool,
}

impl Colours {
    /// `depth_wait_s` is how long depth images wait for their cycle.
    pub(super) fn new(
        node: &Node,
        fill: ColourFill,
        depth_wait_s: f64,
    ) -> Result<Self, NodeFailure> {
        let sent = Qos::sensor(VIEWS_SENT);
        let wait = Wait { longest_s: depth_wait_s + LATEST_DEPTH_S, most: COLOURS_WAITING };
        let images = ["rgb/image", "static_rgb/image", "dynamic_rgb/image"];
        let infos = ["rgb/camera_info", "static_rgb/camera_info", "dynamic_rgb/camera_info"];
        Ok(Self {
            lane: Lane::new(node, images, &sent, wait)?,
            calibration: Calibration::new(node, images[0], infos, &sent, wait)?,
            fill,
            needs_mask: false,
        })
    }

    pub(super) fn follow_subscribers(&mut self, node: &Node) -> Result<(), NodeFailure> {
        self.lane.follow_subscribers(node, &Qos::sensor(VIEWS_KEPT), false)?;
        self.calibration.follow_subscribers(node, self.lane.raw.is_subscribed())?;
        let is_static_masked = self.fill == ColourFill::Black && self.lane.is_static_wanted();
        self.needs_mask = is_static_masked || self.lane.is_dynamic_wanted();
        Ok(())
    }

    pub(super) fn needs_mask(&self) -> bool {
        self.needs_mask
    }

    pub(super) async fn next(&self) -> Arc<Image> {
        self.lane.raw.next().await
    }

    pub(super) fn try_next(&self) -> Option<Arc<Image>> {
        self.lane.raw.try_next()
    }

    pub(super) fn clear(&mut self) {
        self.lane.clear();
        self.calibration.clear();
    }
}

impl Filter {
    /// Where the time has jumped back no depth image of before comes any more: what waits for one goes out.
    pub(super) fn take_colour(&mut self, message: Arc<Image>) {
        self.release_colours(self.colours.lane.is_before(&message));
        self.colours.lane.push(message);
    }

    pub(super) fn release_colours(&mut self, is_over: bool) {
        if !self.colours.needs_mask {
            while let Some(message) = self.colours.lane.pop_beyond_room(true) {
                self.colours.calibration.send_with_image(stamp_of(&*message));
                self.colours.lane.pass_on(message);
            }
            return;
        }
        let Some(camera) = self.colours.calibration.camera().copied() else {
            while let Some(message) = self.colours.lane.pop_beyond_room(is_over) {
                self.refuse_uncalibrated("rgb/image", &self.colours.calibration);
                self.colours.calibration.send_with_image(stamp_of(&*message));
                self.colours.lane.pass_on(message);
            }
            return;
        };
        // The depth images that wait for their cycle come before the cycle's own.
        let is_depth_awaited = self.images.is_waiting() || self.points.is_waiting();
        while let Some(message) = self.colours.lane.pop(is_over, |stamp| {
            self.motion.has_depth(stamp) || (!is_depth_awaited && self.motion.has_view(stamp))
        }) {
            self.colours.calibration.send_with_image(stamp_of(&*message));
            if let Err(error) = self.filter_colour(&message, &camera) {
                self.refuse("rgb/image", error.as_ref());
                self.colours.lane.pass_on(message);
            }
        }
    }

    fn filter_colour(
        &mut self,
        message: &Arc<Image>,
        camera: &CameraModel,
    ) -> Result<(), Box<dyn Error>> {
        camera.validate()?;
        let size_px = (message.width as usize, message.height as usize);
        ColourRegistrationError::check_size(size_px, camera)?;
        let stamp = convert::stamp_from_time(message.header.stamp);
        let is_moving = self.motion.colour_pixels(stamp, camera);
        self.note_verdict(is_moving.is_some());
        let is_moving =
            is_moving.unwrap_or_else(|| vec![false; camera.width_px * camera.height_px]);
        let is_untouched = self.colours.fill == ColourFill::None || !is_moving.contains(&true);
        Ok(self.colours.lane.publish(
            message,
            is_untouched,
            || convert::colour_without(message, &is_moving, true),
            || convert::colour_without(message, &is_moving, false),
        )?)
    }
}
