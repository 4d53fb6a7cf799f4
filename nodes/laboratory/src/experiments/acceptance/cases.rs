//! The scenarios of the targets.

use simulator::{CrossingObject, PathName, Platform, Scenario, SceneName};

use crate::experiments::runs::Run;
use crate::experiments::scenarios::SLOW_TOUR_SCENE;
use crate::experiments::settings::Settings;

/// Scenarios that differ only in the seed.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Case {
    pub(super) name: String,
    pub(super) scene: SceneName,
    pub(super) runs: Vec<Run>,
}

/// The cases of a target.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Set {
    Crossings,
    /// All scenes without moving objects, from a platform at rest: the similarity of two measurements of one scene.
    Ceilings,
    /// The cases of the scenes that the targets name.
    Empty,
    EmptySwaying,
    CrossingsSwaying,
    Tours,
    ThreeCrossing,
    Pausing,
}

/// All cases.
pub(super) struct Cases {
    pub(super) crossings: Vec<Case>,
    ceilings: Vec<Case>,
    empty: Vec<Case>,
    empty_swaying: Vec<Case>,
    crossings_swaying: Vec<Case>,
    tours: Vec<Case>,
    three_crossing: Vec<Case>,
    pausing: Vec<Case>,
}

/// The scenes that the targets name.
const NAMED_SCENES: [SceneName; 3] = [SceneName::B, SceneName::E, SceneName::G];
/// Two measurements of one scene differ at random: the least number of measurements of each empty scene for its ceiling.
const LEAST_CEILING_RUNS: u64 = 3;
pub(super) const PAUSE_S: f64 = 10.0;

impl Cases {
    pub(super) fn of(settings: &Settings) -> Self {
        let named: Vec<SceneName> =
            NAMED_SCENES.into_iter().filter(|scene| settings.scenes.contains(scene)).collect();
        let in_named = |what: &str, runs: &dyn Fn(SceneName) -> Vec<Run>| -> Vec<Case> {
            let case = |&scene: &SceneName| Case {
                name: format!("{scene}, {what}"),
                scene,
                runs: runs(scene),
            };
            named.iter().map(case).collect()
        };
        let seeded = |of: &dyn Fn(u64) -> Scenario| -> Vec<Run> {
            settings.seeds().map(|seed| Run::new(settings.sized(of(seed)))).collect()
        };
        let swaying = |&object: &CrossingObject| {
            in_named(name_of(object), &|scene| settings.crossings_while_swaying(scene, object))
        };
        let empty = |scene| settings.empty(scene, Platform::Still);
        let for_ceilings =
            Settings { seeds: settings.seeds.max(LEAST_CEILING_RUNS), ..settings.clone() };
        let ceiling = |&scene: &SceneName| Case {
            name: format!("{scene}, empty"),
            scene,
            runs: for_ceilings.empty(scene, Platform::Still),
        };
        let mut tours = Vec::new();
        if settings.scenes.contains(&SLOW_TOUR_SCENE) {
            let name = format!("{SLOW_TOUR_SCENE}, 0.036 m/s");
            tours.push(Case { name, scene: SLOW_TOUR_SCENE, runs: settings.slow_tours() });
        }
        tours.extend(in_named("0.2 m/s", &|scene| {
            let tour = |seed| settings.compared_with_itself_empty(Scenario::touring(scene, seed));
            settings.seeds().map(tour).collect()
        }));
        Self {
            crossings: crossings(settings),
            ceilings: settings.scenes.iter().map(ceiling).collect(),
            empty: in_named("empty", &empty),
            empty_swaying: in_named("empty", &|scene| settings.empty(scene, Platform::Sway)),
            crossings_swaying: settings.objects.iter().flat_map(swaying).collect(),
            tours,
            three_crossing: in_named("three crossing", &|scene| {
                seeded(&|seed| Scenario::three_crossing(scene, seed))
            }),
            pausing: in_named("person pausing", &|scene| {
                seeded(&|seed| Scenario::pausing(scene, PAUSE_S, seed))
            }),
        }
    }

    pub(super) fn set(&self, set: Set) -> &[Case] {
        match set {
            Set::Crossings => &self.crossings,
            Set::Ceilings => &self.ceilings,
            Set::Empty => &self.empty,
            Set::EmptySwaying => &self.empty_swaying,
            Set::CrossingsSwaying => &self.crossings_swaying,
            Set::Tours => &self.tours,
            Set::ThreeCrossing => &self.three_crossing,
            Set::Pausing => &self.pausing,
        }
    }

    pub(super) fn into_runs(self) -> Vec<Run> {
        [
            self.crossings,
            self.ceilings,
            self.empty,
            self.empty_swaying,
            self.crossings_swaying,
            self.tours,
            self.three_crossing,
            self.pausing,
        ]
        .into_iter()
        .flatten()
        .flat_map(|case| case.runs)
        .collect()
    }
}

fn crossings(settings: &Settings) -> Vec<Case> {
    let mut cases = Vec::new();
    for &scene in &settings.scenes {
        for &object in &settings.objects {
            for &path in &settings.paths {
                cases.push(crossing(settings, scene, object, path));
            }
        }
    }
    cases
}

fn crossing(settings: &Settings, scene: SceneName, object: CrossingObject, path: PathName) -> Case {
    Case {
        name: format!("{scene}, {}, path {path:?}", name_of(object)),
        scene,
        runs: settings.crossings(scene, object, path),
    }
}

fn name_of(object: CrossingObject) -> &'static str {
    match object {
        CrossingObject::Robot => "robot",
        CrossingObject::Person => "person",
        CrossingObject::Cart => "cart",
    }
}
