use geometry::{Cloud, Stamp};
use nalgebra::Point3;

use super::*;
use crate::ReconstructionConfig;
use crate::tiles::testing::MemoryStore;

/// The point of a tile of its own.
fn cloud(tile: u8) -> Cloud {
    Cloud {
        stamp: Stamp::default(),
        frame_id: "map".to_owned(),
        points_m: (0..64_u8)
            .map(|index| [4 * tile + index / 16, index / 4 % 4, index % 4])
            .map(|cell| Point3::from(cell.map(|along| f32::from(along) + 0.5)))
            .collect(),
    }
}

fn add(map: &mut Map, tile: u8) {
    let Map::Means(map) = map else { panic!("of depth images") };
    map.add(&cloud(tile)).unwrap();
}

#[test]
fn the_warning_goes_once_the_store_has_not_failed_for_a_while() {
    let store = MemoryStore::default();
    let config = ReconstructionConfig {
        pipeline: geometry::PipelineConfig {
            voxel_edge_m: 1.0,
            ..geometry::PipelineConfig::default()
        },
        max_voxels: 64,
        at_max_voxels: AtMaxVoxels::Spill,
        spill_tile_edge_m: 4.0,
        ..ReconstructionConfig::default()
    };
    let mut map = Map::new(config, Some(Box::new(store.clone()))).unwrap();
    let mut watch = SpillWatch::new(Counters::default());
    let start = Instant::now();
    let mut look = |map: &mut Map, seconds: u64| {
        watch.condition(map, start + Duration::from_secs(seconds)).unwrap()
    };
    add(&mut map, 0);
    assert!(!look(&mut map, 0).1);
    store.fail(true);
    // As long as it fails, and is asked.
    for seconds in [10, 30, 50, 70] {
        add(&mut map, 1);
        let (text, is_warning) = look(&mut map, seconds);
        assert!(is_warning && text.contains("1 failures"), "{text}");
    }
    store.fail(false);
    add(&mut map, 1);
    assert!(look(&mut map, 99).1);
    let (text, is_warning) = look(&mut map, 101);
    assert!(!is_warning && text.contains("1 failures"), "the number stays: {text}");
}
