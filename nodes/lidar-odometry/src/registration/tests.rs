//! Registration of scenes whose motion is known.

use std::num::NonZeroUsize;

use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::testing::{Random, Rectangle, apart, seen, street};

const METHODS: [Method; 4] =
    [Method::PointToPoint, Method::PointToPlane, Method::Generalised, Method::VoxelisedGeneralised];

fn threads(count: usize) -> NonZeroUsize {
    NonZeroUsize::new(count).unwrap()
}

fn prepared(points_m: &[Point3<f32>]) -> PreparedCloud {
    PreparedCloud::new(points_m, &PreparationConfig::default(), threads(1)).unwrap()
}

/// Two views of a street, the second from a pose in the frame of the first.
fn views(motion: &Isometry3<f64>, points: usize, seed: u64) -> [PreparedCloud; 2] {
    let mut random = Random::new(seed);
    let scene = street(&mut random);
    [Isometry3::identity(), *motion]
        .map(|pose| prepared(&seen(&scene, &pose, points, 0.02, &mut random)))
}

fn registered(source: &PreparedCloud, target: &PreparedCloud, method: Method) -> Registration {
    let config = RegistrationConfig { method, ..Default::default() };
    register(source, target, &Isometry3::identity(), &config, threads(1)).unwrap()
}

#[test]
fn every_method_finds_a_known_motion() {
    let motion = Random::new(4).motion(0.3, 0.02);
    let [target, source] = views(&motion, 20_000, 1);
    for (method, most_m, most_rad) in [
        // Points of the two clouds are never the same ones.
        (Method::PointToPoint, 0.1, 0.01),
        (Method::PointToPlane, 0.01, 0.001),
        (Method::Generalised, 0.01, 0.001),
        (Method::VoxelisedGeneralised, 0.03, 0.003),
    ] {
        let registration = registered(&source, &target, method);
        let (metres, radians) = apart(&registration.target_from_source, &motion);
        println!("{method:?}: {metres:.4} m {radians:.5} rad, {} steps", registration.iterations);
        assert!(metres < most_m && radians < most_rad, "{method:?}: {metres} m, {radians} rad");
        assert!(registration.overlap > 0.8 && registration.observability.estimated() == 6);
    }
}
