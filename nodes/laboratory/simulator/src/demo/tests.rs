use std::f64::consts::FRAC_PI_2;

use super::*;
use crate::{ObjectPoses, Sample};
use geometry::Scan;

/// A tenth of the columns and rows: the geometry is that of the full image.
fn demo() -> Scenario {
    Scenario::demo().with_depth_size(64, 48)
}

fn truths(scenario: &Scenario) -> Vec<ObjectPoses> {
    let truth = |sample| match sample {
        Sample::ObjectPoses(truth) => Some(truth),
        _ => None,
    };
    scenario.samples().unwrap().filter_map(truth).collect()
}

fn scans(scenario: &Scenario) -> Vec<(Scan, Vec<u16>)> {
    let scan = |sample| match sample {
        Sample::Scan { scan, labels } => Some((scan, labels)),
        _ => None,
    };
    scenario.samples().unwrap().filter_map(scan).collect()
}

/// Beams of the scanner's forward quarter: the aperture that Rec-HV 3.4.1 uses.
fn forward_quarter(scan: &Scan) -> impl Iterator<Item = usize> + '_ {
    (0..scan.ranges_m.len()).filter(|&beam| scan.azimuth_rad(beam).abs() <= FRAC_PI_2 / 2.0 + 1e-6)
}

#[test]
fn each_object_is_in_view_exactly_while_its_path_crosses_the_view() {
    let scenario = demo();
    let tangent = 320.0 / 575.8;
    let mut seen = [0; 2];
    for truth in truths(&scenario) {
        for object in &truth.objects {
            let position_m = object.map_from_object.translation.vector;
            // How far the object reaches along y: half the screen, a leg swung back.
            let half_m = if object.id == ROBOT_ID { 0.32 } else { 0.55 };
            let overlap_m = position_m.x * tangent - (position_m.y.abs() - half_m);
            if overlap_m < -0.2 {
                assert_eq!(object.visible_pixels, 0, "{} at {position_m}", object.name);
                assert_eq!(object.visible_centroid_m, None);
            } else if overlap_m > 0.4 {
                assert!(object.visible_pixels > 10, "{} at {position_m}", object.name);
            }
            if let Some(centroid_m) = object.visible_centroid_m {
                seen[usize::from(object.id - 1)] += 1;
                assert!((centroid_m.x - position_m.x).abs() < 0.25);
                // At the edge of the view only a foot or the end of the screen may show.
                assert!((centroid_m.y - position_m.y).abs() < 0.6);
            }
        }
    }
    // The screen, 1.75 m away, is in view on 1.92 + 0.64 m, and the chassis's rear edge, 2.08 m away, on
    // 2.29 + 0.44 m; at 0.98 m/s and 30 Hz in 78 and 84 images. The person, 2.4 m away, on 2.64 m and a reach of
    // 0.1 m (the trunk) to 0.55 m on each side; at 1.4 m/s in 61 to 80 images.
    assert!((78..=84).contains(&seen[0]), "robot in {} images", seen[0]);
    assert!((61..=80).contains(&seen[1]), "person in {} images", seen[1]);
}

#[test]
fn the_room_is_empty_before_between_and_after_the_crossings() {
    let scenario = demo();
    let [robot, person] = [0, 1].map(|index| scenario.scene.objects[index].path.clone());
    let empty = |time_s: f64| {
        time_s <= robot.waypoints[0].time_s
            || (time_s >= robot.end_s() && time_s <= person.waypoints[0].time_s)
            || time_s >= person.end_s()
    };
    let mut crossing = [0; 3];
    for sample in scenario.samples().unwrap() {
        let time_s = sample.stamp().seconds_since(scenario.start);
        let labels: Vec<u16> = match &sample {
            Sample::Depth { image, labels } => {
                for (index, &label) in labels.object_ids().iter().enumerate() {
                    // A label belongs to a measurement: there is none without one.
                    let measured = image.depth_m(index % 64, index / 64).is_some();
                    assert!(label == 0 || measured);
                }
                labels.object_ids().to_vec()
            }
            Sample::Scan { scan, labels } => {
                for (beam, &label) in labels.iter().enumerate() {
                    assert!(label == 0 || scan.measured_range_m(beam).is_some());
                }
                // A turn takes until 0.143 s after its stamp.
                if !empty(time_s) || !empty(time_s + 0.15) {
                    let met = forward_quarter(scan).any(|beam| labels[beam] > 0);
                    crossing[2] += i32::from(met);
                    continue;
                }
                forward_quarter(scan).map(|beam| labels[beam]).collect()
            }
            _ => continue,
        };
        for id in [ROBOT_ID, PERSON_ID] {
            let pixels = labels.iter().filter(|&&label| label == id).count();
            assert!(pixels == 0 || !empty(time_s), "object {id} at {time_s} s");
            crossing[usize::from(id - 1)] += i32::from(pixels > 0);
        }
    }
    // Images and turns (as below), less the crossings' ends.
    assert!(crossing[0] > 70 && crossing[1] > 55 && crossing[2] > 50, "{crossing:?}");
}

#[test]
fn labelled_pixels_lie_where_the_object_is() {
    let scenario = Scenario::small();
    let mut checked = 0;
    for sample in scenario.samples().unwrap() {
        let Sample::Depth { image, labels } = sample else { continue };
        for (index, _) in
            labels.object_ids().iter().enumerate().filter(|(_, label)| **label == PERSON_ID)
        {
            let depth_m = image.depth_m(index % 160, index / 160).unwrap();
            // The person walks 2.4 m in front of the camera and reaches 0.25 m to both sides of the path.
            assert!((2.0..2.8).contains(&depth_m), "{depth_m}");
            checked += 1;
        }
    }
    assert!(checked > 50_000, "{checked} labelled pixels");
}

#[test]
fn without_objects_there_is_no_label_and_only_those_asked_for_enter() {
    for sample in demo().without_objects().samples().unwrap() {
        match sample {
            Sample::Depth { labels, .. } => {
                assert!(labels.object_ids().iter().all(|&label| label == 0))
            }
            Sample::Scan { labels, .. } => assert!(labels.iter().all(|&label| label == 0)),
            Sample::ObjectPoses(truth) => assert!(truth.objects.is_empty()),
            _ => {}
        }
    }
    let only_robot = demo().with_only_objects(&[ROBOT_ID]);
    assert!(
        truths(&only_robot).iter().all(|t| t.objects.len() == 1 && t.objects[0].name == "robot")
    );
}

/// The deviation over three turns (Rec-HV eq. 3) of the empty room stays below the 0.4 m that Rec-HV takes
/// for motion, and the crossings lift it above: the demo's room is of the kind that the method is for. Of the
/// room come at most 0.17 m from its steps (module `room`), the rest from the noise of ranges.
#[test]
fn the_empty_room_is_quiet_and_the_crossings_are_not() {
    let largest_deviations_m = |scenario: &Scenario| -> Vec<f64> {
        let turns: Vec<Vec<f64>> = scans(scenario)
            .iter()
            .map(|(scan, _)| {
                let measured = |beam: usize| scan.measured_range_m(beam).map(f64::from);
                // A gap takes the nearest return; lines through both neighbours differ little.
                let filled = |beam: usize| {
                    (0..20).find_map(|gap| measured(beam - gap).or(measured(beam + gap))).unwrap()
                };
                forward_quarter(scan).map(filled).collect()
            })
            .collect();
        let deviation = |window: &[Vec<f64>], beam: usize| {
            let mean = window.iter().map(|turn| turn[beam]).sum::<f64>() / 3.0;
            (window.iter().map(|turn| (turn[beam] - mean).powi(2)).sum::<f64>() / 3.0).sqrt()
        };
        turns
            .windows(3)
            .map(|window| (0..91).map(|beam| deviation(window, beam)).fold(0.0, f64::max))
            .collect()
    };
    // The screen, 1.75 m away, crosses 3.5 + 0.64 m at 0.98 m/s, the trunk, 2.4 m away, 4.8 + 0.2 m at 1.4 m/s and
    // the hands up to 0.35 m more on each side: 4.2 and 3.6 to 4.1 s, 55 to 58 turns at 7 Hz. Each crossing stays in
    // two windows more; where a window holds both of its sides once, the deviation is 0.47 of at least 1.7 m.
    for seed in 1..=5 {
        let quiet = largest_deviations_m(&demo().with_seed(seed).without_objects());
        let largest_m = quiet.iter().copied().fold(0.0, f64::max);
        assert!(largest_m < 0.4, "seed {seed}: an empty room deviates by {largest_m} m");
        let lively = largest_deviations_m(&demo().with_seed(seed));
        let moving = lively.iter().filter(|&&deviation_m| deviation_m > 0.4).count();
        assert!((53..=64).contains(&moving), "seed {seed}: motion in {moving} of {}", lively.len());
    }
}

#[test]
fn gaps_in_the_scan_are_the_monitor_and_as_many_as_in_a_room_with_reflecting_things() {
    let scans = scans(&demo().without_objects());
    let gaps: usize = scans
        .iter()
        .map(|(scan, _)| {
            forward_quarter(scan).filter(|&beam| scan.measured_range_m(beam).is_none()).count()
        })
        .sum();
    let per_scan = gaps as f64 / scans.len() as f64;
    // The monitor is 4.2 m away and reaches from 0.2 to 0.75 m right of the middle. Beams are a degree apart and
    // measured anywhere within their degree, so as many of them meet it as it is degrees wide: 7.4.
    let monitor = ((0.75_f64 / 4.2).atan() - (0.2_f64 / 4.2).atan()).to_degrees();
    let by_chance = 0.01 * (91.0 - monitor);
    // Other missing returns graze the lamp or the sides of the shelf: less than a beam. Rec-HV 4.1 finds
    // gaps in 94.4 % of the turns of scene B, which is full of reflecting things; Table 4 shows seven in a row.
    let expected = monitor + by_chance;
    assert!(
        (expected - 0.4..expected + 1.0).contains(&per_scan),
        "{per_scan} gaps in a quarter turn"
    );
}

#[test]
fn the_empty_scene_cloud_lies_within_the_room_in_the_map_frame() {
    let scenario = Scenario::small();
    let cloud = scenario.static_scene_cloud().unwrap();
    assert_eq!(cloud.frame_id, "map");
    // Two columns are dead and the monitor, 18 x 11 pixels, is black. What else is missing lies in shadow or is
    // grazed: tops of furniture, the shelf's sides and the far edges of floor and ceiling.
    let pixels = 160 * 120;
    let most = 158 * 120 - 18 * 11;
    assert!((pixels * 8 / 10..most).contains(&cloud.points_m.len()), "{}", cloud.points_m.len());
    // The camera stands 0.5 m before the rear wall, 1.2 m up in a room of 2.6 m. The lowest row looks at the floor
    // 2.85 m away; at the far wall, 4.5 m away, the view is 2.5 m wide on both sides.
    for point in &cloud.points_m {
        assert!((2.85..4.501).contains(&point.x), "{point}");
        assert!(point.y.abs() < 2.5 && (-1.2001..1.4001).contains(&point.z), "{point}");
    }
    // The far wall's foot is 38 rows below the middle of the image and its top 45 rows above it, so the floor has
    // the lowest 23 of the 120 rows and the ceiling the highest 14, less what is grazed and hidden.
    for z_m in [-1.2, 1.4] {
        let points = cloud.points_m.iter().filter(|point| (point.z - z_m).abs() < 1e-3).count();
        assert!((8 * 158..23 * 158).contains(&points), "{points} points at a height of {z_m} m");
    }
    // The far wall covers 84 rows; the furniture before it takes less than 4.2 of its 13 m^2, seen a fifth larger.
    let wall = cloud.points_m.iter().filter(|point| (point.x - 4.5).abs() < 1e-3).count();
    assert!(wall * 3 > cloud.points_m.len(), "{wall} points of the far wall");
    assert_eq!(cloud, scenario.without_objects().static_scene_cloud().unwrap());
}

#[test]
fn the_small_scenario_is_small() {
    let small = Scenario::small();
    assert_eq!(small.duration_s, 8.0);
    let camera = small.rig.depth_camera.camera;
    assert_eq!((camera.width_px, camera.height_px), (160, 120));
    // The same field of view: the image's edges, half a pixel beyond its outer pixels, see the same angles.
    let full = Scenario::demo().rig.depth_camera.camera;
    let edge = |c: &geometry::CameraModel, u: f64| (u - c.cx_px) / c.fx_px;
    assert!((edge(&camera, -0.5) - edge(&full, -0.5)).abs() < 1e-12);
    assert!((edge(&camera, 159.5) - edge(&full, 639.5)).abs() < 1e-12);
    assert!((14.0..=16.0).contains(&Scenario::demo().duration_s));
}

#[test]
fn a_scenario_survives_being_written_and_read() {
    let scenario = Scenario::demo().with_seed(77).with_pose_noise(0.001, 0.0005);
    let text = serde_json::to_string(&scenario).unwrap();
    assert_eq!(serde_json::from_str::<Scenario>(&text).unwrap(), scenario);
    let misspelt = text.replacen("\"seed\"", "\"sede\"", 1);
    assert!(serde_json::from_str::<Scenario>(&misspelt).is_err());
}
