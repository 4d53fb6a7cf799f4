//! The box around the robot itself: what the sensors see in it is the robot, and no part of the scene.

use std::ops::RangeInclusive;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::{CameraModel, DepthImage, DepthPixels, ParameterError, RayTable, parameter};

/// A box in the rig frame in which everything is the robot: its bumper, its arm, the posts before the scanner, what it carries.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RobotBox {
    least_m: Point3<f64>,
    most_m: Point3<f64>,
}

impl RobotBox {
    /// The box of these corners, as parameters have it: `[x_min_m, y_min_m, z_min_m, x_max_m, y_max_m, z_max_m]`. `None` where each minimum
    /// is its maximum, as with zeros: there is no such box.
    ///
    /// # Errors
    /// When a number is not finite, or a minimum is not below its maximum while another is.
    pub fn of_corners(corners_m: &[f64; 6]) -> Result<Option<Self>, ParameterError> {
        let [x, y, z, to_x, to_y, to_z] = *corners_m;
        let axes = [(x, to_x), (y, to_y), (z, to_z)];
        if axes.iter().all(|(least_m, most_m)| least_m == most_m) {
            return Ok(None);
        }
        for (least_m, most_m) in axes {
            let is_extent = least_m.is_finite() && most_m.is_finite() && least_m < most_m;
            let accepted = ("a box, each maximum above its minimum", least_m);
            parameter::check("robot_box_m", accepted, most_m, is_extent)?;
        }
        Ok(Some(Self { least_m: Point3::new(x, y, z), most_m: Point3::new(to_x, to_y, to_z) }))
    }

    /// The corners, as parameters have them.
    #[must_use]
    pub fn corners_m(&self) -> [f64; 6] {
        let Self { least_m, most_m } = self;
        [least_m.x, least_m.y, least_m.z, most_m.x, most_m.y, most_m.z]
    }

    /// Whether a point of the rig is in it.
    #[must_use]
    pub fn contains(&self, in_rig_m: &Point3<f64>) -> bool {
        (0..3).all(|axis| (self.least_m[axis]..=self.most_m[axis]).contains(&in_rig_m[axis]))
    }

    /// The multiples of `step_m` from `from_m` on at which a ray is in it (the slab method: Kay and Kajiya, "Ray tracing complex
    /// scenes", 1986); `None` where it misses it.
    fn along(&self, from_m: &Point3<f64>, step_m: &Vector3<f64>) -> Option<RangeInclusive<f64>> {
        let (mut first, mut last) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let slab_m = self.least_m[axis]..=self.most_m[axis];
            if step_m[axis] == 0.0 {
                if slab_m.contains(&from_m[axis]) {
                    continue;
                }
                return None;
            }
            let [one, other] =
                [slab_m.start(), slab_m.end()].map(|wall_m| (wall_m - from_m[axis]) / step_m[axis]);
            (first, last) = (first.max(one.min(other)), last.min(one.max(other)));
        }
        (first <= last).then_some(first..=last)
    }
}

/// The pixels of a camera in which its robot may be seen.
#[derive(Clone, PartialEq, Debug)]
pub struct RobotPixels {
    camera: CameraModel,
    rig_from_camera: Isometry3<f64>,
    robot: RobotBox,
    /// By rising index.
    pixels: Vec<RobotPixel>,
}

/// A pixel, and between which depths it shows the robot.
#[derive(Clone, Copy, PartialEq, Debug)]
struct RobotPixel {
    index: u32,
    least_m: f32,
    most_m: f32,
}

impl RobotPixels {
    /// Of the camera with these rays and this mount.
    #[must_use]
    pub fn new(robot: &RobotBox, rays: &RayTable, rig_from_camera: &Isometry3<f64>) -> Self {
        let camera_in_rig = rig_from_camera * Point3::origin();
        let mut pixels = Vec::new();
        for (index, row, column) in places(rays.width_px(), rays.height_px()) {
            let Some(ray) = rays.ray(column, row) else { continue };
            let step_m = rig_from_camera * ray.push(1.0).cast::<f64>();
            if let Some(depths_m) = robot.along(&camera_in_rig, &step_m) {
                let (least_m, most_m) = (*depths_m.start() as f32, *depths_m.end() as f32);
                pixels.push(RobotPixel { index, least_m, most_m });
            }
        }
        Self { camera: *rays.camera(), rig_from_camera: *rig_from_camera, robot: *robot, pixels }
    }

    /// Those of last time where they are the same, or else new ones.
    #[must_use]
    pub fn kept_or_new(
        last: Option<Self>,
        robot: &RobotBox,
        rays: &RayTable,
        rig_from_camera: &Isometry3<f64>,
    ) -> Self {
        let is_same = |last: &Self| {
            last.camera == *rays.camera()
                && last.robot == *robot
                && last.rig_from_camera == *rig_from_camera
        };
        last.filter(is_same).unwrap_or_else(|| Self::new(robot, rays, rig_from_camera))
    }

    /// The pixels of an image of the camera that show the robot, ascending.
    pub fn shown_in<'a>(&'a self, image: &'a DepthImage) -> impl Iterator<Item = usize> + 'a {
        let depth_m = |index: usize| match image.pixels() {
            DepthPixels::Millimetres(depths_mm) => {
                depths_mm.get(index).map(|depth_mm| f32::from(*depth_mm) / 1e3)
            }
            DepthPixels::Metres(depths_m) => depths_m.get(index).copied(),
        };
        self.pixels.iter().filter_map(move |pixel| {
            let index = pixel.index as usize;
            let depth_m = depth_m(index).filter(|depth_m| *depth_m > 0.0)?;
            (pixel.least_m <= depth_m && depth_m <= pixel.most_m).then_some(index)
        })
    }
}

/// The index, row and column of each pixel of an image.
fn places(width_px: usize, height_px: usize) -> impl Iterator<Item = (u32, usize, usize)> {
    let places = (0..height_px).flat_map(move |row| (0..width_px).map(move |column| (row, column)));
    (0_u32..).zip(places).map(|(index, (row, column))| (index, row, column))
}

#[cfg(test)]
mod tests;
