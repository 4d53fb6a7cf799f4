//! The scenarios that several experiments share.

use simulator::{CrossingObject, Path, PathName, Platform, Scenario, SceneName, Waypoint};

use super::runs::Run;
use super::settings::Settings;

/// The side from which an object comes, seen from the sensors.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Direction {
    LeftToRight,
    RightToLeft,
}

impl Direction {
    pub(crate) const BOTH: [Self; 2] = [Self::LeftToRight, Self::RightToLeft];

    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::LeftToRight => "left to right",
            Self::RightToLeft => "right to left",
        }
    }

    /// The side of the scenario's first object; positive y is left.
    fn of(scenario: &Scenario) -> Option<Self> {
        let waypoints = &scenario.scene.objects.first()?.path.waypoints;
        let y_m = |waypoint: &Waypoint| waypoint.pose[1];
        let falls = y_m(waypoints.first()?) > y_m(waypoints.last()?);
        Some(if falls { Self::LeftToRight } else { Self::RightToLeft })
    }
}

impl Settings {
    /// The crossings of the seeds.
    pub(crate) fn crossings(
        &self,
        scene: SceneName,
        object: CrossingObject,
        path: PathName,
    ) -> Vec<Run> {
        self.seeds().map(|seed| self.crossing(scene, object, path, seed)).collect()
    }

    /// As many crossings in one direction as there are seeds: those of the least seeds with this direction.
    pub(crate) fn crossings_towards(
        &self,
        direction: Direction,
        scene: SceneName,
        object: CrossingObject,
        path: PathName,
    ) -> Vec<Run> {
        /// The side is random: this many draws of the same side are practically impossible.
        const DRAWS_FOR_EACH: u64 = 64;
        (self.first_seed..self.first_seed + self.seeds * DRAWS_FOR_EACH)
            .map(|seed| self.crossing(scene, object, path, seed))
            .filter(|run| Direction::of(&run.scenario) == Some(direction))
            .take(usize::try_from(self.seeds).unwrap_or(usize::MAX))
            .collect()
    }

    fn crossing(&self, scene: SceneName, object: CrossingObject, path: PathName, seed: u64) -> Run {
        let crossing = Scenario::crossing(scene, object, path, seed);
        Run::new(self.sized(crossing)).compared_with(self.measured_empty(scene))
    }

    /// The scene without moving objects, for its map: one for all seeds, with noise that none of them has.
    fn measured_empty(&self, scene: SceneName) -> Scenario {
        let empty = Scenario::empty(scene, REFERENCE_SEED);
        let name = format!("{}, reference", empty.name);
        self.sized(Scenario { name, ..empty })
    }

    /// A run that is compared with the map of the same path in the empty scene.
    pub(crate) fn compared_with_itself_empty(&self, scenario: Scenario) -> Run {
        let empty = scenario.clone().without_objects();
        let name = format!("{}, reference", empty.name);
        let seed = empty.seed + REFERENCE_SEED;
        Run::new(self.sized(scenario)).compared_with(self.sized(Scenario { name, seed, ..empty }))
    }

    /// A scene without moving objects, in which the platform may move; for a platform at rest, compared with another
    /// measurement of the same.
    pub(crate) fn empty(&self, scene: SceneName, platform: Platform) -> Vec<Run> {
        let scenario = |seed| {
            let scenario = Scenario::empty(scene, seed).with_platform(platform);
            let name = format!("{}, platform {platform:?}", scenario.name);
            let run = Run::new(self.sized(Scenario { name, ..scenario }));
            match platform {
                Platform::Still => run.compared_with(self.measured_empty(scene)),
                _ => run,
            }
        };
        self.seeds().map(scenario).collect()
    }

    /// A crossing while the platform sways at up to 0.5 m/s and 0.5 rad/s.
    pub(crate) fn crossings_while_swaying(
        &self,
        scene: SceneName,
        object: CrossingObject,
    ) -> Vec<Run> {
        let scenario = |seed| {
            let crossing = Scenario::crossing(scene, object, PathName::A, seed);
            let name = format!("{}, platform {:?}", crossing.name, Platform::Sway);
            let swaying = crossing.with_platform(Platform::Sway);
            Run::new(self.sized(Scenario { name, ..swaying }))
        };
        self.seeds().map(scenario).collect()
    }

    /// The tour of experiment 11: straight ahead at the thesis' speed, depths to 3 m, and a person who crosses.
    pub(crate) fn slow_tours(&self) -> Vec<Run> {
        let scenario = |seed| self.compared_with_itself_empty(slow_tour(self.tour_cycles, seed));
        self.seeds().map(scenario).collect()
    }
}

/// Beyond the seeds of the runs.
const REFERENCE_SEED: u64 = 1_000_000;
/// The scene of the slow tour.
pub(crate) const SLOW_TOUR_SCENE: SceneName = SceneName::C;
/// Rec-HV 4.11.
const TOUR_SPEED_M_PER_S: f64 = 0.036;
/// Rec-HV 5.7: nothing farther is measured, since depth errors would spoil the map.
const TOUR_DEPTH_MAX_M: f64 = 3.0;
/// The person starts when the platform has moved by a fifth of a metre.
const PERSON_STARTS_AFTER_S: f64 = 6.0;

fn slow_tour(cycles: usize, seed: u64) -> Scenario {
    let mut scenario =
        Scenario::crossing(SLOW_TOUR_SCENE, CrossingObject::Person, PathName::A, seed);
    for waypoint in scenario.scene.objects.iter_mut().flat_map(|object| &mut object.path.waypoints)
    {
        waypoint.time_s += PERSON_STARTS_AFTER_S;
    }
    let duration_s = cycles as f64 / scenario.rig.lidar.turn_rate_hz;
    let from = scenario.rig.path.waypoints.first().map_or([0.0; 6], |waypoint| waypoint.pose);
    let mut to = from;
    to[0] += TOUR_SPEED_M_PER_S * duration_s;
    scenario.rig.path = Path {
        waypoints: vec![
            Waypoint { time_s: 0.0, pose: from },
            Waypoint { time_s: duration_s, pose: to },
        ],
    };
    scenario.rig.depth_camera.depth_max_m = TOUR_DEPTH_MAX_M;
    let name = format!("{}, slow tour", scenario.name);
    super::scans::for_scans(Scenario { name, ..scenario }, cycles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossings_in_a_direction_go_that_way_and_are_as_many_as_seeds() {
        let settings = Settings::new(4);
        for direction in Direction::BOTH {
            let runs = settings.crossings_towards(
                direction,
                SceneName::B,
                CrossingObject::Robot,
                PathName::A,
            );
            assert_eq!(runs.len(), 4);
            for run in &runs {
                let path = &run.scenario.scene.objects[0].path;
                let way_m = path.position_at(path.end_s()).y - path.position_at(0.0).y;
                assert_eq!(way_m < 0.0, direction == Direction::LeftToRight);
            }
        }
    }

    #[test]
    fn the_slow_tour_has_the_speed_and_the_cycles_of_the_thesis() {
        let scenario = slow_tour(407, 1);
        assert_eq!(scenario.validate(), Ok(()));
        let path = &scenario.rig.path;
        let way_m = (path.position_at(10.0) - path.position_at(0.0)).norm();
        assert!((way_m / 10.0 - 0.036).abs() < 1e-9);
        // The speed was measured over 2 m (Rec-HV 5.7): that is how far 407 cycles reach.
        let whole_m = (path.position_at(1e3) - path.position_at(0.0)).norm();
        assert!((whole_m - 2.09).abs() < 0.01, "{whole_m}");
        // It keeps its distance from the moving objects.
        let crosses_at_s = scenario.scene.objects[0].path.end_s();
        let gap_m = scenario.scene.objects[0].path.position_at(crosses_at_s).x
            - path.position_at(crosses_at_s).x;
        assert!(gap_m > 1.0, "{gap_m}");
    }

    #[test]
    fn scenarios_that_differ_have_names_that_differ() {
        let settings = Settings::new(1);
        let names = [
            settings.empty(SceneName::B, Platform::Still),
            settings.empty(SceneName::B, Platform::Sway),
            settings.crossings(SceneName::B, CrossingObject::Robot, PathName::A),
            settings.crossings_while_swaying(SceneName::B, CrossingObject::Robot),
            settings.slow_tours(),
        ]
        .map(|runs| runs[0].scenario.name.clone());
        let different: std::collections::BTreeSet<_> = names.iter().collect();
        assert_eq!(different.len(), names.len(), "{names:?}");
    }
}
