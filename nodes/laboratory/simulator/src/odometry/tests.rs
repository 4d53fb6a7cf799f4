use nalgebra::{Point3, Vector3};

use super::*;
use crate::solid::nearest_sighting;
use crate::{Ray, Sample};

/// A few images of a run: colour, and the share of depth pixels that were measured.
struct Look {
    images: Vec<crate::ColourImage>,
    measured: f64,
}

fn look(run: OdometryRun) -> Look {
    let mut scenario = Scenario::odometry(run, 1).with_depth_size(160, 120);
    let depth = &mut scenario.rig.depth_camera;
    depth.rate_hz = 8.0 / scenario.duration_s;
    depth.first_image_s = 1.0;
    let (mut images, mut pixels, mut measured) = (Vec::new(), 0.0, 0.0);
    for sample in scenario.samples().unwrap() {
        match sample {
            Sample::Colour(image) => images.push(image),
            Sample::Depth { image, .. } => {
                for index in 0..160 * 120 {
                    pixels += 1.0;
                    measured +=
                        f64::from(u8::from(image.depth_m(index % 160, index / 160).is_some()));
                }
            }
            _ => {}
        }
    }
    Look { images, measured: measured / pixels }
}

/// The share of pixels whose green differs much from that of the pixel two columns on.
fn edges(look: &Look) -> f64 {
    let (mut edges, mut pixels) = (0.0, 0.0);
    for image in &look.images {
        for row in image.rgb.chunks(3 * image.width_px) {
            for (here, there) in row.chunks(3).zip(row.chunks(3).skip(2)) {
                pixels += 1.0;
                edges += f64::from(u8::from(here[1].abs_diff(there[1]) > 30));
            }
        }
    }
    edges / pixels
}

#[test]
fn runs_are_valid_last_about_20_s_and_keep_clear_of_all_that_stands() {
    for run in OdometryRun::ALL {
        for seed in 0..3 {
            let scenario = Scenario::odometry(run, seed);
            assert_eq!(scenario.validate(), Ok(()), "{run:?}");
            assert_eq!(scenario.name, run.name());
            let text = serde_json::to_string(&scenario).unwrap();
            assert_eq!(serde_json::from_str::<Scenario>(&text).unwrap(), scenario);
            if run != OdometryRun::Rail {
                assert!((14.0..23.0).contains(&scenario.duration_s), "{}", scenario.duration_s);
            }
            let statics = scenario.scene.static_solids();
            for step in 0..40 {
                let time_s = scenario.duration_s * f64::from(step) / 40.0;
                let origin = scenario.rig.path.position_at(time_s);
                for direction in 0..24 {
                    let angle_rad = f64::from(direction) * std::f64::consts::TAU / 24.0;
                    let down = if direction % 3 == 0 { -0.6 } else { 0.0 };
                    let direction = Vector3::new(angle_rad.cos(), angle_rad.sin(), down);
                    let ray = Ray { origin, direction: direction.normalize() };
                    let free_m = nearest_sighting(statics.iter(), &ray, 1e-9)
                        .map_or(f64::INFINITY, |sighting| sighting.distance_m);
                    assert!(free_m > 0.3, "{run:?} at {time_s} s: {free_m} m at {origin}");
                }
            }
        }
    }
}

#[test]
fn ways_are_as_fast_as_a_hand_and_the_seed_varies_them_by_centimetres() {
    for run in OdometryRun::ALL {
        let path = Scenario::odometry(run, 1).rig.path;
        let (mut fastest, mut turning) = (0.0, 0.0);
        for pair in path.waypoints.windows(2) {
            let step_s = pair[1].time_s - pair[0].time_s;
            let (from, to) = (path.pose_at(pair[0].time_s), path.pose_at(pair[1].time_s));
            let way_m = (to.translation.vector - from.translation.vector).norm();
            fastest = f64::max(fastest, way_m / step_s);
            turning = f64::max(turning, from.rotation.angle_to(&to.rotation) / step_s);
        }
        println!("{run:?}: up to {fastest:.2} m/s and {turning:.2} rad/s");
        assert!((0.08..1.2).contains(&fastest), "{run:?}: {fastest} m/s");
        assert!(turning < 2.0, "{run:?}: {turning} rad/s");
        let other = Scenario::odometry(run, 2).rig.path;
        let apart_m = |time_s: f64| (path.position_at(time_s) - other.position_at(time_s)).norm();
        let apart_m = (0..200).map(|step| apart_m(f64::from(step) * 0.1)).fold(0.0, f64::max);
        assert!(apart_m > 0.003 && apart_m < 0.2, "{run:?}: {apart_m} m");
    }
    // It ends at its first pose.
    let closed = Scenario::odometry(OdometryRun::Loop, 3).rig.path;
    let gap: Point3<f64> = (closed.position_at(99.0) - closed.position_at(0.0)).into();
    assert!(gap.coords.norm() < 0.01);
    assert!(closed.distance_at(99.0) > 7.0);
}

#[test]
fn each_run_is_as_hard_as_it_says() {
    let of = |run| look(run);
    let office = of(OdometryRun::Office);
    let (plenty, measured) = (edges(&office), office.measured);
    assert!(plenty > 0.05 && measured > 0.6, "{plenty} edges, {measured} measured");
    let corridor = of(OdometryRun::Corridor);
    assert!(edges(&corridor) < 0.5 * plenty, "corridor {}", edges(&corridor));
    let hall = of(OdometryRun::Hall);
    assert!(hall.measured < 0.6, "hall {}", hall.measured);
    let wall = of(OdometryRun::Wall);
    assert!(wall.measured > 0.9 && edges(&wall) > 0.02, "wall {}", wall.measured);
    // Noise as strong as these edges is everywhere in the image, blur removes edges.
    let dark = of(OdometryRun::LowLight);
    assert!(edges(&dark) > 1.3 * plenty, "low light {}", edges(&dark));
    let blur = of(OdometryRun::Blur);
    assert!(edges(&blur) < plenty, "blur {}", edges(&blur));
}

#[test]
fn the_person_is_in_many_images_and_walks_at_1_4_metres_a_second() {
    let mut scenario = Scenario::odometry(OdometryRun::Person, 1).with_depth_size(64, 48);
    scenario.rig.colour_camera = None;
    scenario.rig.depth_camera.rate_hz = 5.0;
    let (mut seen, mut images, mut fastest) = (0, 0, 0.0);
    for sample in scenario.samples().unwrap() {
        if let Sample::ObjectPoses(poses) = sample {
            images += 1;
            seen += i32::from(poses.objects[0].visible_pixels > 20);
            fastest = f64::max(fastest, poses.objects[0].velocity_m_per_s.norm());
        }
    }
    assert!((fastest - 1.4).abs() < 0.01, "{fastest}");
    assert!(seen * 4 > images && seen * 10 < images * 8, "{seen} of {images}");
}

#[test]
fn truth_and_sensors_come_at_their_rates() {
    let mut scenario =
        Scenario::odometry(OdometryRun::Wall, 1).with_depth_size(32, 24).with_duration_s(3.0);
    scenario.rig.wheels = Some(crate::Wheels::default());
    let (mut colours, mut imu, mut wheels, mut before) = (0, 0, 0, None);
    let mut truth = None;
    for sample in scenario.samples().unwrap() {
        assert!(before.is_none_or(|before| before <= sample.stamp()));
        before = Some(sample.stamp());
        match sample {
            Sample::TruePose(pose) => truth = Some(pose),
            Sample::Colour(image) => {
                colours += 1;
                let truth = truth.take().unwrap();
                assert_eq!(truth.stamp, image.stamp);
                let time_s = image.stamp.seconds_since(scenario.start);
                let expected = scenario.map_from_rig(time_s);
                let off = truth.map_from_rig.inverse() * expected;
                // Stamps are whole nanoseconds.
                assert!(off.translation.vector.norm() < 1e-8 && off.rotation.angle() < 1e-8);
            }
            Sample::Imu(_) => imu += 1,
            Sample::Wheels(_) => wheels += 1,
            _ => {}
        }
    }
    assert_eq!((colours, imu, wheels), (90, 601, 151));
}
