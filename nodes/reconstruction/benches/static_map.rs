//! What one cycle costs the map, alone and with a listener to its changes; and what the whole map costs.
#![allow(missing_docs, clippy::unwrap_used, reason = "a panic is a benchmark's report")]

use std::hint::black_box;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use geometry::{Cloud, Method, PipelineConfig, Stamp};
use nalgebra::Point3;
use reconstruction::{ReconstructionConfig, StaticMap};

/// Points of one cycle: a reduced cloud of a Kinect in a room.
const POINTS: usize = 10_000;
/// Cycles that are seen again and again: a camera that goes to and fro along a wall.
const CYCLES: usize = 50;
/// The cycles between two updates: two a second, of a scanner of 7 Hz.
const CYCLES_PER_UPDATE: usize = 3;
/// As the node's default.
const MOST_POINTS: usize = 10_000;

/// Numbers from 0 to 1, the same ones every time.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32
    }
}

/// Clouds of a floor and a wall, 4 m wide, each 0.2 m further on than the one before.
fn cycles() -> Vec<Cloud> {
    let mut numbers = Numbers(1);
    let mut cycle = |number: usize| {
        let start_m = number as f32 * 0.2;
        let mut point = |index: usize| {
            let (along, across) = (start_m + 4.0 * numbers.next(), 2.5 * numbers.next());
            let noise = 0.02 * numbers.next();
            if index.is_multiple_of(2) {
                Point3::new(along, across, noise)
            } else {
                Point3::new(along, 2.5 + noise, across)
            }
        };
        let points_m = (0..POINTS).map(&mut point).collect();
        Cloud { stamp: Stamp::default(), frame_id: "map".to_owned(), points_m }
    };
    (0..CYCLES).map(&mut cycle).collect()
}

fn config(voxel_edge_m: f64) -> ReconstructionConfig {
    let pipeline = PipelineConfig::new(Method::RecHv, voxel_edge_m);
    ReconstructionConfig { pipeline, ..ReconstructionConfig::default() }
}

fn grown_map(clouds: &[Cloud]) -> StaticMap {
    let mut map = StaticMap::new(config(0.08)).unwrap();
    for cloud in clouds {
        map.add(cloud).unwrap();
    }
    map
}

/// A map of a million voxels.
fn large_map() -> StaticMap {
    let mut map = StaticMap::new(config(1.0)).unwrap();
    let points_m = (0..1_000_000).map(|n| Point3::new((n % 1000) as f32, (n / 1000) as f32, 0.5));
    let cloud =
        Cloud { stamp: Stamp::default(), frame_id: "map".to_owned(), points_m: points_m.collect() };
    map.add(&cloud).unwrap();
    map
}

fn map(criterion: &mut Criterion) {
    let clouds = cycles();
    let mut map = grown_map(&clouds);
    let mut next = (0..CYCLES).cycle();
    let mut cycle = || &clouds[next.next().unwrap()];
    criterion.bench_function("add 10,000 points", |bench| {
        bench.iter(|| map.add(black_box(cycle())).unwrap());
    });
    map.follow_changes();
    let mut count = 0;
    criterion.bench_function("add 10,000 points, an update every third time", |bench| {
        bench.iter(|| {
            map.add(black_box(cycle())).unwrap();
            count += 1;
            (count % CYCLES_PER_UPDATE == 0).then(|| map.take_changes(MOST_POINTS))
        });
    });
    let followed = || {
        let mut map = StaticMap::new(config(0.08)).unwrap();
        map.follow_changes();
        for cloud in &clouds {
            map.add(cloud).unwrap();
        }
        map
    };
    criterion.bench_function("an update of 10,000 points", |bench| {
        bench.iter_batched_ref(
            followed,
            |map| map.take_changes(MOST_POINTS),
            BatchSize::LargeInput,
        );
    });

    let mut large = large_map();
    let mut group = criterion.benchmark_group("a map of 1,000,000 voxels");
    group.sample_size(10);
    group.bench_function("whole", |bench| bench.iter(|| large.cloud_for_listeners()));
    group.bench_function("followed", |bench| bench.iter(|| large.follow_changes()));
    group.finish();
}

criterion_group!(benches, map);
criterion_main!(benches);
