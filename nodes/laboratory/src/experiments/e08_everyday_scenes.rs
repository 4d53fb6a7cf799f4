//! Experiment 8: a person in five everyday scenes (Rec-HV 3.1.8, 4.8, Tables 5 and 6).

use report::PagePicture;
use simulator::{CrossingObject, PathName, SceneName};

use super::figures::{CycleFigures, RunFigures};
use super::map_pictures::{Face, map_pictures};
use super::published::{CYCLES_OF_A_TEST, EverydayRow, TABLES};
use super::runs::{METHODS, Run, Runs};
use super::section::{Section, Shown, Words};
use super::settings::Settings;
use super::table::{AGAINST_THE_THESIS, Cell, Figure, Row, Table, Unit};
use robot::Failure;

fn crossings(settings: &Settings, scene: SceneName) -> Vec<Run> {
    let runs =
        settings.crossings(scene, CrossingObject::Person, PathName::C).into_iter().enumerate();
    runs.map(|(index, run)| run.keeping_clouds_if(index == 0)).collect()
}

pub(crate) fn plan(settings: &Settings) -> Vec<Run> {
    settings.everyday_scenes.iter().flat_map(|scene| crossings(settings, *scene)).collect()
}

/// A column of Table 5 or 6.
struct Column {
    caption: &'static str,
    unit: Unit,
    published: fn(&EverydayRow) -> f64,
    ours: fn(&RunFigures) -> Option<f64>,
}

const COLUMNS: [Column; 9] = [
    Column {
        caption: "Time of a cycle (Table 5)",
        unit: Unit::Milliseconds,
        published: |row| row.cycle_ms,
        ours: |run| middle(run, |cycle| Some(cycle.duration_ms)),
    },
    Column {
        caption: "Points of the reduced cloud a cycle (Table 5)",
        unit: Unit::Count,
        published: |row| row.points,
        ours: |run| middle(run, |cycle| Some(cycle.reduced as f64)),
    },
    Column {
        caption: "Reduction of the cloud (Table 5)",
        unit: Unit::Share,
        published: |row| row.reduction,
        ours: |run| middle(run, |cycle| Some(1.0 - share(cycle.reduced, cycle.points_in)?)),
    },
    Column {
        caption: "Cycles with high variability: with a measured zone (Table 5)",
        unit: Unit::Share,
        published: |row| row.cycles_with_high_variability,
        ours: |run| {
            let cycles = run.cycles_from_entry(CYCLES_OF_A_TEST);
            let with_zone = cycles.iter().filter(|cycle| cycle.has_measured_zone()).count();
            share(with_zone, cycles.len())
        },
    },
    Column {
        caption: "Angle stage: share of the cloud, in cycles with a zone (Table 5)",
        unit: Unit::Share,
        published: |row| row.angle_stage,
        ours: |run| mean_with_zone(run, |cycle| cycle.in_zone),
    },
    Column {
        caption: "Depth stage: share of the cloud, in cycles with a zone (Table 5)",
        unit: Unit::Share,
        published: |row| row.depth_stage,
        ours: |run| mean_with_zone(run, |cycle| cycle.dynamic),
    },
    Column {
        caption: "Points of the map after the first cycle (Table 6)",
        unit: Unit::Count,
        published: |row| row.first_map,
        ours: |run| Some(run.cycles.first()?.map_points as f64),
    },
    Column {
        caption: "Points of the map at the end (Table 6)",
        unit: Unit::Count,
        published: |row| row.last_map,
        ours: |run| Some(run.cycles.last()?.map_points as f64),
    },
    Column {
        caption: "Growth of the map (Table 6)",
        unit: Unit::Share,
        published: |row| row.growth,
        ours: |run| {
            Some(share(run.cycles.last()?.map_points, run.cycles.first()?.map_points)? - 1.0)
        },
    },
];

fn share(part: usize, whole: usize) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

/// The median over all cycles.
fn middle(run: &RunFigures, value: fn(&CycleFigures) -> Option<f64>) -> Option<f64> {
    Figure::median(Unit::Count, run.cycles.iter().filter_map(value)).map(|figure| figure.median)
}

/// The ratio of a stage's points to those of the clouds, over the cycles with a zone.
fn mean_with_zone(run: &RunFigures, part: fn(&CycleFigures) -> usize) -> Option<f64> {
    let with_zone = || {
        let cycles = run.cycles_from_entry(CYCLES_OF_A_TEST).iter();
        cycles.filter(|cycle| !cycle.zones.is_empty())
    };
    share(with_zone().map(part).sum(), with_zone().map(|cycle| cycle.reduced).sum())
}

pub(crate) fn present(settings: &Settings, runs: &Runs) -> Result<Section, Failure> {
    let published_rows = &TABLES.get()?.everyday;
    let published = |scene: SceneName| published_rows.iter().find(|row| row.scene == scene);
    let table = |column: &Column| {
        let row = |scene: &SceneName| {
            let of = crossings(settings, *scene);
            let published = published(*scene)
                .map_or(Cell::Absent, |row| Cell::published(column.unit, (column.published)(row)));
            let ours = METHODS.map(|method| {
                Cell::median(column.unit, runs.all(&of, method).filter_map(column.ours))
            });
            Row::new(format!("scene {scene}"), [vec![published], ours.to_vec()].concat())
        };
        let rows = settings.everyday_scenes.iter().map(row).collect();
        Table::new(column.caption, AGAINST_THE_THESIS, rows)
    };
    let shown = Shown {
        tables: COLUMNS.iter().map(table).collect(),
        pictures: pictures(settings, runs)?,
        ..Shown::default()
    };
    Ok(Section::new(words(settings), shown))
}

/// Figure 43.
fn pictures(settings: &Settings, runs: &Runs) -> Result<Vec<PagePicture>, Failure> {
    let mut pictures = Vec::new();
    for scene in &settings.everyday_scenes {
        let of = crossings(settings, *scene);
        let first = METHODS.map(|method| runs.all(&of, method).next());
        for picture in map_pictures(Face::Above, &format!("scene {scene}"), first)? {
            let caption = format!("Scene {scene}: {}", picture.caption);
            pictures.push(PagePicture { caption, ..picture });
        }
    }
    Ok(pictures)
}

fn words(settings: &Settings) -> Words {
    Words {
        key: "8",
        title: "8. Five everyday scenes",
        thesis: "A person crosses scenes D to H, not straight (path C), 10 runs in each; time, points, reduction, \
                 cycles with high variability, the shares of both stages (Table 5) and the growth of the map (Table \
                 6). Without reduction a cycle took 4.36 s.",
        here: format!(
            "The person on path C in the simulator's scenes {}, {} each. Cycles with high variability and the \
             stages' shares are those of the 25 cycles from the person's entry on; times, points and the map are \
             those of the whole run.",
            settings.everyday_scenes.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
            settings.runs_text()
        ),
        comparability: "The rooms are models of what Table 2 says of the thesis' rooms and not the rooms: points, \
                        maps and their growth hang on them. Times depend on the machine (here as many runs at a \
                        time as it has cores); the published ones hold the wait for the scanner, 142 ms, ours are \
                        work alone. A high share of cycles with high variability was a sign of a difficult room for \
                        rec_hv; free_space should have zones only while the person is in the scanner's aperture, \
                        which is wider than the camera's view.",
    }
}
