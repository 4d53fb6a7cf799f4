//! From a range and an azimuth to a point: the equations of the HDL-64E's user's manual, which those of the other
//! models are a part of.

use nalgebra::Point3;

use super::calibration::LaserCalibration;

/// A laser with what its calibration comes to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Laser {
    sin_elevation: f64,
    cos_elevation: f64,
    /// Counterclockwise.
    rotation_deg: f64,
    range_offset_m: f64,
    /// Beside `range_offset_m`, near by, along x and y; `None` without a two-point calibration.
    near_m: Option<[f64; 2]>,
    height_m: f64,
    horizontal_offset_m: f64,
}

/// Where the two points of the calibration are: near by along x and y, and far off (the manual's appendix F).
const NEAR_M: [f64; 2] = [2.4, 1.93];
const FAR_M: f64 = 25.04;

impl Laser {
    pub(super) fn new(calibration: &LaserCalibration) -> Self {
        let (sin_elevation, cos_elevation) = calibration.elevation_deg.to_radians().sin_cos();
        let near_m = calibration.near_range_offset_m;
        Self {
            sin_elevation,
            cos_elevation,
            rotation_deg: calibration.rotation_deg,
            range_offset_m: calibration.range_offset_m,
            near_m: (near_m != [0.0; 2])
                .then(|| near_m.map(|offset_m| offset_m - calibration.range_offset_m)),
            height_m: calibration.height_m,
            horizontal_offset_m: calibration.horizontal_offset_m,
        }
    }

    /// Added to the range in the packet.
    pub(super) fn range_offset_m(&self) -> f64 {
        self.range_offset_m
    }

    /// The point at a range as in the packet, x forward, y left, z up. `head_deg` is where the head looks,
    /// clockwise from forward.
    ///
    /// The two-point calibration corrects x and y each for itself, up to the far point; of the height, which the manual
    /// leaves open, it is the mean of the two.
    pub(super) fn point_m(&self, raw_range_m: f64, head_deg: f64) -> Point3<f32> {
        let range_m = raw_range_m + self.range_offset_m;
        let (sin, cos) = (head_deg - self.rotation_deg).to_radians().sin_cos();
        let right_m =
            |range_m: f64| range_m * self.cos_elevation * sin - self.horizontal_offset_m * cos;
        let forward_m =
            |range_m: f64| range_m * self.cos_elevation * cos + self.horizontal_offset_m * sin;
        let [to_right_m, to_front_m] = match self.near_m {
            Some([near_x_m, near_y_m]) if raw_range_m <= FAR_M => {
                let corrected_m = |near_m: f64, at_m: f64, distance_m: f64| {
                    range_m + near_m * (FAR_M - distance_m.abs()) / (FAR_M - at_m)
                };
                [
                    corrected_m(near_x_m, NEAR_M[0], right_m(range_m)),
                    corrected_m(near_y_m, NEAR_M[1], forward_m(range_m)),
                ]
            }
            _ => [range_m; 2],
        };
        let up_m = 0.5 * (to_right_m + to_front_m) * self.sin_elevation + self.height_m;
        let point_m = [forward_m(to_front_m), -right_m(to_right_m), up_m];
        Point3::from(point_m.map(|value_m| value_m as f32))
    }
}
