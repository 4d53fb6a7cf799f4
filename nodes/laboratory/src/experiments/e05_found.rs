//! Experiment 5: the object found in the cycles in view (Rec-HV 3.1.5, 4.5).

use report::{Chart, Marks};
use simulator::{CrossingObject, PathName, SceneName};

use super::charts::{Caption, chart_of_values, class, series};
use super::figures::{ObjectFigures, RunFigures};
use super::published::found as published;
use super::runs::{METHODS, Run, Runs};
use super::scenarios::Direction;
use super::section::{Section, Shown, Words};
use super::settings::Settings;
use super::table::{AGAINST_THE_THESIS, Cell, Row, Table, Unit};
use geometry::Method;
use robot::Failure;

const SCENE: SceneName = SceneName::B;
const OBJECT: CrossingObject = CrossingObject::Robot;

fn path_a(settings: &Settings, direction: Direction) -> Vec<Run> {
    settings.crossings_towards(direction, SCENE, OBJECT, PathName::A)
}

fn path_b(settings: &Settings) -> Vec<Run> {
    settings.crossings(SCENE, OBJECT, PathName::B)
}

pub(crate) fn plan(settings: &Settings) -> Vec<Run> {
    [both_of_path_a(settings), path_b(settings)].concat()
}

pub(crate) fn present(settings: &Settings, runs: &Runs) -> Result<Section, Failure> {
    let found = |published: Option<f64>, of: &[Run]| {
        let share = |method| {
            let shares = runs.all(of, method).filter_map(|run| run.object()?.found_share());
            Cell::median(Unit::Share, shares)
        };
        [
            published.map_or(Cell::Absent, |share| Cell::published(Unit::Share, share)),
            share(Method::RecHv),
            share(Method::FreeSpace),
        ]
    };
    let cycles = |published: f64, of: &[Run]| {
        let in_both = |object: &ObjectFigures| {
            object.sightings.iter().filter(|sighting| sighting.in_both).count() as f64
        };
        let counts = |method| runs.all(of, method).filter_map(|run| run.object()).map(in_both);
        [Cell::published(Unit::Count, published)]
            .into_iter()
            .chain(METHODS.map(|method| Cell::median(Unit::Count, counts(method))))
            .collect::<Vec<_>>()
    };
    let mut rows = Vec::new();
    for (direction, published_cycles) in Direction::BOTH
        .into_iter()
        .zip([published::CYCLES_LEFT_TO_RIGHT, published::CYCLES_RIGHT_TO_LEFT])
    {
        let of = path_a(settings, direction);
        let name = |what: &str| format!("path A, {}: {what}", direction.text());
        rows.push(Row::new(name("found"), found(Some(published::SHARE), &of)));
        rows.push(Row::new(name("cycles in view"), cycles(published_cycles, &of)));
    }
    rows.push(Row::new("path B: found", found(None, &path_b(settings))));
    for (name, of) in [
        ("path A, both sides: half of it removed", both_of_path_a(settings)),
        ("path B: half of it removed", path_b(settings)),
    ] {
        rows.push(Row::new(name, removed(runs, &of)));
    }
    let table = Table::new("Found, of the cycles in both views", AGAINST_THE_THESIS, rows);
    let mut charts = Vec::new();
    for direction in Direction::BOTH {
        for method in METHODS {
            let of = path_a(settings, direction);
            charts.extend(runs.all(&of, method).next().map(|run| zone_chart(run, direction)));
        }
    }
    Ok(Section::new(words(settings), Shown { tables: vec![table], charts, ..Shown::default() }))
}

fn both_of_path_a(settings: &Settings) -> Vec<Run> {
    Direction::BOTH.into_iter().flat_map(|direction| path_a(settings, direction)).collect()
}

fn removed(runs: &Runs, of: &[Run]) -> Vec<Cell> {
    let share = |method| {
        let shares = runs.all(of, method).filter_map(|run| run.object()?.removed_share());
        Cell::median(Unit::Share, shares)
    };
    std::iter::once(Cell::Absent).chain(METHODS.map(share)).collect()
}

fn words(settings: &Settings) -> Words {
    Words {
        key: "5",
        title: "5. Found in the cycles in view",
        thesis: "The robot crosses scene B on path A, once from each side (23 and 25 cycles), and its angles of \
                 detection are followed from cycle to cycle: found in all of them.",
        here: format!(
            "Scene B, robot: path A from each side and path B, {} of each. A cycle counts when the image shows \
             at least 200 pixels of the robot (of 640 x 480) and a beam of the aperture meets it; it is found when \
             zones hold half of its pixels or more and some of them are removed.",
            settings.runs_text()
        ),
        comparability: "The thesis judged by eye whether the angles follow the robot and had no truth; here every \
                        pixel is labelled, and the first and last cycles, with a strip of the robot at the border \
                        of the view, count like all others. rec_hv has one zone a cycle, and the edges of the \
                        simulator's doorways (experiment 3) take it where they deviate more than the robot does.",
    }
}

/// Figure 36.
fn zone_chart(run: &RunFigures, direction: Direction) -> Chart {
    let bars = |is_measured: bool| {
        let cycles = run.cycles.iter().enumerate();
        let zones =
            cycles.flat_map(|(index, cycle)| cycle.zones.iter().map(move |zone| (index, zone)));
        let wanted = zones.filter(|(_, zone)| zone.is_measured == is_measured);
        Marks::Bars(
            wanted.map(|(index, zone)| (index as f64, zone.right_deg, zone.left_deg)).collect(),
        )
    };
    let sightings = run.object().into_iter().flat_map(|object| &object.sightings);
    let truth = sightings
        .filter(|sighting| sighting.in_camera)
        .map(|sighting| (sighting.cycle as f64, sighting.azimuth_deg));
    let method = run.method.name();
    let side = if direction == Direction::LeftToRight { "A" } else { "B" };
    chart_of_values(
        Caption {
            id: &format!("e05-{}-{method}", side.to_lowercase()),
            title: &format!("{method}, {} (as Figure 36 {side})", direction.text()),
            description: "Upright bars from the right-hand to the left-hand bound of each zone, and dots where \
                          the robot truly is.",
            x: "cycle",
            y: "azimuth (degrees, left is positive)",
        },
        vec![
            series("zone, held over", "held", bars(false)),
            series("zone, measured", class(run.method), bars(true)),
            series("true bearing", "truth", Marks::Dots(truth.collect())),
        ],
    )
}
