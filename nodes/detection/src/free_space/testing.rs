//! Simulated worlds in the plane, with a scanner, for the tests of this method.

use std::f64::consts::{PI, TAU};

use geometry::{Scan, Stamp, pose_from_vector};
use nalgebra::{Isometry3, Point2, Vector2};

use super::deskewed_scan::{DeskewInput, DeskewedScan};
use super::platform_motion::{Motion, PlatformMotion};
use crate::aperture::Aperture;
use crate::config::FreeSpaceConfig;

pub(crate) const PERIOD_S: f64 = 1.0 / 7.0;

/// Pseudo-random numbers, the same for the same seed.
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// In `[0, 1)` (splitmix64).
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

/// An opaque wall between two points.
#[derive(Clone, Copy)]
pub(crate) struct Wall(pub(crate) Point2<f64>, pub(crate) Point2<f64>);

impl Wall {
    pub(crate) fn new(from: [f64; 2], to: [f64; 2]) -> Self {
        Self(from.into(), to.into())
    }

    fn hit_m(&self, origin: &Point2<f64>, direction: &Vector2<f64>) -> Option<f64> {
        let (length, start) = (self.1 - self.0, self.0 - origin);
        let area = direction.perp(&length);
        let (along_m, share) = (start.perp(&length) / area, start.perp(direction) / area);
        (along_m > 0.0 && (0.0..=1.0).contains(&share)).then_some(along_m)
    }
}

/// The walls of a box.
pub(crate) fn cuboid(center: [f64; 2], size: [f64; 2]) -> Vec<Wall> {
    let corner = |x: f64, y: f64| [center[0] + x * 0.5 * size[0], center[1] + y * 0.5 * size[1]];
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    (0..4).map(|side| Wall::new(corners[side], corners[(side + 1) % 4])).collect()
}

/// A room of 9 x 7 m with cupboards, a pillar, a table's legs and a doorway, seen from near its rear.
pub(crate) fn room() -> Vec<Wall> {
    let mut walls = vec![
        Wall::new([-2.0, -3.5], [7.0, -3.5]),
        Wall::new([7.0, -3.5], [7.0, 3.5]),
        Wall::new([7.0, 3.5], [4.0, 3.5]),
        // The doorway is open from x = 3 to 4, with a corridor behind.
        Wall::new([3.0, 3.5], [-2.0, 3.5]),
        Wall::new([-2.0, 3.5], [-2.0, -3.5]),
        Wall::new([0.0, 5.0], [7.0, 5.0]),
    ];
    walls.extend(cuboid([5.6, -2.4], [0.6, 1.2]));
    walls.extend(cuboid([4.5, 2.7], [0.5, 0.5]));
    walls.extend(cuboid([1.4, -2.4], [0.4, 0.9]));
    walls.extend(cuboid([6.6, 1.0], [0.6, 1.6]));
    for leg in [[4.8, -0.9], [5.6, -0.9], [4.8, 0.1], [5.6, 0.1]] {
        walls.extend(cuboid(leg, [0.05, 0.05]));
    }
    walls
}

/// The errors of a scanner.
#[derive(Clone, Copy)]
pub(crate) struct Scanner {
    pub(crate) noise_m: f64,
    /// The share of beams without a return.
    pub(crate) dropouts: f64,
    /// A beam is measured within this angle around its bearing.
    pub(crate) spread_rad: f64,
}

impl Scanner {
    pub(crate) const A1: Self = Self { noise_m: 0.02, dropouts: 0.02, spread_rad: PI / 180.0 };

    /// One scan of 360 beams without a time increment, all at one moment.
    pub(crate) fn scan(
        &self,
        walls: &[Wall],
        map_from_lidar: &Isometry3<f64>,
        cycle: u32,
        dice: &mut Dice,
    ) -> Scan {
        let origin = Point2::from(map_from_lidar.translation.vector.xy());
        let yaw_rad = map_from_lidar.rotation.euler_angles().2;
        let range_m = |beam: u32| {
            let spread_rad = (dice.uniform() - 0.5) * self.spread_rad;
            let azimuth_rad = f64::from(beam) * TAU / 360.0 - PI + yaw_rad + spread_rad;
            let direction = Vector2::new(azimuth_rad.cos(), azimuth_rad.sin());
            let hit_m = walls
                .iter()
                .filter_map(|wall| wall.hit_m(&origin, &direction))
                .fold(f64::INFINITY, f64::min);
            let noise_m = self.noise_m * dice.normal();
            let dropped = dice.uniform() < self.dropouts;
            if dropped || hit_m > 12.0 { f32::INFINITY } else { (hit_m + noise_m) as f32 }
        };
        Scan { stamp: stamp_of(cycle), ranges_m: (0..360).map(range_m).collect(), ..empty_scan() }
    }
}

pub(crate) fn stamp_of(cycle: u32) -> Stamp {
    Stamp::from_nanos(1_000).plus_seconds(f64::from(cycle) * PERIOD_S)
}

/// A scan of no beams from -pi on, in steps of one degree.
pub(crate) fn empty_scan() -> Scan {
    Scan {
        frame_id: "laser".to_owned(),
        angle_min_rad: -PI as f32,
        angle_increment_rad: (TAU / 360.0) as f32,
        range_min_m: 0.15,
        range_max_m: 12.0,
        ..Scan::default()
    }
}

/// A static platform.
pub(crate) struct StaticPlatform {
    pub(crate) map_from_rig: Isometry3<f64>,
}

impl Default for StaticPlatform {
    fn default() -> Self {
        Self { map_from_rig: pose_from_vector(&[0.3, -0.2, 0.4, 0.1, 0.0, 0.0]) }
    }
}

/// A deskewed scan on a static platform.
pub(crate) fn static_scan(platform: &StaticPlatform, ranges_m: &[f32]) -> DeskewedScan {
    let config = FreeSpaceConfig::default();
    let motion =
        PlatformMotion::new(&config).advance(Stamp::default(), &platform.map_from_rig, "map");
    deskewed(&platform.map_from_rig, ranges_m, &motion)
}

pub(crate) fn deskewed(
    map_from_rig: &Isometry3<f64>,
    ranges_m: &[f32],
    motion: &Motion,
) -> DeskewedScan {
    deskewed_scan(map_from_rig, &Scan { ranges_m: ranges_m.to_vec(), ..empty_scan() }, motion)
}

/// The same of a scan with any angles.
pub(crate) fn deskewed_scan(
    map_from_rig: &Isometry3<f64>,
    scan: &Scan,
    motion: &Motion,
) -> DeskewedScan {
    let rig_from_lidar = Isometry3::identity();
    let beams = Aperture::new(scan, &rig_from_lidar, TAU).unwrap().crop(scan);
    let input = DeskewInput {
        scan,
        beams: &beams,
        rig_from_lidar: &rig_from_lidar,
        map_from_rig,
        pose_stamp: scan.stamp,
        motion,
    };
    DeskewedScan::new(&input, &FreeSpaceConfig::default())
}
