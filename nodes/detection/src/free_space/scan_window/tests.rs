use geometry::pose_from_vector;
use nalgebra::Isometry3;
use proptest::prelude::*;

use super::super::platform_motion::PlatformMotion;
use super::super::testing::{
    Dice, Scanner, StaticPlatform, deskewed, deskewed_scan, room, stamp_of, static_scan,
};
use super::*;
use crate::config::FreeSpaceConfig;
use crate::variability::VariabilityWindow;

/// Turns of a scanner without noise from these poses.
fn scans(poses: &[[f64; 6]]) -> Vec<DeskewedScan> {
    let scanner = Scanner { noise_m: 0.0, dropouts: 0.0, spread_rad: 0.0 };
    let mut follower = PlatformMotion::new(&FreeSpaceConfig::default());
    let mut dice = Dice::new(1);
    poses
        .iter()
        .zip(0..)
        .map(|(vector, cycle)| {
            let pose: Isometry3<f64> = pose_from_vector(vector);
            let motion = follower.advance(stamp_of(cycle), &pose, "map");
            deskewed(&pose, &scanner.scan(&room(), &pose, cycle, &mut dice).ranges_m, &motion)
        })
        .collect()
}

proptest! {
    /// On a static platform without gaps: eq. 3 to the bit.
    #[test]
    fn on_a_static_platform_it_is_the_thesis_formula_to_the_bit(
        scans in prop::collection::vec(prop::collection::vec(0.2f32..8.0, 90), 1..7),
        window_scans in 2usize..5,
    ) {
        let mut thesis = VariabilityWindow::new(window_scans);
        let mut warped = ScanWindow::new(window_scans);
        for scan in &scans {
            thesis.push(scan.clone());
            warped.push(Arc::new(static_scan(&StaticPlatform::default(), scan)));
        }
        let expected = thesis.statistics().map(|statistics| statistics.std_dev_m);
        let got = warped.std_dev_m().map(|beams| beams.into_iter().map(Option::unwrap).collect());
        prop_assert_eq!(got, expected);
    }
}

#[test]
fn a_gap_is_unknown_and_does_not_change_other_beams() {
    let mut thesis = VariabilityWindow::new(3);
    let mut warped = ScanWindow::new(3);
    let mut dice = Dice::new(7);
    for gap in [5, 6, 7] {
        let mut ranges_m: Vec<f32> = (0..360).map(|_| 3.0 + dice.uniform() as f32).collect();
        thesis.push(ranges_m.clone());
        ranges_m[gap] = f32::INFINITY;
        warped.push(Arc::new(static_scan(&StaticPlatform::default(), &ranges_m)));
    }
    let expected = thesis.statistics().unwrap().std_dev_m;
    let got = warped.std_dev_m().unwrap();
    // Without a present return: none. Without one of the earlier two: the deviation of the other two.
    assert_eq!(got[7], None);
    assert!(got[5].is_some() && got[6].is_some());
    for beam in (0..360).filter(|beam| !(5..=7).contains(beam)) {
        assert_eq!(got[beam], Some(expected[beam]));
    }
}

#[test]
fn on_a_moving_platform_the_static_room_hardly_deviates_where_it_was_seen() {
    let poses = [0.0, 1.0, 2.0].map(|step| [0.07 * step, 0.02 * step, 0.0, 0.07 * step, 0.0, 0.0]);
    let scans = scans(&poses);
    let mut plain = VariabilityWindow::new(3);
    let mut warped = ScanWindow::new(3);
    for scan in &scans {
        let range_m = |beam: &super::super::deskewed_scan::DeskewedBeam| {
            beam.hit.map_or(0.0, |hit| hit.range_m)
        };
        plain.push(scan.beams.iter().map(range_m).collect());
        warped.push(Arc::new(scan.clone()));
    }
    let plain_m = plain.statistics().unwrap().std_dev_m;
    let warped_m = warped.std_dev_m().unwrap();
    let known: Vec<f32> = warped_m.iter().flatten().copied().collect();
    let above =
        |deviations: &[f32]| deviations.iter().filter(|deviation| **deviation > 0.1).count();
    let (before, after) = (above(&plain_m), above(&known));
    println!("beams above 0.1 m: {before} plain, {after} warped; {} known", known.len());
    assert!(known.len() > 300 && before > 60);
    // The remaining deviations are at depth edges, within one beam's width.
    assert!(5 * after < before, "{after} of {before}");
}

/// Regression: a scanner of 270 degrees with its gap to the right of the rig: its beams beyond the gap, those ahead, were taken to be
/// where there is no gap.
#[test]
fn a_scanner_with_its_gap_aside_has_the_ranges_of_one_without() {
    let scanner = Scanner { noise_m: 0.0, dropouts: 0.0, spread_rad: 0.0 };
    let mut follower = PlatformMotion::new(&FreeSpaceConfig::default());
    let mut dice = Dice::new(1);
    // From -135 degrees to -45 there is nothing.
    let gap = 45..135;
    let mut pairs = Vec::new();
    for cycle in 0..2 {
        let pose: Isometry3<f64> =
            pose_from_vector(&[0.0, 0.0, 0.0, 0.07 * f64::from(cycle), 0.0, 0.0]);
        let motion = follower.advance(stamp_of(cycle), &pose, "map");
        let full = scanner.scan(&room(), &pose, cycle, &mut dice);
        let beams = (gap.end..360).chain(0..gap.start);
        let part = geometry::Scan {
            ranges_m: beams.map(|beam| full.ranges_m[beam]).collect(),
            angle_min_rad: full.angle_min_rad + gap.end as f32 * full.angle_increment_rad,
            ..full.clone()
        };
        pairs.push([full, part].map(|scan| deskewed_scan(&pose, &scan, &motion)));
    }
    let [full, part] = [0, 1].map(|which| warp(&pairs[0][which], &pairs[1][which]));
    let mut known = 0;
    for (beam, range_m) in part.iter().enumerate() {
        let of_full = if beam < gap.start { beam } else { beam + gap.len() };
        let (Some(range_m), Some(expected_m)) = (range_m, full[of_full]) else { continue };
        known += 1;
        assert!((range_m - expected_m).abs() < 0.01, "{beam}: {range_m} of {expected_m}");
    }
    assert!(known > 220, "{known}");
}

#[test]
fn hidden_ranges_are_unknown() {
    // A step aside past a box uncovers wall that the earlier scan could not see.
    let scans = scans(&[[0.0; 6], [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]]);
    let warped = warp(&scans[0], &scans[1]);
    let hidden: Vec<usize> = (0..360)
        .filter(|&beam| scans[1].beams[beam].hit.is_some() && warped[beam].is_none())
        .collect();
    assert!((10..180).contains(&hidden.len()), "{hidden:?}");
    for (beam, range_m) in warped.iter().enumerate() {
        let Some(range_m) = range_m else { continue };
        assert!(range_m.is_finite() && *range_m > 0.0, "{beam}");
    }
}
