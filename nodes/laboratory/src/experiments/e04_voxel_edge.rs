//! Experiment 4: the time of a cycle over the edge of the voxels (Rec-HV 3.1.4, 4.4).

mod sweep;

use report::{Chart, Marks};
use simulator::{Scenario, SceneName};

use super::charts::{Caption, chart, class, series};
use super::published::voxel_edge as published;
use super::runs::METHODS;
use super::scans::for_scans;
use super::section::{Section, Shown, Words};
use super::settings::Settings;
use super::table::{Cell, Row, Table, Unit};
use geometry::Method;
use robot::Failure;
use sweep::{Cost, Recording, UNREDUCED_EDGE_M};

/// The charts' axes are in centimetres: short ticks fit at their ends.
const CM_PER_M: f64 = 100.0;

/// The costs of the cycles at one edge.
struct AtEdge {
    edge_m: f64,
    rec_hv: Cost,
    free_space: Cost,
}

pub(crate) fn present(settings: &Settings) -> Result<Section, Failure> {
    // There is no image before the first scan.
    let scenario = for_scans(Scenario::empty(SceneName::B, 1), settings.sweep_cycles + 1);
    let recording = Recording::of(&settings.sized(scenario))?;
    // One after the other without other work, since times are measured.
    let unreduced = recording.cost(Method::RecHv, UNREDUCED_EDGE_M)?;
    let at_edge = |&edge_m: &f64| -> Result<AtEdge, Failure> {
        let [rec_hv, free_space] = METHODS.map(|method| recording.cost(method, edge_m));
        Ok(AtEdge { edge_m, rec_hv: rec_hv?, free_space: free_space? })
    };
    let edges: Vec<AtEdge> =
        settings.sweep_edges_m.iter().map(at_edge).collect::<Result<_, _>>()?;
    let shown = Shown {
        tables: vec![table(&unreduced, &edges)],
        charts: vec![time_chart(&edges), points_chart(&edges)],
        ..Shown::default()
    };
    Ok(Section::new(words(settings), shown))
}

fn words(settings: &Settings) -> Words {
    Words {
        key: "4",
        title: "4. Time of a cycle over the edge of the voxels",
        thesis: "Scene B, empty, the sensors still and the angles of segmentation fixed: a cycle without the voxel \
                 grid, then edges from 0.05 to 0.16 m, 100 cycles each; 0.08 m was chosen.",
        here: format!(
            "Scene B, empty, seed 1, {} cycles; in each the zone is fixed to the middle third of the aperture, \
             whatever was found. The cores of the three nodes are called one after the other on one thread, with \
             nothing beside them. \"Without the grid\" is an edge of {} mm, finer than the pixels lie apart \
             (rec_hv alone: such voxels are beyond what free_space's evidence accepts).",
            settings.sweep_cycles,
            UNREDUCED_EDGE_M * 1e3
        ),
        comparability: "Times are those of this machine, and the work alone: the published ones hold the wait for \
                        the scanner, which is why they never fall below 142 ms, and come from Python on ROS 1. The \
                        thesis gives its angles as 30 to 60 degrees, which by its own convention lies outside \
                        of both sensors' views; the middle third is our reading. Its curve (Figure 35) has no \
                        table, so only its two ends are quoted.",
    }
}

fn table(unreduced: &Cost, edges: &[AtEdge]) -> Table {
    let milliseconds = |value: f64| Cell::one(Unit::Milliseconds, value);
    let count = |value: f64| Cell::one(Unit::Count, value);
    let mut rows = vec![Row::new(
        "without the grid",
        [
            Cell::published(Unit::Milliseconds, published::UNREDUCED_MS),
            milliseconds(unreduced.cycle_ms),
            Cell::Absent,
            milliseconds(unreduced.segmentation_ms),
            Cell::Absent,
            count(unreduced.points),
        ],
    )];
    for (index, edge) in edges.iter().enumerate() {
        let is_last = index + 1 == edges.len();
        // Stated in the thesis for the far end of the curve.
        let published = if is_last {
            Cell::published(Unit::Milliseconds, published::LEAST_MS)
        } else {
            Cell::Absent
        };
        rows.push(Row::new(
            format!("{:.2} m", edge.edge_m),
            [
                published,
                milliseconds(edge.rec_hv.cycle_ms),
                milliseconds(edge.free_space.cycle_ms),
                milliseconds(edge.rec_hv.segmentation_ms),
                milliseconds(edge.free_space.segmentation_ms),
                count(edge.rec_hv.points),
            ],
        ));
    }
    Table::new(
        "Mean over the cycles",
        [
            "cycle, published",
            "cycle, rec_hv",
            "cycle, free_space",
            "segmentation, rec_hv",
            "segmentation, free_space",
            "points a cycle",
        ],
        rows,
    )
}

/// Figure 35, first and second part.
fn time_chart(edges: &[AtEdge]) -> Chart {
    let line = |of: &dyn Fn(&AtEdge) -> f64| {
        Marks::Line(edges.iter().map(|edge| (edge.edge_m * CM_PER_M, of(edge))).collect())
    };
    chart(
        Caption {
            id: "e04-time",
            title: "Time of a cycle and of its segmentation (as Figure 35)",
            description: "Mean times over the voxel edge, of a whole cycle by each method and of its segmentation.",
            x: "voxel edge (cm)",
            y: "milliseconds",
        },
        vec![
            series("cycle, rec_hv", class(Method::RecHv), line(&|edge| edge.rec_hv.cycle_ms)),
            series(
                "cycle, free_space",
                class(Method::FreeSpace),
                line(&|edge| edge.free_space.cycle_ms),
            ),
            series("segmentation, rec_hv", "held", line(&|edge| edge.rec_hv.segmentation_ms)),
            series(
                "segmentation, free_space",
                "published",
                line(&|edge| edge.free_space.segmentation_ms),
            ),
        ],
    )
}

/// Figure 35, third part.
fn points_chart(edges: &[AtEdge]) -> Chart {
    let points = edges.iter().map(|edge| (edge.edge_m * CM_PER_M, edge.rec_hv.points)).collect();
    chart(
        Caption {
            id: "e04-points",
            title: "Points of the reduced cloud (as Figure 35)",
            description: "Mean points a cycle over the voxel edge.",
            x: "voxel edge (cm)",
            y: "points",
        },
        vec![series("reduced cloud", "truth", Marks::Line(points))],
    )
}
