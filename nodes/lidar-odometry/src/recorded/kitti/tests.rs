use std::path::Path;

use proptest::prelude::*;

use super::*;

/// Rows of points 10 m off, this many a row, counterclockwise from forward.
fn file(rows: usize, points: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    for row in 0..rows {
        let elevation_rad = 0.03 - 0.007 * row as f32;
        for point in 0..points {
            let azimuth_rad = (point as f32 + 0.3) / points as f32 * std::f32::consts::TAU;
            let (sin, cos) = elevation_rad.sin_cos();
            let (sin_azimuth, cos_azimuth) = azimuth_rad.sin_cos();
            for value in
                [10.0 * cos * cos_azimuth, 10.0 * cos * sin_azimuth, 10.0 * sin, row as f32]
            {
                bytes.extend(value.to_le_bytes());
            }
        }
    }
    bytes
}

#[test]
fn rows_and_columns_are_recovered() {
    let stamp = Stamp::from_nanos(5);
    let revolution = revolution_from_kitti(&file(64, 500), stamp, "velodyne").unwrap();
    assert_eq!((revolution.rows(), revolution.columns()), (64, COLUMNS));
    assert_eq!((revolution.stamp, revolution.measured().count()), (stamp, 64 * 500));
    for row in 0..64 {
        let elevation_rad = 0.03 - 0.007 * row as f32;
        assert!((revolution.elevations_rad()[row] - elevation_rad).abs() < 1e-6);
        for (column, cell) in revolution.row(row).iter().enumerate() {
            let Some(found) = cell else { continue };
            assert_eq!(found.intensity, row as f32);
            let azimuth_rad = found.position_m.y.atan2(found.position_m.x);
            let off_rad = (azimuth_rad - revolution.azimuths_rad()[column]).abs();
            assert!(off_rad < 0.003, "{off_rad}");
        }
    }
    // As the scanner turns.
    assert!(
        revolution.azimuths_rad()[0] < 0.0
            && revolution.azimuths_rad()[1] < revolution.azimuths_rad()[0]
    );
}

#[test]
fn what_is_no_scan_of_kitti_is_refused() {
    let read = |bytes: &[u8]| revolution_from_kitti(bytes, Stamp::default(), "velodyne");
    assert_eq!(read(&[]).unwrap_err(), KittiError::Length { bytes: 0 });
    assert_eq!(read(&[0; 33]).unwrap_err(), KittiError::Length { bytes: 33 });
    assert_eq!(read(&file(65, 10)).unwrap_err(), KittiError::Rows { rows: 65 });
    assert_eq!(read(&file(3, 10)).unwrap().rows(), 3);
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
        let _ = revolution_from_kitti(&bytes, Stamp::default(), "velodyne");
    }

    #[test]
    fn no_points_make_it_panic(points in proptest::collection::vec(-9.0..9.0_f32, 0..400)) {
        let bytes: Vec<u8> = points.iter().flat_map(|value| value.to_le_bytes()).collect();
        if let Ok(revolution) = revolution_from_kitti(&bytes, Stamp::default(), "velodyne") {
            prop_assert_eq!(revolution.measured().count(), points.len() / 4);
        }
    }
}

#[test]
fn every_recorded_scan_has_64_rows_from_the_highest() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    for folder in ["kitti-odometry/sequences/00/velodyne", "kitti360-50/velodyne"] {
        let folder = data.join(folder);
        let Ok(entries) = std::fs::read_dir(&folder) else {
            eprintln!("skipped: {} is not there", folder.display());
            continue;
        };
        for path in entries.map(|entry| entry.unwrap().path()).take(4) {
            let bytes = std::fs::read(&path).unwrap();
            let revolution = revolution_from_kitti(&bytes, Stamp::default(), "velodyne").unwrap();
            assert_eq!(revolution.rows(), 64, "{}", path.display());
            assert_eq!(revolution.measured().count(), bytes.len() / POINT_BYTES);
            assert!(revolution.elevations_rad().windows(2).all(|pair| pair[0] > pair[1]));
            let mut beside_deg = Vec::new();
            for row in 0..64 {
                for (column, cell) in revolution.row(row).iter().enumerate() {
                    let Some(found) = cell else { continue };
                    let azimuth_rad = found.position_m.y.atan2(found.position_m.x);
                    let off_rad = azimuth_rad - revolution.azimuths_rad()[column];
                    beside_deg.push(off_rad.sin().abs().asin().to_degrees());
                }
            }
            beside_deg.sort_by(f32::total_cmp);
            let (middle, most) =
                (beside_deg[beside_deg.len() / 2], beside_deg[beside_deg.len() * 99 / 100]);
            println!("{}: {middle:.2} and {most:.2} degrees beside the column", path.display());
            assert!(middle < 0.2 && most < 1.0, "{middle} {most}");
        }
    }
}
