//! The model of a colour camera.

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
    /// The optical frame of a camera that has its own pose.
    pub frame_id: String,
    /// The delay of an image after the depth image, at most half the depth camera's period.
    pub delay_s: f64,
    /// The exposure time, centred on the stamp: with `sub_exposures` the length of the blur.
    pub exposure_s: f64,
    /// The number of renderings averaged over the exposure; 1 for images without motion blur.
    pub sub_exposures: usize,
    /// Rays per pixel along each axis: 1 for hard edges, more for the smooth edges of a real lens and sensor.
    pub supersampling: usize,
    /// A factor on the brightness; beyond 1 the sensor is saturated.
    pub brightness: f64,
    /// Electrons in a pixel that is just white; shot noise is the square root of their number.
    pub white_electrons: f64,
    /// Standard deviation of the read noise in electrons.
    pub read_noise_electrons: f64,
}

impl Default for ColourCamera {
    /// A sensor like the Kinect's in a bright room.
    fn default() -> Self {
        Self {
            rig_from_camera: None,
            camera: None,
            frame_id: "camera_rgb_optical_frame".to_owned(),
            delay_s: 0.0,
            // Half of the period at 30 images a second.
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
    /// Without sensor noise.
    #[must_use]
    pub fn without_noise(self) -> Self {
        Self { white_electrons: 1e12, read_noise_electrons: 0.0, ..self }
    }

    /// In a dark room: few electrons, amplified by the driver's gain. A standard deviation of about 9 of 255 at mid
    /// gray.
    #[must_use]
    pub fn in_low_light(self) -> Self {
        Self { white_electrons: 160.0, read_noise_electrons: 5.0, ..self }
    }

    /// With motion blur over this exposure.
    #[must_use]
    pub fn with_motion_blur(self, exposure_s: f64, sub_exposures: usize) -> Self {
        Self { exposure_s, sub_exposures, ..self }
    }

    /// Size and intrinsics, for this depth camera.
    #[must_use]
    pub fn model(&self, depth: &DepthCamera) -> CameraModel {
        self.camera.unwrap_or(depth.camera)
    }

    /// The pose in the rig, for this depth camera.
    #[must_use]
    pub fn mounting(&self, depth: &DepthCamera) -> [f64; 6] {
        self.rig_from_camera.unwrap_or(depth.rig_from_camera)
    }

    /// The frame of the images, for this depth camera.
    #[must_use]
    pub fn image_frame_id<'a>(&'a self, depth: &'a DepthCamera) -> &'a str {
        if self.rig_from_camera.is_some() { &self.frame_id } else { &depth.frame_id }
    }
}
