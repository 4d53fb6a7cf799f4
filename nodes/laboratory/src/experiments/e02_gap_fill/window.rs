//! The window of n scans while the robot crosses (Rec-HV Figures 32 and 33).

use detection::DetectionConfig;
use detection::variability::{BeamStatistics, VariabilityWindow};
use report::{Chart, Marks};
use simulator::Scenario;

use crate::experiments::charts::{Caption, chart_of_values, series};
use crate::experiments::published::gap_fill::judgement;
use crate::experiments::scans::{ForwardScan, forward_scans};
use crate::experiments::table::{Cell, Figure, Row, Table, Unit};
use robot::Failure;

/// A mean that differs more than this from the empty room shows the object: five times the scanner's standard
/// deviation at 4 m, which is 0.5 % of the range.
pub(super) const DISPLACED_M: f32 = 0.1;

/// A crossing robot, and the same room without it.
pub(super) struct Crossing {
    scans: Vec<ForwardScan>,
    /// The range of each beam in the empty room: the median of all of its scans.
    background_m: Vec<f32>,
}

/// The result of a window of some length for a scan.
struct Seen<'a> {
    scan: &'a ForwardScan,
    statistics: BeamStatistics,
}

impl Crossing {
    pub(super) fn of(scenario: &Scenario) -> Result<Self, Failure> {
        let empty = forward_scans(&scenario.clone().without_objects())?;
        let filled: Vec<Vec<f32>> = empty.iter().filter_map(ForwardScan::filled_m).collect();
        let beams = filled.first().map_or(0, Vec::len);
        let background_m = (0..beams)
            .map(|beam| {
                let ranges = filled.iter().filter_map(|ranges| ranges.get(beam));
                let median = Figure::median(Unit::Metres, ranges.map(|range| f64::from(*range)));
                median.map_or(0.0, |median| median.median as f32)
            })
            .collect();
        Ok(Self { scans: forward_scans(scenario)?, background_m })
    }

    /// Every scan with a full window of this length.
    fn seen_by(&self, window_scans: usize) -> Vec<Seen<'_>> {
        let mut window = VariabilityWindow::new(window_scans);
        let see = |scan| {
            window.push(ForwardScan::filled_m(scan)?);
            Some(Seen { scan, statistics: window.statistics()? })
        };
        self.scans.iter().filter_map(see).collect()
    }

    /// The number of beams whose mean is in front of the empty room or behind it.
    fn displaced_beams(&self, seen: &Seen<'_>) -> usize {
        let mean_m = &seen.statistics.mean_m;
        let off = |(mean, empty): (&f32, &f32)| (mean - empty).abs() > DISPLACED_M;
        mean_m.iter().zip(&self.background_m).filter(|pair| off(*pair)).count()
    }

    /// The scan with the robot in the middle of the view.
    fn middle(&self) -> Option<usize> {
        let offset_deg = |scan: &ForwardScan| {
            let on_robot = scan.azimuths_deg().zip(&scan.labels).filter(|(_, label)| **label != 0);
            let azimuths = on_robot.map(|(azimuth, _)| azimuth);
            Figure::median(Unit::Degrees, azimuths).map(|middle| middle.median.abs())
        };
        let offsets = self.scans.iter().enumerate();
        offsets
            .filter_map(|(index, scan)| Some((index, offset_deg(scan)?)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(index, _)| index)
    }
}

pub(super) fn table(crossings: &[Crossing], windows: &[usize]) -> Table {
    let row = |&window_scans: &usize| {
        let seen: Vec<(&Crossing, Vec<Seen<'_>>)> =
            crossings.iter().map(|crossing| (crossing, crossing.seen_by(window_scans))).collect();
        let of = |unit, figure: fn(&Crossing, &[Seen<'_>]) -> Option<f64>| {
            Cell::median(unit, seen.iter().filter_map(|(crossing, seen)| figure(crossing, seen)))
        };
        Row::new(
            format!("n = {window_scans}"),
            [
                Cell::words(judgement(window_scans)),
                of(Unit::Metres, largest_when_empty_m),
                of(Unit::Metres, median_edge_m),
                of(Unit::Share, share_above_threshold),
                of(Unit::Times, smear),
            ],
        )
    };
    Table::new(
        "Windows of n scans, scene A, robot on path A",
        [
            "published, by eye",
            "largest deviation, empty",
            "largest deviation of a cycle, robot in view",
            "of these above 0.4 m",
            "robot's width in the mean",
        ],
        windows.iter().map(row).collect(),
    )
}

fn with_robot<'a>(seen: &'a [Seen<'_>]) -> impl Iterator<Item = &'a Seen<'a>> {
    seen.iter().filter(|seen| seen.scan.beams_on_objects() > 0)
}

fn largest_m(seen: &Seen<'_>) -> f64 {
    f64::from(seen.statistics.std_dev_m.iter().copied().fold(0.0, f32::max))
}

/// Before the robot is in view.
fn largest_when_empty_m(_: &Crossing, seen: &[Seen<'_>]) -> Option<f64> {
    let before = seen.iter().take_while(|seen| seen.scan.beams_on_objects() == 0);
    before.map(largest_m).reduce(f64::max)
}

fn median_edge_m(_: &Crossing, seen: &[Seen<'_>]) -> Option<f64> {
    Figure::median(Unit::Metres, with_robot(seen).map(largest_m)).map(|figure| figure.median)
}

fn share_above_threshold(_: &Crossing, seen: &[Seen<'_>]) -> Option<f64> {
    let threshold_m = DetectionConfig::default().min_std_dev_m;
    let all = with_robot(seen).count();
    let above = with_robot(seen).filter(|seen| largest_m(seen) > threshold_m).count();
    (all > 0).then(|| above as f64 / all as f64)
}

fn smear(crossing: &Crossing, seen: &[Seen<'_>]) -> Option<f64> {
    let on_robot: usize = with_robot(seen).map(|seen| seen.scan.beams_on_objects()).sum();
    let displaced: usize = with_robot(seen).map(|seen| crossing.displaced_beams(seen)).sum();
    (on_robot > 0).then(|| displaced as f64 / on_robot as f64)
}

/// Figure 32, column B.
pub(super) fn shape_chart(crossing: &Crossing) -> Chart {
    let middle = crossing.middle().and_then(|index| crossing.scans.get(index));
    let line = |ranges_m: &[f32]| {
        let azimuths = middle.into_iter().flat_map(ForwardScan::azimuths_deg);
        let ranges_m = ranges_m.iter().map(|range_m| f64::from(*range_m));
        Marks::Line(azimuths.zip(ranges_m).collect())
    };
    let mean = |window_scans| {
        let seen = crossing.seen_by(window_scans);
        let at_middle = seen.into_iter().find(|seen| Some(seen.scan) == middle);
        line(&at_middle.map(|seen| seen.statistics.mean_m).unwrap_or_default())
    };
    let now_m = middle.and_then(ForwardScan::filled_m).unwrap_or_default();
    chart_of_values(
        Caption {
            id: "e02-shape",
            title: "The robot in the mean of n scans (as Figure 32, column B)",
            description: "Ranges over the bearing with the robot in the middle of scene A: the scan itself, and \
                          the mean of 3 and of 7 scans, which is wider and shallower.",
            x: "azimuth (degrees, left is positive)",
            y: "range (m)",
        },
        vec![
            series("mean of 7", "published", mean(7)),
            series("mean of 3", "rec-hv", mean(3)),
            series("this scan", "truth", line(&now_m)),
        ],
    )
}

/// Figure 33.
pub(super) fn mean_chart(scans: &[ForwardScan]) -> Chart {
    const WINDOW: usize = 3;
    let places = |scan: &ForwardScan, ranges_m: &[f32]| -> Vec<(f64, f64)> {
        scan.azimuths_deg().zip(ranges_m.iter().map(|range_m| f64::from(*range_m))).collect()
    };
    let mut window = VariabilityWindow::new(WINDOW);
    let mut dots = Vec::new();
    for scan in scans.iter().take(WINDOW) {
        let filled_m = scan.filled_m().unwrap_or_default();
        dots.extend(places(scan, &filled_m));
        window.push(filled_m);
    }
    let mean_m = window.statistics().map(|statistics| statistics.mean_m).unwrap_or_default();
    let mean = scans.first().map(|scan| places(scan, &mean_m)).unwrap_or_default();
    chart_of_values(
        Caption {
            id: "e02-mean",
            title: "Three scans and their mean (as Figure 33)",
            description: "Filled ranges of three scans of scene B, and the mean of each beam.",
            x: "azimuth (degrees, left is positive)",
            y: "range (m)",
        },
        vec![
            series("three scans", "truth", Marks::Dots(dots)),
            series("their mean", "rec-hv", Marks::Line(mean)),
        ],
    )
}
