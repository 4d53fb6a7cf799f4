//! Charts of a trajectory and its reference: the plan with the differences, as in Sturm et al. 2012, the plan in the
//! colours of the error, and the errors over time.

use nalgebra::Vector3;

use super::absolute::MatchedPose;
use super::coverage::{CoverageUnit, is_gap};
use super::plane::Plane;
use super::score::ScoredTrajectory;
use report::{Axis, Chart, Marks, Series};

/// The most points of a line: more cannot be distinguished on a screen.
const MOST_POINTS: usize = 1500;
/// The most differences that are drawn.
const MOST_DIFFERENCES: usize = 300;
/// The classes of the style sheet for errors from small to large.
const BAND_CLASSES: [&str; 5] = ["error-0", "error-1", "error-2", "error-3", "error-4"];

/// The charts of a scored trajectory, the plans in the given plane: plan with differences, plan in colours of
/// the error, error of the position and of the rotation over time, and drift over the length of a segment where
/// there are segments of two lengths.
#[must_use]
pub fn trajectory_charts(scored: &ScoredTrajectory, plane: Plane) -> Vec<Chart> {
    let mut charts = vec![difference_plan(scored, plane), error_plan(scored, plane)];
    let time = time_label(scored);
    charts.push(over_time(scored, ErrorOf::Position, time));
    if scored.score.absolute.rotation_deg.is_some() {
        charts.push(over_time(scored, ErrorOf::Rotation, time));
    }
    if scored.score.segments.by_length.len() > 1 {
        charts.push(drift_chart(scored));
    }
    charts
}

fn time_label(scored: &ScoredTrajectory) -> &'static str {
    match scored.score.coverage.unit {
        CoverageUnit::Seconds => "time since the first pose of the reference (s)",
        CoverageUnit::Frames => "frames since the first pose of the reference",
    }
}

/// The pairs in runs without a gap, thinned for drawing.
fn runs(scored: &ScoredTrajectory) -> Vec<Vec<&MatchedPose>> {
    let coverage = &scored.score.coverage;
    let whole = scored.pairs.chunk_by(|from, to| !is_gap(from, to, coverage));
    whole.map(|run| thinned(run, scored.pairs.len().div_ceil(MOST_POINTS))).collect()
}

/// One of `step`, and the last.
fn thinned<T>(values: &[T], step: usize) -> Vec<&T> {
    let step = step.max(1);
    let mut thinned: Vec<&T> = values.iter().step_by(step).collect();
    if !values.len().saturating_sub(1).is_multiple_of(step) {
        thinned.extend(values.last());
    }
    thinned
}

fn estimate_m(pose: &MatchedPose) -> &Vector3<f64> {
    &pose.estimate.translation.vector
}

/// The reference's path.
fn truth(scored: &ScoredTrajectory, plane: Plane) -> Series {
    let step = scored.reference.len().div_ceil(MOST_POINTS);
    let points = thinned(&scored.reference, step);
    let path = points.iter().map(|pose| plane.project(&pose.translation.vector)).collect();
    Series { name: "reference".to_owned(), class: "reference", marks: Marks::Line(path) }
}

fn plan(id: &str, title: String, description: String, plane: Plane, series: Vec<Series>) -> Chart {
    let points = || series.iter().flat_map(|series| series.marks.points());
    let (xs, ys): (Vec<f64>, Vec<f64>) = points().unzip();
    let [x_label, y_label] = plane.axis_names().map(|name| format!("{name} (m)"));
    let [x, y] = Axis::of_one_scale([&x_label, &y_label], [&xs, &ys]);
    Chart { id: id.to_owned(), title, description, x, y, series }
}

/// As in Figures 39 to 48 of the thesis: the ground truth, the estimate, and lines between the two.
fn difference_plan(scored: &ScoredTrajectory, plane: Plane) -> Chart {
    let estimate = runs(scored)
        .into_iter()
        .map(|run| run.into_iter().map(|pose| plane.project(estimate_m(pose))).collect())
        .collect();
    let step = scored.pairs.len().div_ceil(MOST_DIFFERENCES);
    let differences = thinned(&scored.pairs, step)
        .into_iter()
        .map(|pose| [estimate_m(pose), &pose.reference.translation.vector])
        .map(|ends| ends.map(|end| plane.project(end)).to_vec())
        .collect();
    let series = vec![
        Series {
            name: "difference".to_owned(),
            class: "difference",
            marks: Marks::Paths(differences),
        },
        truth(scored, plane),
        Series { name: "estimate".to_owned(), class: "estimate", marks: Marks::Paths(estimate) },
    ];
    let errors = &scored.score.absolute.translation_m;
    let description = format!(
        "The path of the reference, that of the estimate, and lines between poses that belong together: {:.3} m \
         long in the mean, {:.3} m at most.",
        errors.mean, errors.max
    );
    plan("plan", "Reference and estimate".to_owned(), description, plane, series)
}

/// The estimate in the colours of its error, over the reference.
fn error_plan(scored: &ScoredTrajectory, plane: Plane) -> Chart {
    let largest_m = scored.score.absolute.translation_m.max;
    let bands = BAND_CLASSES.len();
    let band = |pose: &MatchedPose| {
        let share = if largest_m > 0.0 { pose.translation_m / largest_m } else { 0.0 };
        ((share * bands as f64) as usize).min(bands - 1)
    };
    let mut paths: Vec<Vec<Vec<(f64, f64)>>> = vec![Vec::new(); bands];
    for run in runs(scored) {
        for part in run.chunk_by(|from, to| band(from) == band(to)) {
            let Some((first, last)) = part.first().zip(part.last()) else { continue };
            // The line goes on to the first pose of another colour.
            let next = run.iter().find(|pose| pose.at > last.at);
            let path = part.iter().chain(next).map(|pose| plane.project(estimate_m(pose)));
            paths[band(first)].push(path.collect());
        }
    }
    let mut series = vec![truth(scored, plane)];
    for (index, (paths, class)) in paths.into_iter().zip(BAND_CLASSES).enumerate() {
        let edge_m = |edge: usize| largest_m * edge as f64 / bands as f64;
        let name = format!("{:.3} to {:.3} m", edge_m(index), edge_m(index + 1));
        series.push(Series { name, class, marks: Marks::Paths(paths) });
    }
    let description = format!(
        "The path of the estimate in {bands} colours by the distance to the reference, from 0 to {largest_m:.3} m."
    );
    let title = "Error along the path".to_owned();
    plan("error-plan", title, description, plane, series)
}

#[derive(Clone, Copy)]
enum ErrorOf {
    Position,
    Rotation,
}

fn over_time(scored: &ScoredTrajectory, of: ErrorOf, time: &str) -> Chart {
    let value = |pose: &MatchedPose| match of {
        ErrorOf::Position => pose.translation_m,
        ErrorOf::Rotation => pose.rotation_deg,
    };
    let (id, title, label) = match of {
        ErrorOf::Position => ("error-m", "Error of the position over time", "distance (m)"),
        ErrorOf::Rotation => ("error-deg", "Error of the rotation over time", "angle (degrees)"),
    };
    let coverage = &scored.score.coverage;
    let paths: Vec<Vec<(f64, f64)>> = scored
        .pairs
        .chunk_by(|from, to| !is_gap(from, to, coverage))
        .map(|run| peaks(run, scored.pairs.len().div_ceil(MOST_POINTS), value))
        .collect();
    let values = || scored.pairs.iter().map(value);
    let whole = [0.0, coverage.reference];
    let description = format!(
        "{} breaks where the reference is not covered; the largest error is {:.3}.",
        paths.len().saturating_sub(1),
        values().fold(0.0, f64::max)
    );
    Chart {
        id: id.to_owned(),
        title: title.to_owned(),
        description,
        x: Axis::within(time, whole),
        y: Axis::spanning(label, std::iter::once(0.0).chain(values()).collect::<Vec<_>>()),
        series: vec![Series {
            name: "estimate".to_owned(),
            class: "estimate",
            marks: Marks::Paths(paths),
        }],
    }
}

/// Of each `step` poses the one with the largest value, so that thinning does not remove peaks.
fn peaks(run: &[MatchedPose], step: usize, value: impl Fn(&MatchedPose) -> f64) -> Vec<(f64, f64)> {
    run.chunks(step.max(1))
        .filter_map(|part| {
            let largest = part.iter().map(|pose| (pose.at, value(pose)));
            largest.reduce(|one, other| if other.1 > one.1 { other } else { one })
        })
        .collect()
}

fn drift_chart(scored: &ScoredTrajectory) -> Chart {
    let points: Vec<(f64, f64)> = scored
        .score
        .segments
        .by_length
        .iter()
        .map(|of_length| (of_length.length_m, of_length.translation_percent))
        .collect();
    let (lengths_m, percents): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
    Chart {
        id: "drift".to_owned(),
        title: "Drift over the length of a segment".to_owned(),
        description: "The mean drift in percent of the way, by the length of the segment."
            .to_owned(),
        x: Axis::spanning("length of the segment (m)", lengths_m),
        y: Axis::spanning(
            "drift (% of the way)",
            percents.into_iter().chain([0.0]).collect::<Vec<_>>(),
        ),
        series: vec![
            Series {
                name: "mean over segments".to_owned(),
                class: "estimate",
                marks: Marks::Line(points.clone()),
            },
            Series { name: "length".to_owned(), class: "estimate", marks: Marks::Dots(points) },
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{stamped, walk};
    use super::super::{TrajectoryScoreConfig, score_trajectory};
    use super::*;

    fn scored() -> ScoredTrajectory {
        let truth = walk(300);
        let mut estimate: Vec<_> = truth[..100].to_vec();
        estimate.iter_mut().enumerate().for_each(|(index, pose)| {
            pose.translation.vector.x += 0.001 * (index * index % 97) as f64;
        });
        score_trajectory(&stamped(&estimate), &stamped(&truth), &TrajectoryScoreConfig::default())
            .unwrap()
    }

    fn points(chart: &Chart, series: &str) -> usize {
        chart
            .series
            .iter()
            .filter(|one| one.name == series)
            .map(|one| one.marks.points().count())
            .sum()
    }

    #[test]
    fn the_plan_holds_both_paths_and_a_line_for_each_pair() {
        let charts = trajectory_charts(&scored(), Plane::Xy);
        let ids: Vec<&str> = charts.iter().map(|chart| chart.id.as_str()).collect();
        assert_eq!(ids, ["plan", "error-plan", "error-m", "error-deg"]);
        assert_eq!(points(&charts[0], "reference"), 300);
        assert_eq!(points(&charts[0], "estimate"), 100);
        assert_eq!(points(&charts[0], "difference"), 200);
    }

    #[test]
    fn the_colours_leave_no_hole_in_the_path() {
        let chart = error_plan(&scored(), Plane::Xy);
        let bands = chart.series.iter().filter(|series| series.class.starts_with("error"));
        let steps: usize = bands
            .flat_map(|series| match &series.marks {
                Marks::Paths(paths) => paths.clone(),
                _ => Vec::new(),
            })
            .map(|path| path.len() - 1)
            .sum();
        assert_eq!(steps, 99);
    }

    #[test]
    fn what_is_thinned_keeps_its_ends_and_its_peaks() {
        let values: Vec<usize> = (0..=10).collect();
        assert_eq!(thinned(&values, 4), [&0, &4, &8, &10]);
        assert_eq!(thinned(&values, 5), [&0, &5, &10]);
        assert_eq!(thinned::<usize>(&[], 5), Vec::<&usize>::new());
        let scored = scored();
        let largest = peaks(&scored.pairs, 7, |pose| pose.translation_m);
        let peak = largest.iter().map(|point| point.1).fold(0.0, f64::max);
        assert_eq!(peak, scored.score.absolute.translation_m.max);
        assert_eq!(largest.len(), 15);
    }
}
