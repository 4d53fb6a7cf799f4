use simulator::{CrossingObject, PathName, SceneName};

use super::figures::tests::{run as figures, sighting};
use super::figures::{CycleFigures, RunFigures, ZoneFigures};
use super::runs::METHODS;
use super::*;

/// All planned runs, with a robot that is found in cycles 3 to 6.
fn given(settings: &Settings) -> Runs {
    let plan = EXPERIMENTS.iter().flat_map(|experiment| (experiment.plan)(settings));
    Runs::given(plan.map(|planned| {
        let by = |method| {
            let mut run = figures(9, (3..7).map(sighting).collect());
            run.cycles = run.cycles.into_iter().map(with_zone).collect();
            RunFigures { method, scenario: planned.scenario.name.clone(), ..run }
        };
        let figures = METHODS.map(by).to_vec();
        (planned, figures)
    }))
}

fn with_zone(cycle: CycleFigures) -> CycleFigures {
    let zone = ZoneFigures { right_deg: -5.0, left_deg: 5.0, is_measured: true };
    CycleFigures { zones: vec![zone], in_zone: 900, dynamic: 150, ..cycle }
}

/// The sections of the experiments that do not simulate by themselves.
fn sections(settings: &Settings) -> Vec<Section> {
    let runs = given(settings);
    EXPERIMENTS[4..]
        .iter()
        .map(|experiment| (experiment.present)(settings, &runs).unwrap())
        .collect()
}

#[test]
fn every_experiment_has_its_key_its_words_and_a_table_whose_rows_fit_its_columns() {
    let settings = Settings::quick();
    let sections = sections(&settings);
    assert_eq!(sections.iter().map(|section| section.key).collect::<Vec<_>>(), KEYS[4..]);
    for section in &sections {
        for words in [&section.thesis, &section.here, &section.comparability] {
            assert!(words.len() > 40 && !words.contains("  "), "{}: {words}", section.key);
        }
        assert!(!section.tables.is_empty());
        for table in section.tables.iter().chain(&section.details) {
            assert!(!table.rows.is_empty(), "{}", table.caption);
            for row in &table.rows {
                assert_eq!(row.cells.len(), table.columns.len(), "{}: {}", table.caption, row.name);
            }
        }
    }
}

#[test]
fn the_page_and_the_json_hold_all_sections() {
    let settings = Settings::quick();
    let sections = sections(&settings);
    let page = page::page(&settings, &sections);
    let mut ids: Vec<&str> =
        page.split(" id=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    for key in &KEYS[4..] {
        assert!(ids.contains(&format!("experiment-{key}").as_str()), "{key}");
    }
    let count = ids.len();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), count, "ids are unique");
    let json = output::json(&settings, &sections, &given(&settings)).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["experiments"].as_array().unwrap().len(), sections.len());
    assert!(json["runs"].as_array().unwrap().len() >= 2);
}

#[test]
fn what_is_asked_for_is_run_in_the_order_of_the_page() {
    let names = |only: &[&str]| {
        let only: Vec<String> = only.iter().map(|name| (*name).to_owned()).collect();
        chosen(&only).len()
    };
    assert_eq!((names(&[]), names(&["9", "1"]), names(&["acceptance"])), (12, 2, 1));
}

#[test]
fn the_full_plan_shares_scenarios_between_experiments() {
    let settings = Settings::new(1);
    let plan: Vec<Run> =
        EXPERIMENTS.iter().flat_map(|experiment| (experiment.plan)(&settings)).collect();
    let scenarios = count_of_scenarios(&plan);
    assert!(scenarios < plan.len(), "{scenarios} of {}", plan.len());
    // 8 scenes, 2 objects and 3 paths alone are 48.
    assert!(scenarios >= 48 + 3 + 3 + 6 + 4 + 3 + 3, "{scenarios}");
}

/// One small crossing through all three nodes: the figures of the experiments are present and plausible.
#[test]
fn a_crossing_gives_figures_by_both_methods() {
    let settings = Settings::quick();
    let of = settings.crossings(SceneName::B, CrossingObject::Robot, PathName::A);
    let of: Vec<Run> = of
        .into_iter()
        .map(|run| {
            let scenario = run.scenario.clone().with_depth_size(160, 120);
            Run { scenario, ..run }.correlating().keeping_clouds_if(true)
        })
        .collect();
    let runs = Runs::execute(of.clone(), pool::threads_of_machine(), &Interrupt::default(), || ())
        .unwrap();
    for method in METHODS {
        let figures = runs.of(&of[0], method).unwrap();
        let object = figures.object().unwrap();
        assert!(figures.cycles.len() > 30 && object.sightings.len() > 8);
        assert!(object.found_share().unwrap() > 0.5, "{method:?}: {:?}", object.found_share());
        assert!(object.sightings.iter().any(|sighting| sighting.in_both));
        assert!(object.sightings.iter().all(|sighting| sighting.in_camera || !sighting.in_both));
        assert!(figures.labels.unwrap().recall.unwrap() > 0.3);
        assert!(figures.cycles.iter().all(|cycle| cycle.correlation.is_some()));
        assert!(figures.clouds.as_ref().is_some_and(|clouds| clouds.map.len() > 500));
        assert!(figures.cycles_in_view().count() > 8);
    }
}
