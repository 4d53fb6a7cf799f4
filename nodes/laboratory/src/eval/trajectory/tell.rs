//! The score as a table.

use evaluation::trajectory::{
    CoverageUnit, LeftOut, Pairs, Statistics, TrajectoryFacts, TrajectoryScore,
};

use robot::Failure;
use robot::console;

/// Below this coverage of the reference's time a line warns that the errors have little meaning.
const LOST_BELOW: f64 = 0.95;

/// Prints the score; `formats` are those of the estimate and of the reference.
pub(super) fn print(score: &TrajectoryScore, formats: [&str; 2]) -> Result<(), Failure> {
    let [estimate, reference] = formats;
    trajectory("estimate ", estimate, &score.estimate)?;
    trajectory("reference", reference, &score.reference)?;
    association(score)?;
    coverage(score)?;
    let alignment = &score.alignment;
    console::print(format_args!(
        "alignment    {:?}, scale {:.6}, shift {:.4?} m",
        alignment.alignment, alignment.scale, alignment.translation_m
    ))?;
    console::print(
        "                                rmse       mean     median        std        min        max",
    )?;
    row("ATE position (m)", Some(&score.absolute.translation_m))?;
    row("ATE rotation (deg)", score.absolute.rotation_deg.as_ref())?;
    if let Some(offset_deg) = score.absolute.rotation_offset_deg {
        let name = format!("  without its constant {offset_deg:.2} (deg)");
        row(&name, score.absolute.rotation_without_offset_deg.as_ref())?;
    }
    if let Some(turn_deg) = score.body_turn_deg {
        console::print(format_args!(
            "the two are of two bodies, with {turn_deg:.2} degrees between them: RPE and drift are without that turn"
        ))?;
    }
    for relative in &score.relative {
        let of = match relative.pairs {
            Pairs::All => "all",
            Pairs::Consecutive => "consecutive",
        };
        console::print(format_args!(
            "RPE over {}, {} stretches ({of})",
            relative.delta, relative.count
        ))?;
        row("  translation (m)", relative.translation_m.as_ref())?;
        row("  rotation (deg)", relative.rotation_deg.as_ref())?;
    }
    segments(score)
}

fn trajectory(name: &str, format: &str, facts: &TrajectoryFacts) -> Result<(), Failure> {
    let duration = facts.duration_s.map_or(String::new(), |seconds| format!(", {seconds:.2} s"));
    let LeftOut { not_a_pose, repeated_stamps, out_of_order, renormalised } = facts.left_out;
    let mut remarks = String::new();
    for (count, what) in [
        (not_a_pose, "invalid, left out"),
        (repeated_stamps, "with a repeated stamp, left out"),
        (out_of_order, "out of order, sorted"),
        (renormalised, "with a quaternion that was not of length 1"),
    ] {
        if count > 0 {
            remarks.push_str(&format!("; {count} {what}"));
        }
    }
    console::print(format_args!(
        "{name}    {format}, {} poses{duration}, path {:.3} m{remarks}",
        facts.poses, facts.path_m
    ))
}

fn association(score: &TrajectoryScore) -> Result<(), Failure> {
    let association = &score.association;
    let how = match (association.max_difference_s, association.largest_difference_s) {
        (Some(allowed_s), Some(largest_s)) => {
            format!("within {allowed_s} s, the farthest {largest_s:.4} s apart")
        }
        _ => "by the number of the frame".to_owned(),
    };
    console::print(format_args!(
        "matched      {} pairs {how}; without a partner {} of the estimate, {} of the reference",
        association.matched, association.estimate_left_out, association.reference_left_out
    ))
}

fn coverage(score: &TrajectoryScore) -> Result<(), Failure> {
    let coverage = &score.coverage;
    let unit = match coverage.unit {
        CoverageUnit::Seconds => "s",
        CoverageUnit::Frames => "frames",
    };
    let gaps = match coverage.gaps.first() {
        None => "no gap".to_owned(),
        Some(longest) => {
            format!(
                "{} gaps, the longest {:.2} {unit}",
                coverage.gap_count,
                longest.end - longest.start
            )
        }
    };
    console::print(format_args!(
        "coverage     {:.1} % ({:.2} of {:.2} {unit}), {:.1} % of the path; {gaps}",
        100.0 * coverage.share,
        coverage.covered,
        coverage.reference,
        100.0 * coverage.path_share
    ))?;
    if coverage.share < LOST_BELOW {
        console::print(
            "             the errors below say nothing of the parts that are not covered",
        )?;
    }
    Ok(())
}

fn row(name: &str, statistics: Option<&Statistics>) -> Result<(), Failure> {
    console::print(line(name, statistics))
}

/// The figures in columns, apart from each other however large they are.
fn line(name: &str, statistics: Option<&Statistics>) -> String {
    match statistics {
        Some(Statistics { rmse, mean, median, std, min, max }) => format!(
            "{name:<25} {rmse:>10.6} {mean:>10.6} {median:>10.6} {std:>10.6} {min:>10.6} {max:>10.6}"
        ),
        None => format!("{name:<25}{:>11}", "-"),
    }
}

fn segments(score: &TrajectoryScore) -> Result<(), Failure> {
    let segments = &score.segments;
    let (Some(percent), Some(deg_per_m)) =
        (segments.translation_percent, segments.rotation_deg_per_m)
    else {
        return console::print(
            "KITTI drift  the path is shorter than every segment (--segments scaled takes shorter ones)",
        );
    };
    let lengths: Vec<String> =
        segments.by_length.iter().map(|of| format!("{:.2}", of.length_m)).collect();
    console::print(format_args!(
        "KITTI drift  {percent:.4} %, {deg_per_m:.6} deg/m over {} segments of {} m",
        segments.count,
        lengths.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: the errors of positions in millimetres ran into each other.
    #[test]
    fn columns_of_large_figures_stand_apart() {
        let [rmse, mean, median] = [2946.213465, 2883.314616, 3082.527566];
        let statistics = Statistics { rmse, mean, median, std: 6.5, min: 0.0, max: 123_456.7 };
        let told = line("ATE position (m)", Some(&statistics));
        let figures: Vec<f64> =
            told.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        assert_eq!(figures, [rmse, mean, median, 6.5, 0.0, 123_456.7]);
    }
}
