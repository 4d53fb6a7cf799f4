//! A camera that turns about in a round room, followed by nothing but the map that it makes.

mod corridors;

use estimation::perturbation::left::{perturbation_between, perturbed};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::*;
use crate::feature::lines::LineDescriptor;
use crate::keyframing::{FollowedFrame, decide};
use crate::loop_closing::{Known, locate_near};
use crate::map::testing::World;
use crate::map::{ByOdometry, FoundTimes};
use crate::solve::PoseGuess;
use crate::solve::testing::{Random, kinect};

/// A room whose wall is 3 to 5 m off all around.
fn round_room(points: usize, lines: usize, seed: u64) -> World {
    let mut random = Random::new(seed);
    let place = |random: &mut Random| {
        let (angle, radius) =
            (random.between(0.0, std::f64::consts::TAU), random.between(3.0, 5.0));
        Point3::new(radius * angle.sin(), random.between(-1.5, 1.5), radius * angle.cos())
    };
    let bits = |random: &mut Random| [(); 4].map(|()| random.bits());
    let points = (0..points).map(|_| (place(&mut random), Descriptor(bits(&mut random)))).collect();
    let lines = (0..lines).map(|_| {
        let start = place(&mut random);
        let along = Vector3::new(random.normal(), random.normal(), random.normal()).normalize();
        ([start, start + 0.6 * along], LineDescriptor(bits(&mut random)))
    });
    let lines = lines.collect();
    World { points, lines, noise: 1.0 }
}

/// Looking outwards from a circle of half a metre.
fn looking(angle: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * angle);
    let place = turn * Vector3::z() * 0.5;
    Isometry3::from_parts(Translation3::from(place), turn).inverse()
}

struct Trip {
    mapper: Mapper,
    /// The frames' poses as they were followed, and the truth.
    followed: Vec<(Isometry3<f64>, Isometry3<f64>)>,
    /// Keyframes, and the truth.
    kept: Vec<(KeyframeId, Isometry3<f64>)>,
    closed: Vec<(usize, ClosedLoop)>,
    lost: usize,
}

/// Follows the camera over frames 4 degrees apart: by a prediction that is off, then by the map.
fn trip(frames: usize, seed: u64) -> Trip {
    let world = round_room(700, 80, seed);
    let truth: Vec<_> = (0..frames).map(|at| looking(at as f64 * 4.0_f64.to_radians())).collect();
    let noise = StepNoise { shift_m: 0.005, turn_rad: 0.003, is_told: false };
    walk(&truth, &|_| &world, noise, seed)
}

/// The error of odometry from frame to frame, and whether the map is given its motions.
#[derive(Clone, Copy)]
struct StepNoise {
    shift_m: f64,
    turn_rad: f64,
    is_told: bool,
}

/// Follows a camera over these frames, each of which shows a world.
fn walk<'a>(
    truth: &[Isometry3<f64>],
    world: &dyn Fn(usize) -> &'a World,
    noise: StepNoise,
    seed: u64,
) -> Trip {
    let mut random = Random::new(seed + 1);
    let mut config = MappingConfig::default();
    config.loops.keyframing.window.max_keyframes = 8;
    // This world's depths are off by chance, each by itself.
    config.loops.keyframing.window.depths_alike = 1.0;
    let mut trip = Trip {
        mapper: Mapper::new(config).unwrap(),
        followed: Vec::new(),
        kept: Vec::new(),
        closed: Vec::new(),
        lost: 0,
    };
    let (mut pose, mut truth_before) = (truth[0], truth[0]);
    let mut by_odometry =
        ByOdometry { leg: 0, camera_from_odom: truth[0], travelled_m: 0.0, turned_rad: 0.0 };
    let mut since_keyframe = 0;
    for (at, truth) in truth.iter().enumerate() {
        let shown = world(at).frame(truth, &mut random);
        let off = random.perturbation(noise.shift_m, noise.turn_rad);
        let step = perturbed(&(truth * truth_before.inverse()), &off);
        pose = step * pose;
        by_odometry.camera_from_odom = step * by_odometry.camera_from_odom;
        by_odometry.travelled_m += step.translation.vector.norm();
        by_odometry.turned_rad += step.rotation.angle();
        truth_before = *truth;
        let (mut points, mut lines) = (Vec::new(), Vec::new());
        let mut wants = true;
        if let Some((reference, _)) = trip.kept.last() {
            let map = trip.mapper.map();
            let reference = Some(*reference).filter(|id| map.keyframes().contains(*id));
            let reference = reference.or(map.newest()).unwrap();
            let guess = PoseGuess { camera_from_map: pose, covariance: None };
            let known = Known::default();
            let near = (&*shown.frame, &known);
            match locate_near(map, reference, near, &kinect(), &guess, &config.loops) {
                Ok(located) => {
                    pose = located.pose.camera_from_map;
                    (points, lines) = (located.points, located.lines);
                }
                Err(_) => trip.lost += 1,
            }
            let (reference_points, _) = map.count_seen_by(reference);
            let frame = FollowedFrame {
                since_relocalisation: None,
                since_keyframe,
                is_mapping_idle: true,
                tracked_points: points.len(),
                reference_points,
            };
            // Where the map does not reach, odometry alone continues.
            wants = points.is_empty() || decide(&frame, &config.loops.keyframing).is_ok();
            for (_, point) in &points {
                trip.mapper.map_mut().count_predicted(*point, FoundTimes::once(true));
            }
        }
        since_keyframe += 1;
        if wants {
            let new = NewKeyframe {
                camera: kinect(),
                camera_from_map: pose,
                frame: std::sync::Arc::clone(&shown.frame),
                points: &points,
                lines: &lines,
                by_odometry: noise.is_told.then_some(by_odometry),
            };
            let done = trip.mapper.step(new, &|| false).unwrap();
            assert_eq!(trip.mapper.map().check(), Ok(()));
            pose *= done.map_from_before.inverse();
            trip.kept.push((done.keyframe, *truth));
            if let Some((_, closed)) = done.closed {
                trip.closed.push((at, closed));
            }
            since_keyframe = 0;
        }
        trip.followed.push((pose, *truth));
    }
    trip
}

#[test]
fn a_camera_that_turns_about_is_followed_by_the_map_that_it_makes() {
    let trip = trip(105, 1);
    let rms =
        |off: Vec<f64>| (off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt();
    let off = |(one, other): &(Isometry3<f64>, Isometry3<f64>)| {
        perturbation_between(one, other).fixed_rows::<3>(0).norm()
    };
    let followed = rms(trip.followed.iter().map(off).collect());
    let map = trip.mapper.map();
    let left = trip
        .kept
        .iter()
        .filter_map(|(id, truth)| Some((*map.keyframes().get(*id)?.camera_from_map(), *truth)));
    let left: Vec<_> = left.collect();
    let keyframes = rms(left.iter().map(off).collect());
    println!(
        "105 frames, 420 degrees: {} keyframes kept, {} left, {} points, {} lines, lost {}, loops {:?}; \
         followed to {followed:.4} m, keyframes to {keyframes:.4} m",
        trip.kept.len(),
        left.len(),
        map.points().len(),
        map.lines().len(),
        trip.lost,
        trip.closed
    );
    assert_eq!(trip.lost, 0);
    assert!(trip.kept.len() > 10 && followed < 0.02 && keyframes < 0.015);
    // After a turn the beginning is known again: by a loop, or since it was never forgotten.
    let first = trip.mapper.map().root().unwrap();
    let (last, _) = trip.kept.last().unwrap();
    assert!(
        map.neighbours(*last, 15)
            .iter()
            .any(|(id, _)| { map.keyframes().get(*id).unwrap().number() < 15 || *id == first })
    );
    // A lost camera is found again.
    let world = round_room(700, 80, 1);
    let truth = looking(1.0);
    let shown = world.frame(&truth, &mut Random::new(77));
    let corners: Vec<Descriptor> = shown.frame.corners.iter().map(|c| c.descriptor).collect();
    let at = trip.mapper.lost_at(&corners)[0];
    let loops = &trip.mapper.config().loops;
    let found = locate(map, at, &shown.frame, &kinect(), loops).unwrap();
    assert!(off(&(found.pose.camera_from_map, truth)) < 0.03);
}

#[test]
fn bad_parameters_are_named() {
    let mut config = MappingConfig::default();
    config.loops.keyframing.baseline_m = -1.0;
    let refused = Mapper::new(config).unwrap_err().to_string();
    assert!(refused.starts_with("parameter baseline_m "), "{refused}");
}
