//! How much memory a map takes.

use std::mem::size_of;

use super::{Arena, Keyframe, KeyframeId, Map, MapLine, MapPoint, Shared};
use crate::feature::lines::{LineFeature, SegmentInSpace};
use crate::feature::points::Corner;
use crate::frame::MeasuredDepth;
use crate::place_recognition::BYTES_OF_LOOK;

/// Trees of the standard library have nodes of 11 places, about two thirds of them taken.
const TREE_SHARE: f64 = 1.6;

/// The memory of a map.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct MapMemory {
    /// Keyframes: their features, their covisibility, and their descriptors in the index of places.
    pub keyframes_bytes: usize,
    /// Points and lines, and their observations.
    pub landmarks_bytes: usize,
}

impl MapMemory {
    /// All of it.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.keyframes_bytes + self.landmarks_bytes
    }
}

impl Map {
    /// The memory of the map with the index of its places, by its contents; the allocator's overhead is not in it, nor the
    /// 1.6 MB that an index of places begins with. A snapshot that
    /// shares what has not changed costs next to nothing besides. Takes a microsecond a keyframe.
    #[must_use]
    pub fn memory(&self) -> MapMemory {
        let sightings = |keyframe: &Keyframe| {
            keyframe.points().iter().flatten().count() + keyframe.lines().iter().flatten().count()
        };
        let seen: usize = self.keyframes.iter().map(|(_, keyframe)| sightings(keyframe)).sum();
        let keyframes = self.keyframes.iter().map(|(_, keyframe)| bytes_of(keyframe));
        MapMemory {
            keyframes_bytes: keyframes.sum(),
            landmarks_bytes: arena_bytes(&self.points, size_of::<MapPoint>())
                + arena_bytes(&self.lines, size_of::<MapLine>())
                + tree_bytes::<KeyframeId, u32>(seen),
        }
    }
}

fn bytes_of(keyframe: &Keyframe) -> usize {
    let frame = keyframe.frame();
    let corners = frame.corners.capacity() * size_of::<Corner>()
        + frame.corner_depths.capacity() * size_of::<Option<MeasuredDepth>>()
        + keyframe.points.capacity() * size_of::<Option<super::PointId>>()
        + frame.corners.len() * BYTES_OF_LOOK;
    let segments = frame.lines.capacity() * size_of::<LineFeature>()
        + frame.lines_in_space.capacity() * size_of::<Option<SegmentInSpace>>()
        + keyframe.lines.capacity() * size_of::<Option<super::LineId>>();
    let shared = tree_bytes::<KeyframeId, Shared>(keyframe.covisible.len());
    size_of::<Keyframe>() + corners + segments + shared
}

fn arena_bytes<T>(arena: &Arena<T>, each: usize) -> usize {
    // A slot (a generation and a pointer), and the two counts of owners before what it points to.
    const SLOT_BYTES: usize = 4 * size_of::<usize>();
    arena.len() * (each + SLOT_BYTES)
}

fn tree_bytes<K, V>(entries: usize) -> usize {
    (entries as f64 * (size_of::<K>() + size_of::<V>()) as f64 * TREE_SHARE) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::MapConfig;
    use crate::map::testing::{blank, blank_frame};

    #[test]
    fn memory_grows_with_what_is_kept_and_shrinks_with_what_goes() {
        let mut map = Map::new(MapConfig::default());
        assert_eq!(map.memory().bytes(), 0);
        let frame = blank_frame(1000, 100);
        let mut ids = Vec::new();
        let mut sizes = vec![0];
        for _ in 0..3 {
            ids.push(map.insert_keyframe(blank(&frame)).unwrap());
            sizes.push(map.memory().keyframes_bytes);
        }
        // A thousand corners of some 50 bytes and their looks, a hundred segments.
        let steps: Vec<usize> = sizes.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(steps.iter().all(|step| (100_000..250_000).contains(step)), "{steps:?}");
        map.cull_keyframe(ids[1]).unwrap();
        assert!(map.memory().keyframes_bytes < sizes[3]);
    }

    #[test]
    fn landmarks_are_counted_with_who_sees_them() {
        let mut map = Map::new(MapConfig::default());
        let frame = blank_frame(50, 0);
        let first = map.insert_keyframe(blank(&frame)).unwrap();
        let second = map.insert_keyframe(blank(&frame)).unwrap();
        let place = nalgebra::Point3::new(0.0, 0.0, 2.0);
        let point = map.insert_point(first, 0, &place).unwrap();
        let once = map.memory().landmarks_bytes;
        map.observe(second, 0, point).unwrap();
        assert!(once >= size_of::<MapPoint>() && map.memory().landmarks_bytes > once);
    }
}
