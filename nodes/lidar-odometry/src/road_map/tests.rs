use std::sync::{Arc, Mutex};

use proptest::prelude::*;

use super::*;
use crate::testing::Random;

/// A store in memory, which may be full.
#[derive(Clone, Debug, Default)]
struct Shelf {
    kept: Arc<Mutex<BTreeMap<RoadTileKey, Vec<u8>>>>,
    full: bool,
}

impl RoadTileStore for Shelf {
    fn append(&mut self, tile: RoadTileKey, bytes: &[u8]) -> Result<(), TileStoreFailure> {
        if self.full {
            return Err(TileStoreFailure { tile, reason: "no room".to_owned() });
        }
        self.kept.lock().unwrap().entry(tile).or_default().extend(bytes);
        Ok(())
    }

    fn read(&self, tile: RoadTileKey) -> Result<Vec<u8>, TileStoreFailure> {
        Ok(self.kept.lock().unwrap().get(&tile).cloned().unwrap_or_default())
    }
}

fn config(max_voxels: usize) -> RoadMapConfig {
    RoadMapConfig {
        voxel_edge_m: 0.5,
        max_voxels,
        tile_edge_m: 10.0,
        max_range_m: 30.0,
        min_range_m: 0.0,
    }
}

/// A drive there and back.
fn drive(map: &mut RoadMap) {
    let mut random = Random::new(4);
    for step in (0..40).chain((0..40).rev()) {
        let at = Isometry3::translation(5.0 * f64::from(step), 0.0, 0.0);
        let points: Vec<Point3<f32>> =
            (0..300).map(|_| Point3::from((12.0 * random.direction()).cast())).collect();
        let intensities: Vec<f32> = (0..300).map(|_| random.between(0.0, 255.0) as f32).collect();
        map.add(&points, Some(&intensities), &at).unwrap();
        assert!(map.voxels_in_memory() <= map.config.max_voxels);
    }
}

fn all(map: &RoadMap) -> Vec<RoadPoint> {
    map.tiles().into_iter().flat_map(|tile| map.points(tile).unwrap()).collect()
}

#[test]
fn a_small_memory_makes_the_same_map_to_the_bit() {
    let maps = [1_000_000, 1500].map(|max_voxels| {
        let mut map = RoadMap::new(config(max_voxels), Box::new(Shelf::default())).unwrap();
        drive(&mut map);
        map
    });
    assert_eq!(maps[0].counts().spilled_tiles, 0);
    assert!(maps[1].counts().spilled_tiles > 20, "{:?}", maps[1].counts());
    let [large, small] = maps.map(|map| all(&map));
    assert!(large.len() > 8000 && large == small, "{} {}", large.len(), small.len());
    assert_eq!(large.iter().map(|point| u64::from(point.points)).sum::<u64>(), 80 * 300);
}

#[test]
fn a_voxel_is_the_mean_of_its_points_and_of_their_intensities() {
    let mut map = RoadMap::new(config(1000), Box::new(Shelf::default())).unwrap();
    let points =
        [Point3::new(1.1, 2.1, -0.9), Point3::new(1.3, 2.3, -0.7), Point3::new(9.0, 2.0, 0.0)];
    let at = Isometry3::translation(-1000.0, 0.0, 0.0);
    map.add(&points, Some(&[0.25, 0.75, 9.0]), &at).unwrap();
    let found = all(&map);
    assert_eq!(found.len(), 2);
    assert!((found[0].position_m - Point3::new(-998.8, 2.2, -0.8)).norm() < 1e-5, "{found:?}");
    assert_eq!((found[0].intensity, found[0].points), (0.5, 2));
    let bad = [Point3::new(f32::NAN, 0.0, 0.0), Point3::new(40.0, 0.0, 0.0)];
    map.add(&bad, None, &at).unwrap();
    map.add(&points, None, &Isometry3::translation(f64::INFINITY, 0.0, 0.0)).unwrap();
    assert_eq!((map.counts().points, map.counts().left_out), (3, 5));
}

#[test]
fn a_store_that_fails_loses_nothing_in_silence() {
    let full = Shelf { full: true, ..Shelf::default() };
    let mut map = RoadMap::new(config(1000), Box::new(full)).unwrap();
    let mut random = Random::new(9);
    let points: Vec<Point3<f32>> =
        (0..5000).map(|_| Point3::from((20.0 * random.direction()).cast())).collect();
    let failure = map.add(&points, None, &Isometry3::identity()).unwrap_err();
    assert!(failure.to_string().contains("no room"), "{failure}");
    assert_eq!((map.voxels_in_memory(), all(&map).len()), (1000, 1000));
    // One that forgets is found out.
    let shelf = Shelf::default();
    let mut map = RoadMap::new(config(1000), Box::new(shelf.clone())).unwrap();
    drive(&mut map);
    let tile = *shelf.kept.lock().unwrap().keys().next().unwrap();
    shelf.kept.lock().unwrap().get_mut(&tile).unwrap().pop();
    assert!(map.points(tile).unwrap_err().to_string().contains("in place of"));
    let bad = RoadMapConfig { max_voxels: 1, ..config(1) };
    assert!(bad.validate().unwrap_err().to_string().contains("max_voxels"));
}

proptest! {
    #[test]
    fn a_tile_comes_back_as_it_was(
        places in proptest::collection::vec(proptest::array::uniform3(-3000.0..3000.0_f64), 0..50),
        bright in -10.0..300.0_f32,
    ) {
        let mut tile = Tile::default();
        for (index, place) in places.iter().enumerate() {
            let key = VoxelKey { x: index as i32 - 20, y: 7, z: -3 };
            tile.voxels.entry(key).or_default().add(&Point3::from(*place), bright);
        }
        let back: Vec<_> = tile::decoded(&tile.encoded()).collect();
        prop_assert_eq!(back.len(), places.len());
        for (key, voxel) in back {
            prop_assert_eq!(tile.voxels.get(&key), Some(&voxel));
        }
    }
}
