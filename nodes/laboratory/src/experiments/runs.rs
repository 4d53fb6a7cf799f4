//! The scenarios that the experiments need, each run only once.

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

/// A scenario to run with both methods, and the results to keep besides the figures.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Run {
    /// Its name and seed identify it.
    pub(crate) scenario: Scenario,
    /// Whether to compare the map with the empty scene after each cycle.
    pub(crate) correlates: bool,
    /// Whether to keep the clouds, for images.
    pub(crate) keeps_clouds: bool,
    /// The same scene without moving objects and with other noise: the thesis compares with its map.
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

    /// With a comparison with the map of another scenario.
    pub(crate) fn compared_with(self, reference: Scenario) -> Self {
        Self { reference: Some(Box::new(reference)), ..self }
    }

    /// Keeps the clouds when `keeps` is true.
    pub(crate) fn keeping_clouds_if(self, keeps: bool) -> Self {
        Self { keeps_clouds: keeps, ..self }
    }

    fn key(&self) -> Key {
        key_of(&self.scenario)
    }

    /// The results; `None` when it or its reference was interrupted.
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

/// The map that each method measures of a scene without moving objects.
type MeasuredMaps = BTreeMap<Method, Vec<Point3<f32>>>;

/// The reference maps.
type References = BTreeMap<Key, MeasuredMaps>;

/// The scenarios of the references, each once.
fn references_of(runs: &[Run]) -> Vec<&Scenario> {
    let references = runs.iter().filter_map(|run| run.reference.as_deref());
    let by_key: BTreeMap<Key, &Scenario> =
        references.map(|scenario| (key_of(scenario), scenario)).collect();
    by_key.into_values().collect()
}

/// The maps of a scenario without moving objects; of `rec_hv` all clouds in one map, as in the measurement of the thesis' reference.
/// `None` when interrupted.
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

/// The results of the runs.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Runs {
    by_key: BTreeMap<Key, Vec<RunFigures>>,
}

impl Runs {
    /// Executes the runs, each scenario once, on this many threads. `done` is called after each. After an interrupt, the
    /// unfinished runs are left out.
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
        // The longest first, so that none of them runs alone at the end.
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

    /// The results of a method on a run; `None` when it was not planned.
    pub(crate) fn of(&self, run: &Run, method: Method) -> Option<&RunFigures> {
        self.by_key.get(&run.key())?.iter().find(|figures| figures.method == method)
    }

    /// The results of a method on several runs, in their order.
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

/// The number of different scenarios of `runs`, including their references.
pub(crate) fn count_of_scenarios(runs: &[Run]) -> usize {
    merged(runs.to_vec()).len() + references_of(runs).len()
}

/// One run for each scenario, with the options of all its runs.
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
        /// Runs with given figures.
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
