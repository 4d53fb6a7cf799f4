//! A page that decodes messages, as `live_messages.js` does.

use std::collections::BTreeMap;
use std::io::Read;

use geometry::{VoxelGrid, VoxelKey};
use nalgebra::Point3;

use live_view::message::Kind;
use live_view::{BlockKey, TILE_EDGE_BLOCKS};

/// The blocks that a page has.
#[derive(Default)]
pub(super) struct DecodedPage {
    epoch: u32,
    pub(super) voxel_edge_m: f32,
    block_edge_m: f32,
    pub(super) step_m: f32,
    blocks: BTreeMap<BlockKey, Vec<[u16; 3]>>,
    pub(super) total: u32,
    pub(super) last_blocks: u32,
}

/// The body of a message.
pub(super) fn body(message: &[u8]) -> Vec<u8> {
    if message[1] == 0 {
        return message[2..].to_vec();
    }
    let mut body = Vec::new();
    flate2::read::DeflateDecoder::new(&message[2..]).read_to_end(&mut body).unwrap();
    body
}

/// What is left of a body.
pub(super) struct Reader<'a>(pub(super) &'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, length: usize) -> &'a [u8] {
        let (taken, rest) = self.0.split_at(length);
        self.0 = rest;
        taken
    }

    pub(super) fn array<const N: usize>(&mut self) -> [u8; N] {
        self.take(N).try_into().unwrap()
    }

    pub(super) fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.array())
    }

    pub(super) fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.array())
    }

    pub(super) fn differences(&mut self, count: usize) -> Vec<u16> {
        let (low, high) = (self.take(count), self.take(count));
        let mut value = 0_u16;
        let next = |(low, high): (&u8, &u8)| {
            let folded = u16::from_le_bytes([*low, *high]);
            let difference = (folded >> 1).cast_signed() ^ -(folded & 1).cast_signed();
            value = value.wrapping_add(difference.cast_unsigned());
            value
        };
        low.iter().zip(high).map(next).collect()
    }
}

impl DecodedPage {
    pub(super) fn take(&mut self, message: &[u8]) {
        if message[0] != Kind::Map as u8 {
            return;
        }
        let body = body(message);
        let mut reader = Reader(&body);
        let epoch = reader.u32();
        if epoch != self.epoch {
            *self = Self { epoch, ..Self::default() };
        }
        self.voxel_edge_m = reader.f32();
        self.block_edge_m = reader.f32();
        self.step_m = reader.f32();
        assert_eq!(reader.array::<2>(), [TILE_EDGE_BLOCKS as u8, 0]);
        assert_eq!(reader.array::<2>(), [0, 0], "no colours");
        self.total = reader.u32();
        self.last_blocks = reader.u32();
        let heads: Vec<(BlockKey, usize)> = (0..self.last_blocks)
            .map(|_| {
                ([0; 3].map(|_: i32| i32::from_le_bytes(reader.array())), reader.u32() as usize)
            })
            .collect();
        for (key, count) in heads {
            let axes = [0; 3].map(|_| reader.differences(count));
            let points = (0..count).map(|n| [axes[0][n], axes[1][n], axes[2][n]]).collect();
            if count == 0 {
                self.blocks.remove(&key);
            } else {
                self.blocks.insert(key, points);
            }
        }
        assert!(reader.0.is_empty());
    }

    pub(super) fn points(&self) -> impl Iterator<Item = (VoxelKey, Point3<f64>)> {
        let tile_edge_m = f64::from(self.block_edge_m) * f64::from(TILE_EDGE_BLOCKS);
        let grid = VoxelGrid::new(f64::from(self.voxel_edge_m.max(f32::MIN_POSITIVE))).unwrap();
        self.blocks.iter().flat_map(move |(key, points)| {
            points.iter().map(move |steps| {
                let at = |axis: usize| {
                    let tile = key[axis].div_euclid(TILE_EDGE_BLOCKS);
                    f64::from(tile) * tile_edge_m + f64::from(steps[axis]) * f64::from(self.step_m)
                };
                let at_m = Point3::new(at(0), at(1), at(2));
                (grid.key(&at_m), at_m)
            })
        })
    }
}
