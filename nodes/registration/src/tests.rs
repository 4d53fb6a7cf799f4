//! Registration of scenes whose motion is known.

use estimation::perturbation::composite::perturbation_between;
use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::testing::{Random, Rectangle, apart, seen, street, threads};

const METHODS: [Method; 4] =
    [Method::PointToPoint, Method::PointToPlane, Method::Generalised, Method::VoxelisedGeneralised];

fn prepared(points_m: &[Point3<f32>]) -> PreparedCloud {
    PreparedCloud::new(points_m, &PreparationConfig::default(), &threads(1)).unwrap()
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
    register(source, target, &Isometry3::identity(), &config, &threads(1)).unwrap()
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

/// A drive's motion: mostly forward, mostly about z.
fn drive(random: &mut Random, shift_m: f64, turn_rad: f64) -> Isometry3<f64> {
    let shift = shift_m
        * Vector3::new(1.0, random.between(-0.1, 0.1), random.between(-0.03, 0.03)).normalize();
    let turn = turn_rad
        * Vector3::new(
            random.between(-0.1, 0.1),
            random.between(-0.1, 0.1),
            random.between(-1.0, 1.0),
        )
        .normalize();
    Isometry3::new(shift, turn)
}

#[test]
fn starts_from_two_metres_and_five_degrees_off_end_where_the_truth_is() {
    const STARTS: usize = 200;
    let mut random = Random::new(6);
    let motion = drive(&mut random, 1.0, 0.03);
    let [target, source] = views(&motion, 12_000, 8);
    let config = RegistrationConfig::default();
    let mut found = 0;
    for _ in 0..STARTS {
        let shift_m = random.between(0.0, 2.0);
        let turn_rad = random.between(0.0, 5.0_f64.to_radians());
        let guess = motion * drive(&mut random, shift_m, turn_rad);
        let Ok(registration) = register(&source, &target, &guess, &config, &threads(1)) else {
            continue;
        };
        let (metres, radians) = apart(&registration.target_from_source, &motion);
        found +=
            usize::from(metres < 0.01 && radians < 0.05_f64.to_radians() && registration.converged);
    }
    println!("{found} of {STARTS}");
    assert!(found * 100 >= STARTS * 99, "{found} of {STARTS}");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let motion = Random::new(4).motion(0.5, 0.03);
    let [target, source] = views(&motion, 20_000, 2);
    for method in METHODS {
        let config = RegistrationConfig { method, ..Default::default() };
        let on = |count| {
            register(&source, &target, &Isometry3::identity(), &config, &threads(count)).unwrap()
        };
        let expected = on(1);
        for count in [2, 3, 16] {
            assert_eq!(on(count), expected, "{method:?} on {count}");
        }
    }
}

#[test]
fn one_plane_determines_three_directions_and_the_others_keep_the_guess() {
    let mut random = Random::new(12);
    let plane = [Rectangle::new([-20.0, -20.0, -1.7], [40.0, 0.0, 0.0], [0.0, 40.0, 0.0])];
    let [target, source] = [Isometry3::identity(), Isometry3::translation(0.3, 0.2, 0.05)]
        .map(|pose| prepared(&seen(&plane, &pose, 20_000, 0.02, &mut random)));
    for method in METHODS {
        let guess = Isometry3::new(Vector3::new(0.1, -0.1, 0.0), Vector3::new(0.01, 0.0, 0.02));
        let config = RegistrationConfig { method, ..Default::default() };
        let registration = register(&source, &target, &guess, &config, &threads(1)).unwrap();
        assert_eq!(
            registration.observability.estimated(),
            3,
            "{method:?} {:?}",
            registration.observability
        );
        let shift = registration.target_from_source.translation.vector;
        // The guess along the plane, the truth across it.
        let along_m = (shift - Vector3::new(0.1, -0.1, 0.0)).xy().norm();
        assert!(along_m < 0.01 && (shift.z - 0.05).abs() < 0.01, "{method:?}: {shift}");
        let (roll, pitch, yaw) = registration.target_from_source.rotation.euler_angles();
        assert!(
            roll.abs() < 0.002 && pitch.abs() < 0.002 && (yaw - 0.02).abs() < 0.002,
            "{method:?}: {yaw}"
        );
        assert!(registration.covariance[(0, 0)] > 0.5 && registration.covariance[(2, 2)] < 1e-4);
    }
}

#[test]
fn a_tunnel_determines_all_but_the_position_along_it() {
    let mut random = Random::new(13);
    let tunnel = [
        Rectangle::new([-40.0, -4.0, -1.7], [80.0, 0.0, 0.0], [0.0, 8.0, 0.0]),
        Rectangle::new([-40.0, -4.0, -1.7], [80.0, 0.0, 0.0], [0.0, 0.0, 5.0]),
        Rectangle::new([-40.0, 4.0, -1.7], [80.0, 0.0, 0.0], [0.0, 0.0, 5.0]),
    ];
    let [target, source] = [Isometry3::identity(), Isometry3::translation(1.0, 0.1, 0.0)]
        .map(|pose| prepared(&seen(&tunnel, &pose, 30_000, 0.02, &mut random)));
    let guess = Isometry3::translation(0.8, 0.0, 0.0);
    let registration =
        register(&source, &target, &guess, &RegistrationConfig::default(), &threads(1)).unwrap();
    let weak: Vec<Direction> = registration.observability.weak().copied().collect();
    assert_eq!(weak.len(), 1, "{:?}", registration.observability);
    assert!(
        weak[0].shift().unwrap().x.abs() > 0.99
            && weak[0].axis().is_none_or(|_| weak[0].in_units[0].abs() > 0.99)
    );
    let shift = registration.target_from_source.translation.vector;
    assert!((shift - Vector3::new(0.8, 0.1, 0.0)).norm() < 0.01, "{shift}");
}

#[test]
fn clouds_that_cannot_be_registered_are_refused_with_their_numbers() {
    let preparation = PreparationConfig::default();
    let empty =
        |points: &[Point3<f32>]| PreparedCloud::new(points, &preparation, &threads(1)).unwrap_err();
    assert_eq!(empty(&[]), RegistrationError::Empty { points: 0 });
    assert_eq!(
        empty(&[Point3::new(f32::NAN, 0.0, 1.0); 7]),
        RegistrationError::Empty { points: 7 }
    );
    let [target, source] = views(&Isometry3::identity(), 5000, 3);
    let config = RegistrationConfig::default();
    let from = |guess: Isometry3<f64>, config: &RegistrationConfig| {
        register(&source, &target, &guess, config, &threads(1)).unwrap_err()
    };
    let far = from(Isometry3::translation(900.0, 0.0, 0.0), &config);
    assert!(matches!(far, RegistrationError::NoOverlap { found: 0, .. }), "{far}");
    assert!(far.to_string().contains("do not overlap"));
    assert_eq!(from(Isometry3::translation(f64::NAN, 0.0, 0.0), &config), RegistrationError::Guess);
    let spoilt = RegistrationConfig { max_iterations: 0, ..config };
    assert!(from(Isometry3::identity(), &spoilt).to_string().contains("max_iterations"));
    let few = prepared(&[Point3::new(1.0, 2.0, 3.0); 9]);
    let error = register(&few, &target, &Isometry3::identity(), &config, &threads(1)).unwrap_err();
    assert!(matches!(error, RegistrationError::NoOverlap { .. }), "{error}");
}

#[test]
fn the_covariance_is_of_the_size_of_the_errors() {
    const PAIRS: u64 = 30;
    // The square of the error over the covariance is 6 in the mean. As if errors did not depend on each other it is 13.
    let mean: f64 = (0..PAIRS)
        .map(|seed| {
            let motion = Random::new(seed).motion(0.2, 0.01);
            let [target, source] = views(&motion, 8000, 100 + seed);
            let registration = registered(&source, &target, Method::Generalised);
            let error = perturbation_between(&motion, &registration.target_from_source);
            let information = registration.covariance.try_inverse().unwrap();
            error.dot(&(information * error)) / PAIRS as f64
        })
        .sum();
    println!("{mean}");
    assert!((3.0..9.5).contains(&mean), "{mean}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_motion_of_any_scene_is_recovered(
        seed in 0..1000_u64, shift_m in 0.0..1.0_f64, turn_deg in 0.0..3.0_f64, method in prop::sample::select(&METHODS[1..]),
    ) {
        // Faces at random all about.
        let mut random = Random::new(seed);
        let scene: Vec<Rectangle> = (0..25).map(|_| Rectangle {
            corner_m: 8.0 * random.direction(),
            sides_m: [4.0 * random.direction(), 4.0 * random.direction()],
        }).collect();
        let motion = random.motion(shift_m, turn_deg.to_radians());
        let [target, source] = [Isometry3::identity(), motion]
            .map(|pose| prepared(&seen(&scene, &pose, 12_000, 0.005, &mut random)));
        let registration = registered(&source, &target, method);
        let (metres, radians) = apart(&registration.target_from_source, &motion);
        let most_m = if method == Method::VoxelisedGeneralised { 0.05 } else { 0.01 };
        prop_assert!(metres < most_m && radians < most_m / 5.0, "{method:?} {metres} m {radians} rad");
    }

    #[test]
    fn any_points_are_registered_or_refused(
        points in prop::collection::vec(prop::array::uniform3(prop_oneof![
            -50.0..50.0_f32, any::<f32>(), Just(0.0_f32), Just(f32::MAX),
        ]), 0..300),
        edge in prop_oneof![Just(0.0_f64), 1e-9..10.0_f64],
    ) {
        let points: Vec<Point3<f32>> = points.into_iter().map(Point3::from).collect();
        let preparation = PreparationConfig { voxel_edge_m: edge, ..Default::default() };
        if let Ok(cloud) = PreparedCloud::new(&points, &preparation, &threads(2)) {
            for method in METHODS {
                let config = RegistrationConfig { method, ..Default::default() };
                if let Ok(found) = register(&cloud, &cloud, &Isometry3::identity(), &config, &threads(1)) {
                    prop_assert!(crate::is_rigid(&found.target_from_source));
                }
            }
        }
    }
}
