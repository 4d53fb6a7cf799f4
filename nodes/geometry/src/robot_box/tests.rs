use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::{
    DepthLimits, DepthPixels, DepthProjector, Distortion, PixelVoxels, RigConfig, Stamp,
    VoxelAccumulator, VoxelGrid, pose_from_vector, rigid::RigidTransform,
};

const CAMERA: CameraModel = CameraModel {
    width_px: 64,
    height_px: 48,
    fx_px: 60.0,
    fy_px: 60.0,
    cx_px: 31.5,
    cy_px: 23.5,
    distortion: Distortion::None,
};

fn robot(corners_m: [f64; 6]) -> RobotBox {
    RobotBox::of_corners(&corners_m).unwrap().unwrap()
}

fn image(pixels: DepthPixels) -> Arc<DepthImage> {
    let size_px = (CAMERA.width_px, CAMERA.height_px);
    Arc::new(DepthImage::new(Stamp::default(), "camera".to_owned(), size_px, pixels).unwrap())
}

#[test]
fn corners_make_a_box_or_none() {
    let corners_m = [-0.3, -0.2, -0.9, 0.4, 0.2, 0.1];
    assert_eq!(robot(corners_m).corners_m(), corners_m);
    assert_eq!(RobotBox::of_corners(&[0.0; 6]), Ok(None));
    for wrong in [
        [0.0, 0.0, 0.0, 0.4, 0.2, 0.0],
        [0.5, -0.2, -0.9, 0.4, 0.2, 0.1],
        [-0.3, f64::NAN, -0.9, 0.4, 0.2, 0.1],
        [-0.3, -0.2, -0.9, f64::INFINITY, 0.2, 0.1],
    ] {
        let error = RobotBox::of_corners(&wrong).unwrap_err().to_string();
        assert!(error.contains("robot_box_m") && error.contains("a box"), "{error}");
    }
}

/// A bumper 0.5 m before the camera and 0.3 m below it, and the floor at 0.9 m.
#[test]
fn the_bumper_is_left_out_of_the_cloud_and_the_floor_beside_it_is_not() {
    let rig_from_camera = RigConfig::default().mounts().rig_from_camera;
    let rays = RayTable::new(&CAMERA).unwrap();
    let bumper = robot([0.45, -0.2, -0.35, 0.55, 0.2, -0.1]);
    let shows_bumper = |row: usize| (36..40).contains(&row);
    let depth_m = |pixel: usize| if shows_bumper(pixel / CAMERA.width_px) { 0.5 } else { 2.0 };
    let count = CAMERA.width_px * CAMERA.height_px;
    let metres = DepthPixels::Metres((0..count).map(depth_m).collect());
    let mm = DepthPixels::Millimetres((0..count).map(|at| (depth_m(at) * 1e3) as u16).collect());
    for pixels in [metres, mm] {
        let image = image(pixels);
        let of_robot = RobotPixels::new(&bumper, &rays, &rig_from_camera);
        let shown: Vec<usize> = of_robot.shown_in(&image).collect();
        let in_bumper = |pixel: &usize| {
            let (row, column) = (pixel / CAMERA.width_px, pixel % CAMERA.width_px);
            shows_bumper(row) && (column as f64 - CAMERA.cx_px).abs() * 0.5 / CAMERA.fx_px <= 0.2
        };
        assert_eq!(shown, (0..count).filter(in_bumper).collect::<Vec<_>>());
        assert!(!shown.is_empty());

        let projector =
            DepthProjector::new(rays.clone(), DepthLimits::default(), &rig_from_camera, "rig")
                .without_robot(of_robot);
        let depth = projector.image(&image).unwrap();
        let kept = depth.cloud().points_m;
        assert_eq!(kept.len(), count - shown.len());
        assert!(kept.iter().all(|point| !bumper.contains(&point.cast())));
        let mut voxels = VoxelAccumulator::new(VoxelGrid::new(0.08).unwrap());
        assert_eq!(depth.reduce(&mut voxels).points_before_reduction, kept.len());
        // The frame has the robot's pixels, too: the voxels noted would not be all of them.
        let mut noted = PixelVoxels::default();
        assert_eq!(depth.reduce_and_note(&mut voxels, &mut noted), depth.reduce(&mut voxels));
        assert!(!noted.are_made_with(&voxels.grid(), &RigidTransform::new(&rig_from_camera)));
        // The image itself is as it was: what is behind the robot is hidden, not unmeasured.
        assert_eq!(depth.frame().image().depth_m(32, 38), Some(0.5));
    }
}

proptest! {
    /// The pixels are those whose points are in the box, however the camera is mounted, in the box as beside it.
    #[test]
    fn pixels_show_the_robot_where_their_points_are_in_the_box(
        mount in prop::array::uniform6(-1.0_f64..1.0),
        least_m in prop::array::uniform3(-1.5_f64..1.0),
        extent_m in prop::array::uniform3(0.01_f64..2.0),
        depths_mm in prop::collection::vec(0_u16..3_000, 64 * 48),
    ) {
        let [x, y, z] = least_m;
        let [length, width, height] = extent_m;
        let robot = robot([x, y, z, x + length, y + width, z + height]);
        let rig_from_camera = pose_from_vector(&mount);
        let rays = RayTable::new(&CAMERA).unwrap();
        let image = image(DepthPixels::Millimetres(depths_mm));
        let pixels = RobotPixels::new(&robot, &rays, &rig_from_camera);
        let shown: Vec<usize> = pixels.shown_in(&image).collect();
        for (index, row, column) in places(CAMERA.width_px, CAMERA.height_px) {
            let Some(depth_m) = image.depth_m(column, row) else {
                prop_assert!(!shown.contains(&(index as usize)));
                continue;
            };
            let ray = rays.ray(column, row).unwrap().push(1.0).cast::<f64>();
            let point = rig_from_camera * Point3::from(f64::from(depth_m) * ray);
            // Rounding decides where a point is on a wall of the box.
            let [less, more] = [-1e-4, 1e-4].map(|by_m| RobotBox {
                least_m: robot.least_m - Vector3::repeat(by_m),
                most_m: robot.most_m + Vector3::repeat(by_m),
            });
            let is_shown = shown.binary_search(&(index as usize)).is_ok();
            prop_assert!(!less.contains(&point) || is_shown);
            prop_assert!(!is_shown || more.contains(&point));
        }
    }
}
