//! Voxels to a file.

use geometry::VoxelKey;

use super::{FIRST_LINE, INNER, KEY_OFFSET, LEVELS, OCCUPIED, OctomapError};

/// A binary octomap of these voxels, which may come in any order and more than once, with `edge_m`, a positive
/// number, as its resolution. Not pruned: eight leaves stay eight.
///
/// # Errors
/// When a voxel is out of the reach of octomap's keys.
pub fn encode(edge_m: f64, voxels: &[VoxelKey]) -> Result<Vec<u8>, OctomapError> {
    let mut codes: Vec<u64> = voxels.iter().filter_map(code).collect();
    if codes.len() < voxels.len() {
        return Err(OctomapError::OutOfReach { voxels: voxels.len() - codes.len() });
    }
    codes.sort_unstable();
    codes.dedup();
    let mut data = Vec::new();
    if !codes.is_empty() {
        append_node(&codes, LEVELS - 1, &mut data);
    }
    // Two bytes for each node that is no leaf.
    let nodes = data.len() / 2 + codes.len();
    let mut file = format!(
        "{FIRST_LINE}\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n\
         id OcTree\nsize {nodes}\nres {edge_m}\ndata\n"
    )
    .into_bytes();
    file.append(&mut data);
    Ok(file)
}

/// The way from the root to a voxel, three bits a level, the highest level first; `None` out of reach. The codes
/// of a node's voxels stand together in ascending order.
fn code(voxel: &VoxelKey) -> Option<u64> {
    let mut code = 0;
    for (axis, cell) in [voxel.x, voxel.y, voxel.z].into_iter().enumerate() {
        let key = u16::try_from(i64::from(cell) + KEY_OFFSET).ok()?;
        for level in 0..LEVELS {
            code |= u64::from(key >> level & 1) << (3 * level + axis as u32);
        }
    }
    Some(code)
}

/// Appends a node that is no leaf. `level` is that of its children, 0 for the leaves; `codes` are not empty.
fn append_node(codes: &[u64], level: u32, data: &mut Vec<u8>) {
    let child = |code: u64| code >> (3 * level) & 0b111;
    let kind = if level == 0 { OCCUPIED } else { INNER };
    let children = || codes.chunk_by(|a, b| child(*a) == child(*b));
    let bits = children()
        .filter_map(|codes| codes.first())
        .fold(0, |bits, code| bits | kind << (2 * child(*code)));
    data.extend_from_slice(&bits.to_le_bytes());
    if let Some(below) = level.checked_sub(1) {
        for codes in children() {
            append_node(codes, below, data);
        }
    }
}
