//! The tables of the road thesis, with our results for comparison.

use robot::Failure;
use serde::Deserialize;

use super::StageMs;
use super::score::Figures;
use super::table::number;
use crate::published_file::{PublishedFile, of_yaml};

/// `published.yaml`.
static PUBLISHED: PublishedFile<Published> =
    PublishedFile::new("eval/kitti/published.yaml", || of_yaml(include_str!("published.yaml")));

/// The thesis' tables.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Published {
    /// Table 4.2, which is printed second.
    stages: Vec<PublishedStage>,
    /// Tables 4.1 and 4.3 to 4.6.
    tables: Vec<PublishedTable>,
}

/// The time of a stage of a scan.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PublishedStage {
    name: String,
    milliseconds: f64,
    here: Option<Stage>,
}

/// A stage that is measured.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Stage {
    Read,
    Cloud,
    Transform,
    Map,
    Odometry,
    Panoramas,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PublishedTable {
    title: String,
    rows: Vec<Row>,
}

/// A row of a published table, with the variant for the comparison.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    what: String,
    variant: String,
    milliseconds: Option<f64>,
    rms_2d_m: Option<f64>,
    rms_3d_m: Option<f64>,
    precision_percent: Option<f64>,
}

/// The measured time of a stage.
fn milliseconds_of(stage: Stage, ours: &StageMs, transform_ms: Option<f64>) -> Option<f64> {
    match stage {
        Stage::Read => ours.read,
        Stage::Cloud => ours.cloud,
        Stage::Transform => transform_ms,
        Stage::Map => ours.map,
        Stage::Odometry => ours.odometry,
        Stage::Panoramas => ours.panoramas,
    }
}

/// The lines of the tables: the thesis' figure, and that of our variant.
///
/// # Errors
/// When the file of the tables cannot be read.
pub(super) fn beside(figures: &[Figures], of_stages: &StageMs) -> Result<Vec<String>, Failure> {
    let published = PUBLISHED.get()?;
    let mut lines = vec![
        "The thesis' tables, and ours on this recording (thesis -> ours); its times are of PCL, full clouds, one thread of 2018"
            .to_owned(),
    ];
    for (number_of_table, PublishedTable { title, rows }) in published.tables.iter().enumerate() {
        if number_of_table == 1 {
            lines.push("Table 4.2, times of the stages (HDL-32E)".to_owned());
            let ours = figures.iter().find(|one| one.name == "ours");
            let transform = ours.and_then(|one| one.milliseconds_mean);
            for PublishedStage { name, milliseconds, here } in &published.stages {
                let ours = here.and_then(|stage| milliseconds_of(stage, of_stages, transform));
                let ours = number(ours, 2);
                lines.push(format!("  {name:<30}{:<20}ms {milliseconds} -> {ours}", "ours"));
            }
        }
        lines.push(format!("Table {title}"));
        for row in rows {
            let ours = figures.iter().find(|one| one.name == row.variant);
            let pair = |of_thesis: Option<f64>, of_ours: Option<f64>, digits: usize| {
                format!("{} -> {}", number(of_thesis, digits), number(of_ours, digits))
            };
            let mut line = format!("  {:<30}{:<20}", row.what, row.variant);
            line += &format!(
                "ms {:<22}",
                pair(row.milliseconds, ours.and_then(|one| one.milliseconds_mean), 1)
            );
            for (name, of_thesis, of_ours) in [
                ("RMS 2D m", row.rms_2d_m, ours.and_then(|one| one.rms_2d_m)),
                ("RMS 3D m", row.rms_3d_m, ours.and_then(|one| one.rms_3d_m)),
                ("precision %", row.precision_percent, ours.and_then(|one| one.precision_percent)),
            ] {
                if of_thesis.is_some() {
                    line += &format!("  {name} {}", pair(of_thesis, of_ours, 3));
                }
            }
            lines.push(line);
        }
    }
    Ok(lines)
}
