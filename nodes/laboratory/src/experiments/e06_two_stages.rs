//! Experiment 6: the points classified as dynamic by one stage and by two stages (Rec-HV 3.1.6, 4.6).

use report::{Chart, Marks};
use simulator::{CrossingObject, PathName, SceneName};

use super::charts::{Caption, chart, class, series};
use super::figures::{CycleFigures, LabelFigures, RunFigures};
use super::published::two_stages as published;
use super::runs::{METHODS, Run, Runs};
use super::scenarios::Direction;
use super::section::{Section, Shown, Words};
use super::settings::Settings;
use super::table::{AGAINST_THE_THESIS, Cell, Row, Table, Unit};
use robot::Failure;

pub(crate) fn plan(settings: &Settings) -> Vec<Run> {
    settings.crossings_towards(
        Direction::RightToLeft,
        SceneName::B,
        CrossingObject::Robot,
        PathName::A,
    )
}

pub(crate) fn present(settings: &Settings, runs: &Runs) -> Result<Section, Failure> {
    let of = plan(settings);
    // The largest of the cycles in view, which the thesis reads off its curves.
    let row = |name: &str, published: Cell, unit: Unit, value: fn(&CycleFigures) -> f64| {
        let largest = |method| {
            let of_run = |run: &RunFigures| run.cycles_in_view().map(value).reduce(f64::max);
            Cell::median(unit, runs.all(&of, method).filter_map(of_run))
        };
        Row::new(name, [vec![published], METHODS.map(largest).to_vec()].concat())
    };
    let count = |value| Cell::published(Unit::Count, value);
    let of_whole_run = |name: &str, value: fn(&LabelFigures) -> Option<f64>| {
        let ours = |method| {
            let labels = runs.all(&of, method).filter_map(|run| run.labels);
            Cell::median(Unit::Share, labels.filter_map(|labels| value(&labels)))
        };
        Row::new(name, [vec![Cell::Absent], METHODS.map(ours).to_vec()].concat())
    };
    let rows = vec![
        row("one stage: points", count(published::MOST_POINTS_IN_ZONE), Unit::Count, |cycle| {
            cycle.in_zone as f64
        }),
        row(
            "one stage: share of the cloud",
            Cell::words(format!("more than {:.0} %", 100.0 * published::SHARE_IN_ZONE)),
            Unit::Share,
            in_zone_share,
        ),
        row("two stages: points", count(published::DYNAMIC_POINTS), Unit::Count, |cycle| {
            cycle.dynamic as f64
        }),
        row(
            "two stages: share of the cloud",
            Cell::words(format!("about {:.0} %", 100.0 * published::DYNAMIC_SHARE)),
            Unit::Share,
            dynamic_share,
        ),
        of_whole_run("of the robot's pixels, removed", |labels| labels.recall),
        of_whole_run("of the room's pixels, removed", |labels| labels.static_points_removed),
    ];
    let table = Table::new("Largest of the cycles in view", AGAINST_THE_THESIS, rows);
    let charts = METHODS
        .into_iter()
        .filter_map(|method| runs.all(&of, method).next())
        .map(stage_chart)
        .collect();
    Ok(Section::new(words(settings), Shown { tables: vec![table], charts, ..Shown::default() }))
}

fn words(settings: &Settings) -> Words {
    Words {
        key: "6",
        title: "6. One stage and two stages",
        thesis: "The robot crosses scene B on path A from right to left in 24 cycles: the angles alone cut out up to \
                 670 points, more than 60 % of the cloud; the grouping by depth within them leaves some 40 points, \
                 about 5 %.",
        here: format!(
            "The same crossing in the simulator's scene B, {}. One stage is what lies in a zone; two stages is \
             what is taken for moving (with free_space, what has grown from the zones).",
            settings.runs_text()
        ),
        comparability: "How large the robot is in the cloud hangs on its depth and on how much of the room the \
                        camera sees; the thesis' cloud has some 1,100 points, ours four times as many. Fewer points \
                        are no merit of their own: the last two rows are the shares of the robot's and of the \
                        room's pixels that were removed over the whole run, which the thesis could not measure.",
    }
}

fn share(part: usize, cycle: &CycleFigures) -> f64 {
    if cycle.reduced > 0 { part as f64 / cycle.reduced as f64 } else { 0.0 }
}

fn in_zone_share(cycle: &CycleFigures) -> f64 {
    share(cycle.in_zone, cycle)
}

fn dynamic_share(cycle: &CycleFigures) -> f64 {
    share(cycle.dynamic, cycle)
}

/// Figures 38 and 40.
fn stage_chart(run: &RunFigures) -> Chart {
    let line = |value: fn(&CycleFigures) -> usize| {
        let cycles = run.cycles.iter().enumerate();
        Marks::Line(cycles.map(|(index, cycle)| (index as f64, value(cycle) as f64)).collect())
    };
    let method = run.method.name();
    chart(
        Caption {
            id: &format!("e06-{method}"),
            title: &format!("{method}: points of each stage (as Figures 38 and 40)"),
            description: "Points of the reduced cloud, of these in a zone, and of these taken for moving, cycle \
                          by cycle.",
            x: "cycle",
            y: "points",
        },
        vec![
            series("reduced cloud", "truth", line(|cycle| cycle.reduced)),
            series("one stage: in a zone", "published", line(|cycle| cycle.in_zone)),
            series("two stages: moving", class(run.method), line(|cycle| cycle.dynamic)),
        ],
    )
}
