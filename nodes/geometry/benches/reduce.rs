//! How long a Kinect frame takes: `cargo bench -p geometry`.
// A benchmark may stop where it stands, and exports nothing.
#![allow(clippy::unwrap_used, missing_docs)]

use std::{collections::BTreeMap, f64::consts::FRAC_PI_2, hint::black_box, sync::Arc};

use criterion::{Criterion, criterion_group, criterion_main};
use geometry::{
    CameraModel, DepthImage, DepthLimits, DepthPixels, DepthProjector, Distortion, RayTable, Stamp,
    VoxelAccumulator, VoxelGrid, VoxelKey, pose_from_vector,
};
use nalgebra::Point3;

const WIDTH_PX: usize = 640;
const HEIGHT_PX: usize = 480;
/// Depth times disparity: focal length 580 px, baseline 7.5 cm, steps of an eighth of a pixel.
const STEP_M: f32 = 580.0 * 0.075 * 8.0;

/// A Kinect v1's view of a room 5 m deep with a column and a table in it, with the steps of its
/// disparity, noise of half a step from pixel to pixel, and holes. Harder than a real one, whose noise
/// is alike in neighbouring pixels.
fn room(rays: &RayTable) -> DepthImage {
    let mut seed = 1_u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / (1_u64 << 23) as f32 - 1.0
    };
    let mut pixels = Vec::with_capacity(WIDTH_PX * HEIGHT_PX);
    for row_px in 0..HEIGHT_PX {
        for column_px in 0..WIDTH_PX {
            let Some(ray) = rays.ray(column_px, row_px) else { continue };
            let walls_m = (1.2 / ray.y.abs()).min(2.0 / ray.x.abs()).min(5.0);
            let column = (column_px as f32 - 300.0).abs() < 40.0;
            let table = (row_px as f32 - 330.0).abs() < 30.0 && column_px > 400;
            let depth_m = if column {
                2.0
            } else if table {
                2.8
            } else {
                walls_m
            };
            let disparity = (STEP_M / depth_m + 0.5 * noise()).round();
            pixels.push(if noise() > 0.96 { 0 } else { (STEP_M / disparity * 1e3) as u16 });
        }
    }
    let size_px = (WIDTH_PX, HEIGHT_PX);
    DepthImage::new(
        Stamp::default(),
        "camera".to_owned(),
        size_px,
        DepthPixels::Millimetres(pixels),
    )
    .unwrap()
}

fn plain_twin(grid: &VoxelGrid, points_m: &[Point3<f32>]) -> Vec<Point3<f32>> {
    let mut cells: BTreeMap<VoxelKey, (f64, [f64; 3])> = BTreeMap::new();
    for point in points_m {
        let (count, sum) = cells.entry(grid.key(point)).or_default();
        *count += 1.0;
        for (axis, value) in sum.iter_mut().zip(point.iter()) {
            *axis += f64::from(*value);
        }
    }
    cells.values().map(|(count, sum)| Point3::from(sum.map(|axis| (axis / count) as f32))).collect()
}

fn reduce(criterion: &mut Criterion) {
    let camera = CameraModel {
        width_px: WIDTH_PX,
        height_px: HEIGHT_PX,
        fx_px: 522.0,
        fy_px: 518.1,
        cx_px: 305.8,
        cy_px: 248.6,
        distortion: Distortion::None,
    };
    let bent = Distortion::PlumbBob([0.138_263, -0.279_976, 0.002_072, 0.008_884, 0.0]);
    let rig_from_camera = pose_from_vector(&[0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2]);
    let project = |camera| {
        let rays = RayTable::new(&camera).unwrap();
        DepthProjector::new(rays, DepthLimits::default(), &rig_from_camera, "rig")
    };
    let straight_camera = project(camera);
    let bent_camera = project(CameraModel { distortion: bent, ..camera });
    let image = Arc::new(room(straight_camera.rays()));
    let [straight, bent] =
        [&straight_camera, &bent_camera].map(|camera| camera.image(&image).unwrap());
    let cloud = straight.cloud();
    criterion.bench_function("project", |bencher| {
        bencher.iter(|| black_box(straight).cloud());
    });
    for edge_m in [0.08, 0.05, 0.02] {
        let grid = VoxelGrid::new(edge_m).unwrap();
        let mut accumulator = VoxelAccumulator::new(grid);
        let cells = grid.reduce(&cloud.points_m).len();
        let points = cloud.points_m.len();
        let name = |what: &str| format!("{what} {edge_m} m, {points} points to {cells}");
        criterion.bench_function(&name("depth image"), |bencher| {
            bencher.iter(|| black_box(straight).reduce(&mut accumulator));
        });
        criterion.bench_function(&name("depth image, bent lens,"), |bencher| {
            bencher.iter(|| black_box(bent).reduce(&mut accumulator));
        });
        criterion.bench_function(&name("cloud"), |bencher| {
            bencher.iter(|| grid.reduce(black_box(&cloud.points_m)));
        });
        criterion.bench_function(&name("plain twin"), |bencher| {
            bencher.iter(|| plain_twin(&grid, black_box(&cloud.points_m)));
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = reduce
}
criterion_main!(benches);
