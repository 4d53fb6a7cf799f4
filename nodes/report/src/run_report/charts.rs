//! The charts of a run.

use std::collections::BTreeMap;

use geometry::{DynamicZone, ZoneSource};
use maud::{Markup, html};

use crate::chart::{Axis, Chart, Marks, Series};
use crate::headline::{grouped, object_name};
use crate::{CycleRecord, DynamicScore, RunRecord, Summary};

const TIME_LABEL: &str = "time since the first scan (s)";
/// The classes of the style sheet for the objects of the truth, in turn.
const OBJECT_CLASSES: [&str; 4] = ["object-0", "object-1", "object-2", "object-3"];

pub(super) fn charts_section(run: &RunRecord, summary: &Summary) -> Markup {
    let times = CycleTimes::of(run);
    let truth = summary.truth.as_ref().filter(|score| score.cycles_scored > 0);
    html! {
        section aria-labelledby="over-time" {
            h2 id="over-time" { "Over time" }
            @if run.cycles.is_empty() {
                p { "There is no cycle to draw." }
            } @else {
                div.pair {
                    @if run.cycles.iter().any(|cycle| !cycle.zones.is_empty()) || truth.is_some() {
                        (bearing_chart(run, truth, &times))
                    } @else {
                        p { "No cycle has a dynamic zone: nothing that moves was found, and there is no bearing to draw." }
                    }
                    @if let Some(score) = truth { (removed_chart(score, &times)) }
                    (growth_chart(run, &times))
                    (stage_chart(run, &times))
                }
            }
        }
    }
}

/// Seconds from the first cycle's scan to that of each cycle.
struct CycleTimes {
    by_index: BTreeMap<u32, f64>,
}

impl CycleTimes {
    fn of(run: &RunRecord) -> Self {
        let Some(first) = run.cycles.first() else { return Self { by_index: BTreeMap::new() } };
        let time_s = |cycle: &CycleRecord| cycle.scan_stamp.seconds_since(first.scan_stamp);
        Self { by_index: run.cycles.iter().map(|cycle| (cycle.index, time_s(cycle))).collect() }
    }

    fn at(&self, index: u32) -> Option<f64> {
        self.by_index.get(&index).copied()
    }

    fn axis(&self) -> Axis {
        Axis::within(TIME_LABEL, self.by_index.values().copied())
    }

    /// A value of each cycle over its time.
    fn points(&self, run: &RunRecord, value: impl Fn(&CycleRecord) -> usize) -> Vec<(f64, f64)> {
        let point = |cycle: &CycleRecord| Some((self.at(cycle.index)?, value(cycle) as f64));
        run.cycles.iter().filter_map(point).collect()
    }
}

/// The bounds of the zones, and the true bearings where they are known.
fn bearing_chart(run: &RunRecord, truth: Option<&DynamicScore>, times: &CycleTimes) -> Markup {
    let bars = |wanted: fn(ZoneSource) -> bool| -> Vec<(f64, f64, f64)> {
        let zones = run
            .cycles
            .iter()
            .flat_map(|cycle| cycle.zones.iter().map(|zone: &DynamicZone| (cycle.index, zone)));
        zones
            .filter(|(_, zone)| wanted(zone.source))
            .filter_map(|(index, zone)| {
                let (from, to) =
                    (zone.azimuth_min_rad.to_degrees(), zone.azimuth_max_rad.to_degrees());
                Some((times.at(index)?, from, to))
            })
            .collect()
    };
    let held = bars(|source| source != ZoneSource::Measured);
    let measured = bars(|source| source == ZoneSource::Measured);
    let description = format!(
        "Upright bars from the right-hand to the left-hand bound of each zone: {} measured, {} held over.",
        measured.len(),
        held.len()
    );
    let mut series = vec![
        Series { name: "zone, held over".to_owned(), class: "held", marks: Marks::Bars(held) },
        Series {
            name: "zone, measured".to_owned(),
            class: "measured",
            marks: Marks::Bars(measured),
        },
    ];
    for (object, class) in
        truth.iter().flat_map(|score| &score.objects).zip(OBJECT_CLASSES.iter().cycle())
    {
        let dots = object
            .per_cycle
            .iter()
            .filter(|cycle| cycle.in_view)
            .filter_map(|cycle| Some((times.at(cycle.index)?, cycle.azimuth_rad.to_degrees())))
            .collect();
        let name = format!("true bearing of {}", object_name(object));
        series.push(Series { name, class, marks: Marks::Dots(dots) });
    }
    let values: Vec<f64> = series.iter().flat_map(|series| series.marks.values()).collect();
    Chart {
        id: "bearing".to_owned(),
        title: "Bearing of the dynamic zone".to_owned(),
        description,
        x: times.axis(),
        y: Axis::spanning("azimuth (degrees, left is positive)", values),
        series,
    }
    .render_over_time()
}

/// How much of each object was removed, cycle by cycle.
fn removed_chart(score: &DynamicScore, times: &CycleTimes) -> Markup {
    let series: Vec<_> = score
        .objects
        .iter()
        .zip(OBJECT_CLASSES.iter().cycle())
        .map(|(object, class)| {
            let dots = object
                .per_cycle
                .iter()
                .filter(|cycle| cycle.in_view)
                .filter_map(|cycle| Some((times.at(cycle.index)?, cycle.points.share? * 100.0)))
                .collect();
            Series { name: object_name(object), class, marks: Marks::Dots(dots) }
        })
        .collect();
    Chart {
        id: "removed".to_owned(),
        title: "True points removed, cycle by cycle".to_owned(),
        description: "For each cycle in which an object was in view, the share of its points that was removed."
            .to_owned(),
        x: times.axis(),
        y: Axis::spanning("removed (%)", [0.0, 100.0]),
        series,
    }
    .render_over_time()
}

fn growth_chart(run: &RunRecord, times: &CycleTimes) -> Markup {
    let points = times.points(run, |cycle| cycle.map_points);
    let (first, last) = (
        run.cycles.first().map_or(0, |c| c.map_points),
        run.cycles.last().map_or(0, |c| c.map_points),
    );
    Chart {
        id: "growth".to_owned(),
        title: "Growth of the map".to_owned(),
        description: format!(
            "The map grows from {} to {} {}.",
            grouped(first),
            grouped(last),
            run.map_unit()
        ),
        x: times.axis(),
        y: Axis::spanning(run.map_unit(), points.iter().map(|point| point.1).chain([0.0])),
        series: vec![Series {
            name: "static map".to_owned(),
            class: "map",
            marks: Marks::Line(points),
        }],
    }
    .render_over_time()
}

fn stage_chart(run: &RunRecord, times: &CycleTimes) -> Markup {
    let line = |name: &str, class, value: fn(&CycleRecord) -> usize| Series {
        name: name.to_owned(),
        class,
        marks: Marks::Line(times.points(run, value)),
    };
    let series = vec![
        line("reduced", "reduced", |cycle| cycle.counts.reduced),
        line("in a zone", "in-zone", |cycle| cycle.counts.in_zone),
        line("taken for moving", "dynamic", |cycle| cycle.counts.dynamic),
    ];
    let values: Vec<f64> = series.iter().flat_map(|series| series.marks.values()).collect();
    Chart {
        id: "stages".to_owned(),
        title: "Points of each stage".to_owned(),
        description:
            "Points of the reduced cloud, of these in a zone, and of these taken for moving."
                .to_owned(),
        x: times.axis(),
        y: Axis::spanning("points", values.into_iter().chain([0.0])),
        series,
    }
    .render_over_time()
}
