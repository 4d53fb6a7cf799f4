//! What listeners have of the mesh: of a map whose tiles are spilled, and of one that is corrected.

use std::collections::BTreeMap;

use geometry::MeshUpdate;

use super::spilling::{MOST, drive, spilling};
use super::*;

/// The triangles that a listener has, by block.
#[derive(Default)]
struct Listener(BTreeMap<[i32; 3], geometry::TriangleMesh>);

impl Listener {
    fn hear(&mut self, update: MeshUpdate) {
        if update.is_anew {
            self.0.clear();
        }
        for piece in update.pieces {
            if piece.mesh.triangles.is_empty() {
                self.0.remove(&piece.block);
            } else {
                self.0.insert(piece.block, piece.mesh);
            }
        }
    }

    fn take_all(&mut self, map: &mut Map) {
        while let Some(update) = map.take_mesh_changes(usize::MAX) {
            self.hear(update);
        }
    }

    fn corners(&self) -> Vec<[[u32; 3]; 3]> {
        corners(self.0.values())
    }
}

/// The corners of triangles in an order of their own.
fn corners<'a>(meshes: impl IntoIterator<Item = &'a geometry::TriangleMesh>) -> Vec<[[u32; 3]; 3]> {
    let of_mesh = |mesh: &geometry::TriangleMesh| {
        let bits = |corner: Point3<f32>| [corner.x, corner.y, corner.z].map(f32::to_bits);
        let corners = (0..mesh.triangles.len()).map(|index| mesh.corners_m(index).unwrap());
        corners.map(|corners| corners.map(bits)).collect::<Vec<_>>()
    };
    let mut all: Vec<_> = meshes.into_iter().flat_map(of_mesh).collect();
    all.sort_unstable();
    all
}

#[test]
fn listeners_have_the_mesh_of_a_map_that_is_larger_than_its_memory() {
    let (mut map, _store) = spilling(MOST);
    map.follow_mesh();
    let mut first = Listener::default();
    for cycle in &drive() {
        map.integrate(cycle).unwrap();
        if let Some(update) = map.take_mesh_changes(5_000) {
            first.hear(update);
        }
    }
    first.take_all(&mut map);
    // One that comes now is told of what was spilled, too.
    map.follow_mesh();
    let mut later = Listener::default();
    later.take_all(&mut map);
    let whole = map.mesh().unwrap();
    assert!(whole.triangles.len() > 20_000);
    assert_eq!(later.corners(), corners([&whole]));
    // The first one has about the same: a block is told of again when it has changed by more than a listener is to notice.
    assert!(first.0.keys().eq(later.0.keys()));
}

#[test]
fn listeners_have_the_mesh_of_a_map_that_was_corrected() {
    let mut map = map(0.05);
    map.follow_mesh();
    map.follow_path(&path_at(0.0)).unwrap();
    map.integrate(&cycle(&Scene::room(), 0, &rig_at(0.0, 0.0), None)).unwrap();
    let mut listener = Listener::default();
    listener.take_all(&mut map);
    let before = listener.corners();
    map.follow_path(&path_at(0.4)).unwrap();
    listener.take_all(&mut map);
    assert_eq!(listener.corners(), corners([&map.mesh().unwrap()]));
    assert_ne!(listener.corners(), before);
    assert_eq!(map.take_mesh_changes(usize::MAX), None);
}
