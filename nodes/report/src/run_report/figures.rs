//! The pictures of the map on the page.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use crate::headline::grouped;
use crate::html_document::scrolling;
use crate::pictures::{HEIGHT_COLOURS, ViewPictures};
use crate::{KeptOutCause, MapPictures, PictureFrame, RunRecord, Summary};

pub(super) fn map_section(run: &RunRecord, summary: &Summary, pictures: &MapPictures) -> Markup {
    let map = &summary.map;
    let frame = &pictures.top.frame;
    html! {
        section aria-labelledby="map" {
            h2 id="map" { "The map with and without removal" }
            p.note {
                "The same clouds, once with moving objects cut out and once with everything left in, drawn alike. "
                "The colour is the mean height of the voxels that lie behind each other, the brighter the more they are. The white line is the rig's path in "
                code { (run.map_frame_id) } ", the bar in the corner is " (metres(frame.scale_bar_m())) " long."
                @if let Some(edge_m) = run.map_edge_m {
                    " The map is a surface of the depth images with a point about every " (edge_m) " m; the map without removal has a point in each voxel of "
                    (run.voxel_edge_m) " m in which something was seen."
                }
            }
            (height_key(frame))
            (pair("From above (x to the right, y up)", &pictures.top, summary))
            (pair("From the right-hand side (x to the right, z up)", &pictures.side, summary))
            h3 { "What is not in the map, and why" }
            (kept_out_table(summary))
            p.note {
                span.key.bars.removed aria-hidden="true" {} " something moved there; "
                span.key.bars.not-confirmed aria-hidden="true" {} " nothing moved there, see the table. In grey the map."
            }
            div.pair {
                (picture(&pictures.top.removed, frame, "Not in the map, from above",
                    &format!("{} voxels that are not in the map, seen from above.", grouped(map.voxels_kept_out))))
                (picture(&pictures.side.removed, &pictures.side.frame, "Not in the map, from the side",
                    &format!("{} voxels that are not in the map, seen from the side.", grouped(map.voxels_kept_out))))
            }
            @if frame.points_outside() + pictures.side.frame.points_outside() > 0 {
                p.note {
                    "A few points lie far from all others and outside of the pictures: "
                    (grouped(frame.points_outside())) " from above, "
                    (grouped(pictures.side.frame.points_outside())) " from the side, of both maps together."
                }
            }
        }
    }
}

/// How many voxels the map does not hold, by their causes.
fn kept_out_table(summary: &Summary) -> Markup {
    let map = &summary.map;
    html! {
        p.note {
            "Of the " (grouped(map.points_without_removal)) " voxels of the map without removal, " (grouped(map.voxels_kept_out))
            " hold no point of the map."
        }
        (scrolling(&html! {
            table {
                caption { "Voxels without a point of the map" }
                thead { tr { th.text scope="col" { "why" } th scope="col" { "voxels" } th.text scope="col" { "what that means" } } }
                tbody {
                    @for cause in KeptOutCause::ALL {
                        tr { th scope="row" { (cause.name()) } td { (grouped(map.kept_out.of(cause))) } td.text { (cause.meaning()) } }
                    }
                }
            }
        }))
    }
}

fn pair(view: &str, pictures: &ViewPictures, summary: &Summary) -> Markup {
    let (with, without) =
        (grouped(summary.map.points), grouped(summary.map.points_without_removal));
    html! {
        h3 { (view) }
        div.pair {
            (picture(&pictures.with_removal, &pictures.frame, &format!("With removal: {with} points"),
                &format!("The map with removal, {view}: {with} points.")))
            (picture(&pictures.without_removal, &pictures.frame, &format!("Without removal: {without} voxels"),
                &format!("The map without removal, {view}: {without} voxels.")))
        }
    }
}

fn picture(png: &[u8], frame: &PictureFrame, caption: &str, alt: &str) -> Markup {
    let (width_px, height_px) = frame.size_px();
    html! {
        figure {
            img width=(width_px) height=(height_px) alt=(alt)
                src=(format!("data:image/png;base64,{}", STANDARD.encode(png)));
            figcaption { (caption) }
        }
    }
}

/// The colours of the heights, from the lowest to the highest.
fn height_key(frame: &PictureFrame) -> Markup {
    let (low_m, high_m) = frame.height_range_m();
    let stops: Vec<_> =
        HEIGHT_COLOURS.iter().map(|[r, g, b]| format!("rgb({r},{g},{b})")).collect();
    let style = format!("background:linear-gradient(to right,{})", stops.join(","));
    html! {
        p.heights {
            "Height " (format!("{low_m:.1} m"))
            span.ramp style=(style) role="img" aria-label="from blue, low, to yellow, high" {}
            (format!("{high_m:.1} m"))
        }
    }
}

fn metres(length_m: f64) -> String {
    // A power of ten: its digits are few whatever its size.
    format!("{} m", (length_m * 1e6).round() / 1e6)
}
