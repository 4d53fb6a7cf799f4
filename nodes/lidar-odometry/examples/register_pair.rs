//! Registers one scan to another and prints the time of each step as a line of JSON:
//!
//! ```text
//! cargo run --release -p lidar-odometry --example register_pair -- TARGET.bin SOURCE.bin [option=value ...]
//! ```
//!
//! Scans are files of KITTI: x, y, z and intensity as 32-bit floats. Options: `method` (`point_to_point`,
//! `point_to_plane`, `generalised`, `voxelised_generalised`), `threads`, `repeats`, `voxel_edge_m`, `every` (of the coarse
//! steps).
// An example prints, and may stop where it stands.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::num::NonZeroUsize;
use std::time::Instant;

use estimation::ScopedThreads;
use lidar_odometry::registration::{
    CoarseConfig, Method, PreparationConfig, PreparedCloud, RegistrationConfig, register,
};
use nalgebra::{Isometry3, Point3};

fn main() {
    let mut paths = Vec::new();
    let mut config = RegistrationConfig::default();
    let mut preparation = PreparationConfig::default();
    let (mut threads, mut repeats) = (1, 1);
    for argument in std::env::args().skip(1) {
        let Some((name, value)) = argument.split_once('=') else {
            paths.push(argument);
            continue;
        };
        match name {
            "method" => config.method = method(value),
            "threads" => threads = value.parse().unwrap(),
            "repeats" => repeats = value.parse().unwrap(),
            "neighbours" => preparation.neighbours = value.parse().unwrap(),
            "voxel_edge_m" => preparation.voxel_edge_m = value.parse().unwrap(),
            "every" => {
                config.coarse = CoarseConfig { every: value.parse().unwrap(), ..config.coarse }
            }
            _ => panic!("there is no option {name}"),
        }
    }
    let executor = ScopedThreads::new(NonZeroUsize::new(threads).expect("at least one thread"));
    let [target, source] = [0, 1].map(|which| points(&paths[which]));
    for _ in 0..repeats {
        let start = Instant::now();
        let [target, source] = [&target, &source]
            .map(|points| PreparedCloud::new(points, &preparation, &executor).unwrap());
        let prepared = start.elapsed();
        let found = register(&source, &target, &Isometry3::identity(), &config, &executor).unwrap();
        let whole = start.elapsed();
        let pose = found.target_from_source.to_homogeneous();
        let rows: Vec<f64> =
            pose.row_iter().flat_map(|row| row.iter().copied().collect::<Vec<_>>()).collect();
        println!(
            "{{\"ms\": {:.3}, \"prepare_ms\": {:.3}, \"iterations\": {}, \"converged\": {}, \"points\": [{}, {}], \
             \"correspondences\": {}, \"residual_rms_m\": {:.5}, \"estimated\": {}, \"least_constrained_share\": {:.5}, \
             \"pose\": {rows:?}}}",
            1e3 * whole.as_secs_f64(),
            1e3 * prepared.as_secs_f64(),
            found.iterations,
            found.converged,
            target.len(),
            source.len(),
            found.correspondences,
            found.residual_rms_m,
            found.observability.estimated(),
            found.observability.directions[5].information,
        );
    }
}

fn method(name: &str) -> Method {
    match name {
        "point_to_point" => Method::PointToPoint,
        "point_to_plane" => Method::PointToPlane,
        "generalised" => Method::Generalised,
        "voxelised_generalised" => Method::VoxelisedGeneralised,
        _ => panic!("there is no method {name}"),
    }
}

fn points(path: &str) -> Vec<Point3<f32>> {
    let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let floats: Vec<f32> =
        bytes.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect();
    floats.chunks_exact(4).map(|point| Point3::new(point[0], point[1], point[2])).collect()
}
