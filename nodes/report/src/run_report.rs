//! The report page: one file that shows a run and needs nothing else, no network and no fonts. Its script is the 3D view; without
//! it, or without WebGL, the pictures and tables are there all the same.
//!
//! It holds no duration and no time of day, so that the same run gives the same bytes; how long the steps took
//! is in `summary.json`.

mod charts;
mod figures;
mod tables;

use maud::{Markup, html};

use crate::html_document::document;
use crate::scene::{self, PageLimits};
use crate::{PictureError, RunRecord, Summary, headline, map_pictures};

/// The report page of `run`, whose figures are `summary`.
///
/// # Errors
/// When the pictures of the map cannot be made; see [`map_pictures`].
pub fn report_html(run: &RunRecord, summary: &Summary) -> Result<String, PictureError> {
    report_html_within(run, summary, &PageLimits::default())
}

/// The same with other limits of what the page carries.
///
/// # Errors
/// As [`report_html`].
pub fn report_html_within(
    run: &RunRecord,
    summary: &Summary,
    limits: &PageLimits,
) -> Result<String, PictureError> {
    let pictures = map_pictures(run, &summary.kept_out)?;
    let scene = scene::scene(run, summary, limits)?;
    let sentences = headline(summary);
    let body = html! {
        header {
            p.kicker { "stillmap report" }
            h1 { (run.bag_name) }
            (facts(run, summary))
        }
        main {
            section aria-label="Outcome" {
                @for (index, sentence) in sentences.iter().enumerate() {
                    p.lead[index == 0] { (sentence) }
                }
            }
            section.scene-section aria-labelledby="view" {
                h2 id="view" { "The map in 3D, and each cycle" }
                div id="viewer" { "The 3D view needs a browser that runs scripts and has WebGL 2." }
            }
            (figures::map_section(run, summary, &pictures))
            (charts::charts_section(run, summary))
            (tables::tables_section(run, summary))
        }
        (scene)
    };
    Ok(document(&run.bag_name, scene::STYLE, Some(&scene::content_security_policy()), &body))
}

fn facts(run: &RunRecord, summary: &Summary) -> Markup {
    html! {
        dl.facts {
            div { dt { "Method" } dd { code { (run.method) } } }
            div { dt { "Transport" } dd { (run.transport.name()) } }
            div { dt { "Cycles" } dd { (summary.cycles.total) } }
            div { dt { "Length" } dd { (format!("{:.1} s", summary.duration_s)) } }
            div { dt { "Voxel edge" } dd { (format!("{} m", run.voxel_edge_m)) } }
        }
    }
}
