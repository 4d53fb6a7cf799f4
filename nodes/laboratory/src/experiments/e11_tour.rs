//! Experiment 11: a tour with a person who crosses (Rec-HV 3.1.11, 4.11).

use report::{Chart, Marks, Series};

use super::charts::{Caption, chart, chart_of_values, class, series};
use super::figures::{CycleFigures, RunFigures};
use super::map_pictures::{Face, map_pictures};
use super::published::tour as published;
use super::runs::{METHODS, Run, Runs};
use super::section::{Section, Shown, Words};
use super::settings::Settings;
use super::table::{AGAINST_THE_THESIS, Cell, Figure, Row, Table, Unit};
use robot::Failure;

pub(crate) fn plan(settings: &Settings) -> Vec<Run> {
    let runs = settings.slow_tours().into_iter().enumerate();
    runs.map(|(index, run)| run.correlating().keeping_clouds_if(index == 0)).collect()
}

pub(crate) fn present(settings: &Settings, runs: &Runs) -> Result<Section, Failure> {
    let of = plan(settings);
    let row = |name: &str, published: Option<f64>, unit, value: fn(&RunFigures) -> Option<f64>| {
        let published = published.map_or(Cell::Absent, |value| Cell::published(unit, value));
        let ours = |method| Cell::median(unit, runs.all(&of, method).filter_map(value));
        Row::new(name, [vec![published], METHODS.map(ours).to_vec()].concat())
    };
    let rows = vec![
        row("cycles", Some(published::CYCLES), Unit::Count, |run| Some(run.cycles.len() as f64)),
        row("time of a cycle", Some(published::CYCLE_MS), Unit::Milliseconds, |run| {
            let times = run.cycles.iter().map(|cycle| cycle.duration_ms);
            Some(Figure::median(Unit::Milliseconds, times)?.median)
        }),
        row("map after the first cycle (points)", Some(published::FIRST_MAP), Unit::Count, |run| {
            Some(run.cycles.first()?.map_points as f64)
        }),
        row("map at the end (points)", Some(published::LAST_MAP), Unit::Count, |run| {
            Some(run.cycles.last()?.map_points as f64)
        }),
        row(
            "correlation at the end, front view",
            Some(published::CORRELATION),
            Unit::Share,
            |run| Some(run.map.correlation?.front),
        ),
        row("correlation at the end, front view, measured reference", None, Unit::Share, |run| {
            Some(run.map.correlation_with_measured?.front)
        }),
        row("correlation at the end, least of three views", None, Unit::Share, |run| {
            Some(run.map.correlation?.least())
        }),
        row(
            "cycles with motion found",
            Some(published::CYCLES_WITH_HIGH_VARIABILITY),
            Unit::Share,
            |run| {
                let found = run.cycles.iter().filter(|cycle| cycle.has_measured_zone()).count();
                Some(found as f64 / run.cycles.len() as f64)
            },
        ),
        row("cycles with the person in view", None, Unit::Share, |run| {
            Some(run.cycles_in_view().count() as f64 / run.cycles.len() as f64)
        }),
        row(
            "cycles that did not remove the person",
            Some(published::CYCLES_NOT_REMOVED),
            Unit::Count,
            |run| Some(cycles_not_removed(run) as f64),
        ),
        row("voxels left of the person", None, Unit::Count, |run| {
            Some(run.labels?.ghost_voxels as f64)
        }),
    ];
    let table = Table::new("The tour", AGAINST_THE_THESIS, rows);
    let first = METHODS.map(|method| runs.all(&of, method).next());
    let mut pictures = Vec::new();
    for face in [Face::Front, Face::Side, Face::Above] {
        pictures.extend(map_pictures(face, "the tour", first)?);
    }
    let first: Vec<&RunFigures> = first.into_iter().flatten().collect();
    let shown = Shown { tables: vec![table], charts: charts(&first), pictures, ..Shown::default() };
    Ok(Section::new(words(settings), shown))
}

fn words(settings: &Settings) -> Words {
    Words {
        key: "11",
        title: "11. The tour",
        thesis: "The platform goes straight ahead through scene C at 0.036 m/s, depths cut at 3 m, while a person \
                 crosses at right angles; 407 cycles. The pose is that of ORB-SLAM2. High variability was read in \
                 83 % of the cycles, since the platform itself moves, and two cycles left part of the person in the \
                 map.",
        here: format!(
            "The simulator's scene C, the same speed and depth, {} cycles, {}; the person sets out some 7 s after \
             the start. A cycle did not remove the person when less than half of the pixels were removed while at \
             least 200 (of 640 x 480) were in view.",
            settings.tour_cycles,
            settings.seeds_text()
        ),
        comparability: "The pose here is the simulator's, without error: what visual odometry would add is not in \
                        these figures. The reference of the thesis is a map of its own, thinned out by hand; ours \
                        is the true surface that came into view, and for one row the map of the same tour without \
                        the person. The thesis gives 407 cycles of 151 ms and 109 s in all, which cannot both be; \
                        we take the cycles at the scanner's 7 Hz, which at 0.036 m/s are the 2 m over which it \
                        measured its speed.",
    }
}

fn cycles_not_removed(run: &RunFigures) -> usize {
    let sightings = run.objects.iter().flat_map(|object| &object.sightings);
    sightings.filter(|sighting| sighting.in_camera && !sighting.removed).count()
}

/// Figures 47, 52 and 53.
fn charts(runs: &[&RunFigures]) -> Vec<Chart> {
    const PERCENT: f64 = 100.0;
    let line = |run: &RunFigures, value: fn(&CycleFigures) -> Option<f64>| {
        let points = run.cycles.iter().filter_map(|cycle| Some((cycle.time_s, value(cycle)?)));
        Marks::Line(points.collect())
    };
    let lines = |value| -> Vec<Series> {
        let of_run =
            |run: &&RunFigures| series(run.method.name(), class(run.method), line(run, value));
        runs.iter().map(of_run).collect()
    };
    let way = runs.first().map(|run| line(run, |cycle| Some(cycle.rig_m.x)));
    vec![
        chart(
            Caption {
                id: "e11-growth",
                title: "Points of the map (as Figure 52)",
                description: "Points of the map over the time of the tour, by both methods.",
                x: "time (s)",
                y: "points",
            },
            lines(|cycle| Some(cycle.map_points as f64)),
        ),
        chart(
            Caption {
                id: "e11-correlation",
                title: "Correlation from the front (as Figure 53)",
                description: "Correlation of the map with the empty scene over the time of the tour.",
                x: "time (s)",
                y: "correlation (%)",
            },
            lines(|cycle| Some(cycle.correlation?.front * PERCENT)),
        ),
        chart_of_values(
            Caption {
                id: "e11-way",
                title: "Way of the platform (as Figure 47)",
                description: "The platform's x over the time of the tour: the simulator's own.",
                x: "time (s)",
                y: "x (m)",
            },
            way.map(|way| series("platform", "truth", way)).into_iter().collect(),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::figures::Sighting;
    use super::super::figures::tests::{run, sighting};
    use super::*;

    #[test]
    fn cycles_that_left_the_person_are_those_in_view() {
        let left = Sighting { removed: false, ..sighting(1) };
        let out_of_view = Sighting { in_camera: false, removed: false, ..sighting(2) };
        assert_eq!(cycles_not_removed(&run(4, vec![sighting(0), left, out_of_view])), 1);
    }
}
