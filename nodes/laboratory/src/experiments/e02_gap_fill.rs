//! Experiment 2: filling the gaps, and the length n of the window (Rec-HV 3.1.2, 4.2).

mod window;

use detection::aperture::Beam;
use detection::gap_fill::{RangeLimits, fill_gaps};
use report::{Chart, Marks};
use simulator::{CrossingObject, PathName, Scenario, SceneName};

use super::charts::{Caption, chart_of_values, series};
use super::published::{FilledPiece, TABLES, gap_fill as published};
use super::scans::{ForwardScan, for_scans, forward_scans};
use super::section::{Section, Shown, Words};
use super::settings::Settings;
use super::table::{Cell, Row, Table, Unit};
use robot::Failure;
use window::Crossing;

pub(crate) fn present(settings: &Settings) -> Result<Section, Failure> {
    let scene_b = settings
        .seeds()
        .map(|seed| {
            forward_scans(&for_scans(Scenario::empty(SceneName::B, seed), settings.raw_scans))
        })
        .collect::<Result<Vec<_>, _>>()?;
    let crossings = settings
        .seeds()
        .map(|seed| {
            let scenario =
                Scenario::crossing(SceneName::A, CrossingObject::Robot, PathName::A, seed);
            Crossing::of(&scenario)
        })
        .collect::<Result<Vec<_>, _>>()?;
    let mut charts: Vec<_> =
        scene_b.first().and_then(|scans| fill_chart(scans)).into_iter().collect();
    charts.extend(crossings.first().map(window::shape_chart));
    charts.extend(scene_b.first().map(|scans| window::mean_chart(scans)));
    let tables =
        vec![fill_table(&scene_b), readings_table()?, window::table(&crossings, &settings.windows)];
    let shown = Shown { tables, charts, ..Shown::default() };
    Ok(Section::new(words(settings), shown))
}

fn words(settings: &Settings) -> Words {
    Words {
        key: "2",
        title: "2. Gap fill and the window's length",
        thesis: "Gaps between returns are filled by the line through them and gaps at the ends by the line \
                 through the two nearest returns; then the window of n scans was tried with n = 2 to 7 while \
                 the robot crosses scene A, and n = 3 was chosen by eye.",
        here: format!(
            "The readings of Table 4 as printed; scene B, empty, {} scans; scene A with the robot on path A; \
             {}. In place of the eye: how far edges stand out, and how much wider than the robot the mean of \
             the window sees it (beams whose mean is more than {} m off the empty room, over the beams that \
             meet the robot).",
            settings.raw_scans,
            settings.seeds_text(),
            window::DISPLACED_M
        ),
        comparability: "Table 4 can be compared to the digit: its input is in the thesis. The window was \
                        judged from pictures, so its rows have words where ours have figures. The gap fill and \
                        the window belong to rec_hv alone; free_space neither fills nor averages.",
    }
}

fn fill_table(scene_b: &[Vec<ForwardScan>]) -> Table {
    let not_filled = |scans: &Vec<ForwardScan>| {
        let holds_gap = |scan: &&ForwardScan| {
            !scan.filled_m().is_some_and(|ranges_m| ranges_m.iter().all(|range| range.is_finite()))
        };
        scans.iter().filter(holds_gap).count() as f64 / scans.len() as f64
    };
    Table::new(
        "Cycles with gaps after the fill",
        ["published", "rec_hv here"],
        vec![Row::new(
            "scene B",
            [
                Cell::published(Unit::Share, published::CYCLES_WITH_GAPS),
                Cell::median(Unit::Share, scene_b.iter().map(not_filled)),
            ],
        )],
    )
}

/// Table 4: every reading that was filled.
fn readings_table() -> Result<Table, Failure> {
    let mut rows = Vec::new();
    for piece in &TABLES.get()?.gap_fill {
        let ours_m = filled_as_here(piece);
        for (place, (read_m, published_m)) in piece.read_m.iter().zip(&piece.filled_m).enumerate() {
            if read_m.is_some() {
                continue;
            }
            let name = format!("{}, beam {}", piece.name, place + 1);
            let ours = ours_m.as_ref().and_then(|ranges_m| ranges_m.get(place));
            let metres = |range_m: f32| Cell::one(Unit::Metres, f64::from(range_m));
            let ours = ours.map_or(Cell::Absent, |range_m| metres(*range_m));
            rows.push(Row::new(name, [metres(*published_m), ours]));
        }
    }
    Ok(Table::new("Filled readings of Table 4", ["published", "rec_hv here"], rows))
}

/// Figure 31: the scan with the most gaps.
fn fill_chart(scans: &[ForwardScan]) -> Option<Chart> {
    let scan = scans.iter().max_by_key(|scan| scan.gaps())?;
    let filled_m = scan.filled_m()?;
    let dots = |is_measured: bool| {
        let beams = scan.beams.iter().zip(scan.azimuths_deg()).zip(&filled_m);
        let wanted = beams.filter(|((beam, _), _)| beam.range_m.is_some() == is_measured);
        Marks::Dots(wanted.map(|((_, azimuth), range_m)| (azimuth, f64::from(*range_m))).collect())
    };
    let chart = chart_of_values(
        Caption {
            id: "e02-fill",
            title: "A scan and its filled gaps (as Figure 31)",
            description: "Scene B, seed 1, the scan with the most gaps: ranges that were measured and ranges that \
                          were filled in.",
            x: "azimuth (degrees, left is positive)",
            y: "range (m)",
        },
        vec![series("measured", "truth", dots(true)), series("filled in", "rec-hv", dots(false))],
    );
    Some(chart)
}

fn filled_as_here(piece: &FilledPiece) -> Option<Vec<f32>> {
    /// The scanner of the thesis (3.4.1).
    const LIMITS: RangeLimits = RangeLimits { min_m: 0.15, max_m: 8.0 };
    let beam = |(index, range_m): (usize, &Option<f32>)| Beam {
        index,
        azimuth_rad: (piece.first_deg + index as f64).to_radians(),
        range_m: *range_m,
    };
    let beams: Vec<Beam> = piece.read_m.iter().enumerate().map(beam).collect();
    fill_gaps(&beams, LIMITS).ok().map(|filled| filled.ranges_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_4_comes_out_as_printed() {
        let table = readings_table().unwrap();
        assert_eq!(table.rows.len(), 6 + 8);
        for row in &table.rows {
            let [Cell::Figure(published), Cell::Figure(ours)] = &row.cells[..] else {
                panic!("{row:?}")
            };
            // The thesis prints millimetres, of ranges that it had rounded for print.
            assert!((published.median - ours.median).abs() < 1.1e-3, "{row:?}");
        }
    }

    #[test]
    fn the_fill_leaves_no_gap_and_longer_windows_smear_the_robot() {
        let section = present(&Settings::quick()).unwrap();
        assert_eq!(section.tables[0].rows[0].cells[1].text(), "0 %");
        let smears: Vec<f64> = section.tables[2]
            .rows
            .iter()
            .map(|row| match row.cells.last() {
                Some(Cell::Figure(figure)) => figure.median,
                other => panic!("{other:?}"),
            })
            .collect();
        assert!(smears.is_sorted(), "{smears:?}");
        assert_eq!(section.charts.len(), 3);
    }
}
