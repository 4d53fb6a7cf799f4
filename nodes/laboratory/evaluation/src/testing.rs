//! Runs for tests.

use geometry::Stamp;
use report::{CycleRecord, RunRecord};

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
