//! A camera that moves along a wall and back, drifts meanwhile, and is at the beginning again.

use std::sync::Arc;

use estimation::perturbation::left::{perturbation_between, perturbed};
use nalgebra::{Isometry3, Vector6};

use super::*;
use crate::bundle_adjustment::{BundleConfig, Window, WindowConfig, adjust};
use crate::map::testing::{World, around};
use crate::map::{KeyframeId, LineId, Map, MapConfig, NewKeyframe, PointId};
use crate::solve::testing::{Random, kinect};

/// Landmarks not seen for this many keyframes are mapped again.
const MEMORY: usize = 3;
/// The error of odometry with each step of half a metre.
const DRIFT: [f64; 6] = [0.004, 0.002, 0.006, 0.001, 0.002, 0.0];

struct Trip {
    map: Map,
    ids: Vec<KeyframeId>,
    truth: Vec<Isometry3<f64>>,
    world: World,
}

impl Trip {
    /// There and back, 24 keyframes each.
    fn new(seed: u64) -> Self {
        let world = World::wall(1000, 150, 24.0, 1.0, seed);
        let there = around(24, 0.5);
        let truth: Vec<_> = there.iter().chain(there.iter().rev()).copied().collect();
        let (mut map, mut random) = (Map::new(MapConfig::default()), Random::new(seed));
        let mut points: Vec<Option<(PointId, usize)>> = vec![None; world.points.len()];
        let mut lines: Vec<Option<(LineId, usize)>> = vec![None; world.lines.len()];
        let (mut pose, mut ids) = (truth[0], Vec::new());
        for (at, true_pose) in truth.iter().enumerate() {
            if at > 0 {
                let step = true_pose * truth[at - 1].inverse();
                pose = perturbed(&step, &Vector6::from(DRIFT)) * pose;
            }
            let shown = world.frame(true_pose, &mut random);
            let remembered = |last: usize| at - last <= MEMORY;
            let known = shown.points.iter().enumerate().filter_map(|(corner, index)| {
                points[*index].filter(|(_, last)| remembered(*last)).map(|(id, _)| (corner, id))
            });
            let known: Vec<(usize, PointId)> = known.collect();
            let known_lines = shown.lines.iter().enumerate().filter_map(|(segment, index)| {
                lines[*index].filter(|(_, last)| remembered(*last)).map(|(id, _)| (segment, id))
            });
            let known_lines: Vec<(usize, LineId)> = known_lines.collect();
            let new = NewKeyframe {
                camera: kinect(),
                camera_from_map: pose,
                frame: Arc::clone(&shown.frame),
                points: &known,
                lines: &known_lines,
                by_odometry: None,
            };
            let keyframe = map.insert_keyframe(new).unwrap();
            let drift = pose.inverse() * true_pose;
            for (corner, index) in shown.points.iter().enumerate() {
                let id = known.iter().find(|(at, _)| *at == corner).map(|(_, id)| *id);
                let place = drift * world.points[*index].0;
                let id = id.unwrap_or_else(|| map.insert_point(keyframe, corner, &place).unwrap());
                points[*index] = Some((id, at));
            }
            for (segment, index) in shown.lines.iter().enumerate() {
                let id = known_lines.iter().find(|(at, _)| *at == segment).map(|(_, id)| *id);
                let ends = world.lines[*index].0.map(|end| drift * end);
                let id = id.unwrap_or_else(|| map.insert_line(keyframe, segment, &ends).unwrap());
                lines[*index] = Some((id, at));
            }
            ids.push(keyframe);
        }
        assert_eq!(map.check(), Ok(()));
        Self { map, ids, truth, world }
    }

    /// Root mean square of how far the keyframes are from the truth.
    fn rms_m(&self, map: &Map) -> f64 {
        let off = self.ids.iter().zip(&self.truth).map(|(id, truth)| {
            let pose = map.keyframes().get(*id).unwrap().camera_from_map();
            perturbation_between(truth, pose).fixed_rows::<3>(0).norm_squared()
        });
        (off.sum::<f64>() / self.ids.len() as f64).sqrt()
    }

    fn locate(&self, map: &Map, at: usize, by: usize) -> Result<Located, NotLocated> {
        let frame = map.keyframes().get(self.ids[at]).unwrap().frame();
        locate(map, self.ids[by], frame, &kinect(), &LoopConfig::default())
    }
}

#[test]
fn a_trip_there_and_back_is_closed() {
    for seed in 0..3 {
        let trip = Trip::new(seed);
        let mut map = trip.map.clone();
        let (first, last) = (trip.ids[0], trip.ids[47]);
        assert!(!map.keyframes().get(last).unwrap().covisible().contains_key(&first));
        let located = trip.locate(&map, 47, 0).unwrap();
        // The first keyframe is where it is: the last is as far from it as it really is.
        let (off_m, off_rad) = off(&located.pose.camera_from_map, &trip.truth[47]);
        assert!(off_m < 0.02 && off_rad < 0.01, "{off_m} {off_rad}");
        let before = trip.rms_m(&map);
        let landmarks = (map.points().len(), map.lines().len());
        let config = LoopConfig::default();
        let closed = close_loop(&mut map, last, first, &located, &config, &|| false).unwrap();
        assert_eq!(map.check(), Ok(()));
        let after = trip.rms_m(&map);
        assert!(map.keyframes().get(last).unwrap().covisible().contains_key(&first));
        assert!(map.points().len() < landmarks.0 && map.lines().len() < landmarks.1);
        let window = Window::full(&map, &WindowConfig::default());
        let adjusted = adjust(&window.bundle, &BundleConfig::default(), &|| false).unwrap();
        window.apply(&adjusted, &mut map).unwrap();
        assert_eq!(map.check(), Ok(()));
        let adjusted = trip.rms_m(&map);
        println!(
            "23 m there and back: gap {:.3} m {:.3} rad; rms {before:.3} m, closed {after:.3} m, adjusted \
             {adjusted:.3} m; {} fused, {} seen again",
            closed.gap_m, closed.gap_rad, closed.fused.fused, closed.fused.seen
        );
        assert!(after < 0.6 * before && adjusted < before, "{before} {after} {adjusted}");
        assert!(closed.fused.fused > 30, "{closed:?}");
    }
}

fn off(one: &Isometry3<f64>, other: &Isometry3<f64>) -> (f64, f64) {
    let off = perturbation_between(one, other);
    (off.fixed_rows::<3>(0).norm(), off.fixed_rows::<3>(3).norm())
}

#[test]
fn another_place_is_not_taken_for_this_one() {
    let trip = Trip::new(4);
    for by in [14, 18, 23] {
        let refused = trip.locate(&trip.map, 47, by).err();
        let refused = refused.map(|error| matches!(error, NotLocated::TooFewMatches { .. }));
        assert_eq!(refused, Some(true), "{by}");
    }
    let mut map = trip.map.clone();
    map.cull_keyframe(trip.ids[10]).unwrap();
    let gone = trip.locate(&map, 47, 10).unwrap_err();
    assert_eq!(gone, NotLocated::NoKeyframe(trip.ids[10]));
}

#[test]
fn a_loop_that_odometry_contradicts_is_not_closed() {
    let trip = Trip::new(5);
    let mut map = trip.map.clone();
    // As if a place four metres on looked the same: no drift over so short a distance is as large.
    let mut located = trip.locate(&map, 3, 0).unwrap();
    let wrong = Isometry3::translation(4.0, 0.0, 0.0);
    located.pose.camera_from_map = wrong * located.pose.camera_from_map;
    let (from, to) = (trip.ids[3], trip.ids[0]);
    let before = format!("{map:?}");
    let config = LoopConfig::default();
    let refused = close_loop(&mut map, from, to, &located, &config, &|| false);
    assert!(matches!(refused, Err(NotClosed::Contradicted { .. })), "{refused:?}");
    let stopped = close_loop(&mut map, from, to, &located, &config, &|| true);
    assert_eq!(stopped, Err(NotClosed::Aborted));
    assert_eq!(before, format!("{map:?}"));
}

#[test]
fn a_lost_camera_is_found_by_a_keyframe_near_by() {
    let trip = Trip::new(6);
    let (map, _) = trip.world.map(&trip.truth[..24], 1);
    let ids: Vec<KeyframeId> = map.keyframes().ids().collect();
    let mut random = Random::new(2);
    for at in [2, 11, 20] {
        let pose = perturbed(&trip.truth[at], &random.perturbation(0.1, 0.05));
        let shown = trip.world.frame(&pose, &mut random);
        let config = LoopConfig::default();
        let found = locate(&map, ids[at], &shown.frame, &kinect(), &config).unwrap();
        let (off_m, off_rad) = off(&found.pose.camera_from_map, &pose);
        assert!(off_m < 0.01 && off_rad < 0.005, "{off_m} {off_rad}");
        assert!(found.points.len() > 60 && !found.lines.is_empty());
        // What it is found by is what it shows.
        for (corner, id) in &found.points {
            let look = map.points().get(*id).unwrap().look().descriptor;
            assert!(look.distance(&shown.frame.corners[*corner].descriptor) < 60);
        }
    }
}

#[test]
fn a_graph_of_a_map_without_loops_is_at_rest() {
    let trip = Trip::new(7);
    let essential = essential_graph(&trip.map, &LoopConfig::default());
    assert_eq!(essential.graph.poses.len(), 48);
    assert!(essential.graph.edges.len() >= 47);
    let config = pose_graph::GraphConfig::default();
    let rest = pose_graph::optimise(&essential.graph, &config, &|| false).unwrap();
    assert!(rest.chi2_before < 1e-12 && rest.chi2 < 1e-12);
}

#[test]
fn landmarks_go_along_with_the_oldest_keyframe_that_sees_them() {
    let trip = Trip::new(8);
    let mut map = trip.map.clone();
    let shift = Isometry3::translation(1.0, 2.0, 3.0);
    let moved: Vec<_> = map
        .keyframes()
        .iter()
        .map(|(id, keyframe)| (id, keyframe.camera_from_map() * shift.inverse()))
        .collect();
    let corrected = correct(&mut map, &moved).unwrap();
    assert_eq!(corrected.keyframes, 48);
    for ((_, before), (_, after)) in trip.map.points().iter().zip(map.points().iter()) {
        assert!((shift * before.position_m() - after.position_m()).norm() < 1e-9);
    }
    let nowhere = [(trip.ids[0], Isometry3::translation(f64::NAN, 0.0, 0.0))];
    assert!(correct(&mut map, &nowhere).is_err());
}
