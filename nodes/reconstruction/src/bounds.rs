//! What the bounds of a map keep out of it: too fine an edge never leaves a map empty without a word.

use volume::{BLOCK_EDGE, SurfaceConfig};

use crate::{Addition, AtMaxVoxels, ReconstructionConfig};

/// Counts what the bounds have kept out of a map.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct KeptOut {
    cycles: usize,
    cut_views: usize,
    refused: usize,
    dropped: usize,
}

/// A bound that keeps something out of the map, and what helps.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct BoundReached {
    /// What is not in the map, with the numbers.
    pub what: String,
    /// The parameter that helps.
    pub fix: String,
}

impl KeptOut {
    /// Notes what one cycle did.
    pub fn note(&mut self, addition: &Addition) {
        let Addition { is_view_cut, refused_points, dropped_voxels, .. } = *addition;
        self.note_counts(is_view_cut, refused_points, dropped_voxels);
    }

    /// The same by the counts of a report.
    pub fn note_counts(&mut self, is_view_cut: bool, refused_points: usize, dropped_voxels: usize) {
        self.cycles += 1;
        self.cut_views += usize::from(is_view_cut);
        self.refused += refused_points;
        self.dropped += dropped_voxels;
    }

    /// How many blocks were dropped to make room for others, as that was asked for.
    #[must_use]
    pub fn dropped(&self) -> usize {
        self.dropped
    }

    /// Whether the map had no room for all that was seen.
    #[must_use]
    pub fn lacked_room(&self, config: &ReconstructionConfig) -> bool {
        self.dropped > 0 || self.refused(config).is_some()
    }

    /// The bounds that were reached in a map of these parameters.
    #[must_use]
    pub fn bounds_reached(&self, config: &ReconstructionConfig) -> Vec<BoundReached> {
        self.cut_views(config).into_iter().chain(self.refused(config)).collect()
    }

    fn cut_views(&self, config: &ReconstructionConfig) -> Option<BoundReached> {
        let Self { cycles, cut_views, .. } = *self;
        let SurfaceConfig { edge_m, max_blocks_per_image, .. } = config.surface()?;
        (cut_views > 0).then(|| BoundReached {
            what: format!(
                "map_edge_m {edge_m} is too fine for what the camera sees: {cut_views} of {cycles} depth images have more than \
                 {max_blocks_per_image} blocks of {BLOCK_EDGE} voxels an axis, and what is farther is not in the map"
            ),
            fix: format!(
                "raise map_edge_m (--map-edge) of the whole pipeline: {} needs a quarter of the blocks",
                2.0 * edge_m
            ),
        })
    }

    fn refused(&self, config: &ReconstructionConfig) -> Option<BoundReached> {
        let refused = self.refused;
        // With the others the blocks that are refused wait for a tile, or for room.
        if refused == 0 || config.at_max_voxels != AtMaxVoxels::Refuse {
            return None;
        }
        Some(match config.surface() {
            Some(SurfaceConfig { edge_m, max_blocks, .. }) => BoundReached {
                what: format!(
                    "the map is full: it has max_map_blocks {max_blocks} blocks of {BLOCK_EDGE} voxels an axis of map_edge_m \
                     {edge_m}, and {refused} times a block of a depth image was left out"
                ),
                fix: "raise map_edge_m (--map-edge) of the whole pipeline, or max_map_blocks (2.1 kB each), or set at_max_voxels to \
                      drop_oldest or spill"
                    .to_owned(),
            },
            None => BoundReached {
                what: format!(
                    "the map is full: it has max_voxels {} voxels of voxel_edge_m {}, and {refused} points were left out",
                    config.max_voxels, config.pipeline.voxel_edge_m
                ),
                fix: "raise voxel_edge_m of the whole pipeline, or max_voxels".to_owned(),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use geometry::{Method, PipelineConfig};

    use super::*;

    fn of(method: Method) -> ReconstructionConfig {
        let pipeline = PipelineConfig { map_edge_m: 0.002, ..PipelineConfig::new(method, 0.05) };
        ReconstructionConfig { pipeline, ..ReconstructionConfig::default() }
    }

    #[test]
    fn each_bound_is_named_with_its_numbers_and_what_helps() {
        let mut kept_out = KeptOut::default();
        let config = of(Method::FreeSpace);
        kept_out.note(&Addition::default());
        assert!(kept_out.bounds_reached(&config).is_empty());
        kept_out.note(&Addition { is_view_cut: true, refused_points: 7, ..Addition::default() });
        let [cut, full] = &kept_out.bounds_reached(&config)[..] else { panic!("two bounds") };
        for part in ["map_edge_m 0.002", "1 of 2 depth images", "30000 blocks"] {
            assert!(cut.what.contains(part), "{cut:?}");
        }
        assert!(cut.fix.contains("--map-edge"), "{cut:?}");
        assert!(full.what.contains("max_map_blocks 200000") && full.what.contains("7 times"));
        assert!(full.fix.contains("max_map_blocks") && full.fix.contains("spill"));

        let of_means = &kept_out.bounds_reached(&of(Method::RecHv))[..];
        let [full] = of_means else { panic!("{of_means:?}") };
        assert!(full.what.contains("max_voxels 1000000 voxels of voxel_edge_m 0.05"), "{full:?}");
        let at_max_voxels = AtMaxVoxels::DropOldest;
        assert_eq!(
            kept_out
                .bounds_reached(&ReconstructionConfig { at_max_voxels, ..config.clone() })
                .len(),
            1
        );
        let drops = ReconstructionConfig { at_max_voxels, ..config.clone() };
        assert!(kept_out.lacked_room(&config) && !kept_out.lacked_room(&drops));
        kept_out.note(&Addition { dropped_voxels: 5, ..Addition::default() });
        assert!(kept_out.lacked_room(&drops) && kept_out.dropped() == 5);
    }
}
