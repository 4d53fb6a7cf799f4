//! Objects that stop, for a while or for good.

use geometry::PipelineConfig;

use super::*;

/// Walks in, stands from 3.5 s to 13.5 s, and goes on.
fn pausing(time_s: f64) -> Vec<Solid> {
    let walking_s = time_s.min(3.5) + (time_s - 13.5).max(0.0);
    walker(1, 2.6, across_m(walking_s, -2.5, 1.0))
}

#[test]
fn an_object_that_pauses_stays_dynamic_without_any_zone() {
    let is_walking = |time_s: f64| !(3.6..13.5).contains(&time_s);
    let pause = Run { is_zoned: &is_walking, ..run(furnished(), &pausing, 120) };
    let score = pause.score(9);
    check(&score, "pausing");
    assert_eq!(score.ids[&1].len(), 1, "{:?}", score.ids);
}

#[test]
fn an_object_that_stays_beyond_the_longest_stop_becomes_static() {
    let is_walking = |time_s: f64| !(3.6..13.5).contains(&time_s);
    let pipeline = PipelineConfig { max_stop_s: 3.0, ..PipelineConfig::default() };
    let short = SegmentationConfig { pipeline, ..config() };
    let pause = Run { config: short, is_zoned: &is_walking, ..run(furnished(), &pausing, 90) };
    let score = pause.score(9);
    // At 5 s it stands there and is dynamic; from 8 s on it is not, and stays so.
    assert!(score.cut_of_cycle[35] > 50, "{:?}", score.cut_of_cycle);
    assert!(score.cut_of_cycle[56..].iter().all(|cut| *cut <= 3), "{:?}", score.cut_of_cycle);
}

/// Regression: each look at furniture that had been moved began its time anew, so that a robot on patrol never had it in its map.
#[test]
fn what_stands_where_it_stood_at_an_earlier_look_has_stayed_meanwhile() {
    let walks_in = |time_s: f64| walker(1, 2.6, across_m(time_s.min(3.5), -2.5, 1.0));
    let looks_away = |time_s: f64| (5.0..14.0).contains(&time_s);
    let rig = |time_s: f64| rig_at(0.0, 0.0, if looks_away(time_s) { 2.5 } else { 0.0 });
    let pipeline = PipelineConfig { max_stop_s: 8.0, ..PipelineConfig::default() };
    let short = SegmentationConfig { pipeline, ..config() };
    let looks = Run { config: short, room_from_rig: &rig, ..run(furnished(), &walks_in, 110) };
    let cut = looks.score(9).cut_of_cycle;
    let cycle = |time_s: f64| (time_s / CYCLE_S) as usize;
    assert!(cut[cycle(4.5)] > 50, "{cut:?}");
    // It is found once, and has stayed; noise puts a few points beside it.
    assert!(cut[cycle(14.0) + 3..].iter().all(|cut| *cut <= 10), "{cut:?}");
}

/// Comes in with something beside him, stops for half a second, and goes on without it.
fn leaving(beside: fn(f64) -> Vec<Solid>) -> impl Fn(f64) -> Vec<Solid> {
    move |time_s| {
        let (goes_on_s, other_s) = ((time_s - 4.0).max(0.0), time_s.min(3.5));
        let mut solids = walker(1, 2.6, across_m(other_s + goes_on_s, -2.5, 1.0));
        solids.extend(beside(across_m(other_s, -2.5, 1.0)));
        solids
    }
}

/// The points that were cut in each cycle of who leaves something, where 12 s are the longest stop, and so are 2 s of what is left.
fn cut_of(beside: fn(f64) -> Vec<Solid>) -> Vec<usize> {
    let moving = leaving(beside);
    let pipeline = PipelineConfig { max_stop_s: 12.0, ..PipelineConfig::default() };
    let config = SegmentationConfig { pipeline, ..config() };
    Run { config, ..run(furnished()[..4].to_vec(), &moving, 90) }.score(9).cut_of_cycle
}

#[test]
fn what_was_carried_in_and_left_is_static_sooner_than_who_stands() {
    let crate_beside = |y_m: f64| vec![solid(2, [2.1, y_m - 0.25, 0.0], [2.45, y_m + 0.25, 0.8])];
    let cycle = |time_s: f64| (time_s / CYCLE_S) as usize;
    let cut = cut_of(crate_beside);
    assert!(cut[cycle(4.5)] > 50, "{cut:?}");
    assert!(cut[cycle(9.0)..].iter().all(|cut| *cut <= 10), "{cut:?}");
}

/// Two who come in together and part are like one who leaves a thing, but for their shape.
#[test]
fn who_came_in_with_another_and_stands_is_no_thing_that_was_left() {
    let cycle = |time_s: f64| (time_s / CYCLE_S) as usize;
    let cut = cut_of(|y_m| walker(2, 2.25, y_m));
    assert!(cut[cycle(9.0)..].iter().all(|cut| *cut > 50), "{cut:?}");
}
