//! The parameters of segmentation, their defaults, and where these come from.

use geometry::{Method, ParameterError, PipelineConfig, parameter};
use volume::OccupancyConfig;

/// A length or a time beyond this is a mistake.
const MUCH: f64 = 1e6;
/// Less than this is as good as nothing, and would divide by it.
const LITTLE: f64 = 1e-3;

geometry::parameters! {
    /// The parameters of [`crate::Segmenter`].
    #[derive(Clone, PartialEq, Debug)]
    pub struct SegmentationConfig {
        /// What segmentation shares with the other nodes of the pipeline.
        pipeline: PipelineConfig as flatten;
        /// What only the method `free_space` reads; `rec_hv` has no parameters of its own.
        free_space: FreeSpaceConfig as flatten, read_with("method", "free_space");
    }
    check = Self::check_edge;
}

geometry::parameters! {
    /// The parameters that only the method `free_space` reads.
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct FreeSpaceConfig {
        /// The most blocks of evidence, of 8 voxels an axis, that are kept, which bounds the memory.
        // 80 MB if each voxel of them has a history of its own; of most the free ones share one. A view of 8 m has 600 of the
        // thesis' edge, an office floor of 1,000 m2 10,000.
        max_evidence_blocks: usize = 10_000, whole(100, 10_000_000);
        /// Farther from the camera there is neither evidence nor motion: what moves there stays in the static cloud and the map.
        // A Kinect measures to some 6 m; beyond, its depth error is wider than the voxel. Depths begin at 0.3 m (`DepthRange`).
        evidence_reach_m: f64 = 8.0, between(0.5, 1000.0);
        /// What has been in its place for less than this is not background yet.
        // At 1 m/s, the slower speed of Rec-HV 3.4.1, something 0.64 m wide leaves a place in 0.65 s.
        min_background_s: f64 = 1.0, between(0.0, MUCH);
        /// Largest horizontal extent of an object, where nothing is known of the space around it.
        // A person with arms and legs astride; a robot with its screen is half of that.
        max_object_width_m: f64 = 1.2, between(LITTLE, MUCH);
        /// Largest height of an object above the floor, where nothing is known of the space around it.
        // A tall person with an arm raised.
        max_object_height_m: f64 = 2.2, between(LITTLE, MUCH);
        /// This many newly occupied points in free space, in an image and the one before, are an object even without a zone.
        // 0.13 m2 of surface at the thesis' edge: a head and shoulders.
        min_unzoned_points: usize = 20, whole(1, MUCH as i64);
        /// Standard deviation of an object's acceleration.
        // A walker who stops, starts or turns does so within half a second: 1.4 m/s / 0.5 s.
        acceleration_m_per_s2: f64 = 2.8, between(LITTLE, MUCH);
        /// Of its first three cycles, an object must be seen in this many to become a track.
        min_seen_cycles: u32 = 2, whole(1, 3);
        /// A track ends after this many cycles in which it should have been seen and was not.
        // A second and a half of the RPLIDAR A1.
        max_unseen_cycles: u32 = 10, whole(0, MUCH as i64);
        /// The most objects that are tracked.
        // More than a room holds.
        max_tracks: usize = 32, whole(1, 200);
    }
}

impl SegmentationConfig {
    fn check_edge(&self) -> Result<(), ParameterError> {
        let edge_m = self.pipeline.voxel_edge_m;
        let edges_m = OccupancyConfig::LEAST_EDGE_M..=OccupancyConfig::MOST_EDGE_M;
        let holds = self.pipeline.method != Method::FreeSpace || edges_m.contains(&edge_m);
        parameter::check("voxel_edge_m", "0.001 to 10 with the method free_space", edge_m, holds)
    }
}

impl FreeSpaceConfig {
    /// The most blocks of evidence that one image updates, which bounds the time of a cycle however many are kept.
    pub(crate) fn max_evidence_blocks_per_image(&self) -> usize {
        self.max_evidence_blocks.min(OccupancyConfig::default().max_blocks_per_image)
    }

    /// The parameters of the evidence, with voxels of an edge.
    pub(crate) fn occupancy(&self, edge_m: f64) -> OccupancyConfig {
        OccupancyConfig {
            edge_m,
            reach_m: self.evidence_reach_m,
            max_blocks: self.max_evidence_blocks,
            max_blocks_per_image: self.max_evidence_blocks_per_image(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_method(method: Method) -> SegmentationConfig {
        let pipeline = PipelineConfig { method, ..PipelineConfig::default() };
        SegmentationConfig { pipeline, ..SegmentationConfig::default() }
    }

    #[test]
    fn the_defaults_are_valid_for_both_methods() {
        for method in Method::ALL {
            assert_eq!(of_method(method).validate(), Ok(()));
        }
    }

    #[test]
    fn each_bad_parameter_is_named() {
        type Spoil = fn(&mut SegmentationConfig);
        let cases: [(&str, Spoil); 13] = [
            ("voxel_edge_m", |c| c.pipeline.voxel_edge_m = -1.0),
            ("max_evidence_blocks", |c| c.free_space.max_evidence_blocks = 0),
            ("evidence_reach_m", |c| c.free_space.evidence_reach_m = f64::NAN),
            ("voxel_edge_m", |c| c.pipeline.voxel_edge_m = 1e-9),
            ("min_background_s", |c| c.free_space.min_background_s = -0.1),
            ("max_object_width_m", |c| c.free_space.max_object_width_m = 0.0),
            ("max_object_height_m", |c| c.free_space.max_object_height_m = -2.0),
            ("min_unzoned_points", |c| c.free_space.min_unzoned_points = 0),
            ("acceleration_m_per_s2", |c| c.free_space.acceleration_m_per_s2 = 0.0),
            ("min_seen_cycles", |c| c.free_space.min_seen_cycles = 4),
            ("max_unseen_cycles", |c| c.free_space.max_unseen_cycles = u32::MAX),
            ("max_stop_s", |c| c.pipeline.max_stop_s = f64::NAN),
            ("max_tracks", |c| c.free_space.max_tracks = 0),
        ];
        for (name, spoil) in cases {
            let mut bad = of_method(Method::FreeSpace);
            spoil(&mut bad);
            let message = bad.validate().unwrap_err().to_string();
            assert!(message.contains(name), "{message} does not name {name}");
        }
    }
}
