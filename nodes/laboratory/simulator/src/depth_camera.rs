//! The model of a depth camera.

use std::f64::consts::FRAC_PI_2;

use geometry::{CameraModel, Distortion};
use serde::{Deserialize, Serialize};

use crate::{DepthEncoding, NoReturn, StampError};

/// A depth camera that triangulates a projected pattern, as the first Kinect does.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DepthCamera {
    /// The pose of the optical frame in the rig: `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]`.
    pub rig_from_camera: [f64; 6],
    /// The optical frame that images are stamped with.
    pub frame_id: String,
    /// Size and intrinsics, without distortion.
    pub camera: CameraModel,
    /// Images a second.
    pub rate_hz: f64,
    /// When the first image is taken, in seconds since the start.
    pub first_image_s: f64,
    /// The least measurable depth.
    pub depth_min_m: f64,
    /// The largest measurable depth; at most 65.535 m, the largest depth of a 16-bit image.
    pub depth_max_m: f64,
    /// The depth step per disparity step at 1 m: the depth `z` of disparity `n` is `1 / (n * this)`, so
    /// that neighbouring depths are `this * z^2` apart. In 1/m.
    pub disparity_step_per_m: f64,
    /// Standard deviation of the measured disparity in such steps, rounding included.
    pub disparity_noise_steps: f64,
    /// The distance of the projector to the right of the camera: what it cannot illuminate is in shadow.
    pub projector_baseline_m: f64,
    /// Columns at the right edge that are never measured.
    pub dead_columns_px: usize,
    /// The share of pixels that fail at random.
    pub dropout_ratio: f64,
    /// The least reflectivity of a measurable target at 1 m and normal incidence.
    pub min_signal: f64,
    /// How its images are written.
    pub encoding: DepthEncoding,
    /// The depth of a pixel in metres without a measurement; in millimetres it is 0.
    pub no_return: NoReturn,
    /// The errors of its stamps.
    pub stamps: StampError,
}

impl Default for DepthCamera {
    /// The camera of Rec-HV.
    fn default() -> Self {
        Self::kinect_v1()
    }
}

impl DepthCamera {
    /// A Kinect v1 with `freenect_camera`: frame `camera_depth_optical_frame`, 640 x 480 at 30 Hz,
    /// millimetres in 16 bits with 0 for nothing measured.
    ///
    /// - Intrinsics are the driver's defaults, f = 575.8157 px, which see 58 x 45 degrees; nominal are
    ///   57 x 43 (Rec-HV 3.4.1). Annex 2 of Rec-HV calibrates another camera of the same make with f = 522.
    /// - Depth steps and noise are those of Khoshelham and Elberink, "Accuracy and Resolution of Kinect Depth
    ///   Data for Indoor Mapping Applications" (2012): m/(f b) = 2.85e-5 1/cm and half a step of
    ///   deviation, hence sigma_z = 1.43e-3 z^2 (3.6 cm at 5 m) and steps of 2.85e-3 z^2.
    /// - The projector stands 7.5 cm right of the camera, so shadows lie left of what throws them; the
    ///   correlation window leaves the last 8 columns empty.
    /// - The first image is taken half a period after the start, since nothing ties the camera's clock to
    ///   the scanner's or to the pose's.
    #[must_use]
    pub fn kinect_v1() -> Self {
        let focal_px = 575.815_734_863_281_2;
        Self {
            rig_from_camera: [0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2],
            frame_id: "camera_depth_optical_frame".to_owned(),
            camera: CameraModel {
                width_px: 640,
                height_px: 480,
                fx_px: focal_px,
                fy_px: focal_px,
                cx_px: 314.5,
                cy_px: 235.5,
                distortion: Distortion::None,
            },
            rate_hz: 30.0,
            first_image_s: 1.0 / 60.0,
            depth_min_m: 0.5,
            depth_max_m: 6.0,
            disparity_step_per_m: 2.85e-3,
            disparity_noise_steps: 0.5,
            projector_baseline_m: 0.075,
            dead_columns_px: 8,
            dropout_ratio: 0.001,
            min_signal: 0.01,
            encoding: DepthEncoding::Millimetres,
            no_return: NoReturn::Nan,
            stamps: StampError::default(),
        }
    }

    /// The same camera with another number of pixels over the same field of view. Depth errors stay the same: the
    /// driver decimates the image, not the measurement.
    #[must_use]
    pub fn with_size(mut self, width_px: usize, height_px: usize) -> Self {
        let camera = &mut self.camera;
        let columns = width_px as f64 / camera.width_px.max(1) as f64;
        let rows = height_px as f64 / camera.height_px.max(1) as f64;
        self.dead_columns_px = (self.dead_columns_px as f64 * columns).round() as usize;
        // A pixel's centre has whole coordinates, so the image begins half a pixel before 0.
        *camera = CameraModel {
            width_px,
            height_px,
            fx_px: camera.fx_px * columns,
            fy_px: camera.fy_px * rows,
            cx_px: (camera.cx_px + 0.5) * columns - 0.5,
            cy_px: (camera.cy_px + 0.5) * rows - 0.5,
            distortion: camera.distortion,
        };
        self
    }
}
