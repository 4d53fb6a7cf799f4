//! Clouds and trajectories of recorded data sets.

use evaluation::trajectory::{parse_stamps, parse_trajectory};
use lidar_odometry::packets::Model;
use lidar_odometry::recorded::{revolution_from_kitti, revolutions_from_csv};

use super::bags::on_disk;
use super::{FAST, OF_FILES, VALUES, samples, text_of};
use crate::{MemoryBound, Target};

/// A scan of KITTI has 64 rows of 2250 columns, however few points are in it.
const SCANS: MemoryBound = MemoryBound { base_bytes: 64 << 20, per_byte: 512 };
/// A line of CSV becomes a whole revolution, one at a time.
const REVOLUTIONS: MemoryBound = MemoryBound { base_bytes: 8 << 20, per_byte: 512 };

pub(super) const TARGETS: &[Target] = &[
    Target {
        name: "trajectory",
        body: |bytes| {
            let _ = parse_trajectory(bytes);
            let _ = parse_stamps(bytes);
        },
        seeds: trajectories,
        words: &[b",", b" ", b"\n", b"#", b"e-10", b"\t", b"nan"],
        memory: VALUES,
        gate_cases: FAST,
    },
    Target {
        name: "kitti_scan",
        body: |bytes| drop(revolution_from_kitti(bytes, samples::STAMP, "velodyne")),
        seeds: kitti_scans,
        words: &[],
        memory: SCANS,
        gate_cases: OF_FILES,
    },
    Target {
        name: "csv_scans",
        body: csv,
        seeds: || vec![b"0, 1.0 2.0 0.1 1.5 2.0 0.1\n\x000, 10 20\n".to_vec()],
        words: &[b",", b";", b"\n", b"\0", b" 1.0"],
        memory: REVOLUTIONS,
        gate_cases: OF_FILES,
    },
    Target {
        name: "tum_list",
        body: |bytes| {
            let list = on_disk("depth.txt", bytes, |path| robot::import::tum::read_list(path).ok());
            for (_, rest) in list.into_iter().flatten() {
                let _ = robot::import::tum::pose_of(&rest);
            }
            let _ = robot::import::tum::parse_intrinsics(text_of(bytes));
        },
        seeds: || {
            vec![b"# depth\n1305031102.160407 depth/1305031102.160407.png\n1305031102.2 1 2 3 0 0 0 1\n".to_vec()]
        },
        words: &[b" ", b"\n", b"#", b","],
        memory: VALUES,
        gate_cases: OF_FILES,
    },
];

fn trajectories() -> Vec<Vec<u8>> {
    let texts = [
        "# TUM\n1.0 1 2 3 0 0 0 1\n2.0 1 2 3 0 0 0.6 0.8\n",
        "1 0 0 1 0 1 0 2 0 0 1 3\n0 -1 0 1 1 0 0 2 0 0 1 3\n",
        "#timestamp, p_x\n1403636579763555584,4.6,-1.7,0.7,0.5,-0.1,-0.8,-0.1,-0.02\n",
    ];
    texts.iter().map(|text| text.as_bytes().to_vec()).collect()
}

fn kitti_scans() -> Vec<Vec<u8>> {
    let mut file = Vec::new();
    for row in 0..3_u8 {
        for step in 0..8_u8 {
            let azimuth_rad = 0.7 * f32::from(step);
            let point = [10.0 * azimuth_rad.cos(), 10.0 * azimuth_rad.sin(), -f32::from(row), 0.5];
            file.extend(point.iter().flat_map(|value| value.to_le_bytes()));
        }
    }
    vec![file]
}

/// Coordinates, a zero, intensities.
fn csv(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |byte| *byte == 0).map(text_of);
    let (coordinates, intensities) = (parts.next().unwrap_or(""), parts.next().unwrap_or(""));
    if let Ok(revolutions) =
        revolutions_from_csv(coordinates, intensities, Model::Vlp16, "velodyne")
    {
        assert!(revolutions.map(|revolution| revolution.rows()).all(|rows| rows > 0));
    }
}
