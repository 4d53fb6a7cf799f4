//! The messages to a browser. `page/src/live_messages.js` of the report reads them.
//!
//! The first byte is the kind, the second whether the rest is compressed (deflate, RFC 1951). Numbers are little-endian.

use report::payload::{Effort, deflated, drawn_colour, push_colours, push_differences_16};

use crate::map::{BlockKey, LiveMap, PlacedPoint, TILE_EDGE_BLOCKS};
use crate::mesh::LiveMesh;

/// Shorter messages are not compressed.
const WORTH_COMPRESSING_BYTES: usize = 256;

/// What a message is about.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum Kind {
    /// Blocks of the map, each whole: it takes the place of what the browser has of it.
    Map = 1,
    /// The latest cycle: what the sensors saw, what moves, where the rig is.
    Moment = 2,
    /// The state of the nodes, as JSON.
    Status = 3,
    /// Triangles by blocks, each whole: they take the place of what the browser has of them. For a browser that asks for them.
    Mesh = 4,
}

/// A message of `kind` with this body.
#[must_use]
pub fn message(kind: Kind, body: &[u8]) -> Vec<u8> {
    let is_compressed = body.len() >= WORTH_COMPRESSING_BYTES;
    let mut message = vec![kind as u8, u8::from(is_compressed)];
    if is_compressed {
        message.extend(deflated(body, Effort::Least));
    } else {
        message.extend(body);
    }
    message
}

/// These blocks of the map as they are; one that the map does not have is sent without points.
#[must_use]
pub fn of_map(map: &LiveMap, blocks: &[BlockKey]) -> Vec<u8> {
    message(Kind::Map, &map_body(map, blocks))
}

fn map_body(map: &LiveMap, blocks: &[BlockKey]) -> Vec<u8> {
    let has_colours = map.has_colours();
    let mut body = Vec::new();
    body.extend(map.epoch().to_le_bytes());
    body.extend((map.voxel_edge_m() as f32).to_le_bytes());
    body.extend((map.block_edge_m() as f32).to_le_bytes());
    body.extend((map.step_m() as f32).to_le_bytes());
    body.extend((TILE_EDGE_BLOCKS as u16).to_le_bytes());
    body.extend(u16::from(has_colours).to_le_bytes());
    body.extend((map.len() as u32).to_le_bytes());
    body.extend((blocks.len() as u32).to_le_bytes());
    for key in blocks {
        key.iter().for_each(|along| body.extend(along.to_le_bytes()));
        body.extend((map.point_count(key) as u32).to_le_bytes());
    }
    for key in blocks {
        push_points(&mut body, map.points(key), has_colours);
    }
    body
}

fn push_points(
    body: &mut Vec<u8>,
    points: impl Iterator<Item = PlacedPoint> + Clone,
    has_colours: bool,
) {
    for axis in 0..3 {
        push_differences_16(body, points.clone().map(|point| point.steps[axis]));
    }
    if has_colours {
        push_colours(body, points.map(|point| drawn_colour(point.colour)));
    }
}

/// The triangles of these blocks as they are; a block that the mesh does not have is sent without. The first message takes the place of all
/// that the browser has: it may have asked before, and what was on its way then may have come since.
#[must_use]
pub fn of_mesh(mesh: &LiveMesh, blocks: &[BlockKey], is_first: bool) -> Vec<u8> {
    let mut body = Vec::new();
    for number in [usize::from(is_first), mesh.len(), mesh.refused(), blocks.len()] {
        body.extend((number as u32).to_le_bytes());
    }
    for key in blocks {
        key.iter().for_each(|along| body.extend(along.to_le_bytes()));
        let block = mesh.block(key);
        let triangles = block.map_or(0, |block| block.triangles());
        body.extend((triangles as u32).to_le_bytes());
        let Some(block) = block else { continue };
        block.least_m.iter().for_each(|along| body.extend(along.to_le_bytes()));
        body.extend(block.step_m.to_le_bytes());
        let has_colours = !block.colours.is_empty();
        body.extend(u16::from(has_colours).to_le_bytes());
        for axis in 0..3 {
            push_differences_16(&mut body, block.corners.iter().map(|corner| corner[axis]));
        }
        if has_colours {
            push_colours(&mut body, block.colours.iter().copied().map(drawn_colour));
        }
    }
    message(Kind::Mesh, &body)
}
