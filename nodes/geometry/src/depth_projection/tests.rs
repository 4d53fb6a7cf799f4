use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::{CameraModel, DepthPixels, Distortion, Stamp, VoxelGrid, pose_from_vector};

const WIDTH_PX: usize = 130;
const HEIGHT_PX: usize = 5;

/// Two blocks and a bit a row; with and without distortion.
fn cameras() -> [CameraModel; 2] {
    let pinhole = CameraModel {
        width_px: WIDTH_PX,
        height_px: HEIGHT_PX,
        fx_px: 100.0,
        fy_px: 90.0,
        cx_px: 64.5,
        cy_px: 2.25,
        distortion: Distortion::None,
    };
    let bent = Distortion::PlumbBob([0.138, -0.28, 0.002, 0.009, 0.0]);
    [pinhole, CameraModel { distortion: bent, ..pinhole }]
}

fn image(pixels: DepthPixels) -> Arc<DepthImage> {
    let stamp = Stamp::from_nanos(42);
    Arc::new(DepthImage::new(stamp, "camera".to_owned(), (WIDTH_PX, HEIGHT_PX), pixels).unwrap())
}

fn any_pixels() -> impl Strategy<Value = DepthPixels> {
    const COUNT: usize = WIDTH_PX * HEIGHT_PX;
    let millimetres = prop_oneof![Just(0_u16), 400..4000_u16, any::<u16>()];
    let metres = prop_oneof![5 => 0.4..4.0_f32, 1 => any::<f32>()];
    prop_oneof![
        proptest::collection::vec(millimetres, COUNT).prop_map(DepthPixels::Millimetres),
        proptest::collection::vec(metres, COUNT).prop_map(DepthPixels::Metres),
    ]
}

/// Pixel by pixel, in words of the public interface alone.
fn plain_cloud(image: &DepthImage, rays: &RayTable, limits: DepthLimits) -> Vec<Point3<f32>> {
    let mut points_m = Vec::new();
    for row_px in 0..image.height_px() {
        for column_px in 0..image.width_px() {
            let Some(depth_m) = image.depth_m(column_px, row_px) else { continue };
            let Some(ray) = rays.ray(column_px, row_px) else { continue };
            if depth_m >= limits.min_m && depth_m <= limits.max_m {
                points_m.push(Point3::new(ray.x * depth_m, ray.y * depth_m, depth_m));
            }
        }
    }
    points_m.retain(|point: &Point3<f32>| point.iter().all(|value| value.is_finite()));
    points_m
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn projecting_and_reducing_at_once_is_the_same_as_step_by_step(
        pixels in any_pixels(),
        vector in proptest::array::uniform6(-3.0..3.0_f64),
        edge_m in prop_oneof![Just(0.08), Just(0.02)],
        (min_m, max_m) in prop_oneof![Just((0.0, f32::MAX)), Just((0.8, 3.0))],
    ) {
        let (image, limits) = (image(pixels), DepthLimits { min_m, max_m });
        let (grid, rig_from_camera) = (VoxelGrid::new(edge_m).unwrap(), pose_from_vector(&vector));
        let mut accumulator = VoxelAccumulator::new(grid);
        accumulator.push(&Point3::new(9.0, 9.0, 9.0));
        for camera in cameras() {
            let rays = RayTable::new(&camera).unwrap();
            let in_camera =
                DepthProjector::new(rays.clone(), limits, &Isometry3::identity(), "camera");
            let cloud = in_camera.image(&image).unwrap().cloud();
            prop_assert_eq!(&cloud.points_m, &plain_cloud(&image, &rays, limits));

            let in_rig = DepthProjector::new(rays, limits, &rig_from_camera, "rig");
            let direct = in_rig.image(&image).unwrap().cloud();
            let stepwise = cloud.clone().transformed(&rig_from_camera, "rig");
            let finite = |point: &&Point3<f32>| point.iter().all(|value| value.is_finite());
            prop_assert_eq!(
                direct.points_m.iter().collect::<Vec<_>>(),
                stepwise.points_m.iter().filter(finite).collect::<Vec<_>>()
            );

            let reduced = in_rig.image(&image).unwrap().reduce(&mut accumulator);
            prop_assert_eq!(reduced.points_before_reduction, direct.points_m.len());
            prop_assert_eq!(&reduced.cloud.points_m, &grid.reduce(&direct.points_m));
            prop_assert_eq!(reduced.cloud.stamp, image.stamp);
            prop_assert_eq!(reduced.cloud.frame_id.as_str(), "rig");
        }
    }
}

#[test]
fn a_wall_before_the_camera_is_a_wall_before_the_rig() {
    let rays = RayTable::new(&cameras()[0]).unwrap();
    let rig_from_camera = pose_from_vector(&[0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2]);
    let projector = DepthProjector::new(rays, DepthLimits::default(), &rig_from_camera, "rig");
    let wall = image(DepthPixels::Millimetres(vec![2000; WIDTH_PX * HEIGHT_PX]));
    let cloud = projector.image(&wall).unwrap().cloud();
    assert_eq!(cloud.points_m.len(), WIDTH_PX * HEIGHT_PX);
    assert_eq!((cloud.stamp, cloud.frame_id.as_str()), (wall.stamp, "rig"));
    // The first pixel is the upper left one, and y left and z up are positive:
    // y = 2 * 64.5 / 100, z = 2 * 2.25 / 90.
    let first_m = cloud.points_m[0];
    assert!((first_m - Point3::new(2.0, 1.29, 0.05)).norm() < 1e-5, "{first_m}");
    assert!(cloud.points_m.iter().all(|point| (point.x - 2.0).abs() < 1e-5));
}

#[test]
fn limits_are_included() {
    let rays = RayTable::new(&cameras()[0]).unwrap();
    let limits = DepthLimits { min_m: 0.5, max_m: 4.0 };
    let projector = DepthProjector::new(rays, limits, &Isometry3::identity(), "camera");
    let mut depths_m = vec![0.0; WIDTH_PX * HEIGHT_PX];
    depths_m[..4].copy_from_slice(&[0.499, 0.5, 4.0, 4.001]);
    let cloud = projector.image(&image(DepthPixels::Metres(depths_m))).unwrap().cloud();
    let depths_m: Vec<f32> = cloud.points_m.iter().map(|point| point.z).collect();
    assert_eq!(depths_m, [0.5, 4.0]);
}

#[test]
fn an_image_of_another_size_is_refused() {
    let rays = RayTable::new(&cameras()[0]).unwrap();
    let projector =
        DepthProjector::new(rays, DepthLimits::default(), &Isometry3::identity(), "camera");
    let pixels = DepthPixels::Millimetres(vec![1; WIDTH_PX * HEIGHT_PX]);
    let turned =
        DepthImage::new(Stamp::default(), String::new(), (HEIGHT_PX, WIDTH_PX), pixels).unwrap();
    let expected = DepthCameraError {
        image_width_px: HEIGHT_PX,
        image_height_px: WIDTH_PX,
        camera_width_px: WIDTH_PX,
        camera_height_px: HEIGHT_PX,
    };
    assert_eq!(projector.image(&Arc::new(turned)).unwrap_err(), expected);
}

/// Regression: detection and segmentation each computed the rays of a lens, and over DDS segmentation would for each message.
#[test]
fn the_rays_of_a_camera_are_shared() {
    let camera = cameras().into_iter().find(|camera| !camera.distortion.is_none()).unwrap();
    let rays = RayTable::new(&camera).unwrap();
    let pixels = |rays: &RayTable| match rays.row(1).unwrap() {
        RayRow::Bent { x, .. } => x.as_ptr(),
        RayRow::Straight { .. } => std::ptr::null(),
    };
    let projector =
        DepthProjector::new(rays.clone(), DepthLimits::default(), &Isometry3::identity(), "camera");
    let depths = image(DepthPixels::Millimetres(vec![1; WIDTH_PX * HEIGHT_PX]));
    let frame = projector.image(&depths).unwrap().frame();
    assert_eq!(pixels(frame.rays()), pixels(&rays));

    let (mut last, mut of_messages) = (None, Vec::new());
    for _ in 0..3 {
        let of_message = RayTable::new(&camera).unwrap();
        of_message.share_with(&mut last);
        of_messages.push(of_message);
    }
    assert!(of_messages.iter().all(|rays| pixels(rays) == pixels(&of_messages[0])));
    let other = RayTable::new(&CameraModel { fx_px: camera.fx_px + 1.0, ..camera }).unwrap();
    other.share_with(&mut last);
    assert_ne!(pixels(&other), pixels(&of_messages[0]));
    assert_eq!(last, Some(other));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn the_pixels_in_a_box_are_those_whose_voxels_are_in_it(
        pixels in any_pixels(),
        least in prop::array::uniform3(-30..30_i32),
        cells in prop::array::uniform3(0..30_i32),
    ) {
        let (image, grid) = (image(pixels), VoxelGrid::new(0.08).unwrap());
        let rays = RayTable::new(&cameras()[0]).unwrap();
        let key = |[x, y, z]: [i32; 3]| VoxelKey { x, y, z };
        let most = [0, 1, 2].map(|axis: usize| least[axis] + cells[axis]);
        let pixels_in = |least: [i32; 3], most: [i32; 3]| {
            let mut taken = Vec::new();
            let within = VoxelBox { least: key(least), most: key(most) };
            let area = PixelArea::whole(WIDTH_PX, HEIGHT_PX);
            let camera = (&*image, &rays);
            let rig_from_camera = RigidTransform::new(&Isometry3::identity());
            for_each_voxel(camera, &rig_from_camera, area, (&grid, &within), |pixel, voxel| {
                taken.push((pixel, voxel));
            });
            taken
        };
        let mut expected = pixels_in([i32::MIN; 3], [i32::MAX; 3]);
        let voxels: Vec<VoxelKey> = expected.iter().map(|(_, voxel)| *voxel).collect();
        let around = VoxelBox::around(&voxels);
        if let Some(VoxelBox { least, most }) = around {
            let corners = [least, most].map(|corner| [corner.x, corner.y, corner.z]);
            prop_assert_eq!(&pixels_in(corners[0], corners[1]), &expected);
        }
        expected.retain(|(_, voxel)| {
            let along = [voxel.x, voxel.y, voxel.z];
            (0..3).all(|axis| (least[axis]..=most[axis]).contains(&along[axis]))
        });
        prop_assert_eq!(pixels_in(least, most), expected);
    }
}

/// The pixels of an area and their voxels, as the frame has them.
fn voxels_of(
    frame: &DepthFrame,
    rig_from_camera: &Isometry3<f64>,
    (grid, within): (&VoxelGrid, &VoxelBox),
    area: &PixelArea,
) -> Vec<(usize, VoxelKey)> {
    let mut taken = Vec::new();
    frame.for_each_voxel(rig_from_camera, area.clone(), (grid, within), |pixel, voxel| {
        taken.push((pixel, voxel));
    });
    taken
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Those of the reduction are those that are computed, and those of another mount or grid are not taken for them.
    #[test]
    fn the_voxels_that_were_noted_are_those_of_the_pixels(
        pixels in any_pixels(),
        half_cells in 0..40_i32,
        columns_px in (0..WIDTH_PX, 0..WIDTH_PX + 9),
        rows_px in (0..HEIGHT_PX, 0..HEIGHT_PX + 9),
    ) {
        let corner = |cell: i32| VoxelKey { x: cell, y: cell, z: cell };
        let within = VoxelBox { least: corner(-half_cells), most: corner(half_cells) };
        let area = PixelArea { columns_px: columns_px.0..columns_px.1, rows_px: rows_px.0..rows_px.1 };
        let (image, rays) = (image(pixels), RayTable::new(&cameras()[1]).unwrap());
        let mounts = [0.3, 0.31].map(|rad| Isometry3::rotation(Vector3::x() * rad));
        let grids = [0.08, 0.1].map(|edge_m| VoxelGrid::new(edge_m).unwrap());
        let projector = DepthProjector::new(rays, DepthLimits::default(), &mounts[0], "rig");
        let depth = projector.image(&image).unwrap();
        let frame = depth.frame();
        let asked = [(0, 0), (0, 1), (1, 0)];
        let voxels = || asked.map(|(mount, grid): (usize, usize)| {
            voxels_of(&frame, &mounts[mount], (&grids[grid], &within), &area)
        });
        let computed = voxels();

        let (mut accumulator, mut noted) = (VoxelAccumulator::new(grids[0]), PixelVoxels::default());
        // What was noted of another image is written over.
        noted.begin(&image, (grids[1], RigidTransform::new(&mounts[1])));
        let reduced = depth.reduce_and_note(&mut accumulator, &mut noted);
        prop_assert_eq!(reduced, depth.reduce(&mut accumulator));
        let noted = Arc::new(noted);
        frame.share(&noted);
        let is_known = noted.are_made_with(&grids[0], &RigidTransform::new(&mounts[0]));
        prop_assert_eq!(is_known, matches!(image.pixels(), DepthPixels::Millimetres(_)));
        prop_assert_eq!(voxels(), computed);
    }
}
