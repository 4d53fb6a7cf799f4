use std::collections::BTreeSet;

use proptest::prelude::*;

use super::*;

const HEADER: &str = "# Octomap OcTree binary file\n\
    # (feel free to add / change comments, but leave the first line as it is!)\n#\n\
    id OcTree\nsize 17\nres 0.08\ndata\n";

fn key(x: i32, y: i32, z: i32) -> VoxelKey {
    VoxelKey { x, y, z }
}

/// A file of the header's size with these nodes.
fn file(nodes: usize, data: &[u8]) -> Vec<u8> {
    let mut file = HEADER.replace("size 17", &format!("size {nodes}")).into_bytes();
    file.extend_from_slice(data);
    file
}

#[test]
fn one_voxel_by_hand() {
    // Cell 0 an axis has key 32768: the upper half at the root, the lower half at the 15 levels below. Child 7
    // is in the upper two bits of the second byte, child 0 in the lower two of the first.
    let mut data = vec![0, 0b1100_0000];
    data.extend([0b11, 0].repeat(14));
    data.extend([0b10, 0]);
    let expected = file(17, &data);
    assert_eq!(encode(0.08, &[key(0, 0, 0)]).unwrap(), expected);
    let octree = decode(&expected, 10).unwrap();
    assert_eq!(octree, Octree { edge_m: 0.08, voxels: vec![key(0, 0, 0)] });
}

#[test]
fn children_stand_by_x_then_y_then_z() {
    for (voxel, child) in [(key(1, 0, 0), 1), (key(0, 1, 0), 2), (key(0, 0, 1), 4)] {
        let bytes = encode(0.08, &[voxel]).unwrap();
        let last = u16::from_le_bytes([bytes[bytes.len() - 2], bytes[bytes.len() - 1]]);
        assert_eq!(last, 0b10 << (2 * child));
    }
}

#[test]
fn a_pruned_cube_is_all_its_voxels_and_free_leaves_are_none() {
    // Down to the node of 4 voxels an axis about the cell (0, 0, 0): there child 0 is an occupied cube of two
    // voxels an axis, child 1 a free one.
    let mut data = vec![0, 0b1100_0000];
    data.extend([0b11, 0].repeat(13));
    data.extend([0b0110, 0]);
    let octree = decode(&file(17, &data), 8).unwrap();
    let expected: Vec<_> = (0..8).map(|bits| key(bits >> 2, bits >> 1 & 1, bits & 1)).collect();
    assert_eq!(octree.voxels, expected);
    assert_eq!(decode(&file(17, &data), 7), Err(OctomapError::TooManyVoxels { most: 7 }));
    // An eighth of all there is.
    let huge = decode(&file(2, &[0b10, 0]), 1_000_000);
    assert_eq!(huge, Err(OctomapError::TooManyVoxels { most: 1_000_000 }));
}

#[test]
fn an_empty_map_is_a_file_without_nodes() {
    let bytes = encode(0.05, &[]).unwrap();
    assert!(bytes.ends_with(b"id OcTree\nsize 0\nres 0.05\ndata\n"));
    assert_eq!(decode(&bytes, 0).unwrap(), Octree { edge_m: 0.05, voxels: vec![] });
}

#[test]
fn what_is_beyond_the_keys_is_told() {
    let most = i32::from(i16::MAX);
    let least = i32::from(i16::MIN);
    let corners = [key(least, least, least), key(most, most, most), key(least, most, 0)];
    let octree = decode(&encode(1.0, &corners).unwrap(), 3).unwrap();
    assert_eq!(BTreeSet::from_iter(octree.voxels), BTreeSet::from(corners));
    let out = [key(most + 1, 0, 0), key(0, least - 1, 0), key(0, 0, i32::MAX), key(0, 0, 0)];
    assert_eq!(encode(1.0, &out), Err(OctomapError::OutOfReach { voxels: 3 }));
}

#[test]
fn what_is_wrong_is_said() {
    let good = encode(0.08, &[key(3, -4, 5)]).unwrap();
    let with = |from: &str, to: &str| {
        let at = good.windows(from.len()).position(|part| part == from.as_bytes()).unwrap();
        [&good[..at], to.as_bytes(), &good[at + from.len()..]].concat()
    };
    for (bytes, part) in [
        (b"ply\n".to_vec(), "no binary octomap"),
        (with("OcTree\n", "ColorOcTree\n"), "'id OcTree'"),
        (with("size 17", "size many"), "'size'"),
        (with("res 0.08", "res -1"), "'res'"),
        (with("data\n", ""), "'data'"),
        (with("size 17", "size 16"), "17 nodes, not the 16"),
        (good[..good.len() - 1].to_vec(), "cut off within its 17 nodes"),
        (file(18, &[0b11, 0].repeat(17)), "more than 16 levels"),
    ] {
        let error = decode(&bytes, 10).unwrap_err().to_string();
        assert!(error.contains(part), "{part}: {error}");
    }
}

proptest! {
    #[test]
    fn voxels_survive_the_file(
        voxels in prop::collection::vec(prop::array::uniform3(prop_oneof![-4..4_i32, -32768..32768_i32]), 0..200),
        edge_m in 1e-3..10.0_f64,
    ) {
        let voxels: Vec<_> = voxels.into_iter().map(|[x, y, z]| key(x, y, z)).collect();
        let bytes = encode(edge_m, &voxels).unwrap();
        let octree = decode(&bytes, voxels.len()).unwrap();
        prop_assert_eq!(octree.edge_m, edge_m);
        let expected = BTreeSet::from_iter(voxels.iter().copied());
        prop_assert_eq!(octree.voxels.len(), expected.len());
        prop_assert_eq!(BTreeSet::from_iter(octree.voxels), expected);
        // The order of the voxels changes no byte.
        let backwards: Vec<_> = voxels.into_iter().rev().collect();
        prop_assert_eq!(encode(edge_m, &backwards).unwrap(), bytes);
    }

    #[test]
    fn no_bytes_make_it_panic(data in prop::collection::vec(any::<u8>(), 0..300), nodes in 0..200_usize) {
        let _ = decode(&data, 100);
        if let Ok(octree) = decode(&file(nodes, &data), 100) {
            prop_assert!(octree.voxels.len() <= 100);
        }
    }
}
