//! The page of a scored trajectory.

use super::charts::trajectory_charts;
use super::coverage::CoverageUnit;
use super::plane::Plane;
use super::relative::Pairs;
use super::score::{ScoredTrajectory, TrajectoryFacts, TrajectoryScore};
use super::statistics::Statistics;
use report::{CellTone, Page, PageCell, PagePart, PageRow, PageSection, PageTable};

/// Below this share of the reference's time a tracker counts as lost; the page then begins with that.
const LOST_BELOW: f64 = 0.95;
/// The columns of errors.
const COLUMNS: [&str; 7] = ["", "RMSE", "mean", "median", "std", "min", "max"];

/// The labels of a score, given by the caller.
#[derive(Clone, PartialEq, Debug)]
pub struct TrajectoryPageFacts {
    /// The name of the estimate.
    pub estimate_name: String,
    /// The name of the reference.
    pub reference_name: String,
    /// The plane of the plans.
    pub plane: Plane,
}

/// The page, with tables and charts.
#[must_use]
pub fn trajectory_page(scored: &ScoredTrajectory, facts: &TrajectoryPageFacts) -> Page {
    let score = &scored.score;
    let mut charts = trajectory_charts(scored, facts.plane);
    let over_time = charts.split_off(2);
    let section = |id: &str, title: &str, parts: Vec<PagePart>| PageSection {
        id: id.to_owned(),
        title: title.to_owned(),
        parts,
    };
    Page {
        kicker: "stillmap eval trajectory".to_owned(),
        title: facts.estimate_name.clone(),
        facts: vec![
            ("Reference".to_owned(), facts.reference_name.clone()),
            ("Alignment".to_owned(), alignment_text(score)),
            ("Pairs".to_owned(), score.association.matched.to_string()),
        ],
        lead: lead(score),
        sections: vec![
            section("path", "Path", vec![PagePart::Charts(charts)]),
            section(
                "errors",
                "Errors",
                vec![PagePart::Charts(over_time), PagePart::Tables(vec![error_table(score)])],
            ),
            section(
                "drift",
                "Drift over segments",
                vec![PagePart::Tables(vec![drift_table(score)])],
            ),
            section(
                "coverage",
                "What was compared",
                vec![PagePart::Tables(vec![pair_table(score), gap_table(score)])],
            ),
        ],
    }
}

/// The results as sentences; the coverage comes first when it is low.
#[must_use]
pub(super) fn lead(score: &TrajectoryScore) -> Vec<String> {
    let errors = &score.absolute.translation_m;
    let coverage = &score.coverage;
    let unit = unit_name(coverage.unit);
    let outcome = format!(
        "The position is off by {} m (RMSE after alignment), {} m at most.",
        metres(errors.rmse),
        metres(errors.max)
    );
    let covered = format!(
        "The estimate covers {} of the reference's {} ({:.1} of {:.1} {unit}) and {} of its path of {:.2} m.",
        percent(coverage.share),
        match coverage.unit {
            CoverageUnit::Seconds => "time",
            CoverageUnit::Frames => "frames",
        },
        coverage.covered,
        coverage.reference,
        percent(coverage.path_share),
        score.reference.path_m
    );
    let mut lead = if coverage.share < LOST_BELOW {
        let lost = "Errors do not cover the parts without an estimate.".to_owned();
        vec![covered, lost, outcome]
    } else {
        vec![outcome, covered]
    };
    if score.absolute.rotation_deg.is_none() {
        lead.push(
            "The positions lie on a line, or in one place: the rotation of the alignment is undetermined, and errors \
             of the rotation are left out."
                .to_owned(),
        );
    }
    lead
}

pub(super) fn alignment_text(score: &TrajectoryScore) -> String {
    use super::alignment::Alignment;
    match score.alignment.alignment {
        Alignment::None => "none".to_owned(),
        Alignment::Origin => "first pose".to_owned(),
        Alignment::Yaw => "translation and rotation about z".to_owned(),
        Alignment::Se3 => "SE(3), Umeyama".to_owned(),
        Alignment::Sim3 => format!("Sim(3), Umeyama, scale {:.4}", score.alignment.scale),
    }
}

fn error_table(score: &TrajectoryScore) -> PageTable {
    let mut rows = vec![
        statistics_row("position (m)", Some(&score.absolute.translation_m)),
        statistics_row("rotation (deg)", score.absolute.rotation_deg.as_ref()),
    ];
    if let Some(offset_deg) = score.absolute.rotation_offset_deg {
        let name = format!("rotation (deg), constant offset of {offset_deg:.2} taken out");
        rows.push(statistics_row(&name, score.absolute.rotation_without_offset_deg.as_ref()));
    }
    for relative in &score.relative {
        let of = match relative.pairs {
            Pairs::All => "all",
            Pairs::Consecutive => "consecutive",
        };
        let over = format!("over {} ({} {of})", relative.delta, relative.count);
        let (metres, degrees) = (&relative.translation_m, &relative.rotation_deg);
        rows.push(statistics_row(&format!("drift (m) {over}"), metres.as_ref()));
        rows.push(statistics_row(&format!("turn (deg) {over}"), degrees.as_ref()));
    }
    let mut caption = "Absolute errors (ATE) and relative errors (RPE)".to_owned();
    if let Some(turn_deg) = score.body_turn_deg {
        caption.push_str(&format!(
            "; the latter without the {turn_deg:.2} degrees between the two bodies"
        ));
    }
    PageTable { caption, columns: COLUMNS.map(str::to_owned).to_vec(), rows }
}

fn statistics_row(name: &str, statistics: Option<&Statistics>) -> PageRow {
    let cells = match statistics {
        Some(&Statistics { rmse, mean, median, std, min, max }) => {
            [rmse, mean, median, std, min, max].map(|value| plain(metres(value))).to_vec()
        }
        None => vec![plain("\u{2013}".to_owned()); COLUMNS.len() - 1],
    };
    PageRow { name: name.to_owned(), cells }
}

fn drift_table(score: &TrajectoryScore) -> PageTable {
    let segments = &score.segments;
    let row = |name: String, count: usize, percent: f64, deg_per_m: f64| PageRow {
        name,
        cells: vec![
            plain(count.to_string()),
            plain(format!("{percent:.3}")),
            plain(format!("{deg_per_m:.5}")),
        ],
    };
    let mut rows: Vec<PageRow> = segments
        .by_length
        .iter()
        .map(|of| {
            let name = format!("{:.2} m", of.length_m);
            row(name, of.count, of.translation_percent, of.rotation_deg_per_m)
        })
        .collect();
    if let (Some(percent), Some(deg_per_m)) =
        (segments.translation_percent, segments.rotation_deg_per_m)
    {
        rows.push(row("all".to_owned(), segments.count, percent, deg_per_m));
    }
    let caption = if rows.is_empty() {
        "The path is shorter than the shortest segment; --segments scaled takes shorter ones"
    } else {
        "As in KITTI's odometry benchmark"
    };
    PageTable {
        caption: caption.to_owned(),
        columns: ["segment", "count", "drift (%)", "turn (deg/m)"].map(str::to_owned).to_vec(),
        rows,
    }
}

fn pair_table(score: &TrajectoryScore) -> PageTable {
    let facts = |name: &str, facts: &TrajectoryFacts, without: usize| {
        let left_out = facts.left_out;
        let duration = facts.duration_s.map_or("\u{2013}".to_owned(), |s| format!("{s:.2}"));
        PageRow {
            name: name.to_owned(),
            cells: [
                facts.poses.to_string(),
                without.to_string(),
                duration,
                format!("{:.2}", facts.path_m),
                left_out.not_a_pose.to_string(),
                left_out.repeated_stamps.to_string(),
                left_out.out_of_order.to_string(),
            ]
            .map(plain)
            .to_vec(),
        }
    };
    let association = &score.association;
    let columns = [
        "",
        "poses",
        "without partner",
        "seconds",
        "path (m)",
        "no pose",
        "stamp repeated",
        "out of order",
    ];
    let caption = match (association.max_difference_s, association.largest_difference_s) {
        (Some(allowed_s), Some(largest_s)) => format!(
            "{} pairs, stamps at most {allowed_s} s apart ({:.4} s at most)",
            association.matched, largest_s
        ),
        _ => format!("{} pairs by the number of the frame", association.matched),
    };
    PageTable {
        caption,
        columns: columns.map(str::to_owned).to_vec(),
        rows: vec![
            facts("estimate", &score.estimate, association.estimate_left_out),
            facts("reference", &score.reference, association.reference_left_out),
        ],
    }
}

fn gap_table(score: &TrajectoryScore) -> PageTable {
    let coverage = &score.coverage;
    let rows = coverage.gaps.iter().map(|gap| PageRow {
        name: format!("{:.2}", gap.start),
        cells: vec![plain(format!("{:.2}", gap.end)), plain(format!("{:.2}", gap.end - gap.start))],
    });
    let unit = unit_name(coverage.unit);
    PageTable {
        caption: match coverage.gap_count {
            0 => "No gap in the estimate".to_owned(),
            count => {
                format!("Gaps of the estimate ({count}), {unit} since the reference's first pose")
            }
        },
        columns: ["from", "to", "length"].map(str::to_owned).to_vec(),
        rows: rows.collect(),
    }
}

fn unit_name(unit: CoverageUnit) -> &'static str {
    match unit {
        CoverageUnit::Seconds => "s",
        CoverageUnit::Frames => "frames",
    }
}

fn plain(text: String) -> PageCell {
    PageCell { text, tone: CellTone::Plain }
}

fn metres(value: f64) -> String {
    format!("{value:.4}")
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{stamped, walk};
    use super::super::{TrajectoryScoreConfig, score_trajectory};
    use super::*;
    use report::page_html;

    fn html(poses: usize) -> String {
        let truth = walk(200);
        let config = TrajectoryScoreConfig::default();
        let scored =
            score_trajectory(&stamped(&truth[..poses]), &stamped(&truth), &config).unwrap();
        let facts = TrajectoryPageFacts {
            estimate_name: "a <b>.txt".to_owned(),
            reference_name: "truth.txt".to_owned(),
            plane: Plane::Xy,
        };
        page_html(&trajectory_page(&scored, &facts))
    }

    #[test]
    fn the_page_says_first_that_a_tracker_was_lost() {
        let lost = html(40);
        let covered =
            lost.find("covers 19.6 % of the reference&#39;s time").or(lost.find("covers 19.6 %"));
        let outcome = lost.find("The position is off by");
        assert!(covered.unwrap() < outcome.unwrap());
        let whole = html(200);
        assert!(
            whole.find("The position is off by").unwrap() < whole.find("covers 100.0 %").unwrap()
        );
    }

    #[test]
    fn the_page_holds_its_charts_and_no_name_breaks_it() {
        let page = html(200);
        for id in ["plan-t", "error-plan-t", "error-m-t", "error-deg-t"] {
            assert!(page.contains(&format!("id=\"{id}\"")), "{id}");
        }
        assert!(page.contains("a &lt;b&gt;.txt"));
        assert!(!page.contains("NaN"));
        assert!(page.contains("shorter than the shortest segment") || page.contains("100.00 m"));
    }
}
