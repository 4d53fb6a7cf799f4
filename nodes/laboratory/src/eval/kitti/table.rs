//! The printed result of an evaluation.

use robot::Failure;

use super::{Evaluation, published};

/// The lines: a table of all scores, then the comparison with the thesis' tables.
pub(super) fn lines(evaluation: &Evaluation) -> Result<Vec<String>, Failure> {
    let Evaluation { figures, stages, scans, true_poses, way_m, .. } = evaluation;
    let mut lines = vec![format!("{scans} scans, {true_poses} true poses over {way_m:.1} m")];
    let head = [
        "",
        "poses",
        "no fit",
        "ms",
        "drift %",
        "deg/100m",
        "ATE m",
        "RMS 2D m",
        "RMS 3D m",
        "end %",
        "precision %",
    ];
    let mut rows = vec![head.map(str::to_owned)];
    for one in figures {
        rows.push([
            one.name.clone(),
            one.poses.to_string(),
            one.troubles.to_string(),
            number(one.milliseconds_median, 1),
            number(one.translation_percent, 3),
            number(one.rotation_deg_per_100m, 3),
            number(Some(one.ate_rmse_m), 3),
            number(one.rms_2d_m, 3),
            number(one.rms_3d_m, 3),
            number(one.end_error_percent, 2),
            number(one.precision_percent, 2),
        ]);
    }
    for row in &rows {
        let [name, cells @ ..] = row;
        let cells: String = cells.iter().map(|cell| format!("{cell:>12}")).collect();
        lines.push(format!("{name:<20}{cells}"));
    }
    lines.push(String::new());
    lines.extend(published::beside(figures, stages)?);
    Ok(lines)
}

pub(super) fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}
