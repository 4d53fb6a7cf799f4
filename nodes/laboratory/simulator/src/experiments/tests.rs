use std::collections::BTreeMap;

use super::*;
use crate::{Figure, Sample};

fn small(scenario: Scenario) -> Scenario {
    scenario.with_depth_size(64, 48)
}

/// For each object the times, in seconds since the start, of the images and revolutions that show it.
#[derive(Default)]
struct Seen {
    images_s: Vec<f64>,
    turns_s: Vec<f64>,
}

/// Beams count within the forward quarter only, and at least two of them.
fn seen(scenario: &Scenario) -> BTreeMap<u16, Seen> {
    let mut seen: BTreeMap<u16, Seen> = BTreeMap::new();
    for sample in scenario.samples().unwrap() {
        let time_s = sample.stamp().seconds_since(scenario.start);
        match sample {
            Sample::ObjectPoses(truth) => {
                for object in truth.objects.iter().filter(|object| object.visible_pixels > 0) {
                    seen.entry(object.id).or_default().images_s.push(time_s);
                }
            }
            Sample::Scan { scan, labels } => {
                let mut beams: BTreeMap<u16, usize> = BTreeMap::new();
                for (beam, &label) in labels.iter().enumerate() {
                    if label > 0 && scan.azimuth_rad(beam).abs() < std::f64::consts::FRAC_PI_4 {
                        *beams.entry(label).or_default() += 1;
                    }
                }
                for (id, _) in beams.into_iter().filter(|(_, beams)| *beams >= 2) {
                    seen.entry(id).or_default().turns_s.push(time_s);
                }
            }
            _ => {}
        }
    }
    seen
}

/// Each object is out of both views for the first and the last moments, and in both between.
fn check_crossing(scenario: &Scenario, ids: &[u16]) {
    let seen = seen(scenario);
    assert_eq!(seen.keys().copied().collect::<Vec<_>>(), ids, "{}", scenario.name);
    for (id, seen) in seen {
        let what = format!("{} in {}, seed {}", id, scenario.name, scenario.seed);
        assert!(seen.images_s.len() > 15, "{what}: {} images", seen.images_s.len());
        assert!(seen.turns_s.len() > 5, "{what}: {} turns", seen.turns_s.len());
        for times_s in [&seen.images_s, &seen.turns_s] {
            assert!(times_s[0] > LEAD_S, "{what}: seen at {} s", times_s[0]);
            let last_s = times_s[times_s.len() - 1];
            assert!(last_s < scenario.duration_s - TAIL_S, "{what}: seen at {last_s} s");
        }
    }
}

#[test]
fn whatever_crosses_comes_from_out_of_sight_and_leaves_it_in_every_scene() {
    for (index, scene) in SceneName::ALL.into_iter().enumerate() {
        let seed = index as u64;
        let object =
            [CrossingObject::Person, CrossingObject::Robot, CrossingObject::Cart][index % 3];
        for path in [PathName::A, PathName::B, PathName::C] {
            check_crossing(&small(Scenario::crossing(scene, object, path, seed)), &[object.id()]);
        }
    }
    for path in [PathName::D, PathName::E] {
        let person = Scenario::crossing(SceneName::B, CrossingObject::Person, path, 4);
        assert!(!person.rig.path.is_still());
        check_crossing(&small(person), &[PERSON_ID]);
    }
    check_crossing(&small(Scenario::touring(SceneName::C, 2)), &[PERSON_ID]);
}

#[test]
fn three_are_in_view_at_once() {
    for seed in 0..4 {
        let scenario = small(Scenario::three_crossing(SceneName::A, seed));
        check_crossing(&scenario, &[ROBOT_ID, PERSON_ID, SECOND_PERSON_ID]);
        // All are within the camera's view at some moment.
        let widest = |time_s: f64| {
            let slope = |object: &MovingObject| {
                let place_m = object.path.position_at(time_s);
                (place_m.y / (place_m.x - 0.5)).abs()
            };
            scenario.scene.objects.iter().map(slope).fold(0.0, f64::max)
        };
        let least =
            (0..1000).map(|step| widest(f64::from(step) * 0.02)).fold(f64::INFINITY, f64::min);
        assert!(least < 0.5, "seed {seed}: {least}");
    }
}

#[test]
fn who_pauses_stays_in_both_views_and_goes_on() {
    for seed in 0..5 {
        let scenario = small(Scenario::pausing(SceneName::B, 10.0, seed));
        check_crossing(&scenario, &[PERSON_ID]);
        let path = &scenario.scene.objects[0].path;
        let rests: Vec<_> =
            path.waypoints.windows(2).filter(|pair| pair[0].pose == pair[1].pose).collect();
        assert_eq!(rests.len(), 1);
        let (from_s, to_s) = (rests[0][0].time_s, rests[0][1].time_s);
        assert!((to_s - from_s - 10.0).abs() < 1e-9);
        assert!(rests[0][0].pose[1].abs() <= 0.5);
        let seen = &seen(&scenario)[&PERSON_ID];
        let resting = |times_s: &[f64]| {
            times_s.iter().filter(|time_s| (from_s..to_s).contains(*time_s)).count()
        };
        assert!(resting(&seen.images_s) >= 299, "{}", resting(&seen.images_s));
        assert!(resting(&seen.turns_s) >= 68, "{}", resting(&seen.turns_s));
    }
}

#[test]
fn a_seed_varies_the_run_and_the_same_seed_repeats_it() {
    let run = |seed| Scenario::crossing(SceneName::A, CrossingObject::Person, PathName::A, seed);
    assert_eq!(run(5), run(5));
    let speed_m_per_s = |scenario: &Scenario| {
        let path = &scenario.scene.objects[0].path;
        path.distance_at(99.0) / (path.end_s() - path.start_s())
    };
    let runs: Vec<Scenario> = (0..40).map(run).collect();
    let speeds: Vec<f64> = runs.iter().map(speed_m_per_s).collect();
    assert!(speeds.iter().all(|speed| (1.33..=1.47).contains(speed)), "{speeds:?}");
    assert!(speeds.iter().any(|&speed| speed < 1.36) && speeds.iter().any(|&speed| speed > 1.44));
    let from_left = runs.iter().filter(|run| run.scene.objects[0].path.waypoints[0].pose[1] > 0.0);
    assert!((10..=30).contains(&from_left.count()));
    let phases: Vec<f64> = runs.iter().map(|run| run.rig.depth_camera.first_image_s).collect();
    assert!(phases.iter().all(|&phase_s| (0.0..1.0 / 30.0).contains(&phase_s)));
    for (index, run) in runs.iter().enumerate() {
        assert!(runs[..index].iter().all(|other| other.scene != run.scene));
        let Figure::Walker(walker) = &run.scene.objects[0].figure else { panic!("no person") };
        assert!((1.6..1.9).contains(&walker.height_m));
    }
}

#[test]
fn a_door_is_a_part_of_the_room_until_it_turns() {
    let scenario = small(Scenario::opening_door(SceneName::A, 1));
    let seen = seen(&scenario);
    assert_eq!(seen.keys().copied().collect::<Vec<_>>(), [PERSON_ID, DOOR_ID]);
    let [from_s, to_s] = scenario.scene.objects[1].label_span_s.unwrap();
    assert!((to_s - from_s - 2.0).abs() < 1e-9);
    let door = &seen[&DOOR_ID];
    assert!(door.images_s.iter().all(|time_s| (from_s..=to_s).contains(time_s)));
    assert!(door.images_s.len() >= 58 && door.turns_s.len() >= 10);
    // The person waits beside it while it turns, out of its way.
    let person = &scenario.scene.objects[0].path;
    for step in 0..=20 {
        let time_s = from_s + (to_s - from_s) * f64::from(step) / 20.0;
        let hinge_to_person = person.position_at(time_s) - nalgebra::Point3::new(3.6, 0.4, 0.0);
        assert!(hinge_to_person.norm() > 0.8 + 0.3, "{}", hinge_to_person.norm());
    }
}

#[test]
fn a_chair_moves_with_the_person_who_pushes_it_and_then_stays() {
    let scenario = small(Scenario::moving_chair(SceneName::A, 1));
    let seen = seen(&scenario);
    assert_eq!(seen.keys().copied().collect::<Vec<_>>(), [PERSON_ID, CHAIR_ID]);
    let [person, chair] = [0, 1].map(|index| &scenario.scene.objects[index].path);
    assert!((chair.distance_at(99.0) - 0.9).abs() < 1e-9);
    for step in 0..=20 {
        let time_s = chair.start_s() + (chair.end_s() - chair.start_s()) * f64::from(step) / 20.0;
        let apart_m = (person.position_at(time_s) - chair.position_at(time_s)).norm();
        assert!((0.45..0.65).contains(&apart_m), "{apart_m} at {time_s} s");
    }
}

#[test]
fn every_scenario_can_be_simulated_and_written() {
    for scene in SceneName::ALL {
        for seed in 0..3 {
            for scenario in [
                Scenario::empty(scene, seed),
                Scenario::empty(scene, seed).with_platform(Platform::Sway),
                Scenario::crossing(scene, CrossingObject::Robot, PathName::C, seed),
                Scenario::three_crossing(scene, seed),
                Scenario::pausing(scene, 10.0, seed),
                Scenario::touring(scene, seed),
                Scenario::opening_door(scene, seed),
                Scenario::moving_chair(scene, seed),
            ] {
                assert_eq!(scenario.validate(), Ok(()), "{}", scenario.name);
                assert!(scenario.duration_s < 40.0);
                let text = serde_json::to_string(&scenario).unwrap();
                assert_eq!(serde_json::from_str::<Scenario>(&text).unwrap(), scenario);
            }
        }
    }
}
