//! The nodes of a block.

use nalgebra::Point3;

use crate::block::BLOCK_VOXELS;
use crate::evidence::Evidence;
use crate::ticks::TICK_S;

/// The distance that stands for the whole truncation.
pub(super) const FULL: f32 = 32_767.0;
/// From this share of the truncation on a distance says that there is no surface.
const NO_SURFACE: i16 = 31_000;
/// A block is in the same place before the camera when it has moved by no more than this, in its edges: what the border of the
/// image has left out of it all the time is then but a strip.
const SAME_PLACE_IN_EDGES: f64 = 0.25;

/// Nodes of a block, in flat arrays: x runs fastest, then y, then z. Four bytes a node, and three of colour.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct SurfaceBlock {
    /// Shares of the truncation in 32767ths; positive before the surface.
    pub(super) distance: [i16; BLOCK_VOXELS],
    /// 0 where nothing is known.
    pub(super) weight: [u16; BLOCK_VOXELS],
    /// Red, green, blue; [`geometry::NO_COLOUR`] where none was seen.
    pub(super) colour: Option<Box<[[u8; 3]; BLOCK_VOXELS]>>,
    /// For there being a surface in it.
    pub(super) evidence: Evidence,
    /// The tick of the first image that it was compared with.
    pub(super) first_seen: u32,
    /// In a correction the weight of the nodes that came with that moment; 0 otherwise.
    pub(super) moment_weight: u32,
    /// The tick of the last image that changed it.
    pub(super) last_seen: u32,
    /// The tick of the last image that showed a surface in it.
    pub(super) last_hit: u32,
    /// Where the camera was then, in the map.
    pub(super) hit_from_m: [f32; 3],
    /// Where its middle is in the frame of the camera, where all images that showed a surface in it saw it in the same place, to
    /// [`SAME_PLACE_IN_EDGES`].
    pub(super) seen_at_m: Option<[f32; 3]>,
    /// Nodes near the surface when they were counted last; see [`SurfaceBlock::count_near`].
    pub(super) near_nodes: u16,
}

impl Default for SurfaceBlock {
    fn default() -> Self {
        Self {
            distance: [0; BLOCK_VOXELS],
            weight: [0; BLOCK_VOXELS],
            colour: None,
            evidence: Evidence::default(),
            first_seen: 0,
            moment_weight: 0,
            last_seen: 0,
            last_hit: 0,
            hit_from_m: [0.0; 3],
            seen_at_m: None,
            near_nodes: 0,
        }
    }
}

impl SurfaceBlock {
    /// An image from a camera in this place shows a surface in it, which has its middle in that place of its own frame.
    pub(super) fn hit(
        &mut self,
        now: u32,
        hit_from_m: [f32; 3],
        middle_in_camera_m: [f32; 3],
        edge_m: f64,
    ) {
        self.evidence.hit();
        let is_same = self.last_hit == 0 || self.was_seen_only_at(middle_in_camera_m, edge_m);
        let first_m = self.seen_at_m.unwrap_or(middle_in_camera_m);
        self.seen_at_m = is_same.then_some(first_m);
        (self.last_hit, self.hit_from_m) = (now, hit_from_m);
    }

    /// Whether all images that showed a surface in it saw it in the same place as one that has its middle there. `edge_m` is the
    /// edge of a block.
    pub(super) fn was_seen_only_at(&self, middle_in_camera_m: [f32; 3], edge_m: f64) -> bool {
        self.seen_at_m.is_some_and(|seen_at_m| {
            let moved_m = Point3::from(seen_at_m) - Point3::from(middle_in_camera_m);
            f64::from(moved_m.norm()) <= SAME_PLACE_IN_EDGES * edge_m
        })
    }

    /// Forgets everything, and keeps the memory of the colours.
    pub(super) fn clear(&mut self) {
        self.distance = [0; BLOCK_VOXELS];
        self.weight = [0; BLOCK_VOXELS];
        if let Some(colour) = &mut self.colour {
            **colour = [[0; 3]; BLOCK_VOXELS];
        }
        self.evidence = Evidence::default();
        (self.first_seen, self.moment_weight) = (0, 0);
        (self.last_seen, self.last_hit) = (0, 0);
        (self.hit_from_m, self.seen_at_m) = ([0.0; 3], None);
        self.near_nodes = 0;
    }

    /// The time from the first image that it was compared with to the last that showed a surface in it.
    pub(super) fn lasted_s(&self) -> f64 {
        f64::from(self.last_hit.saturating_sub(self.first_seen)) * TICK_S
    }

    /// The time since the last image that showed a surface in it.
    pub(super) fn missed_s(&self, now: u32) -> f64 {
        f64::from(now.saturating_sub(self.last_hit)) * TICK_S
    }

    /// The weight of all its nodes.
    pub(super) fn weight(&self) -> u32 {
        self.weight.iter().map(|weight| u32::from(*weight)).sum()
    }

    /// So much weight came to it that was seen first at that moment: the heaviest part counts, the earliest of equal ones.
    pub(super) fn take_moment(&mut self, first_seen: u32, weight: u32) {
        let is_of_this = (weight, self.first_seen) > (self.moment_weight, first_seen);
        if is_of_this {
            (self.first_seen, self.moment_weight) = (first_seen, weight);
        }
    }

    /// Whether some node is near a surface.
    pub(super) fn has_surface(&self) -> bool {
        let near = |(distance, weight): (&i16, &u16)| (*weight != 0) & (*distance < NO_SURFACE);
        self.distance.iter().zip(&self.weight).fold(false, |any, node| any | near(node))
    }

    /// How many nodes are no farther from a surface than `most`, in 32767ths of the truncation.
    pub(super) fn count_near(&self, most: i16) -> u16 {
        let near = |(distance, weight): (&i16, &u16)| {
            (*weight != 0) & (*distance <= most) & (*distance >= -most)
        };
        let nodes = self.distance.iter().zip(&self.weight);
        nodes.fold(0, |count, node| count + u16::from(near(node)))
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let colour = self.colour.as_ref().map_or(0, |colour| size_of_val(&**colour));
        size_of::<Self>() + colour
    }
}
