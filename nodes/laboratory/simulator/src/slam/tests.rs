use nalgebra::Vector3;

use super::*;
use crate::solid::nearest_sighting;
use crate::{Ray, Sample};

fn turn_rad(path: &Path, time_s: f64, step_s: f64) -> f64 {
    path.pose_at(time_s).rotation.angle_to(&path.pose_at(time_s + step_s).rotation)
}

#[test]
fn runs_are_valid_and_keep_clear_of_all_that_stands() {
    for run in SlamRun::ALL {
        for seed in 0..3 {
            let scenario = Scenario::slam(run, seed);
            assert_eq!(scenario.validate(), Ok(()), "{run:?}");
            assert_eq!(scenario.name, run.name());
            let text = serde_json::to_string(&scenario).unwrap();
            assert_eq!(serde_json::from_str::<Scenario>(&text).unwrap(), scenario);
            let statics = scenario.scene.static_solids();
            for step in 0..150 {
                let time_s = scenario.duration_s * f64::from(step) / 150.0;
                let origin = scenario.rig.path.position_at(time_s);
                for direction in 0..24 {
                    let angle_rad = f64::from(direction) * std::f64::consts::TAU / 24.0;
                    let direction = Vector3::new(angle_rad.cos(), angle_rad.sin(), 0.0);
                    let free_m = nearest_sighting(statics.iter(), &Ray { origin, direction }, 1e-9)
                        .map_or(f64::INFINITY, |sighting| sighting.distance_m);
                    assert!(free_m > 0.3, "{run:?} {seed} at {time_s} s: {free_m} m at {origin}");
                }
            }
        }
    }
}

#[test]
fn ways_are_as_fast_as_a_hand_and_long_ones_end_where_they_began() {
    const STEP_S: f64 = 0.02;
    for run in SlamRun::ALL {
        let path = Scenario::slam(run, 1).rig.path;
        let (mut fastest, mut turning, mut jumps) = (0.0, 0.0, 0);
        let steps = (path.end_s() / STEP_S) as u32;
        for time_s in (0..steps).map(|step| f64::from(step) * STEP_S) {
            let way_m = (path.position_at(time_s + STEP_S) - path.position_at(time_s)).norm();
            if way_m > 0.5 {
                jumps += 1;
                continue;
            }
            fastest = f64::max(fastest, way_m / STEP_S);
            turning = f64::max(turning, turn_rad(&path, time_s, STEP_S) / STEP_S);
        }
        let length_m = path.distance_at(path.end_s());
        println!("{run:?}: {length_m:.1} m, up to {fastest:.2} m/s and {turning:.2} rad/s");
        assert_eq!(jumps > 0, run == SlamRun::Kidnapped, "{run:?}: {jumps} jumps");
        if run != SlamRun::Kidnapped {
            assert!((0.08..1.2).contains(&fastest), "{run:?}: {fastest} m/s");
            assert!(turning < 2.0, "{run:?}: {turning} rad/s");
        }
    }
    for run in [SlamRun::LongOffice, SlamRun::TexturedPlane, SlamRun::Flat, SlamRun::Dark] {
        let path = Scenario::slam(run, 2).rig.path;
        let gap = path.pose_at(0.0).inverse() * path.pose_at(path.end_s());
        assert!(gap.translation.vector.norm() < 0.01, "{run:?}");
        assert!(gap.rotation.angle() < 0.01, "{run:?}");
    }
    let flat = Scenario::slam(SlamRun::Flat, 1).rig.path;
    assert!(flat.distance_at(flat.end_s()) > 60.0);
}

/// This many small images of a run: each colour image, and the share of its depth pixels on moving objects.
fn look(run: SlamRun, images: u32) -> Vec<(Vec<u8>, f64)> {
    let mut scenario = Scenario::slam(run, 1).with_depth_size(80, 60);
    let depth = &mut scenario.rig.depth_camera;
    depth.rate_hz = f64::from(images) / scenario.duration_s;
    depth.first_image_s = 0.5 / depth.rate_hz;
    let (mut shares, mut colours) = (Vec::new(), Vec::new());
    for sample in scenario.samples().unwrap() {
        match sample {
            Sample::Colour(image) => colours.push(image.rgb),
            Sample::ObjectPoses(poses) => {
                let pixels: usize = poses.objects.iter().map(|object| object.visible_pixels).sum();
                shares.push(pixels as f64 / f64::from(80 * 60));
            }
            _ => {}
        }
    }
    colours.into_iter().zip(shares).collect()
}

#[test]
fn people_are_in_the_picture_and_those_who_walk_fill_much_of_it() {
    for (run, most) in [
        (SlamRun::DeskWithPerson, 0.03),
        (SlamRun::SittingXyz, 0.04),
        (SlamRun::SittingHalfsphere, 0.03),
        (SlamRun::WalkingXyz, 0.2),
        (SlamRun::WalkingHalfsphere, 0.1),
    ] {
        let shares: Vec<f64> = look(run, 24).into_iter().map(|(_, share)| share).collect();
        let seen = shares.iter().fold(0.0, |a, b| f64::max(a, *b));
        assert!(seen > most && seen < 0.8, "{run:?}: {seen}");
        assert!(shares.iter().filter(|share| **share > 0.005).count() > 8, "{run:?}: {shares:?}");
    }
}

#[test]
fn in_the_dark_colour_images_are_black() {
    let images = look(SlamRun::Dark, 30);
    let bright =
        |rgb: &[u8]| rgb.iter().map(|byte| f64::from(*byte)).sum::<f64>() / rgb.len() as f64;
    let dark = images.iter().filter(|(rgb, _)| bright(rgb) < 12.0).count();
    let light = images.iter().filter(|(rgb, _)| bright(rgb) > 40.0).count();
    assert!(dark + light == images.len() && (12..18).contains(&dark), "{dark} and {light}");
}
