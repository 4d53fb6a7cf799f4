use std::collections::BTreeMap;

use geometry::{Cloud, Method, PipelineConfig, Stamp};
use proptest::prelude::*;

use super::super::testing;
use super::*;
use crate::{ReconstructionConfig, StaticMap};

const EDGE_M: f64 = 0.1;

fn grid() -> VoxelGrid {
    VoxelGrid::new(EDGE_M).unwrap()
}

fn empty_map(max_voxels: usize) -> StaticMap {
    let config = ReconstructionConfig {
        pipeline: PipelineConfig::new(Method::RecHv, EDGE_M),
        max_voxels,
        ..ReconstructionConfig::default()
    };
    StaticMap::new(config).unwrap()
}

fn cloud(points: &[[f32; 3]]) -> Cloud {
    testing::cloud(Stamp::from_nanos(5), "map", points)
}

/// One that has the whole map of some moment and applies what it is told.
#[derive(Clone, Default)]
struct Listener {
    points: BTreeMap<VoxelKey, Point3<f32>>,
}

impl Listener {
    fn with(points: &[Point3<f32>]) -> Self {
        let mut listener = Self::default();
        listener.apply(points);
        listener
    }

    fn apply(&mut self, points: &[Point3<f32>]) {
        self.points.extend(points.iter().map(|point| (grid().key(point), *point)));
    }

    fn apply_changes(&mut self, changes: &MapChanges) {
        self.apply(&changes.updated.points_m);
        assert!(changes.removed.points_m.is_empty());
    }

    /// The farthest that a point stands from the map's; `None` when the voxels are not the same.
    fn farthest_m(&self, map: &StaticMap) -> Option<f64> {
        let truth = Self::with(&map.points());
        if !self.points.keys().eq(truth.points.keys()) {
            return None;
        }
        let way = |(a, b): (&Point3<f32>, &Point3<f32>)| (a.cast::<f64>() - b.cast()).norm();
        Some(self.points.values().zip(truth.points.values()).map(way).fold(0.0, f64::max))
    }
}

#[test]
fn what_is_new_or_has_moved_is_told_once() {
    let mut map = empty_map(100);
    map.add(&cloud(&[[0.02, 0.0, 0.0]])).unwrap();
    let told = |map: &mut StaticMap| map.take_changes(10).updated.points_m;
    assert!(told(&mut map).is_empty(), "nobody follows");
    map.follow_changes();
    assert!(told(&mut map).is_empty(), "the map of the moment is known");
    // By 2 mm, which is less than 3.1 mm; then by 4 mm in all.
    map.add(&cloud(&[[0.024, 0.0, 0.0]])).unwrap();
    assert!(told(&mut map).is_empty());
    map.add(&cloud(&[[0.028, 0.0, 0.0], [0.55, 0.0, 0.0]])).unwrap();
    let (moved, new) = (Point3::new(0.024, 0.0, 0.0), Point3::new(0.55, 0.0, 0.0));
    assert_eq!(told(&mut map), [moved, new]);
    assert!(told(&mut map).is_empty());
    map.unfollow_changes();
    map.add(&cloud(&[[0.75, 0.0, 0.0]])).unwrap();
    assert_eq!((map.waiting_changes(), told(&mut map).len()), (0, 0));
}

#[test]
fn who_waits_longest_is_told_of_first_however_busy_others_are() {
    let mut map = empty_map(100);
    map.follow_changes();
    let at = |voxel: f32, offset: f32| [voxel * 0.1 + 0.01 + offset, 0.01, 0.01];
    map.add(&cloud(&[at(0.0, 0.0), at(1.0, 0.0), at(2.0, 0.0)])).unwrap();
    let mut told = Vec::new();
    for cycle in 0..6_u8 {
        // The first voxel moves on and on, by more than the others may.
        let mut offset = 0.0;
        for _ in 0..=cycle {
            offset = 0.08 - offset;
            map.add(&cloud(&[at(0.0, offset); 40])).unwrap();
        }
        told.extend(map.take_changes(1).updated.points_m.iter().map(|point| grid().key(point).x));
    }
    assert_eq!(told[..3], [0, 1, 2]);
}

#[test]
fn a_cleared_map_has_nothing_to_tell() {
    let mut map = empty_map(100);
    map.follow_changes();
    map.add(&cloud(&[[0.02, 0.0, 0.0]])).unwrap();
    map.clear();
    assert!(map.take_changes(10).updated.points_m.is_empty());
    map.add(&cloud(&[[0.02, 0.0, 0.0]])).unwrap();
    let changes = map.take_changes(10).updated;
    assert_eq!((changes.points_m.len(), changes.stamp), (1, Stamp::from_nanos(5)));
    assert_eq!(changes.frame_id, "map");
}

#[test]
fn the_memory_of_the_queue_is_counted_and_bounded() {
    let points: Vec<_> = (0..50_000).map(|x| [x as f32, 0.0, 0.0]).collect();
    let (mut followed, mut alone) = (empty_map(40_000), empty_map(40_000));
    followed.follow_changes();
    for _ in 0..3 {
        followed.add(&cloud(&points)).unwrap();
        alone.add(&cloud(&points)).unwrap();
    }
    assert_eq!(followed.waiting_changes(), 40_000);
    let waiting_bytes = followed.memory_bytes() - alone.memory_bytes();
    assert!((40_000 * 12..=40_000 * 24 + 64).contains(&waiting_bytes), "{waiting_bytes}");
    followed.unfollow_changes();
    assert_eq!(followed.memory_bytes(), alone.memory_bytes());
}

/// What may happen to a map that is listened to.
#[derive(Clone, Debug)]
enum Event {
    Add(Vec<[f32; 3]>),
    Take(usize),
    /// Another listener comes, and gets the whole map of this moment.
    Listen,
    /// All listeners go, and the next ones follow from this moment on.
    FollowAnew,
}

fn events() -> impl Strategy<Value = Vec<Event>> {
    let points = |most| prop::collection::vec(prop::array::uniform3(-0.15f32..0.15), 0..most);
    let event = prop_oneof![
        6 => points(30).prop_map(Event::Add),
        4 => (0_usize..8).prop_map(Event::Take),
        1 => Just(Event::Listen),
        1 => Just(Event::FollowAnew),
    ];
    prop::collection::vec(event, 0..60)
}

/// A number at, just below or just above a boundary of voxels.
fn near_a_boundary() -> impl Strategy<Value = f32> {
    let boundary = (-30_i32..30).prop_map(|cell| (f64::from(cell) * EDGE_M) as f32);
    let tiny = prop_oneof![Just(1e-20_f32), Just(-1e-20), Just(-0.0), Just(-3e-12), Just(7e-13)];
    prop_oneof![
        boundary.clone(),
        boundary.clone().prop_map(f32::next_down),
        boundary.prop_map(f32::next_up),
        tiny,
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn who_has_a_map_and_all_changes_after_it_has_the_map(events in events()) {
        let mut map = empty_map(50);
        map.follow_changes();
        let mut listeners = vec![Listener::with(&map.cloud_for_listeners().points_m)];
        for event in events {
            match event {
                Event::Add(points) => {
                    map.add(&cloud(&points)).unwrap();
                }
                Event::Take(most_points) => {
                    let waiting = map.waiting_changes();
                    let changes = map.take_changes(most_points);
                    let told = changes.updated.points_m.len();
                    prop_assert!(told <= most_points && !changes.is_incomplete);
                    prop_assert!(told == most_points || map.waiting_changes() == 0);
                    prop_assert!(map.waiting_changes() + told <= waiting);
                    listeners.iter_mut().for_each(|listener| listener.apply_changes(&changes));
                }
                Event::Listen => {
                    listeners.push(Listener::with(&map.cloud_for_listeners().points_m));
                }
                Event::FollowAnew => {
                    map.follow_changes();
                    listeners = vec![Listener::with(&map.cloud_for_listeners().points_m)];
                }
            }
        }
        while map.waiting_changes() > 0 {
            let changes = map.take_changes(7);
            listeners.iter_mut().for_each(|listener| listener.apply_changes(&changes));
        }
        for listener in &mut listeners {
            let farthest_m = listener.farthest_m(&map);
            prop_assert!(
                farthest_m.is_some_and(|way_m| way_m <= LISTENER_TOLERANCE_IN_EDGES * EDGE_M),
                "{farthest_m:?}"
            );
            // A whole map takes the place of everything.
            *listener = Listener::with(&map.points());
            prop_assert_eq!(listener.farthest_m(&map), Some(0.0));
        }
    }

    #[test]
    fn a_mean_lies_in_the_voxel_that_it_stands_for(
        points in prop::collection::vec(prop::array::uniform3(near_a_boundary()), 1..40),
        repeats in 1_usize..4,
    ) {
        let mut map = empty_map(10_000);
        for _ in 0..repeats {
            map.add(&cloud(&points)).unwrap();
        }
        let listener = Listener::with(&map.cloud_for_listeners().points_m);
        prop_assert_eq!(listener.points.len(), map.len());
        for (key, mean) in &listener.points {
            prop_assert_eq!(map.voxel(*key).map(|(own, _)| own), Some(*mean));
        }
    }
}
