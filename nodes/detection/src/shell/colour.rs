//! The colours of the cycles: of the colour camera, or of the points themselves.

mod inputs;

use std::sync::Arc;

use geometry::{
    CameraModel, ColourImage, ColourRegistration, DepthFrame, Stamp, pose_from_vector, seen_colour,
};
use msgs::convert;
use msgs::sensor_msgs::{CameraInfo, PointCloud2};
use nalgebra::Isometry3;
use node_shell::{Counters, NodeFailure};

use super::{ColourInput, DetectionParameters};
use crate::colour_images::{ColourChoice, ColourImages};
pub(super) use inputs::{ColourInputs, ColourMessage};

/// The condition's name on `/diagnostics`.
const CONDITION: &str = "colour";

/// The colours of the cycles.
pub(super) struct Colours {
    source: ColourInput,
    /// Whether each cycle counts, so that one waits for its image however long the camera has sent none.
    takes_every_cycle: bool,
    images: ColourImages<ColourMessage>,
    camera: Option<CameraModel>,
    colour_from_depth: Isometry3<f64>,
    registration: Option<ColourRegistration>,
    counters: Counters,
    cycles_with: u64,
    cycles_without: u64,
}

/// Why a cycle has no colours though there is a colour camera.
#[derive(Debug, thiserror::Error)]
pub(super) enum NoColours {
    /// No image is near.
    #[error("no image within {max_offset_s} s of the depth image")]
    NoImage {
        /// The bound.
        max_offset_s: f64,
    },
    /// The camera has no calibration.
    #[error("no calibration of the colour camera on rgb/camera_info")]
    NoCalibration,
    /// The message cannot be used.
    #[error("{0}")]
    Unusable(NodeFailure),
}

impl Colours {
    /// `None` where there are to be no colours, or the method has no use for them.
    pub(super) fn new(
        parameters: &DetectionParameters,
        takes_every_cycle: bool,
        counters: Counters,
    ) -> Option<Self> {
        let source = parameters.colour_source()?;
        let most = parameters.config.max_waiting_clouds;
        Some(Self {
            source,
            takes_every_cycle,
            images: ColourImages::new(parameters.max_colour_offset_s, most),
            camera: None,
            colour_from_depth: pose_from_vector(&parameters.colour_from_depth),
            registration: None,
            counters,
            cycles_with: 0,
            cycles_without: 0,
        })
    }

    /// Takes an image; one that is not later than the last one is left out.
    pub(super) fn take(&mut self, message: ColourMessage) {
        self.images.push(message.stamp(), message);
    }

    /// Takes the calibration of the camera of the images on a topic; most come again and again.
    ///
    /// # Errors
    /// When it is none.
    pub(super) fn take_camera(
        &mut self,
        message: &CameraInfo,
        image_topic: &str,
    ) -> Result<(), NodeFailure> {
        let camera = convert::camera_of_image(message, image_topic)?;
        camera.validate()?;
        if self.camera != Some(camera) {
            self.camera = Some(camera);
            self.registration = None;
        }
        Ok(())
    }

    /// Whether the cycle of a depth image is to wait for its colour image. `is_last` says that no later cycle is complete.
    pub(super) fn is_awaited(&mut self, depth: Stamp, is_last: bool) -> bool {
        match self.source {
            ColourInput::Raw | ColourInput::Compressed => match self.images.choose(depth) {
                ColourChoice::Settled(_) => false,
                ColourChoice::Open { is_alive, .. } => {
                    self.takes_every_cycle || (is_alive && is_last)
                }
            },
            ColourInput::Cloud | ColourInput::None => false,
        }
    }

    /// The colours of the pixels of a cycle's depth image, by the colour camera; `None` where they come from the points.
    ///
    /// # Errors
    /// When there are none.
    pub(super) fn of_camera(
        &mut self,
        frame: &DepthFrame,
    ) -> Option<Result<Vec<[u8; 3]>, NoColours>> {
        let is_of_camera = matches!(self.source, ColourInput::Raw | ColourInput::Compressed);
        is_of_camera.then(|| self.looked_up(frame))
    }

    fn looked_up(&mut self, frame: &DepthFrame) -> Result<Vec<[u8; 3]>, NoColours> {
        let (image, unusable) = (frame.image(), |error: NodeFailure| NoColours::Unusable(error));
        let message = self.images.choose(image.stamp).image();
        let max_offset_s = self.images.max_offset_s();
        let message = message.ok_or(NoColours::NoImage { max_offset_s })?;
        let camera = self.camera.ok_or(NoColours::NoCalibration)?;
        let colour: ColourImage = message.image().map_err(|error| unusable(error.into()))?;
        let known = self.registration.take().filter(|known| known.is_of(frame.camera(), &camera));
        let registration = match known {
            Some(known) => known,
            None => ColourRegistration::new(frame.rays(), &camera, &self.colour_from_depth)
                .map_err(|error| unusable(error.into()))?,
        };
        let colours = registration.colours(&colour, image);
        self.registration = Some(registration);
        colours.map_err(|error| unusable(error.into()))
    }

    /// The colours of the pixels by the points that the image was made of; `None` where these have none. `has_pixels` says that
    /// each point is a pixel.
    ///
    /// # Errors
    /// When the message is malformed.
    pub(super) fn of_points(
        &self,
        message: &Arc<PointCloud2>,
        frame: &DepthFrame,
        has_pixels: bool,
    ) -> Result<Option<Vec<[u8; 3]>>, NodeFailure> {
        if self.source != ColourInput::Cloud {
            return Ok(None);
        }
        let Some(colours) = convert::colours_from_cloud_message(message)? else { return Ok(None) };
        if has_pixels && colours.len() == frame.image().pixels().len() {
            return Ok(Some(colours.into_iter().map(seen_colour).collect()));
        }
        let points = convert::coloured_cloud_from_message(message)?;
        let colours = points.colours.into_iter().map(seen_colour);
        Ok(Some(frame.colours_of_points(points.cloud.points_m.iter().zip(colours))))
    }

    /// Counts a cycle, with its colours or without.
    pub(super) fn note(&mut self, outcome: Result<(), &NoColours>) {
        match outcome {
            Ok(()) => self.cycles_with += 1,
            Err(_) => self.cycles_without += 1,
        }
        let counts = [
            ("cycles_with_colour", self.cycles_with),
            ("cycles_without_colour", self.cycles_without),
        ];
        self.counters.note_counts(&counts);
        let text = match outcome {
            Ok(()) => "the cycles have colours".to_owned(),
            Err(reason) => format!("the last cycle has no colours: {reason}"),
        };
        self.counters.note_condition(CONDITION, &text, outcome.is_err());
    }

    /// Forgets the images, as after a jump of the clock.
    pub(super) fn forget(&mut self) {
        self.images.clear();
    }
}
