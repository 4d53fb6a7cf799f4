//! Who asks for triangles has those that are there, and nobody else is sent any.

use std::collections::BTreeMap;

use geometry::{MeshPiece, MeshUpdate, TriangleMesh};
use nalgebra::Point3;

use super::decoded::{Reader, body};
use super::{EDGE_M, MANY};
use crate::message::Kind;
use crate::{BlockKey, Browser, LiveState};

/// Whether a message with triangles is the first one, and its blocks: how many triangles, and the least coordinates.
fn mesh_heads(message: &[u8]) -> (bool, Vec<(BlockKey, u32, [f32; 3])>) {
    let body = body(message);
    let mut reader = Reader(&body);
    let is_first = reader.u32() == 1;
    let (_total, _refused, blocks) = (reader.u32(), reader.u32(), reader.u32());
    let heads = (0..blocks).map(|_| {
        let key = [0; 3].map(|_: i32| i32::from_le_bytes(reader.array()));
        let triangles = reader.u32();
        if triangles == 0 {
            return (key, 0, [0.0; 3]);
        }
        let least_m = [0; 3].map(|_: i32| reader.f32());
        assert!(reader.f32() >= 0.001);
        assert_eq!(reader.array::<2>(), [0, 0], "no colours");
        (0..3).for_each(|_| drop(reader.differences(3 * triangles as usize)));
        (key, triangles, least_m)
    });
    let heads: Vec<_> = heads.collect();
    assert!(reader.0.is_empty());
    (is_first, heads)
}

/// Triangles of a block, at a height.
fn piece(block: BlockKey, triangles: u32, height_m: f32) -> MeshPiece {
    let along_m = block[0] as f32;
    let corner =
        |n: u32| Point3::new(along_m + 0.01 * (n % 3) as f32, 0.02 * (n / 3) as f32, height_m);
    let mesh = TriangleMesh {
        points_m: (0..3 * triangles).map(corner).collect(),
        triangles: (0..triangles).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect(),
        ..TriangleMesh::default()
    };
    MeshPiece { block, mesh }
}

fn update(is_anew: bool, pieces: Vec<MeshPiece>) -> MeshUpdate {
    MeshUpdate { is_anew, pieces, ..MeshUpdate::default() }
}

/// What a page has of the mesh: by block its triangles, and the height of the first corner.
fn drain_mesh(browser: &mut Browser, state: &LiveState, page: &mut BTreeMap<BlockKey, (u32, f32)>) {
    while let Some(message) = browser.next_message(state) {
        if message[0] == Kind::Mesh as u8 {
            let (is_first, blocks) = mesh_heads(&message);
            if is_first {
                page.clear();
            }
            for (key, triangles, least_m) in blocks {
                page.remove(&key);
                if triangles > 0 {
                    page.insert(key, (triangles, least_m[2]));
                }
            }
        }
    }
}

#[test]
fn who_asks_for_triangles_has_those_of_each_block_and_nobody_else_is_sent_any() {
    let mut state = LiveState::new(EDGE_M, MANY, 100).unwrap();
    let (mut asks, mut does_not) = (Browser::default(), Browser::default());
    let [mut page, mut other] = [const { BTreeMap::new() }; 2];
    asks.want_mesh(true);
    let blocks = vec![piece([0; 3], 3, 1.0), piece([-1, 0, 0], 2, 2.0), piece([5, 5, 5], 4, 0.5)];
    state.mesh_mut().take(&update(true, blocks));
    for browser in [(&mut asks, &mut page), (&mut does_not, &mut other)] {
        drain_mesh(browser.0, &state, browser.1);
    }
    let expected = [([-1, 0, 0], (2, 2.0)), ([0; 3], (3, 1.0)), ([5; 3], (4, 0.5))];
    assert_eq!(page, BTreeMap::from(expected));
    assert!(other.is_empty() && state.mesh().len() == 9);
    // One changes, one goes; who begins to ask has all that is there by then.
    state.mesh_mut().take(&update(false, vec![piece([0; 3], 1, 3.0), piece([5; 3], 0, 0.0)]));
    does_not.want_mesh(true);
    drain_mesh(&mut asks, &state, &mut page);
    drain_mesh(&mut does_not, &state, &mut other);
    assert_eq!(page, BTreeMap::from([([-1, 0, 0], (2, 2.0)), ([0; 3], (1, 3.0))]));
    assert_eq!(page, other);
    // Asked for again after an end, all comes again, in the place of what has gone since.
    asks.want_mesh(false);
    asks.want_mesh(true);
    page.insert([9; 3], (1, 1.0));
    drain_mesh(&mut asks, &state, &mut page);
    assert_eq!(page, other);
    state.mesh_mut().take(&update(true, Vec::new()));
    drain_mesh(&mut asks, &state, &mut page);
    assert!(page.is_empty() && state.mesh().is_empty());
}

#[test]
fn triangles_have_a_bound_and_none_that_is_old_stays_for_want_of_room() {
    let mut state = LiveState::new(EDGE_M, MANY, 10).unwrap();
    state.mesh_mut().take(&update(false, vec![piece([0; 3], 6, 1.0), piece([1; 3], 4, 1.0)]));
    assert_eq!((state.mesh().len(), state.mesh().refused()), (10, 0));
    state.mesh_mut().take(&update(false, vec![piece([0; 3], 7, 2.0)]));
    assert_eq!((state.mesh().len(), state.mesh().refused()), (4, 7));
    // What is no place is not drawn.
    let mut odd = piece([2; 3], 2, 1.0);
    odd.mesh.points_m[4].x = f32::NAN;
    odd.mesh.triangles[0][2] = 99;
    state.mesh_mut().take(&update(false, vec![odd]));
    assert_eq!(state.mesh().len(), 4);
}
