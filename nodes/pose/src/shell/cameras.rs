//! From messages to the rectified images of one camera.

use geometry::{CameraModel, DepthImage, Stamp, pose_from_vector};
use msgs::convert;
use msgs::sensor_msgs::Image;
use nalgebra::Isometry3;
use node_shell::NodeFailure;

use super::parameters::{DepthSource, PoseParameters};
use crate::image::{DepthRegistration, GrayImage, RawImage, Rectification, gray_from_raw};

/// The calibrations, and what follows from them.
#[derive(Clone, Debug)]
pub(super) struct Cameras {
    source: DepthSource,
    color_from_depth: Isometry3<f64>,
    color: Option<Color>,
    depth: Option<CameraModel>,
    registration: Option<DepthRegistration>,
}

/// The colour camera.
#[derive(Clone, Debug)]
struct Color {
    model: CameraModel,
    /// The same without distortion.
    rectified: CameraModel,
    rectification: Option<Rectification>,
}

/// A pair of images as the tracker takes it.
#[derive(Clone, Debug)]
pub(super) struct RectifiedPair {
    pub(super) gray: GrayImage,
    pub(super) depth: DepthImage,
    pub(super) camera: CameraModel,
}

impl Cameras {
    pub(super) fn new(parameters: &PoseParameters) -> Self {
        Self {
            source: parameters.depth,
            color_from_depth: pose_from_vector(&parameters.color_from_depth),
            color: None,
            depth: None,
            registration: None,
        }
    }

    /// Whether the colour camera is.
    pub(super) fn color_is_known(&self) -> bool {
        self.color.is_some()
    }

    /// Whether pairs can be rectified.
    pub(super) fn are_known(&self) -> bool {
        self.color_is_known() && (self.source == DepthSource::Registered || self.depth.is_some())
    }

    /// Takes the calibration of the colour camera; most come again and again.
    pub(super) fn take_color(&mut self, model: CameraModel) -> Result<(), NodeFailure> {
        if self.color.as_ref().is_some_and(|known| known.model == model) {
            return Ok(());
        }
        model.validate()?;
        let rectification =
            if model.distortion.is_none() { None } else { Some(Rectification::new(&model)?) };
        let rectified = rectification.as_ref().map_or(model, |rectified| *rectified.target());
        self.color = Some(Color { model, rectified, rectification });
        self.registration = None;
        Ok(())
    }

    /// Takes the calibration of the depth camera.
    pub(super) fn take_depth(&mut self, model: CameraModel) -> Result<(), NodeFailure> {
        if self.depth != Some(model) {
            model.validate()?;
            self.depth = Some(model);
            self.registration = None;
        }
        Ok(())
    }

    /// Why the depth images may not be registered, although they are taken as such: the driver says that another camera has
    /// taken them. Some drivers register them and leave the name, so that this is no error.
    pub(super) fn registration_doubt(&self, color: &Image, depth: &Image) -> Option<String> {
        let (color, depth) = (&color.header.frame_id, &depth.header.frame_id);
        let is_doubtful = self.source == DepthSource::Registered
            && !color.is_empty()
            && !depth.is_empty()
            && color != depth;
        is_doubtful.then(|| {
            format!(
                "the depth images are in {depth:?} and the colour images in {color:?}, but depth is \"registered\": unless the \
                 driver has registered them and left the name, have it do so (align_depth of a RealSense), or set depth to \
                 \"raw\""
            )
        })
    }

    /// The pair as the rectified colour camera would have taken it.
    pub(super) fn rectified(
        &mut self,
        stamp: Stamp,
        color: &Image,
        depth: &Image,
    ) -> Result<RectifiedPair, NodeFailure> {
        let Some(Color { rectified, rectification, .. }) = &self.color else {
            return Err("the colour camera has no calibration".into());
        };
        let gray = gray(color)?;
        let gray = match rectification {
            Some(rectification) => rectification.rectify(&gray)?,
            None => gray,
        };
        let mut depth = convert::depth_from_message(depth)?;
        depth = match (self.source, self.depth) {
            (DepthSource::Registered, _) => match rectification {
                Some(rectification) => rectification.rectify_depth(&depth)?,
                None => depth,
            },
            (DepthSource::Raw, Some(model)) => {
                if self.registration.is_none() {
                    let registration =
                        DepthRegistration::new(&model, rectified, &self.color_from_depth)?;
                    self.registration = Some(registration);
                }
                let registration = self.registration.as_ref().ok_or("no registration")?;
                registration.register(&depth, &color.header.frame_id)?
            }
            (DepthSource::Raw, None) => return Err("the depth camera has no calibration".into()),
        };
        let size_px = (gray.width_px(), gray.height_px());
        for (what, found_px) in
            [("colour", size_px), ("depth", (depth.width_px(), depth.height_px()))]
        {
            let wanted_px = (rectified.width_px, rectified.height_px);
            if found_px != wanted_px {
                return Err(format!(
                    "the {what} image has {} x {} pixels, and the camera's calibration is for {} x {}",
                    found_px.0, found_px.1, wanted_px.0, wanted_px.1
                )
                .into());
            }
        }
        depth.stamp = stamp;
        Ok(RectifiedPair { gray, depth, camera: *rectified })
    }
}

fn gray(message: &Image) -> Result<GrayImage, NodeFailure> {
    Ok(gray_from_raw(&RawImage {
        width_px: message.width as usize,
        height_px: message.height as usize,
        encoding: message.encoding.parse()?,
        is_big_endian: message.is_bigendian != 0,
        step_bytes: message.step as usize,
        data: &message.data,
    })?)
}
