use evaluation::ReducedClouds;
use simulator::{CrossingObject, PathName, SceneName};

use super::*;

fn options(methods: &[Method]) -> TrialOptions {
    TrialOptions {
        methods: methods.to_vec(),
        correlate_each_cycle: true,
        score_labels: true,
        voxel_edge_m: None,
    }
}

fn short_crossing() -> Scenario {
    Scenario::crossing(SceneName::B, CrossingObject::Robot, PathName::A, 3)
        .with_depth_size(160, 120)
        .with_duration_s(6.0)
}

#[test]
fn both_methods_see_the_same_cycles_with_their_truth() {
    let trials = trials(&options(&[Method::RecHv, Method::FreeSpace]));
    let [rec_hv, free_space] = &trials[..] else { panic!("one trial a method") };
    assert_eq!((rec_hv.method, free_space.method), (Method::RecHv, Method::FreeSpace));
    let stamps = |trial: &Trial| {
        trial.record.cycles.iter().map(|cycle| cycle.cloud_stamp).collect::<Vec<_>>()
    };
    assert!(rec_hv.record.cycles.len() > 20, "{}", rec_hv.record.cycles.len());
    assert_eq!(stamps(rec_hv), stamps(free_space));
    for trial in &trials {
        assert_eq!(trial.cycles.len(), trial.record.cycles.len());
        for (cycle, recorded) in trial.cycles.iter().zip(&trial.record.cycles) {
            assert_eq!(cycle.truth.stamp, recorded.cloud_stamp);
            assert_eq!(cycle.truth.objects.len(), 1);
            assert!(cycle.correlation.is_some());
        }
        let score = trial.score.as_ref().unwrap();
        assert_eq!((score.cycles_scored, score.cycles_without_truth), (trial.cycles.len(), 0));
        assert!(score.objects.iter().any(|object| object.cycles_in_view > 0));
    }
    assert!(rec_hv.cycles.iter().all(|cycle| cycle.tracks.is_empty()));
    assert!(free_space.cycles.iter().any(|cycle| !cycle.tracks.is_empty()));
}

/// The reference surface once had a point per 8 cm voxel here, but one per pixel in the score of a bag.
#[test]
fn the_distance_from_the_surface_is_that_of_run_and_eval_map() {
    let scenario = short_crossing();
    let trial = trials(&options(&[Method::FreeSpace])).remove(0);
    let surface_m = scenario.static_scene_cloud().unwrap().points_m;
    let tolerance_m = DynamicScoreRules::default().surface_tolerance_m;
    let clouds = ReducedClouds::of(&surface_m, &trial.record.static_map, tolerance_m).unwrap();
    let surface = trial.score.unwrap().map.surface;
    assert_eq!(surface, Some(clouds.distance(tolerance_m).unwrap()));
}

#[test]
fn a_trial_repeats_itself() {
    let run = || {
        let mut trial = trials(&options(&[Method::FreeSpace])).remove(0);
        for cycle in &mut trial.record.cycles {
            cycle.step_durations_s.clear();
        }
        trial
    };
    assert!(run() == run());
}

#[test]
fn another_edge_gives_another_map() {
    let points = |voxel_edge_m| {
        let options = TrialOptions {
            voxel_edge_m,
            score_labels: false,
            correlate_each_cycle: false,
            methods: vec![Method::RecHv],
        };
        let trial = trials(&options).remove(0);
        assert!(trial.score.is_none() && trial.cycles[0].correlation.is_none());
        trial.record.static_map.len()
    };
    assert!(points(Some(0.16)) < points(None) / 2);
}

fn trials(options: &TrialOptions) -> Vec<Trial> {
    run_trial(&short_crossing(), options, &Interrupt::default()).unwrap().unwrap()
}

#[test]
fn a_trial_that_is_interrupted_is_none() {
    let interrupt = Interrupt::default();
    interrupt.trigger();
    let trial = run_trial(&short_crossing(), &options(&[Method::RecHv]), &interrupt).unwrap();
    assert!(trial.is_none());
}
