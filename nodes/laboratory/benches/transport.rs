//! The cost of a cloud before it is sent and after it is received: encoding, decoding, and conversion to geometry.
//! `stillmap bench transport` includes these in its figures, together with the network's share.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a panic is a benchmark's report"
)]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use msgs::sensor_msgs::{PointCloud2, PointField};
use msgs::{cdr, convert};

/// Bytes of a point with x, y, z and a colour, with the padding of depth camera drivers.
const POINT_STEP: u32 = 16;
/// Points of the clouds: of a reduced one, of every pixel of a Kinect v1, and of twice as many.
const POINTS: [u32; 3] = [6_250, 307_200, 614_400];

fn cloud(points: u32) -> PointCloud2 {
    let field = |(at, name): (u32, &str)| PointField {
        name: name.to_owned(),
        offset: at * 4,
        datatype: PointField::FLOAT32,
        count: 1,
    };
    PointCloud2 {
        height: 1,
        width: points,
        fields: (0..).zip(["x", "y", "z", "rgb"]).map(field).collect(),
        point_step: POINT_STEP,
        row_step: POINT_STEP * points,
        data: (0..points * 4).flat_map(|word| (word as f32 * 1e-3).to_le_bytes()).collect(),
        is_dense: true,
        ..PointCloud2::default()
    }
}

fn clouds(criterion: &mut Criterion) {
    for points in POINTS {
        let message = cloud(points);
        let bytes = cdr::encode(&message).unwrap();
        let mut group = criterion.benchmark_group("PointCloud2");
        group.throughput(Throughput::Bytes(bytes.len() as u64));
        let id = |step: &str| BenchmarkId::new(step, bytes.len());
        group.bench_function(id("encode"), |bench| {
            bench.iter(|| cdr::encode(black_box(&message)).unwrap());
        });
        group.bench_function(id("decode"), |bench| {
            bench.iter(|| cdr::decode::<PointCloud2>(black_box(&bytes)).unwrap());
        });
        group.bench_function(id("to geometry"), |bench| {
            bench.iter(|| convert::cloud_from_message(black_box(&message)).unwrap());
        });
        group.finish();
    }
}

criterion_group!(benches, clouds);
criterion_main!(benches);
