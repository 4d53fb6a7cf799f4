//! Benchmark: the integration of a depth image of 640 x 480 at voxel edges of 1 to 10 cm: `cargo bench -p volume`.
//!
//! Of corrections: each block moves. Of the mesh: of all blocks, and of those that an image has changed, as `mesh` of the node has it. And of the distances for
//! planners: of queries, of the blocks that are computed for the first time, and again after a change.
//!
//! The camera moves 1 cm an image through a furnished room, with the noise of a Kinect.
// A benchmark may panic, and exports nothing.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use estimation::executor::Serial;
use geometry::{CameraModel, DepthFrame, DepthImage, DepthPixels, Distortion, Stamp};
use nalgebra::{Isometry3, Point3, Vector3};
use volume::{
    DepthInput, DepthNoise, DepthRange, DepthView, DistanceConfig, DistanceField, MeshFollower,
    PointRules, Surface, SurfaceConfig,
};

const CAMERA: CameraModel = CameraModel {
    width_px: 640,
    height_px: 480,
    fx_px: 525.0,
    fy_px: 525.0,
    cx_px: 319.5,
    cy_px: 239.5,
    distortion: Distortion::None,
};
/// The number of images of the camera's path; then it goes back.
const IMAGES: usize = 30;

/// As many triangles as the node of the map has in a message.
const MESSAGE_TRIANGLES: usize = 1_000;

/// The depth of a ray from a position in the room, which has five walls, two boxes and a ball.
fn depth_m(from: &Point3<f64>, ray: &Vector3<f64>) -> f64 {
    let planes = [
        ([0.18, 0.0, 1.0], 3.95),
        ([-1.0, 0.0, 0.05], 1.6),
        ([1.0, 0.0, 0.08], 1.9),
        ([0.0, 1.0, 0.02], 1.15),
        ([0.0, -1.0, 0.0], 1.35),
    ];
    let planes = planes.map(|(normal, offset)| {
        let normal = Vector3::from(normal);
        (offset - normal.dot(&from.coords)) / normal.dot(ray)
    });
    let boxes = [([-1.3, 0.3, 2.2], [-0.6, 1.15, 2.9]), ([0.7, 0.0, 2.6], [1.4, 1.15, 3.2])];
    let boxes = boxes.map(|(least, most)| {
        let [a, b] = [least, most].map(|corner| (Point3::from(corner) - from).component_div(ray));
        let (enters, leaves) = (a.inf(&b).max(), a.sup(&b).min());
        if enters < leaves { enters } else { f64::INFINITY }
    });
    let (from_ball, radius_m) = (from - Point3::new(-0.9, 0.05, 2.5), 0.25);
    let (a, b) = (ray.norm_squared(), ray.dot(&from_ball));
    let root = b * b - a * (from_ball.norm_squared() - radius_m * radius_m);
    let ball = if root > 0.0 { (-b - root.sqrt()) / a } else { f64::INFINITY };
    let depths = planes.into_iter().chain(boxes).chain([ball]);
    depths.filter(|depth_m| *depth_m > 0.2).fold(f64::INFINITY, f64::min)
}

fn images() -> Vec<(DepthFrame, Isometry3<f64>)> {
    let mut seed = 1_u64;
    let mut noise = || {
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 40) as f64 / f64::from(1 << 24)
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    };
    (0..IMAGES)
        .map(|index| {
            let along_m = 0.01 * index as f64;
            let pose = Isometry3::translation(along_m, 0.0, along_m);
            let from = Point3::new(along_m, 0.0, along_m);
            let pixels = (0..480).flat_map(|row| (0..640).map(move |column| (column, row)));
            let values = pixels.map(|(column, row)| {
                let x = (f64::from(column) - CAMERA.cx_px) / CAMERA.fx_px;
                let y = (f64::from(row) - CAMERA.cy_px) / CAMERA.fy_px;
                let depth_m = depth_m(&from, &Vector3::new(x, y, 1.0));
                ((depth_m + 1.4e-3 * depth_m * depth_m * noise()) * 1e3).round() as u16
            });
            let pixels = DepthPixels::Millimetres(values.collect());
            let stamp = Stamp::default().plus_seconds(0.1 * index as f64);
            let image = DepthImage::new(stamp, "camera".into(), (640, 480), pixels).unwrap();
            (DepthFrame::new(image, CAMERA).unwrap(), pose)
        })
        .collect()
}

fn view() -> DepthView {
    DepthView::new(DepthRange { min_m: 0.2, max_m: 6.0 }, DepthNoise::default()).unwrap()
}

fn fill(view: &mut DepthView, (frame, map_from_camera): &(DepthFrame, Isometry3<f64>)) {
    view.fill(&DepthInput::new(frame, map_from_camera)).unwrap();
}

fn integrate(criterion: &mut Criterion) {
    let images = images();
    let coloured: Vec<_> = images
        .iter()
        .map(|(frame, pose)| {
            (frame.clone().with_colours(vec![[128; 3]; 640 * 480]).unwrap(), *pose)
        })
        .collect();
    let mut view = view();
    criterion.bench_function("preparation", |bencher| {
        let mut images = images.iter().cycle();
        bencher.iter(|| fill(&mut view, images.next().unwrap()));
    });
    let mut group = criterion.benchmark_group("surface");
    group.sample_size(15);
    for has_colour in [false, true] {
        let images = if has_colour { &coloured } else { &images };
        for edge_m in [0.10, 0.08, 0.05, 0.03, 0.02, 0.01] {
            let config =
                SurfaceConfig { edge_m, reach_m: 6.0, has_colour, ..SurfaceConfig::default() };
            let mut surface = Surface::new(config).unwrap();
            let mut images = images.iter().cycle();
            let name = if has_colour { "coloured image" } else { "image" };
            let id = BenchmarkId::new(name, format!("{edge_m} m"));
            group.bench_function(id, |bencher| {
                bencher.iter(|| {
                    fill(&mut view, images.next().unwrap());
                    surface.integrate(&view, &Serial)
                });
            });
            if !has_colour {
                group.bench_function(
                    BenchmarkId::new("points", format!("{edge_m} m")),
                    |bencher| {
                        bencher.iter(|| surface.points(PointRules::default()).len());
                    },
                );
            }
        }
    }
    group.finish();
}

/// Of each block, by corrections of parts of an edge: without a turn, and with one.
fn correction(criterion: &mut Criterion) {
    let images = images();
    let mut view = view();
    let mut group = criterion.benchmark_group("correction");
    group.sample_size(15);
    for edge_m in [0.05, 0.02] {
        let config = SurfaceConfig { edge_m, reach_m: 6.0, ..SurfaceConfig::default() };
        let mut surface = Surface::new(config).unwrap();
        for image in &images {
            fill(&mut view, image);
            surface.integrate(&view, &Serial);
        }
        let shift = Isometry3::translation(0.3 * edge_m, 0.2 * edge_m, -0.4 * edge_m);
        let turn = Isometry3::new(shift.translation.vector, Vector3::new(0.002, 0.004, -0.001));
        group.throughput(Throughput::Elements(surface.blocks() as u64));
        for (name, motion) in [("shift", shift), ("turn", turn)] {
            group.bench_function(BenchmarkId::new(name, format!("{edge_m} m")), |bencher| {
                bencher.iter(|| surface.corrected(|_| motion).blocks());
            });
        }
    }
    group.finish();
}

fn mesh(criterion: &mut Criterion) {
    let images = images();
    let mut view = view();
    let mut group = criterion.benchmark_group("mesh");
    for edge_m in [0.05, 0.03, 0.02] {
        let config = SurfaceConfig { edge_m, reach_m: 6.0, ..SurfaceConfig::default() };
        let mut surface = Surface::new(config).unwrap();
        let mut follower = MeshFollower::default();
        let mut images = images.iter().cycle();
        group.bench_function(BenchmarkId::new("blocks of an image", edge_m), |bencher| {
            bencher.iter_custom(|iterations| {
                let mut took = Duration::ZERO;
                for _ in 0..iterations {
                    fill(&mut view, images.next().unwrap());
                    surface.integrate(&view, &Serial);
                    let start = Instant::now();
                    follower.follow(&surface);
                    while follower.waiting() > 0 {
                        let most = MESSAGE_TRIANGLES;
                        black_box(follower.take(&surface, PointRules::default(), most));
                    }
                    took += start.elapsed();
                }
                took
            });
        });
        group.bench_function(BenchmarkId::new("all blocks", edge_m), |bencher| {
            bencher.iter(|| surface.mesh(PointRules::default()).triangles.len());
        });
    }
    group.finish();
}

/// The room, in metres: 3 by 2.2 by 3.6.
const ROOM_M: [[f64; 2]; 3] = [[-1.5, 1.5], [-1.1, 1.1], [0.2, 3.8]];
/// The places of an iteration.
const PLACES: usize = 100_000;

/// Places in the room, in an order of no kind.
fn places() -> Vec<Point3<f64>> {
    let mut seed = 7_u64;
    let mut along = |[least, most]: [f64; 2]| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        least + (most - least) * (seed >> 40) as f64 / f64::from(1 << 24)
    };
    (0..PLACES).map(|_| Point3::from(ROOM_M.map(&mut along))).collect()
}

/// Places every 5 cm in the plane at y = 0.
fn slice() -> Vec<Point3<f64>> {
    let along = |[least, most]: [f64; 2]| {
        (0..((most - least) / 0.05) as usize).map(move |step| least + 0.05 * step as f64)
    };
    let [x, _, z] = ROOM_M;
    along(z).flat_map(|z| along(x).map(move |x| Point3::new(x, 0.0, z))).collect()
}

fn ask(field: &mut DistanceField, surface: &Surface, places: &[Point3<f64>]) {
    for place in places {
        black_box(field.at(surface, place));
    }
}

fn distance(criterion: &mut Criterion) {
    let images = images();
    let mut view = view();
    let config = SurfaceConfig { edge_m: 0.03, reach_m: 6.0, ..SurfaceConfig::default() };
    let mut surface = Surface::new(config).unwrap();
    for image in &images {
        fill(&mut view, image);
        surface.integrate(&view, &Serial);
    }
    let (places, slice) = (places(), slice());
    let anew = |surface: &Surface| DistanceField::of(surface, DistanceConfig::default()).unwrap();
    let mut group = criterion.benchmark_group("distance");
    group.sample_size(15);
    let mut field = anew(&surface);
    ask(&mut field, &surface, &places);
    group.throughput(Throughput::Elements(PLACES as u64));
    group.bench_function("queries", |bencher| {
        bencher.iter(|| ask(&mut field, &surface, &places));
    });
    group.throughput(Throughput::Elements(field.blocks() as u64));
    group.bench_function("all blocks of the room", |bencher| {
        bencher.iter(|| ask(&mut anew(&surface), &surface, &places));
    });
    group.throughput(Throughput::Elements(1));
    group.bench_function("slice, for the first time", |bencher| {
        bencher.iter(|| ask(&mut anew(&surface), &surface, &slice));
    });
    // Each block goes and comes back by turns.
    let keys = surface.block_keys();
    let blocks: Vec<Vec<u8>> = keys.iter().map(|key| surface.block_bytes(*key).unwrap()).collect();
    for what in ["one changed block", "one changed block, and all of the room is asked for"] {
        let mut changes = keys.iter().zip(&blocks).cycle().step_by(37);
        let mut gone = None;
        group.bench_function(what, |bencher| {
            bencher.iter_custom(|iterations| {
                let mut took = Duration::ZERO;
                for _ in 0..iterations {
                    let key = match gone.take() {
                        Some((key, bytes)) => {
                            let _ = surface.put_block(bytes).unwrap();
                            key
                        }
                        None => {
                            let (key, bytes) = changes.next().unwrap();
                            surface.remove_block(*key);
                            gone = Some((*key, bytes));
                            *key
                        }
                    };
                    field.follow_block(key);
                    let start = Instant::now();
                    field.update(&surface);
                    let updated = start.elapsed();
                    ask(&mut field, &surface, &places);
                    took += if what == "one changed block" { updated } else { start.elapsed() };
                }
                took
            });
        });
        if let Some((_, bytes)) = gone {
            field.follow_block(surface.put_block(bytes).unwrap());
        }
    }
    let mut images = images.iter().cycle();
    group.bench_function("an image, and a slice is asked for", |bencher| {
        bencher.iter_custom(|iterations| {
            let mut took = Duration::ZERO;
            for _ in 0..iterations {
                fill(&mut view, images.next().unwrap());
                surface.integrate(&view, &Serial);
                let start = Instant::now();
                field.follow(&surface);
                ask(&mut field, &surface, &slice);
                took += start.elapsed();
            }
            took
        });
    });
    group.finish();
}

criterion_group!(benches, integrate, correction, mesh, distance);
criterion_main!(benches);
