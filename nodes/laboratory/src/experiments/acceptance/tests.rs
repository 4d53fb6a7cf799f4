use simulator::{Scenario, SceneName};

use super::values::{Phase, recall_in};
use super::*;
use crate::experiments::figures::tests::{run, sighting};
use crate::experiments::figures::{LabelFigures, RunFigures, Sighting};

fn labels(recall: f64) -> LabelFigures {
    LabelFigures {
        recall: Some(recall),
        precision: Some(1.0),
        precision_with_borders: Some(0.9),
        static_points_removed: Some(0.0),
        ghost_voxels: 0,
    }
}

/// All planned runs with the figures from `of`, by both methods.
fn runs(settings: &Settings, of: impl Fn(&Run) -> RunFigures) -> Runs {
    Runs::given(plan(settings).into_iter().map(|planned| {
        let by = |method| RunFigures { method, ..of(&planned) };
        let figures = METHODS.map(by).to_vec();
        (planned, figures)
    }))
}

fn verdict(section: &Section, criterion: &str) -> Cell {
    let rows = &section.tables[0].rows;
    let row = rows.iter().find(|row| row.name == criterion).unwrap();
    row.cells.last().unwrap().clone()
}

#[test]
fn one_case_that_misses_makes_the_target_missed_and_is_named() {
    let settings = Settings { scenes: vec![SceneName::B, SceneName::E], ..Settings::quick() };
    let section = present(
        &settings,
        &runs(&settings, |planned| {
            let is_bad = planned.scenario.name.starts_with("E, person on path A");
            let labels = Some(labels(if is_bad { 0.97 } else { 0.99 }));
            RunFigures { labels, ..run(9, vec![sighting(4), sighting(5)]) }
        }),
    )
    .unwrap();
    assert_eq!(verdict(&section, "label recall"), Cell::Verdict(Verdict::Missed));
    let recall = section.tables[0].rows.iter().find(|row| row.name == "label recall").unwrap();
    assert_eq!(recall.cells[2].text(), "97.0 %");
    assert_eq!(recall.cells[3].text(), "E, person, path A");
    assert_eq!(recall.cells[4].text(), "3 of 4");
    assert_eq!(
        verdict(&section, "label precision, borders of one voxel aside"),
        Cell::Verdict(Verdict::Met)
    );
    assert_eq!(
        verdict(&section, "found (in a zone, or half of it removed), of the cycles in both views"),
        Cell::Verdict(Verdict::Met)
    );
}

#[test]
fn what_was_not_measured_is_neither_met_nor_missed() {
    let section = present(&Settings::quick(), &Runs::default()).unwrap();
    assert_eq!((section.count(Verdict::Met), section.count(Verdict::Missed)), (0, 0));
    assert!(section.count(Verdict::NotRun) > 15);
}

#[test]
fn one_seed_of_ten_may_switch_identities_and_two_may_not() {
    let settings = Settings { seeds: 10, ..Settings::quick() };
    for (switching, expected) in [(1, Verdict::Met), (2, Verdict::Missed)] {
        let runs = runs(&settings, |planned| {
            let identity_switches = usize::from(planned.scenario.seed <= switching);
            RunFigures { identity_switches, ..run(3, Vec::new()) }
        });
        let section = present(&settings, &runs).unwrap();
        let name = "three crossing: seeds without an identity switch";
        assert_eq!(verdict(&section, name), Cell::Verdict(expected));
        let row = section.tables[0].rows.iter().find(|row| row.name == name).unwrap();
        assert_eq!(row.cells[1], Cell::Absent, "rec_hv has no identities");
    }
}

#[test]
fn the_phases_of_a_pause_are_told_apart() {
    let scenario = Scenario::pausing(SceneName::B, 10.0, 1);
    let path = &scenario.scene.objects[0].path;
    let rest = path.waypoints.windows(2).find(|pair| pair[0].pose == pair[1].pose).unwrap();
    assert!((rest[1].time_s - rest[0].time_s - 10.0).abs() < 1e-9);
    let at = |time_s: f64, points_removed| Sighting { time_s, points_removed, ..sighting(0) };
    let sightings = vec![
        at(rest[0].time_s - 0.5, 100),
        at(rest[0].time_s + 0.5, 40),
        at(rest[1].time_s - 0.5, 60),
        at(rest[1].time_s + 0.5, 90),
    ];
    let run = run(9, sightings);
    let recall = |phase| recall_in(&scenario, &run, phase);
    assert_eq!(recall(Phase::Before), Some(1.0));
    assert_eq!(recall(Phase::During), Some(0.5));
    assert_eq!(recall(Phase::After), Some(0.9));
    assert_eq!(recall_in(&Scenario::empty(SceneName::B, 1), &run, Phase::During), None);
}

/// The thesis' measure is of little use for a scene that is one flat wall: no map can be more similar to a measurement of
/// it than another measurement.
#[test]
fn a_case_that_reaches_the_ceiling_of_its_scene_meets_the_correlation() {
    use evaluation::Correlation;
    let settings = Settings { scenes: vec![SceneName::A], ..Settings::quick() };
    let front = |front| Some(Correlation { front, top: 1.0, side: 1.0 });
    for (crossed, expected) in [(0.91, Verdict::Met), (0.89, Verdict::Missed)] {
        let section = present(
            &settings,
            &runs(&settings, |planned| {
                let mut run = run(9, vec![sighting(4)]);
                let is_empty = planned.scenario.scene.objects.is_empty();
                run.map.correlation_with_measured = front(if is_empty { 0.5 } else { crossed });
                run.map.undisturbed_correlation_with_measured =
                    front(if is_empty { 0.9 } else { 1.0 });
                run
            }),
        )
        .unwrap();
        let name = "correlation with a measured empty scene, still";
        assert_eq!(verdict(&section, name), Cell::Verdict(expected));
        let rows = &section.tables[0].rows;
        let place = rows.iter().position(|row| row.name == name).unwrap();
        assert!(rows[place + 1].name.starts_with("ceiling of the correlation"));
        assert_eq!(rows[place + 1].cells[2].text(), "90.0 %");
        let met = rows[place].cells[4].text();
        assert_eq!(met.contains("by the ceiling"), expected == Verdict::Met, "{met}");
    }
}
