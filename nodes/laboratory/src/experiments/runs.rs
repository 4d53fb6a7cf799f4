//! The scenarios that the experiments need, each run once, however many of them ask for it.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;

use nalgebra::Point3;
use simulator::Scenario;

use super::figures::RunFigures;
use super::pool::in_order;
use super::scans::beams_on_objects;
use crate::trial::{Trial, TrialOptions, run_trial};
use geometry::Method;
use robot::{Failure, Interrupt};

/// Both methods, in the order of the tables.
pub(crate) const METHODS: [Method; 2] = [Method::RecHv, Method::FreeSpace];

/// A scenario to be run by both methods, and what is wanted of it besides the figures.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Run {
    /// Its name and seed tell it from all others.
    pub(crate) scenario: Scenario,
    /// The map against the empty scene after each cycle.
    pub(crate) correlates: bool,
    /// The clouds, for pictures.
    pub(crate) keeps_clouds: bool,
    /// The same scene without what moves and with other noise: its map is what the thesis compares with.
    pub(crate) reference: Option<Box<Scenario>>,
}

type Key = (String, u64);

impl Run {
    pub(crate) fn new(scenario: Scenario) -> Self {
        Self { scenario, correlates: false, keeps_clouds: false, reference: None }
    }

    pub(crate) fn correlating(self) -> Self {
        Self { correlates: true, ..self }
    }

    /// Compared with the map of another scenario.
    pub(crate) fn compared_with(self, reference: Scenario) -> Self {
        Self { reference: Some(Box::new(reference)), ..self }
    }

    /// Keeps the clouds when `keeps` holds.
    pub(crate) fn keeping_clouds_if(self, keeps: bool) -> Self {
        Self { keeps_clouds: keeps, ..self }
    }

    fn key(&self) -> Key {
        key_of(&self.scenario)
    }

    /// What came of it; `None` where it was interrupted, or what it is compared with was.
    fn execute(
        &self,
        references: &References,
        interrupt: &Interrupt,
    ) -> Result<Option<Vec<RunFigures>>, Failure> {
        let scenario = &self.scenario;
        let reference = match &self.reference {
            Some(reference) => match references.get(&key_of(reference)) {
                None => return Ok(None),
                found => found,
            },
            None => None,
        };
        let has_objects = !scenario.scene.objects.is_empty();
        let options = TrialOptions {
            methods: METHODS.to_vec(),
            correlate_each_cycle: self.correlates,
            score_labels: true,
            voxel_edge_m: None,
        };
        let beams = if has_objects { beams_on_objects(scenario)? } else { BTreeMap::new() };
        let trials = run_trial(scenario, &options, interrupt)
            .map_err(|failure| failure.within(format_args!("scenario {}", scenario.name)))?;
        let figures = |trial: Trial| {
            let reference_m = reference.and_then(|maps| maps.get(&trial.method)).map(Vec::as_slice);
            RunFigures::of(trial, scenario, &beams, reference_m, self.keeps_clouds)
        };
        Ok(trials.map(|trials| trials.into_iter().map(figures).collect()))
    }
}

fn key_of(scenario: &Scenario) -> Key {
    (scenario.name.clone(), scenario.seed)
}

/// What each method measures of a scene in which nothing moves.
type MeasuredMaps = BTreeMap<Method, Vec<Point3<f32>>>;

/// The maps that others are compared with.
type References = BTreeMap<Key, MeasuredMaps>;

/// Each scenario that runs are compared with, once.
fn references_of(runs: &[Run]) -> Vec<&Scenario> {
    let references = runs.iter().filter_map(|run| run.reference.as_deref());
    let by_key: BTreeMap<Key, &Scenario> =
        references.map(|scenario| (key_of(scenario), scenario)).collect();
    by_key.into_values().collect()
}

/// The maps of a scenario in which nothing moves, of `rec_hv` as the thesis measures its reference: all clouds in one map;
/// `None` where it was interrupted.
fn measured_maps(
    scenario: &Scenario,
    interrupt: &Interrupt,
) -> Result<Option<MeasuredMaps>, Failure> {
    let options = TrialOptions {
        methods: METHODS.to_vec(),
        correlate_each_cycle: false,
        score_labels: false,
        voxel_edge_m: None,
    };
    let trials = run_trial(scenario, &options, interrupt)
        .map_err(|failure| failure.within(format_args!("scenario {}", scenario.name)))?;
    let map = |trial: &Trial| (trial.method, trial.undisturbed_map().to_vec());
    Ok(trials.map(|trials| trials.iter().map(map).collect()))
}

/// What came of the runs.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Runs {
    by_key: BTreeMap<Key, Vec<RunFigures>>,
}

impl Runs {
    /// Executes the runs, each scenario once, on so many threads. `done` is told after each. Those that are not done when it is
    /// interrupted are left out.
    pub(crate) fn execute(
        runs: Vec<Run>,
        threads: NonZeroUsize,
        interrupt: &Interrupt,
        mut done: impl FnMut(),
    ) -> Result<Self, Failure> {
        let mut runs = merged(runs);
        let scenarios = references_of(&runs);
        let map = |scenario: &&Scenario| measured_maps(scenario, interrupt);
        let maps = in_order(&scenarios, threads, map, &mut done)?;
        let keys = scenarios.into_iter().map(key_of);
        let references: References =
            keys.zip(maps).filter_map(|(key, map)| Some((key, map?))).collect();
        // The longest first, or one of them would run alone at the end.
        runs.sort_by(|a, b| {
            let longest = b.scenario.duration_s.total_cmp(&a.scenario.duration_s);
            longest.then_with(|| a.key().cmp(&b.key()))
        });
        let execute = |run: &Run| run.execute(&references, interrupt);
        let figures = in_order(&runs, threads, execute, done)?;
        let done = runs.iter().map(Run::key).zip(figures);
        Ok(Self { by_key: done.filter_map(|(key, figures)| Some((key, figures?))).collect() })
    }

    /// Whether all of these runs are done.
    pub(crate) fn has_all(&self, runs: &[Run]) -> bool {
        runs.iter().all(|run| self.by_key.contains_key(&run.key()))
    }

    /// What a method made of a run; none where it was not asked for.
    pub(crate) fn of(&self, run: &Run, method: Method) -> Option<&RunFigures> {
        self.by_key.get(&run.key())?.iter().find(|figures| figures.method == method)
    }

    /// What a method made of each of several runs, in their order.
    pub(crate) fn all<'a>(
        &'a self,
        runs: &'a [Run],
        method: Method,
    ) -> impl Iterator<Item = &'a RunFigures> + Clone {
        runs.iter().filter_map(move |run| self.of(run, method))
    }

    /// All of them, by scenario and seed and then by method.
    pub(crate) fn figures(&self) -> impl Iterator<Item = &RunFigures> {
        self.by_key.values().flatten()
    }
}

/// How many different scenarios `runs` need, those that they are compared with included.
pub(crate) fn count_of_scenarios(runs: &[Run]) -> usize {
    merged(runs.to_vec()).len() + references_of(runs).len()
}

/// One run for each scenario, with all that any of them wants.
fn merged(runs: Vec<Run>) -> Vec<Run> {
    let mut by_key: BTreeMap<Key, Run> = BTreeMap::new();
    for run in runs {
        match by_key.get_mut(&run.key()) {
            Some(known) => {
                known.correlates |= run.correlates;
                known.keeps_clouds |= run.keeps_clouds;
                known.reference = known.reference.take().or(run.reference);
            }
            None => {
                by_key.insert(run.key(), run);
            }
        }
    }
    by_key.into_values().collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use simulator::SceneName;

    use super::*;

    impl Runs {
        /// Runs whose figures are given.
        pub(crate) fn given(figures: impl IntoIterator<Item = (Run, Vec<RunFigures>)>) -> Self {
            Self {
                by_key: figures.into_iter().map(|(run, figures)| (run.key(), figures)).collect(),
            }
        }
    }

    #[test]
    fn a_scenario_that_several_ask_for_is_one_run_with_all_that_they_want() {
        let empty = |seed| Run::new(Scenario::empty(SceneName::A, seed));
        let runs = merged(vec![
            empty(1),
            empty(2),
            empty(1).correlating(),
            empty(1).keeping_clouds_if(true),
        ]);
        assert_eq!(runs.len(), 2);
        assert!(runs[0].correlates && runs[0].keeps_clouds);
        assert!(!runs[1].correlates && !runs[1].keeps_clouds);
        assert_eq!(count_of_scenarios(&[empty(1), empty(1)]), 1);
        let compared = |seed| empty(seed).compared_with(Scenario::empty(SceneName::A, 9));
        assert_eq!(count_of_scenarios(&[compared(1), compared(2), empty(1)]), 3);
        assert!(merged(vec![empty(1), compared(1)])[0].reference.is_some());
    }
}
