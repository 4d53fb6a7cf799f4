//! The tables of a run.

use std::collections::BTreeMap;

use geometry::ZoneSource;
use maud::{Markup, html};

use crate::headline::{grouped, object_name, ordinal, percent};
use crate::html_document::scrolling;
use crate::{
    CycleRecord, CycleScore, DynamicScore, IDENTITY_GATE_M, ObjectScore, PointStatistics,
    RunRecord, Summary,
};

pub(super) fn tables_section(run: &RunRecord, summary: &Summary) -> Markup {
    html! {
        section aria-labelledby="figures" {
            h2 id="figures" { "Figures" }
            div.tables {
                @for table in [cycle_table(summary), point_table(summary), map_table(run, summary), drop_table(summary)] {
                    (scrolling(&table))
                }
            }
        }
        @if let Some(score) = &summary.truth {
            (truth_section(score))
        }
        section aria-labelledby="cycles" {
            h2 id="cycles" { "Every cycle" }
            details {
                summary { "Show all " (summary.cycles.total) " cycles" }
                (every_cycle_table(run, summary.truth.as_ref()))
            }
        }
    }
}

fn row(name: &str, value: impl AsRef<str>) -> Markup {
    html! { tr { th scope="row" { (name) } td { (value.as_ref()) } } }
}

/// A count that may have shrunk, with a comma between its thousands.
fn grouped_signed(count: i64) -> String {
    let sign = if count < 0 { "\u{2212}" } else { "" };
    format!("{sign}{}", grouped(count.unsigned_abs() as usize))
}

/// A median of counts: a whole number or a half.
fn grouped_median(median: f64) -> String {
    let half = if median.fract() == 0.0 { "" } else { ".5" };
    // Towards zero, so that the half is what is left.
    let sign = if median < 0.0 { "\u{2212}" } else { "" };
    format!("{sign}{}{half}", grouped(median.abs().trunc() as usize))
}

fn cycle_table(summary: &Summary) -> Markup {
    let cycles = &summary.cycles;
    html! {
        table {
            caption { "Cycles" }
            tbody {
                (row("with a measured zone", grouped(cycles.with_measured_zone)))
                (row("with a held zone only", grouped(cycles.with_held_zone_only)))
                (row("without a zone", grouped(cycles.without_zone)))
                (row("all", grouped(cycles.total)))
                (row("zones measured", grouped(cycles.detections)))
            }
        }
    }
}

fn point_table(summary: &Summary) -> Markup {
    let points = &summary.points;
    let line = |name: &str, statistics: Option<PointStatistics>| {
        html! {
            tr {
                th scope="row" { (name) }
                @if let Some(statistics) = statistics {
                    td { (grouped_median(statistics.median)) } td { (grouped_signed(statistics.min)) } td { (grouped_signed(statistics.max)) }
                } @else {
                    td { "\u{2013}" } td { "\u{2013}" } td { "\u{2013}" }
                }
            }
        }
    };
    html! {
        table {
            caption { "Points a cycle" }
            thead { tr { td {} th scope="col" { "median" } th scope="col" { "min" } th scope="col" { "max" } } }
            tbody {
                (line("before reduction", points.before_reduction))
                (line("reduced", points.reduced))
                (line("in a zone", points.in_zone))
                (line("taken for moving", points.dynamic))
                (line("growth of the map", points.map_growth))
            }
        }
    }
}

fn map_table(run: &RunRecord, summary: &Summary) -> Markup {
    let (map, shares) = (&summary.map, &summary.zone_shares);
    html! {
        table {
            caption { "Map and shares" }
            tbody {
                (row(&format!("map, after the first cycle ({})", run.map_unit()), grouped(map.points_after_first_cycle)))
                (row("map, at the end (points)", grouped(map.points)))
                (row("map without removal (voxels)", grouped(map.points_without_removal)))
                (row("of these, without a point of the map", grouped(map.voxels_kept_out)))
                (row("of these, since something moved there", grouped(map.kept_out.moved)))
                (row("of the cloud in a zone, where there is one", percent(shares.in_zone)))
                (row("of the cloud taken for moving, where there is a zone", percent(shares.dynamic)))
            }
        }
    }
}

fn drop_table(summary: &Summary) -> Markup {
    html! {
        table {
            caption { "Dropped" }
            @if summary.drops.is_empty() {
                tbody { tr { td { "Nothing was dropped." } } }
            } @else {
                thead { tr { th.text scope="col" { "where" } th.text scope="col" { "why" } th scope="col" { "how often" } } }
                tbody {
                    @for drop in &summary.drops {
                        tr { th.text scope="row" { (drop.topic_or_stage) } td.text { (drop.reason) } td { (drop.count) } }
                    }
                }
            }
        }
    }
}

fn truth_section(score: &DynamicScore) -> Markup {
    let rules = &score.rules;
    let map = &score.map;
    let confirmed = &map.static_confirmed;
    html! {
        section aria-labelledby="truth" {
            h2 id="truth" { "Against the truth" }
            p.note {
                "A true point is removed when its voxel holds a point that was taken for moving. An object is in view with at least "
                (rules.in_view_px_at_640x480) " labelled pixels that have a depth (of 640 x 480, in proportion otherwise); found when zones hold "
                (percent(Some(rules.found_share_in_zone))) " of its points or more and some were removed; removed when "
                (percent(Some(rules.removed_share))) " of its points or more were. A track follows an object within "
                (IDENTITY_GATE_M) " m, and "
                "an identity switch is an object that gets another track than it had (CLEAR MOT). A voxel of the map is the objects' own when they touched it and "
                "no static point ever did. A voxel of the static scene is confirmed when static points touched it in "
                (rules.confirming_cycles) " cycles or more: what they touched less often is mostly noise of the depth. It is kept when the map has a "
                "point within one edge of the mean of these points. "
                (grouped(score.cycles_scored)) " cycles were compared, "
                (grouped(score.cycles_without_truth)) " have no truth."
            }
            (scrolling(&html! {
                table {
                    caption { "Objects" }
                    thead { tr {
                        th.text scope="col" { "object" }
                        th scope="col" { "cycles in view" }
                        th scope="col" { "found in a zone" }
                        th scope="col" { "removed" }
                        th scope="col" { "either" }
                        th scope="col" { "share" }
                        th scope="col" { "for the first time in" }
                        th scope="col" { "points removed" }
                        th scope="col" { "voxels only it touched" }
                        th scope="col" { "of these in the map without removal" }
                        th scope="col" { "left in the map" }
                    } }
                    tbody { @for object in &score.objects { tr {
                        th scope="row" { (object_name(object)) }
                        td { (grouped(object.cycles_in_view)) }
                        td { (grouped(object.cycles_found)) }
                        td { (grouped(object.cycles_removed)) }
                        td { (grouped(object.cycles_found_or_removed)) }
                        td { (percent(object.found_or_removed_share)) }
                        td { (first_found_text(object)) }
                        td { (percent(object.points.share)) }
                        td { (grouped(object.own_voxels)) }
                        td { (grouped(object.own_voxels_without_removal)) }
                        td { (grouped(object.own_voxels_left)) }
                    } } }
                }
            }))
            div.tables {
                (scrolling(&html! { table {
                    caption { "Points over the run" }
                    tbody {
                        (row("of objects, removed", percent(score.object_points.share)))
                        (row("of the static scene, removed wrongly", percent(score.static_points.share)))
                        (row("of what was removed, moving (borders of one voxel aside)", percent(score.labels.precision)))
                    }
                } }))
                @if let Some(identities) = &score.identities {
                    (scrolling(&html! { table {
                        caption { "Tracks" }
                        tbody {
                            (row("an object in view, over all cycles", grouped(identities.sightings)))
                            (row("of these, followed by a track", grouped(identities.followed)))
                            (row("identity switches", grouped(identities.switches)))
                        }
                    } }))
                }
                (scrolling(&html! { table {
                    caption { "Voxels of the map" }
                    tbody {
                        (row("objects' own", grouped(map.object_only)))
                        (row("objects' own, in the map without removal", grouped(map.object_only_without_removal)))
                        (row("objects' own, left in the map", grouped(map.object_only_left)))
                        (row("static scene, confirmed", grouped(confirmed.voxels)))
                        (row("confirmed, kept by the map without removal", grouped(confirmed.without_removal)))
                        (row("confirmed, kept", grouped(confirmed.kept)))
                        (row("confirmed kept", percent(confirmed.kept_share)))
                        (row("confirmed kept, of the map without removal", percent(confirmed.kept_share_of_unfiltered)))
                        (row("static scene, touched at all", grouped(map.static_scene)))
                        (row("touched at all, kept by the map without removal", grouped(map.static_without_removal)))
                        (row("touched at all, kept", grouped(map.static_kept)))
                        (row("touched at all, kept", percent(map.static_kept_share)))
                        (row("touched at all, kept, of the map without removal", percent(map.static_kept_share_of_unfiltered)))
                    }
                } }))
                @if let Some(surface) = &map.surface {
                    (scrolling(&html! { table {
                        caption { "Map and true surface" }
                        tbody {
                            (row("mean distance of a point of the map (accuracy)", millimetres(surface.accuracy_m)))
                            (row("mean distance of a point of the surface (completeness)", millimetres(surface.completeness_m)))
                            (row(&format!("points of the map within {} m", surface.tolerance_m), percent(Some(surface.precision))))
                            (row(&format!("surface within {} m of the map", surface.tolerance_m), percent(Some(surface.recall))))
                            (row("F-score", percent(Some(surface.f_score))))
                        }
                    } }))
                }
            }
        }
    }
}

fn millimetres(length_m: f64) -> String {
    format!("{:.1}\u{a0}mm", 1e3 * length_m)
}

/// "2nd (cycle 31)": which of the cycles in view it was, and its number.
fn first_found_text(object: &ObjectScore) -> String {
    object.first_found.map_or_else(
        || "\u{2013}".to_owned(),
        |first| format!("{} (cycle {})", ordinal(first.nth_in_view), first.cycle),
    )
}

fn every_cycle_table(run: &RunRecord, truth: Option<&DynamicScore>) -> Markup {
    let first = run.cycles.first().map(|cycle| cycle.scan_stamp);
    let scores: BTreeMap<u32, &CycleScore> =
        truth.iter().flat_map(|score| &score.per_cycle).map(|score| (score.index, score)).collect();
    html! {
        (scrolling(&html! {
            table {
                caption { "Every cycle" }
                thead { tr {
                    th.text scope="col" { "cycle" }
                    th scope="col" { "time (s)" }
                    th scope="col" { "zones (degrees)" }
                    th scope="col" { "points" }
                    th scope="col" { "reduced" }
                    th scope="col" { "in a zone" }
                    th scope="col" { "moving" }
                    th scope="col" { "map (" (run.map_unit()) ")" }
                    @if truth.is_some() {
                        th scope="col" { "of objects removed" }
                        th scope="col" { "of static removed" }
                    }
                } }
                tbody { @for cycle in &run.cycles { tr {
                    th scope="row" { (cycle.index) }
                    td { @if let Some(first) = first { (format!("{:.2}", cycle.scan_stamp.seconds_since(first))) } }
                    td { (zones_text(cycle)) }
                    td { (grouped(cycle.points_in)) }
                    td { (grouped(cycle.counts.reduced)) }
                    td { (grouped(cycle.counts.in_zone)) }
                    td { (grouped(cycle.counts.dynamic)) }
                    td { (grouped(cycle.map_points)) }
                    @if truth.is_some() {
                        @let score = scores.get(&cycle.index);
                        td { (percent(score.and_then(|score| score.object_points.share))) }
                        td { (percent(score.and_then(|score| score.static_points.share))) }
                    }
                } } }
            }
        }))
    }
}

fn zones_text(cycle: &CycleRecord) -> String {
    let zone_text = |zone: &geometry::DynamicZone| {
        let held = match zone.source {
            ZoneSource::Measured => String::new(),
            ZoneSource::Held { cycles } => format!(" (held {cycles})"),
        };
        let (from, to) = (zone.azimuth_min_rad.to_degrees(), zone.azimuth_max_rad.to_degrees());
        format!("{from:.0} to {to:.0}{held}")
    };
    let zones: Vec<_> = cycle.zones.iter().map(zone_text).collect();
    zones.join(", ")
}
