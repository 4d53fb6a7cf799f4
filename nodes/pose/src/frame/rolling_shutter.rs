//! Images whose rows were taken one after the other, as if they had been taken at once.
//!
//! The sensors of cheap cameras are read row by row over most of the time between two images. While the camera turns by a
//! radian a second an image is skewed by 15 pixels; a pose that is measured by it is biased towards the part of the image that has
//! more features. (Kerl, Stueckler and Cremers 2015, "Dense continuous-time tracking and mapping with rolling shutter
//! RGB-D cameras", have the same model for dense odometry.)

use geometry::CameraModel;
use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector3};

use super::Frame;

/// How fast a camera moves, in its own frame.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Twist {
    /// The velocity of the static scene: the motion of the map's points in the camera frame at its origin.
    pub shift_m_per_s: Vector3<f64>,
    /// How fast they turn about the camera.
    pub turn_rad_per_s: Vector3<f64>,
}

impl Twist {
    /// The motion from one pose to the next one in a time.
    #[must_use]
    pub fn between(
        camera_from_map: &Isometry3<f64>,
        next_camera_from_map: &Isometry3<f64>,
        elapsed_s: f64,
    ) -> Self {
        let motion = next_camera_from_map * camera_from_map.inverse();
        Self {
            shift_m_per_s: motion.translation.vector / elapsed_s,
            turn_rad_per_s: motion.rotation.scaled_axis() / elapsed_s,
        }
    }

    /// Where the map's points have come to after a time, to first order in the shift.
    fn after(&self, time_s: f64) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(time_s * self.shift_m_per_s),
            UnitQuaternion::from_scaled_axis(time_s * self.turn_rad_per_s),
        )
    }
}

impl Frame {
    /// The features as a camera would see them that takes all rows at the moment of the middle one. The rows of the image
    /// were read from the top to the bottom within `readout_s`.
    ///
    /// Features without depth are only rotated.
    #[must_use]
    pub fn at_middle_row(&self, twist: &Twist, readout_s: f64, camera: &CameraModel) -> Self {
        let mut frame = self.clone();
        // Taken by this much after the middle row, seen from where the middle row was taken.
        let back = |row_px: f64| {
            let after_s = (row_px / camera.height_px as f64 - 0.5) * readout_s;
            twist.after(-after_s)
        };
        for (corner, depth) in frame.corners.iter_mut().zip(&mut frame.corner_depths) {
            let pixel = corner.pixel.cast::<f64>();
            let Some(ray) = camera.ray(&pixel) else { continue };
            let moved = moved(ray.push(1.0), depth.map(|depth| depth.depth_m), &back(pixel.y));
            let Some(pixel) = camera.project(&moved) else { continue };
            corner.pixel = pixel.cast();
            if let Some(depth) = depth {
                depth.depth_m = moved.z;
            }
        }
        for (line, in_space) in frame.lines.iter_mut().zip(&mut frame.lines_in_space) {
            let depths_m = in_space.map(|line| [line.start_m.z, line.end_m.z]);
            let ends = [&mut line.segment.start_px, &mut line.segment.end_px];
            for (end, which) in ends.into_iter().zip([0, 1]) {
                let pixel = Point2::from(end.map(f64::from));
                let Some(ray) = camera.ray(&pixel) else { continue };
                let depth_m = depths_m.map(|depths_m| depths_m[which]);
                let moved = moved(ray.push(1.0), depth_m, &back(pixel.y));
                let Some(pixel) = camera.project(&moved) else { continue };
                *end = [pixel.x as f32, pixel.y as f32];
            }
            if let Some(line) = in_space {
                for end in [&mut line.start_m, &mut line.end_m] {
                    let Some(pixel) = camera.project(end) else { continue };
                    *end = back(pixel.y) * *end;
                }
            }
        }
        frame
    }
}

/// Where a ray leads that began at another time, as far as it has an end.
fn moved(ray: Vector3<f64>, depth_m: Option<f64>, motion: &Isometry3<f64>) -> Point3<f64> {
    match depth_m {
        Some(depth_m) => motion * Point3::from(ray * depth_m),
        None => Point3::from(motion.rotation * ray),
    }
}
