//! Experiment 9: the error of the object's position (Rec-HV 3.1.9, 4.9, Table 7).

use nalgebra::Point3;
use report::{Chart, Marks, Series};
use simulator::{CrossingObject, PathName, SceneName};

use super::charts::{Caption, chart_of_values, series};
use super::figures::Sighting;
use super::positions::{Along, MEAN_OF_POINTS, PositionErrors, PositionOf, TRACK};
use super::published::{CentroidRun, CentroidRuns, TABLES};
use super::runs::{METHODS, Run, Runs};
use super::scenarios::Direction;
use super::section::{Section, Shown, Words};
use super::settings::Settings;
use super::table::{Cell, Row, Table, Unit};
use geometry::Method;
use robot::Failure;

const SCENE: SceneName = SceneName::B;

/// A group of runs, with the figures of the thesis.
struct Group {
    name: String,
    runs: Vec<Run>,
    /// The crossings of Table 7 to compare with.
    published: Option<Direction>,
}

fn groups(settings: &Settings) -> Vec<Group> {
    let mut groups = Vec::new();
    for (object, name) in [(CrossingObject::Robot, "robot"), (CrossingObject::Person, "person")] {
        for direction in Direction::BOTH {
            groups.push(Group {
                name: format!("{name}, path A, {}", direction.text()),
                runs: settings.crossings_towards(direction, SCENE, object, PathName::A),
                published: (object == CrossingObject::Robot).then_some(direction),
            });
        }
        for path in [PathName::B, PathName::C] {
            groups.push(Group {
                name: format!("{name}, path {path:?}"),
                runs: settings.crossings(SCENE, object, path),
                published: None,
            });
        }
    }
    groups
}

pub(crate) fn plan(settings: &Settings) -> Vec<Run> {
    groups(settings).into_iter().flat_map(|group| group.runs).collect()
}

/// The compared positions.
const POSITIONS: [(&str, Method, PositionOf); 3] = [
    ("rec_hv, mean of points", Method::RecHv, MEAN_OF_POINTS),
    ("free_space, mean of points", Method::FreeSpace, MEAN_OF_POINTS),
    ("free_space, track", Method::FreeSpace, TRACK),
];

pub(crate) fn present(settings: &Settings, runs: &Runs) -> Result<Section, Failure> {
    let groups = groups(settings);
    let published = &TABLES.get()?.centroid;
    let table = |caption: &str, along, unit, rows: &[Line]| {
        let columns = ["published"].into_iter().chain(POSITIONS.map(|(name, ..)| name));
        let of_group =
            |group| rows.iter().map(move |line| line.row((group, published), runs, along, unit));
        Table::new(caption, columns, groups.iter().flat_map(of_group).collect())
    };
    let tables = vec![
        table("Error of the depth", Along::Depth, Unit::Metres, &ERRORS),
        identity_table(&groups, runs),
    ];
    let details = vec![
        table("Error in the plane", Along::Plane, Unit::Metres, &ERRORS),
        table("Cycles in view with a position", Along::Depth, Unit::Share, &GIVEN),
        published_table(published),
    ];
    let charts = groups.iter().take(3).enumerate().filter_map(|(index, group)| {
        let [rec_hv, free_space] = METHODS.map(|method| runs.all(&group.runs, method).next());
        let letter = ["a", "b", "c"].get(index)?;
        Some(way_chart(
            letter,
            &group.name,
            &rec_hv?.object()?.sightings,
            &free_space?.object()?.sightings,
        ))
    });
    let shown = Shown { tables, details, charts: charts.collect(), ..Shown::default() };
    Ok(Section::new(words(settings), shown))
}

fn words(settings: &Settings) -> Words {
    Words {
        key: "9",
        title: "9. The object's position",
        thesis: "The robot crosses scene B, 5 runs from each side on path A and 5 on path B; the mean of the points \
                 taken for moving is its position, of which the depth is compared with the known way (Table 7 has \
                 path A alone).",
        here: format!(
            "Robot and person in scene B on path A from each side and on paths B and C, {} each. Truth is the \
             mean of the true surface that the camera sees in the cycle, in the map frame (which on a platform that \
             stands still is the rig's); every cycle counts in which the image shows at least 200 pixels (of 640 x \
             480) of the object. rec_hv gives the mean of its moving points; free_space the same, and the position of \
             the nearest of its tracks, however far that is.",
            settings.runs_text()
        ),
        comparability: "The thesis knew the robot's line and not where on it the robot was, so its error is against \
                        the line's depth and not against the visible surface; ours is against the surface of the \
                        same moment. The robot differs too: its screen stands on a mast here. Errors in the plane \
                        and identity switches are not in the thesis.",
    }
}

/// A row of each group.
struct Line {
    name: &'static str,
    published: Option<fn(&CentroidRun) -> f64>,
    ours: fn(&PositionErrors) -> f64,
}

const ERRORS: [Line; 3] = [
    Line { name: "mean", published: Some(|run| run.mean_m), ours: |errors| errors.mean_m },
    Line { name: "RMSE", published: Some(|run| run.rmse_m), ours: |errors| errors.rmse_m },
    Line { name: "largest", published: Some(|run| run.max_m), ours: |errors| errors.max_m },
];
const GIVEN: [Line; 1] =
    [Line { name: "given", published: None, ours: |errors| errors.given_share }];

impl Line {
    fn row(
        &self,
        (group, published): (&Group, &CentroidRuns),
        runs: &Runs,
        along: Along,
        unit: Unit,
    ) -> Row {
        // The thesis has only the depth.
        let published = match (group.published, self.published) {
            (Some(direction), Some(of)) if along == Along::Depth => {
                Cell::published(unit, of(&published.side(direction).mean))
            }
            _ => Cell::Absent,
        };
        let ours = POSITIONS.map(|(_, method, position_of)| {
            let errors = runs
                .all(&group.runs, method)
                .filter_map(|run| PositionErrors::of(&run.object()?.sightings, position_of, along));
            Cell::median(unit, errors.map(|errors| (self.ours)(&errors)))
        });
        Row::new(
            format!("{}: {}", group.name, self.name),
            [vec![published], ours.to_vec()].concat(),
        )
    }
}

fn identity_table(groups: &[Group], runs: &Runs) -> Table {
    let rows = groups.iter().map(|group| {
        let switches = runs.all(&group.runs, Method::FreeSpace);
        let switches = switches.map(|run| run.identity_switches as f64);
        Row::new(group.name.clone(), [Cell::median(Unit::Count, switches)])
    });
    Table::new("Identity switches a run", ["free_space, track"], rows.collect())
}

/// Table 7, run by run.
fn published_table(published: &CentroidRuns) -> Table {
    let side = |name: &'static str, direction| {
        let runs = &published.side(direction).runs;
        runs.iter().enumerate().map(move |(index, run)| {
            let metres = |value| Cell::published(Unit::Metres, value);
            let cells = [metres(run.max_m), metres(run.mean_m), metres(run.rmse_m)];
            Row::new(format!("{name}, run {}", index + 1), cells)
        })
    };
    let rows = side("left to right", Direction::LeftToRight)
        .chain(side("right to left", Direction::RightToLeft));
    Table::new("Table 7 as published", ["largest", "mean", "RMSE"], rows.collect())
}

/// Figure 44.
fn way_chart(letter: &str, name: &str, rec_hv: &[Sighting], free_space: &[Sighting]) -> Chart {
    let place = |position: Point3<f64>| (-position.y, position.x);
    let places = |sightings: &[Sighting], of: PositionOf| -> Vec<(f64, f64)> {
        let in_view = sightings.iter().filter(|sighting| sighting.in_camera);
        in_view.filter_map(|sighting| of(sighting).map(place)).collect()
    };
    let dots = |name: &str, class, sightings, of| -> Series {
        series(name, class, Marks::Dots(places(sightings, of)))
    };
    let truth = places(free_space, |sighting| Some(sighting.true_m));
    chart_of_values(
        Caption {
            id: &format!("e09-{letter}"),
            title: &format!("{name} (as Figure 44 {})", letter.to_uppercase()),
            description: "From above: the true middle of the visible surface as a line, and the positions that \
                          each method gives.",
            x: "to the right (m)",
            y: "depth (m)",
        },
        vec![
            series("truth", "truth", Marks::Line(truth)),
            dots("rec_hv, mean of points", "rec-hv", rec_hv, MEAN_OF_POINTS),
            dots("free_space, track", "free-space", free_space, TRACK),
        ],
    )
}
