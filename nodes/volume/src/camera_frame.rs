//! From the map to the frame of a camera, in single precision.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::projection::{CameraBox, CameraBoxes, LANES};

/// The pose of a camera, as places and cubes of the map need it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraFrame {
    camera_from_map: [[f32; 3]; 3],
    pub(crate) camera_in_map_m: Point3<f64>,
    /// Half the extent of a cube of edge 1 along the camera's axes.
    half: [f32; 3],
}

impl CameraFrame {
    pub(crate) fn new(map_from_camera: &Isometry3<f64>) -> Self {
        let rotation: Matrix3<f64> =
            map_from_camera.rotation.inverse().to_rotation_matrix().into_inner();
        let row = |axis: usize| [0, 1, 2].map(|column| rotation[(axis, column)] as f32);
        let camera_from_map = [row(0), row(1), row(2)];
        let half =
            camera_from_map.map(|row| 0.5 * row.iter().map(|share| share.abs()).sum::<f32>());
        let camera_in_map_m = map_from_camera.translation.vector.into();
        Self { camera_from_map, camera_in_map_m, half }
    }

    /// A point of the map in the camera's frame. The difference is computed in double precision, so that no precision is lost
    /// far from the map's origin.
    #[inline]
    pub(crate) fn in_camera_m(&self, point_in_map: &Point3<f64>) -> [f32; 3] {
        let from_camera: Vector3<f64> = point_in_map - self.camera_in_map_m;
        let [x, y, z] = [from_camera.x as f32, from_camera.y as f32, from_camera.z as f32];
        self.camera_from_map.map(|[a, b, c]| a * x + b * y + c * z)
    }

    /// A step of `edge_m` along each axis of the map, in the camera's frame.
    pub(crate) fn steps_m(&self, edge_m: f64) -> [[f32; 3]; 3] {
        let edge_m = edge_m as f32;
        [0, 1, 2].map(|axis: usize| self.camera_from_map.map(|row| row[axis] * edge_m))
    }

    /// The box, along the camera's axes, around a cube of the map with this centre.
    #[inline]
    pub(crate) fn around_cube(&self, middle_in_map_m: &Point3<f64>, edge_m: f32) -> CameraBox {
        let half_m = self.half.map(|half| half * edge_m);
        CameraBox { middle_m: self.in_camera_m(middle_in_map_m), half_m }
    }

    /// The same around several cubes.
    #[inline]
    pub(crate) fn around_cubes(
        &self,
        middles_in_map_m: &[Point3<f64>; LANES],
        edge_m: f32,
    ) -> CameraBoxes {
        let mut middle_m = [[0.0; LANES]; 3];
        for (cube, middle_in_map_m) in middles_in_map_m.iter().enumerate() {
            for (along, value_m) in middle_m.iter_mut().zip(self.in_camera_m(middle_in_map_m)) {
                along[cube] = value_m;
            }
        }
        CameraBoxes { middle_m, half_m: self.half.map(|half| half * edge_m) }
    }
}
