//! What a colour camera is like.

use geometry::CameraModel;
use serde::{Deserialize, Serialize};

use crate::DepthCamera;

/// The colour camera beside the depth camera. It takes an image for every depth image.
///
/// By default its images are registered: they are seen from where the depth camera is, with its
/// intrinsics and at its stamps, so that a pixel of both shows the same point.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ColourCamera {
    /// The pose of its optical frame in the rig, `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]`; that of the
    /// depth camera, which is then the frame of the images too, when it is not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rig_from_camera: Option<[f64; 6]>,
    /// Size and intrinsics, without distortion; those of the depth camera when they are not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraModel>,
    /// The optical frame of a camera with a pose of its own.
    pub frame_id: String,
    /// How much later than the depth image an image is taken, at most half a period of it.
    pub delay_s: f64,
    /// How long the shutter is open, around the stamp: with `sub_exposures` the length of the blur.
    pub exposure_s: f64,
    /// Moments within the exposure that are averaged; 1 for images without motion blur.
    pub sub_exposures: usize,
    /// Rays through a pixel along each of its edges: 1 for hard edges, more for what a lens and a sensor make
    /// of them.
    pub supersampling: usize,
    /// A factor on all that is seen; beyond 1 the sensor is saturated.
    pub brightness: f64,
    /// Electrons in a pixel that is just white: their number is uncertain by its square root (shot noise).
    pub white_electrons: f64,
    /// Standard deviation of the electrons that reading adds.
    pub read_noise_electrons: f64,
}

impl Default for ColourCamera {
    /// A sensor of the size of the Kinect's in a bright room.
    fn default() -> Self {
        Self {
            rig_from_camera: None,
            camera: None,
            frame_id: "camera_rgb_optical_frame".to_owned(),
            delay_s: 0.0,
            // Half of what 30 images a second leave.
            exposure_s: 1.0 / 60.0,
            sub_exposures: 1,
            supersampling: 2,
            brightness: 1.0,
            // Pixels of 2.8 um hold some 10,000 electrons.
            white_electrons: 8000.0,
            read_noise_electrons: 8.0,
        }
    }
}

impl ColourCamera {
    /// Without any noise of the sensor.
    #[must_use]
    pub fn without_noise(self) -> Self {
        Self { white_electrons: 1e12, read_noise_electrons: 0.0, ..self }
    }

    /// In a dark room: the driver's gain shows as bright what few electrons tell. A deviation of some 9 of 255
    /// in the shades of mid gray.
    #[must_use]
    pub fn in_low_light(self) -> Self {
        Self { white_electrons: 160.0, read_noise_electrons: 5.0, ..self }
    }

    /// With motion blur over this exposure.
    #[must_use]
    pub fn with_motion_blur(self, exposure_s: f64, sub_exposures: usize) -> Self {
        Self { exposure_s, sub_exposures, ..self }
    }

    /// Size and intrinsics, beside this depth camera.
    #[must_use]
    pub fn model(&self, depth: &DepthCamera) -> CameraModel {
        self.camera.unwrap_or(depth.camera)
    }

    /// The pose in the rig, beside this depth camera.
    #[must_use]
    pub fn mounting(&self, depth: &DepthCamera) -> [f64; 6] {
        self.rig_from_camera.unwrap_or(depth.rig_from_camera)
    }

    /// The frame of the images, beside this depth camera.
    #[must_use]
    pub fn image_frame_id<'a>(&'a self, depth: &'a DepthCamera) -> &'a str {
        if self.rig_from_camera.is_some() { &self.frame_id } else { &depth.frame_id }
    }
}
