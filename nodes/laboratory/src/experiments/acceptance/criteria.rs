//! The criteria: every figure with its target.

use simulator::Scenario;

use super::cases::{Case, Set};
use super::values::{
    Phase, correlation, correlation_with_surface, found, ghost_voxels, in_zone, keeps_identities,
    position, recall_in, removed, without_zone,
};
use crate::experiments::figures::RunFigures;
use crate::experiments::positions::Along;
use crate::experiments::runs::Runs;
use crate::experiments::table::{Cell, Figure, Unit};
use geometry::Method;

/// A figure and its target.
pub(super) struct Criterion {
    pub(super) name: &'static str,
    pub(super) set: Set,
    unit: Unit,
    /// `None` when it is reported without a target.
    pub(super) target: Option<Target>,
    /// For figures of which more is better.
    more_is_better: bool,
    over_seeds: OverSeeds,
    /// Whether the similarity of two measurements of the empty scene replaces a higher target: the thesis' measure is
    /// of little use for a scene that is one flat wall.
    pub(super) has_ceiling: bool,
    value: Value,
}

/// The target of a figure.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Target {
    AtLeast(f64),
    MoreThan(f64),
    AtMost(f64),
    LessThan(f64),
}

/// How the seeds of a case are combined into one figure.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum OverSeeds {
    Median,
    /// The share of the seeds that have a property.
    Mean,
}

/// Targets that this command does not measure.
pub(super) const NOT_RUN: [(&str, &str); 4] = [
    ("recorded kitchen: ghost voxels left, background kept", "at most 2 %, at least 95 %"),
    (
        "recorded legs: clusters in a zone, zones where nobody is",
        "at least 90 %, less than 1 in 100 scans",
    ),
    ("recorded moving robot, alone: scans with a zone", "less than 5 %"),
    ("an hour's tour: map in its bound, cost of last minute to first", "yes, within 20 %"),
];

type Value = fn(&Scenario, &RunFigures) -> Option<f64>;

/// A median over the seeds that has a target.
fn at(set: Set, name: &'static str, unit: Unit, target: Target, value: Value) -> Criterion {
    Criterion {
        name,
        set,
        unit,
        target: Some(target),
        more_is_better: matches!(target, Target::AtLeast(_) | Target::MoreThan(_)),
        over_seeds: OverSeeds::Median,
        has_ceiling: false,
        value,
    }
}

fn crossing(name: &'static str, unit: Unit, target: Target, value: Value) -> Criterion {
    at(Set::Crossings, name, unit, target, value)
}

/// Reported with the others, without a target.
fn told(criterion: Criterion) -> Criterion {
    Criterion { target: None, ..criterion }
}

/// All of them, in the order of the table.
pub(super) fn all() -> Vec<Criterion> {
    use Target::{AtLeast, AtMost, LessThan, MoreThan};
    vec![
        crossing(
            "found (in a zone, or half of it removed), of the cycles in both views",
            Unit::Share,
            AtLeast(1.0),
            found,
        ),
        told(crossing("in a zone, of the same cycles", Unit::Share, AtLeast(1.0), in_zone)),
        told(crossing(
            "half of it removed, of the same cycles",
            Unit::Share,
            AtLeast(1.0),
            removed,
        )),
        crossing("label recall", Unit::Share, AtLeast(0.98), |_, run| run.labels?.recall),
        crossing(
            "label precision, borders of one voxel aside",
            Unit::Share,
            AtLeast(0.97),
            |_, run| run.labels?.precision,
        ),
        crossing("static map wrongly removed", Unit::Share, LessThan(0.005), |_, run| {
            run.map.lost_of_measured
        }),
        crossing("depth of the centroid, mean error", Unit::Metres, AtMost(0.02), |_, run| {
            Some(position(run, Along::Depth)?.mean_m)
        }),
        crossing("depth of the centroid, RMSE", Unit::Metres, AtMost(0.03), |_, run| {
            Some(position(run, Along::Depth)?.rmse_m)
        }),
        crossing("centroid in the plane, mean error", Unit::Metres, AtMost(0.02), |_, run| {
            Some(position(run, Along::Plane)?.mean_m)
        }),
        crossing("centroid in the plane, RMSE", Unit::Metres, AtMost(0.03), |_, run| {
            Some(position(run, Along::Plane)?.rmse_m)
        }),
        Criterion {
            target: None,
            ..crossing("cycles in view with a position", Unit::Share, AtLeast(1.0), |_, run| {
                Some(position(run, Along::Depth)?.given_share)
            })
        },
        Criterion {
            has_ceiling: true,
            ..crossing(
                "correlation with a measured empty scene, still",
                Unit::Share,
                AtLeast(0.97),
                correlation,
            )
        },
        told(crossing(
            "correlation with the true surface, still",
            Unit::Share,
            AtLeast(0.97),
            correlation_with_surface,
        )),
        told(at(
            Set::Empty,
            "the same of a scene in which nothing moved",
            Unit::Share,
            AtLeast(0.97),
            correlation_with_surface,
        )),
        crossing("ghost voxels left", Unit::Count, AtMost(0.0), ghost_voxels),
        at(
            Set::Empty,
            "empty scene: cycles without a zone",
            Unit::Share,
            MoreThan(0.99),
            without_zone,
        ),
        at(
            Set::EmptySwaying,
            "empty scene, swaying platform: cycles without a zone",
            Unit::Share,
            MoreThan(0.99),
            without_zone,
        ),
        Criterion {
            target: None,
            ..at(
                Set::CrossingsSwaying,
                "swaying platform, path A: found, of the cycles in both views",
                Unit::Share,
                AtLeast(1.0),
                found,
            )
        },
        at(
            Set::Tours,
            "correlation with a measured empty scene, on tour",
            Unit::Share,
            AtLeast(0.97),
            correlation,
        ),
        Criterion {
            over_seeds: OverSeeds::Mean,
            ..at(
                Set::ThreeCrossing,
                "three crossing: seeds without an identity switch",
                Unit::Share,
                AtLeast(0.9),
                keeps_identities,
            )
        },
        at(
            Set::Pausing,
            "pausing 10 s: recall before",
            Unit::Share,
            AtLeast(0.98),
            |scenario, run| recall_in(scenario, run, Phase::Before),
        ),
        at(
            Set::Pausing,
            "pausing 10 s: recall during",
            Unit::Share,
            AtLeast(0.98),
            |scenario, run| recall_in(scenario, run, Phase::During),
        ),
        at(
            Set::Pausing,
            "pausing 10 s: recall after",
            Unit::Share,
            AtLeast(0.98),
            |scenario, run| recall_in(scenario, run, Phase::After),
        ),
        at(Set::Pausing, "pausing 10 s: ghost voxels left", Unit::Count, AtMost(0.0), ghost_voxels),
    ]
}

/// The correlation of two measurements of the empty scene.
pub(super) fn ceiling() -> Criterion {
    told(at(
        Set::Ceilings,
        "ceiling of the correlation: two measurements of the empty scene",
        Unit::Share,
        Target::AtLeast(0.97),
        |_, run| Some(run.map.undisturbed_correlation_with_measured?.front),
    ))
}

impl Criterion {
    /// The figure of a case by a method; `None` when it was not run, or no seed has it.
    pub(super) fn figure(&self, case: &Case, runs: &Runs, method: Method) -> Option<Figure> {
        let of_run =
            |run| runs.of(run, method).and_then(|figures| (self.value)(&run.scenario, figures));
        let values: Vec<f64> = case.runs.iter().filter_map(of_run).collect();
        match self.over_seeds {
            OverSeeds::Median => Figure::median(self.unit, values),
            OverSeeds::Mean if values.is_empty() => None,
            OverSeeds::Mean => {
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                Some(Figure { values: values.len(), ..Figure::one(self.unit, mean) })
            }
        }
    }

    /// The case with the worst figure; the first of equal ones.
    pub(super) fn worst<'c>(&self, figures: Vec<(&'c Case, Figure)>) -> Option<(&'c Case, Figure)> {
        let badness =
            |figure: &Figure| if self.more_is_better { -figure.median } else { figure.median };
        figures.into_iter().rev().max_by(|a, b| badness(&a.1).total_cmp(&badness(&b.1)))
    }

    pub(super) fn is_met(&self, figure: &Figure) -> bool {
        let value = figure.median;
        match self.target {
            None => true,
            Some(Target::AtLeast(least)) => value >= least,
            Some(Target::MoreThan(bound)) => value > bound,
            Some(Target::AtMost(most)) => value <= most,
            Some(Target::LessThan(bound)) => value < bound,
        }
    }

    pub(super) fn target_cell(&self) -> Cell {
        let figure = |value| Figure::as_printed(self.unit, value).text();
        match self.target {
            None => Cell::Absent,
            Some(Target::AtLeast(least)) => Cell::words(format!("at least {}", figure(least))),
            Some(Target::MoreThan(bound)) => Cell::words(format!("more than {}", figure(bound))),
            Some(Target::AtMost(most)) => Cell::words(format!("at most {}", figure(most))),
            Some(Target::LessThan(bound)) => Cell::words(format!("less than {}", figure(bound))),
        }
    }
}
