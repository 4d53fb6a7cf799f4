//! What listeners are told of.

use std::collections::BTreeMap;

use estimation::executor::Serial;
use nalgebra::Isometry3;

use super::super::{MeshChange, MeshFollower};
use super::*;
use crate::testing::{self, Scene};

/// The triangles that a listener has.
#[derive(Default)]
struct Listener(BTreeMap<BlockKey, BlockMesh>);

impl Listener {
    fn hear(&mut self, changes: Vec<MeshChange>) {
        for MeshChange { key, mesh } in changes {
            if mesh.is_empty() {
                assert!(self.0.remove(&key).is_some(), "nothing has gone from {key:?}");
            } else {
                self.0.insert(key, mesh);
            }
        }
    }

    /// How far, in edges, the farthest vertex is from where it is. Each block has the triangles that it has.
    fn farthest_off(&self, surface: &Surface) -> f32 {
        let mut farthest = 0.0_f32;
        let mut blocks = 0;
        for key in surface.block_keys() {
            let mesh = mesh_of(surface, key);
            if mesh.is_empty() {
                continue;
            }
            blocks += 1;
            let known = &self.0[&key];
            assert_eq!(known.triangles, mesh.triangles, "{key:?}");
            for (known, now) in known.vertices.iter().zip(&mesh.vertices) {
                assert_eq!(known.edge, now.edge);
                farthest = farthest.max((known.along - now.along).abs());
            }
        }
        assert_eq!(self.0.len(), blocks);
        farthest
    }
}

fn look(surface: &mut Surface, depth_m: f64, time_s: f64) {
    let camera = testing::camera(160, 120);
    let view =
        testing::view_of_scene(&Scene::wall(depth_m), &camera, &Isometry3::identity(), time_s);
    surface.integrate(&view, &Serial);
}

fn take(follower: &mut MeshFollower, surface: &Surface, most: usize) -> Vec<MeshChange> {
    follower.take(surface, PointRules::default(), most)
}

#[test]
fn a_listener_has_the_mesh_whatever_changes() {
    let mut surface = Surface::new(config(0.05)).unwrap();
    let (mut follower, mut listener) = (MeshFollower::default(), Listener::default());
    let mut told = 0;
    // The wall comes, wavers, stands farther away and then nearer: what was before it goes.
    for (index, depth_m) in [2.0, 2.001, 2.002, 2.0, 2.9, 2.9, 2.9].into_iter().enumerate() {
        for repeat in 0..5 {
            look(&mut surface, depth_m, (5 * index + repeat) as f64);
            follower.follow(&surface);
            let changes = take(&mut follower, &surface, usize::MAX);
            told += changes.len();
            listener.hear(changes);
            assert!(listener.farthest_off(&surface) <= LISTENER_TOLERANCE_IN_EDGES as f32);
        }
    }
    assert!(
        listener
            .0
            .values()
            .all(|mesh| mesh.vertices.iter().all(|vertex| vertex.position_m.z > 2.5))
    );
    assert!(told < 6 * listener.0.len(), "{told} for {} blocks", listener.0.len());
    assert_eq!(follower.waiting(), 0);
}

#[test]
fn what_does_not_change_is_not_told_of_again() {
    let mut surface = Surface::new(config(0.05)).unwrap();
    let mut follower = MeshFollower::default();
    look(&mut surface, 2.0, 0.0);
    follower.follow(&surface);
    assert!(take(&mut follower, &surface, usize::MAX).len() > 20);
    look(&mut surface, 2.0, 1.0);
    follower.follow(&surface);
    assert!(follower.waiting() > 20);
    assert_eq!(take(&mut follower, &surface, usize::MAX), []);
}

#[test]
fn a_change_has_no_more_triangles_than_asked_for_and_the_rest_follows() {
    const MOST: usize = 700;
    let mut surface = Surface::new(config(0.05)).unwrap();
    let (mut follower, mut listener) = (MeshFollower::default(), Listener::default());
    look(&mut surface, 2.0, 0.0);
    follower.follow(&surface);
    let mut rounds = 0;
    while follower.waiting() > 0 {
        let changes = take(&mut follower, &surface, MOST);
        let triangles: usize = changes.iter().map(|change| change.mesh.triangles.len()).sum();
        assert!(triangles <= MOST, "{triangles}");
        listener.hear(changes);
        rounds += 1;
        assert!(rounds < 1000);
    }
    assert!(rounds > 3);
    assert_eq!(listener.farthest_off(&surface), 0.0);
    // One block alone may have more.
    follower.begin_to_show(&surface);
    let change = take(&mut follower, &surface, 1);
    assert!(change.len() == 1 && change[0].mesh.triangles.len() > 1);
}

/// Also what was told of and has gone since, before anybody was told.
#[test]
fn a_listener_that_comes_later_is_told_of_all() {
    let mut surface = Surface::new(config(0.05)).unwrap();
    let (mut follower, mut first) = (MeshFollower::default(), Listener::default());
    look(&mut surface, 2.0, 0.0);
    follower.follow(&surface);
    first.hear(take(&mut follower, &surface, usize::MAX));
    for step in 1..12 {
        look(&mut surface, 2.9, f64::from(step));
        follower.follow(&surface);
    }
    follower.begin_to_show(&surface);
    let changes = take(&mut follower, &surface, usize::MAX);
    let mut later = Listener::default();
    later.hear(changes.iter().filter(|change| !change.mesh.is_empty()).cloned().collect());
    first.hear(changes);
    assert_eq!((first.farthest_off(&surface), later.farthest_off(&surface)), (0.0, 0.0));
    assert!(!later.0.is_empty());
}

/// A block that was taken away by hand.
#[test]
fn a_block_that_has_gone_has_no_triangles() {
    let mut surface = field(0.05, 1, |[x, y, z]| Some((x + y + z) as f32 / 3.0 - 0.2));
    let (mut follower, mut listener) = (MeshFollower::default(), Listener::default());
    follower.begin_to_show(&surface);
    listener.hear(take(&mut follower, &surface, usize::MAX));
    let gone = *listener.0.keys().next_back().unwrap();
    surface.remove_block(gone);
    follower.follow_block(gone);
    let changes = take(&mut follower, &surface, usize::MAX);
    assert!(changes.iter().any(|change| change.key == gone && change.mesh.is_empty()));
    listener.hear(changes);
    assert_eq!(listener.farthest_off(&surface), 0.0);
}
