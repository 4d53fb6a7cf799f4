//! A file to voxels.

use geometry::VoxelKey;

use super::{FIRST_LINE, FREE, INNER, KEY_OFFSET, LEVELS, OCCUPIED, OctomapError, Octree};

/// The occupied voxels of a binary octomap, at most so many. A file that has more takes no memory: its voxels are counted
/// before they are made, since one leaf may stand for 2^45 of them.
///
/// # Errors
/// When the bytes are no such file, are cut off, or hold more voxels.
pub fn decode(bytes: &[u8], most_voxels: usize) -> Result<Octree, OctomapError> {
    let (header, data) = Header::split_off(bytes)?;
    let mut count = 0_u64;
    read_leaves(header, data, &mut |_, level| count = count.saturating_add(1 << (3 * level)))?;
    let capacity = usize::try_from(count).ok().filter(|count| *count <= most_voxels);
    let capacity = capacity.ok_or(OctomapError::TooManyVoxels { most: most_voxels })?;
    let mut voxels = Vec::with_capacity(capacity);
    read_leaves(header, data, &mut |corner, level| push_cube(&mut voxels, corner, level))?;
    Ok(Octree { edge_m: header.edge_m, voxels })
}

/// Calls `leaf` with each occupied leaf: its lowest key, and its level.
fn read_leaves(
    header: Header,
    data: &[u8],
    leaf: &mut impl FnMut([i64; 3], u32),
) -> Result<(), OctomapError> {
    let mut reader = Reader { data, header, nodes: 0, leaf };
    if header.nodes > 0 {
        reader.nodes = 1;
        reader.read_node([0; 3], LEVELS - 1)?;
    }
    if reader.nodes != header.nodes {
        return Err(OctomapError::OtherSize { promised: header.nodes, found: reader.nodes });
    }
    Ok(())
}

/// A leaf as voxels: a cube of 2^level of them an axis.
fn push_cube(voxels: &mut Vec<VoxelKey>, corner: [i64; 3], level: u32) {
    let side = 1_i64 << level;
    let [x, y, z] = corner.map(|key| key - KEY_OFFSET);
    for x in x..x + side {
        for y in y..y + side {
            let voxel = |z: i64| VoxelKey { x: x as i32, y: y as i32, z: z as i32 };
            voxels.extend((z..z + side).map(voxel));
        }
    }
}

#[derive(Clone, Copy)]
struct Header {
    nodes: usize,
    edge_m: f64,
}

impl Header {
    /// The header, and what follows it.
    fn split_off(bytes: &[u8]) -> Result<(Self, &[u8]), OctomapError> {
        let Some(mut rest) = bytes.strip_prefix(FIRST_LINE.as_bytes()) else {
            return Err(OctomapError::NotThisFormat);
        };
        let (mut is_octree, mut nodes, mut edge_m) = (false, None, None);
        loop {
            // The first turn ends the first line.
            let end = rest.iter().position(|byte| *byte == b'\n');
            let end = end.ok_or(OctomapError::Header { entry: "data" })?;
            let (line, after) = rest.split_at(end);
            rest = after.get(1..).unwrap_or_default();
            let line = str::from_utf8(line).unwrap_or_default();
            let mut words = line.split_ascii_whitespace();
            match (words.next(), words.next()) {
                (Some("id"), name) => is_octree = name == Some("OcTree"),
                (Some("size"), Some(number)) => nodes = number.parse().ok(),
                (Some("res"), Some(number)) => edge_m = number.parse().ok(),
                (Some("data"), _) => break,
                _ => {}
            }
        }
        if !is_octree {
            return Err(OctomapError::Header { entry: "id OcTree" });
        }
        let nodes = nodes.ok_or(OctomapError::Header { entry: "size" })?;
        let edge_m = edge_m.filter(|edge_m: &f64| edge_m.is_finite() && *edge_m > 0.0);
        let edge_m = edge_m.ok_or(OctomapError::Header { entry: "res" })?;
        Ok((Self { nodes, edge_m }, rest))
    }
}

struct Reader<'a, Leaf> {
    data: &'a [u8],
    header: Header,
    /// Found so far, the root included.
    nodes: usize,
    leaf: &'a mut Leaf,
}

impl<Leaf: FnMut([i64; 3], u32)> Reader<'_, Leaf> {
    /// Reads a node that is no leaf, from `corner`, the lowest of octomap's keys in it. `level` is that of its
    /// children, 0 for the leaves; so deep does the reader call itself.
    fn read_node(&mut self, corner: [i64; 3], level: u32) -> Result<(), OctomapError> {
        let Some((bits, rest)) = self.data.split_first_chunk() else {
            return Err(OctomapError::CutOff { nodes: self.header.nodes });
        };
        self.data = rest;
        let bits = u16::from_le_bytes(*bits);
        for child in 0..8 {
            let half = |axis: usize| (i64::from(child) >> axis & 1) << level;
            let corner = [0, 1, 2].map(|axis| corner[axis] + half(axis));
            match bits >> (2 * child) & 0b11 {
                FREE => self.nodes += 1,
                OCCUPIED => {
                    self.nodes += 1;
                    (self.leaf)(corner, level);
                }
                // The children of all inner nodes come after the two bytes of their parent, in turn.
                INNER => {
                    let below = level.checked_sub(1).ok_or(OctomapError::TooDeep)?;
                    self.nodes += 1;
                    self.read_node(corner, below)?;
                }
                _ => {}
            }
        }
        Ok(())
    }
}
