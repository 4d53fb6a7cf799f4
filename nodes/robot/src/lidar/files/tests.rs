use std::fs;

use geometry::{pcd, ply};
use lidar_odometry::road_map::RoadMapConfig;
use nalgebra::{Isometry3, Point3};

use super::*;
use crate::lidar::RoadTiles;

fn map(folder: &Path, max_voxels: usize) -> RoadMap {
    let config = RoadMapConfig { max_voxels, min_range_m: 0.0, ..RoadMapConfig::default() };
    let store = Box::new(RoadTiles::below(folder).unwrap());
    let mut map = RoadMap::new(config, store).unwrap();
    for step in 0..60 {
        let points: Vec<Point3<f32>> = (0..400_u16)
            .map(|index| {
                Point3::new(f32::from(index % 20) - 10.0, f32::from(index / 20) - 10.0, 1.0)
            })
            .collect();
        let intensities: Vec<f32> = (0..400_u16).map(f32::from).collect();
        let at = Isometry3::translation(7.03 * f64::from(step), 1000.0, 0.0);
        map.add(&points, Some(&intensities), &at).unwrap();
    }
    map
}

#[test]
fn a_spilled_map_is_written_with_all_its_points_to_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let tiles = folder.path().join("tiles");
    let map = map(&tiles, 2_000);
    assert!(map.counts().spilled_tiles > 5 && map.voxels_in_memory() <= 2_000);
    let extent = RoadExtent::of(&map).unwrap();
    assert!(extent.points > 10_000, "{extent:?}");
    assert_eq!((extent.low_m[1].round(), extent.high_m[1].round()), (990.0, 1009.0));
    let path = |name: &str| folder.path().join(name);
    write_ply(&path("map.ply"), &map, &extent, RoadColour::Intensity).unwrap();
    write_pcd(&path("map.pcd"), &map, &extent).unwrap();
    write_las(&path("map.las"), &map, &extent, RoadColour::Height).unwrap();
    let ply = ply::decode(&fs::read(path("map.ply")).unwrap()).unwrap();
    let pcd = pcd::decode(&fs::read(path("map.pcd")).unwrap()).unwrap();
    assert!(ply.len() as u64 == extent.points && ply == pcd);
    let mut las = las::Reader::from_path(path("map.las")).unwrap();
    let las = las.read_all().unwrap();
    let las: Vec<las::Point> = las.points().map(Result::unwrap).collect();
    assert_eq!(las.len(), ply.len());
    for (las, ply) in las.iter().zip(&ply) {
        let off_m = [las.x - f64::from(ply.x), las.y - f64::from(ply.y), las.z - f64::from(ply.z)];
        assert!(off_m.iter().all(|off_m| off_m.abs() < crate::las_file::STEP_M), "{off_m:?}");
        assert!(las.color.is_some());
    }
    let (dark, bright) =
        (las.iter().map(|it| it.intensity).min(), las.iter().map(|it| it.intensity).max());
    assert_eq!((dark, bright), (Some(0), Some(u16::MAX)));
    drop(map);
    assert_eq!(fs::read_dir(&tiles).unwrap().count(), 0);
}

#[test]
fn a_missing_tile_is_an_error_that_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let tiles = folder.path().join("tiles");
    let map = map(&tiles, 2_000);
    let own = fs::read_dir(&tiles).unwrap().next().unwrap().unwrap().path();
    let files = fs::read_dir(own).unwrap().map(|entry| entry.unwrap().path());
    fs::remove_file(files.into_iter().find(|path| path.extension().is_some()).unwrap()).unwrap();
    let error = RoadExtent::of(&map).unwrap_err().to_string();
    assert!(error.contains("is missing") && error.contains(".tile"), "{error}");
    assert!(RoadTiles::below(Path::new("/proc/none")).is_err());
}
