use nalgebra::{Isometry3, Point2, distance};

use super::super::testing::{
    Dice, PERIOD_S, Scanner, StaticPlatform, Wall, cuboid, room, static_scan,
};
use super::motion_evidence::{LEAST_SIGHTINGS, LONGEST_DOUBT_MS};
use super::sighting::MEMORY_MS;
use super::*;

mod in_free_space;
mod isolated;
mod one_to_one;

/// A scan of a room from a platform at `platform_m`.
fn scan_in(walls: &[Wall], platform_m: [f64; 2], seed: u64) -> DeskewedScan {
    let pose = Isometry3::translation(platform_m[0], platform_m[1], 0.0);
    let scan = Scanner::A1.scan(walls, &pose, 0, &mut Dice::new(seed));
    static_scan(&StaticPlatform { map_from_rig: pose }, &scan.ranges_m)
}

/// The class unknown for every return.
fn nothing_known(scan: &DeskewedScan) -> Vec<Option<ReturnClass>> {
    scan.beams.iter().map(|beam| beam.hit.map(|_| ReturnClass::Unknown)).collect()
}

/// The room with one more box of the size of a person in it.
fn with_person(place_m: [f64; 2]) -> Vec<Wall> {
    let mut walls = room();
    walls.extend(cuboid(place_m, [0.3, 0.4]));
    walls
}

fn stamp_ms(scan: usize) -> u32 {
    (scan as f64 * PERIOD_S * 1e3) as u32 + 1
}

/// The beams of a scan that hit a person at `place_m`.
fn beams_on(scan: &DeskewedScan, place_m: [f64; 2]) -> Range<usize> {
    let is_on_it = |beam: &usize| {
        let hit = scan.beams[*beam].hit;
        hit.is_some_and(|hit| distance(&hit.in_map_m, &Point2::from(place_m)) < 0.4)
    };
    let beams: Vec<usize> = (0..scan.beams.len()).filter(is_on_it).collect();
    beams.first().zip(beams.last()).map_or(0..0, |(first, last)| *first..*last + 1)
}
