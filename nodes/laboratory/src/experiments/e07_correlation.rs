//! Experiment 7: the map against the empty scene, cycle by cycle (Rec-HV 3.1.7, 4.7).

use evaluation::Correlation;
use report::{Chart, DynamicScoreRules, Marks};
use simulator::{CrossingObject, PathName, SceneName};

use super::charts::{Caption, chart_of_values, class, medians, series};
use super::figures::RunFigures;
use super::map_pictures::{Face, map_pictures};
use super::published::{CYCLES_OF_A_TEST, correlation as published};
use super::runs::{METHODS, Run, Runs};
use super::scenarios::Direction;
use super::section::{Section, Shown, Words};
use super::settings::Settings;
use super::table::{AGAINST_THE_THESIS, Cell, Row, Table, Unit};
use geometry::Method;
use robot::Failure;

pub(crate) fn plan(settings: &Settings) -> Vec<Run> {
    let crossings = settings.crossings_towards(
        Direction::RightToLeft,
        SceneName::B,
        CrossingObject::Robot,
        PathName::A,
    );
    let runs = crossings.into_iter().enumerate();
    runs.map(|(index, run)| run.correlating().keeping_clouds_if(index == 0)).collect()
}

pub(crate) fn present(settings: &Settings, runs: &Runs) -> Result<Section, Failure> {
    let of = plan(settings);
    let row = |name: &str, published: Cell, value: fn(&RunFigures) -> Option<f64>| {
        let ours = |method| Cell::median(Unit::Share, runs.all(&of, method).filter_map(value));
        Row::new(name, [vec![published], METHODS.map(ours).to_vec()].concat())
    };
    let tolerance_cm = 1e2 * DynamicScoreRules::default().surface_tolerance_m;
    let f_score = format!("F-score of the map at {tolerance_cm:.0} cm");
    let rows = vec![
        row(
            "front view, mean of 25 cycles",
            Cell::published(Unit::Share, published::MEAN),
            mean_of_a_test,
        ),
        row("front view, at the end, measured reference", Cell::Absent, |run| {
            Some(run.map.correlation_with_measured?.front)
        }),
        row("front view, at the end", Cell::Absent, |run| Some(run.map.correlation?.front)),
        row("view from above, at the end", Cell::Absent, |run| Some(run.map.correlation?.top)),
        row("view from the side, at the end", Cell::Absent, |run| Some(run.map.correlation?.side)),
        row(&f_score, Cell::Absent, |run| Some(run.map.surface?.f_score)),
    ];
    let table = Table::new("Correlation with the empty scene", AGAINST_THE_THESIS, rows);
    let first = |method| runs.all(&of, method).next();
    let clouds = [Method::RecHv, Method::FreeSpace].map(first);
    let mut pictures = map_pictures(Face::Front, "e07", clouds)?;
    pictures.extend(map_pictures(Face::Above, "e07", clouds)?);
    let charts = vec![correlation_chart(&of, runs)];
    Ok(Section::new(
        words(settings),
        Shown { tables: vec![table], charts, pictures, ..Shown::default() },
    ))
}

fn words(settings: &Settings) -> Words {
    Words {
        key: "7",
        title: "7. Correlation with the empty scene",
        thesis: "The robot crosses scene B on path A in 10 runs of 25 cycles; after each cycle the map is painted \
                 from the front and compared with a picture of the empty scene by normalised template matching.",
        here: format!(
            "The same crossing from right to left, {}; the 25 cycles are those from the robot's entry on. The \
             measure is the thesis' (front view, 1 px a centimetre), and two views more that show what is wrong in \
             depth.",
            settings.runs_text()
        ),
        comparability: "The thesis compares with a measured cloud of the empty scene. The rows are against the \
                        true surface, which has neither noise nor gaps and is the harder reference; one row is \
                        against a map of the empty scene that was measured with the same sensors and other noise, \
                        which is the thesis' way. How points become pixels is not told in the thesis; our painting \
                        is described in the crate `evaluation`.",
    }
}

/// The mean over the cycles of a test, by the thesis' own view.
fn mean_of_a_test(run: &RunFigures) -> Option<f64> {
    let cycles = run.cycles_from_entry(CYCLES_OF_A_TEST);
    let fronts: Vec<f64> = cycles.iter().filter_map(|cycle| cycle.correlation).map(front).collect();
    (!fronts.is_empty()).then(|| fronts.iter().sum::<f64>() / fronts.len() as f64)
}

fn front(correlation: Correlation) -> f64 {
    correlation.front
}

/// Figure 42.
fn correlation_chart(of: &[Run], runs: &Runs) -> Chart {
    const PERCENT: f64 = 100.0;
    let mut all = Vec::new();
    for method in METHODS {
        let of_cycles = |run: &RunFigures| {
            let cycles = run.cycles_from_entry(CYCLES_OF_A_TEST).iter();
            cycles.filter_map(|cycle| Some(cycle.correlation?.front * PERCENT)).collect()
        };
        let rows: Vec<Vec<f64>> = runs.all(of, method).map(of_cycles).collect();
        let dots = rows
            .iter()
            .flat_map(|row| row.iter().enumerate().map(|(cycle, value)| (cycle as f64, *value)));
        let name = method.name();
        all.push(series(format!("{name}, each run"), class(method), Marks::Dots(dots.collect())));
        all.push(series(format!("{name}, median"), class(method), Marks::Line(medians(&rows))));
    }
    chart_of_values(
        Caption {
            id: "e07-correlation",
            title: "Correlation from the front (as Figure 42)",
            description: "After each cycle of each run, and the median of the runs, by both methods.",
            x: "cycle since the robot came into view",
            y: "correlation (%)",
        },
        all,
    )
}
