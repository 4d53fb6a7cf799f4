//! The record of one run of the pipeline, for scoring and reporting.

use std::collections::BTreeMap;

use geometry::{CameraModel, DynamicZone, MapView, SegmentationCounts, Stamp, TriangleMesh};
use nalgebra::{Isometry3, Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::{CycleView, RigCamera};

/// How the stages of a run were connected.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Transport {
    /// The nodes in one process, on no network, taken in turn.
    #[default]
    Local,
    /// The nodes as separate participants on DDS.
    Dds,
}

impl Transport {
    /// The name as the command line and `summary.json` have it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Local => "local",
            Self::Dds => "dds",
        }
    }
}

/// A run of the pipeline over one bag, filled by the front door from either transport.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct RunRecord {
    /// The bag's name, without the folders that lead to it: a page must not differ with the machine.
    pub bag_name: String,
    /// How the stages were connected.
    pub transport: Transport,
    /// The method by its parameter's name, such as `rec_hv`.
    pub method: String,
    /// Edge of the voxels of the reduction and of the map (Rec-HV 3.2.3: t_vg).
    pub voxel_edge_m: f64,
    /// From a point of the map to the next; absent where that is `voxel_edge_m`.
    pub map_edge_m: Option<f64>,
    /// The depth camera; absent where no cycle has a depth image.
    pub camera: Option<CameraModel>,
    /// The scanner's frame in the rig.
    pub rig_from_lidar: Isometry3<f64>,
    /// The mount of the depth camera, by the first cycle; `None` without a cycle.
    pub rig_from_camera: Option<Isometry3<f64>>,
    /// The frame of both maps.
    pub map_frame_id: String,
    /// The cycles that went through all three stages, in the order of their index. A cycle that was lost
    /// in transit is not here but in `drops`.
    pub cycles: Vec<CycleRecord>,
    /// The drops, where and why.
    pub drops: Vec<DropCount>,
    /// The map, in the map frame.
    pub static_map: Vec<Point3<f32>>,
    /// The normal of each point of the map, to the side from which it was seen; none at all where the map has none, or was received
    /// as a cloud.
    pub map_normals: Vec<Vector3<f32>>,
    /// Red, green and blue of each point of the map, [`geometry::NO_COLOUR`] where none was seen; none at all where the map has no
    /// colours.
    pub map_colours: Vec<[u8; 3]>,
    /// Where the map was seen from; none where it has none, or was received as a cloud.
    pub map_views: Vec<MapView>,
    /// How many blocks of 8 voxels an axis the map dropped to make room for others.
    pub dropped_blocks: usize,
    /// Whether the map had no room for all that was seen: it dropped or refused some.
    pub lacked_room: bool,
    /// The map as triangles, in the map frame, where it was made so and is at hand.
    pub mesh: Option<TriangleMesh>,
    /// The map that the same clouds give when nothing is removed, in the map frame.
    pub unfiltered_map: Vec<Point3<f32>>,
}

impl RunRecord {
    /// The depth camera in its place on the rig; `None` where no cycle has a depth image.
    pub(crate) fn rig_camera(&self) -> Option<RigCamera> {
        Some(RigCamera { model: self.camera?, rig_from_camera: self.rig_from_camera? })
    }

    /// From a point of the map to the next.
    pub(crate) fn map_spacing_m(&self) -> f64 {
        self.map_edge_m.unwrap_or(self.voxel_edge_m)
    }

    /// What [`CycleRecord::map_points`] counts: of a map of depth images its voxels at the surface, of which several can
    /// have a point, or none.
    pub(crate) fn map_unit(&self) -> &'static str {
        if self.map_edge_m.is_some() { "voxels at the surface" } else { "points" }
    }
}

/// One cycle of a run.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct CycleRecord {
    /// The cycle's number, as detection gave it.
    pub index: u32,
    /// The scan of the cycle.
    pub scan_stamp: Stamp,
    /// The moment of the cloud, of the pose, and of every point here.
    pub cloud_stamp: Stamp,
    /// The pose at `cloud_stamp`.
    pub map_from_rig: Isometry3<f64>,
    /// Zones with moving objects; empty when there are none.
    pub zones: Vec<DynamicZone>,
    /// Points of the cloud before the reduction.
    pub points_in: usize,
    /// Points of each stage of the segmentation.
    pub counts: SegmentationCounts,
    /// Points of the static map after this cycle; of a map of depth images ([`RunRecord::map_edge_m`]) its voxels near the
    /// surface.
    pub map_points: usize,
    /// The points that segmentation took for moving: reduced points in the rig frame.
    pub dynamic_points_m: Vec<Point3<f32>>,
    /// Where the tracks are, in the map frame, by their numbers; empty with a method that follows nothing.
    pub tracks_m: BTreeMap<u32, Point3<f64>>,
    /// What the sensors saw; of a long run only every n-th cycle has it.
    pub view: Option<CycleView>,
    /// How long each step took, in the order of the steps. The names are unique within the cycle (say
    /// `detection/gap_fill`) and the steps do not overlap: their sum is the cycle's time.
    pub step_durations_s: Vec<(String, f64)>,
}

/// How often one thing was dropped for one reason.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DropCount {
    /// The topic or the stage that lost it.
    pub topic_or_stage: String,
    /// Why, in words.
    pub reason: String,
    /// How often.
    pub count: u64,
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An uneventful cycle at `index` tenths of a second, its rig at the map's origin.
    pub(crate) fn cycle(index: u32) -> CycleRecord {
        let stamp = Stamp::from_nanos(i64::from(index) * 100_000_000);
        CycleRecord { index, scan_stamp: stamp, cloud_stamp: stamp, ..CycleRecord::default() }
    }

    /// A run of `cycles` with voxels of 10 cm and empty maps.
    pub(crate) fn run(cycles: Vec<CycleRecord>) -> RunRecord {
        RunRecord {
            bag_name: "room.mcap".to_owned(),
            method: "rec_hv".to_owned(),
            voxel_edge_m: 0.1,
            map_frame_id: "map".to_owned(),
            cycles,
            ..RunRecord::default()
        }
    }

    #[test]
    fn the_transport_is_named_as_it_is_serialised() {
        for transport in [Transport::Local, Transport::Dds] {
            let json = serde_json::to_string(&transport).unwrap();
            assert_eq!(json, format!("\"{}\"", transport.name()));
        }
    }
}
