//! Experiment 1: beams without a return (Rec-HV 3.1.1, 4.1).

use report::Marks;
use simulator::{Scenario, SceneName};

use super::charts::{Caption, chart, chart_of_values, series};
use super::published::raw_ranges as published;
use super::scans::{ForwardScan, for_scans, forward_scans};
use super::section::{Section, Shown, Words};
use super::settings::Settings;
use super::table::{Cell, Row, Table, Unit};
use robot::Failure;

pub(crate) fn present(settings: &Settings) -> Result<Section, Failure> {
    let scene = |scene| {
        settings
            .seeds()
            .map(|seed| forward_scans(&for_scans(Scenario::empty(scene, seed), settings.raw_scans)))
            .collect::<Result<Vec<_>, _>>()
    };
    let (scene_a, scene_b) = (scene(SceneName::A)?, scene(SceneName::B)?);
    let row =
        |name: &str, published, runs: &[Vec<ForwardScan>], of: fn(&[ForwardScan]) -> f64, unit| {
            Row::new(name, [published, Cell::median(unit, runs.iter().map(|scans| of(scans)))])
        };
    let table = Table::new(
        "Beams without a return",
        ["published", "simulated here"],
        vec![
            row(
                "A: cycles with gaps",
                Cell::words("none told"),
                &scene_a,
                share_with_gaps,
                Unit::Share,
            ),
            row("A: gap beams a cycle", Cell::Absent, &scene_a, mean_gaps, Unit::Count),
            row(
                "B: cycles with gaps",
                Cell::published(Unit::Share, published::CYCLES_WITH_GAPS),
                &scene_b,
                share_with_gaps,
                Unit::Share,
            ),
            row(
                "B: gap beams a cycle",
                Cell::published(Unit::Count, published::GAP_BEAMS),
                &scene_b,
                mean_gaps,
                Unit::Count,
            ),
        ],
    );
    let first = |runs: &[Vec<ForwardScan>]| runs.first().cloned().unwrap_or_default();
    let charts = vec![gap_chart(&first(&scene_b)), range_chart(&first(&scene_a), &first(&scene_b))];
    let shown = Shown { tables: vec![table], charts, ..Shown::default() };
    Ok(Section::new(words(settings), shown))
}

fn words(settings: &Settings) -> Words {
    Words {
        key: "1",
        title: "1. Ranges as they come",
        thesis: "Raw ranges of two rooms without anything that moves: the empty scene A and the reflecting \
                 scene B, and of B 500 cycles, to see how often and how many beams bring nothing back.",
        here: format!(
            "Scenes A and B of the simulator, nothing moving, {} scans each, {}. It is before any method: \
             both read the same scans.",
            settings.raw_scans,
            settings.seeds_text()
        ),
        comparability: "The scanner's model decides these figures, not the software: black, mirroring and far \
                        surfaces lose beams, and 1 % fail at random. The rooms of the thesis are not to be \
                        had, so only the kind of figure can be compared: gaps in most cycles of scene B.",
    }
}

fn share_with_gaps(scans: &[ForwardScan]) -> f64 {
    let with_gaps = scans.iter().filter(|scan| scan.gaps() > 0).count();
    with_gaps as f64 / scans.len() as f64
}

fn mean_gaps(scans: &[ForwardScan]) -> f64 {
    scans.iter().map(ForwardScan::gaps).sum::<usize>() as f64 / scans.len() as f64
}

/// Figure 30.
fn gap_chart(scans: &[ForwardScan]) -> report::Chart {
    let dots = scans.iter().enumerate().map(|(cycle, scan)| (cycle as f64, scan.gaps() as f64));
    chart(
        Caption {
            id: "e01-gaps",
            title: "Beams without a return, cycle by cycle (as Figure 30)",
            description: "Scene B, seed 1: how many of the 90 beams of each cycle have no return.",
            x: "cycle",
            y: "beams without a return",
        },
        vec![series("scene B", "rec-hv", Marks::Dots(dots.collect()))],
    )
}

/// Figure 29.
fn range_chart(scene_a: &[ForwardScan], scene_b: &[ForwardScan]) -> report::Chart {
    let dots = |scans: &[ForwardScan]| {
        let beams = scans.first().into_iter().flat_map(|scan| &scan.beams);
        let places = beams.filter_map(|beam| {
            let range_m = f64::from(beam.range_m?);
            Some((-range_m * beam.azimuth_rad.sin(), range_m * beam.azimuth_rad.cos()))
        });
        Marks::Dots(places.collect())
    };
    chart_of_values(
        Caption {
            id: "e01-ranges",
            title: "One scan from above (as Figure 29)",
            description: "Where the beams of one cycle of scenes A and B end.",
            x: "to the right (m)",
            y: "ahead (m)",
        },
        vec![series("scene A", "truth", dots(scene_a)), series("scene B", "rec-hv", dots(scene_b))],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scene_b_loses_more_beams_than_scene_a() {
        let section = present(&Settings::quick()).unwrap();
        let rows = &section.tables[0].rows;
        let median = |row: usize| match &rows[row].cells[1] {
            Cell::Figure(figure) => figure.median,
            other => panic!("{other:?}"),
        };
        assert!((0.0..=1.0).contains(&median(0)) && median(0) < 0.95);
        assert!(median(2) > median(0) && median(3) > median(1), "{rows:?}");
        assert_eq!(section.charts.len(), 2);
    }
}
