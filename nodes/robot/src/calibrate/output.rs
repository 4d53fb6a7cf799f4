//! The output of a calibration: text, JSON, and a parameter file.

use std::path::Path;

use calibration::Calibration;
use geometry::{ExtrinsicsSource, pose_vector};
use node_shell::write_whole_file;
use serde::Serialize;

use super::StartingMounts;
use crate::console;
use crate::failure::Failure;

/// The JSON output.
#[derive(Serialize)]
struct Json<'a> {
    bag: String,
    #[serde(flatten)]
    found: &'a Calibration,
}

pub(super) fn print_json(bag: &Path, found: &Calibration) -> Result<(), Failure> {
    let json = Json { bag: bag.display().to_string(), found };
    let json = serde_json::to_string_pretty(&json)
        .map_err(|error| Failure::new(format!("cannot print the calibration: {error}")))?;
    console::print(json)
}

pub(super) fn print(
    found: &Calibration,
    start: &StartingMounts,
    written: Option<&Path>,
) -> Result<(), Failure> {
    for line in lines(found) {
        console::print(line)?;
    }
    match written {
        Some(path) => console::print(format_args!("parameters: {}", path.display())),
        None => console::print(parameters(found, start).trim_end()),
    }
}

fn lines(found: &Calibration) -> Vec<String> {
    let mut lines: Vec<String> = found.coordinates.iter().map(line).collect();
    lines.extend(found.not_observable.iter().cloned());
    lines.push(format!(
        "{} returns on planes and {} on edges of {} cycles count; {} fit nothing, {} are of what moves",
        found.plane_returns, found.edges, found.cycles, found.outliers, found.moving_returns
    ));
    lines.push(format!(
        "{} returns lie on the surface that the camera sees there, {} beside it; where {} are, the depth scatters too much",
        found.agreeing_returns, found.contradicting_returns, found.noisy_returns
    ));
    lines.push(format!(
        "distance from the surfaces (root mean square): {:.4} m before, {:.4} m after",
        found.rms_before_m, found.rms_after_m
    ));
    lines
}

/// A coordinate, its correction and its standard deviation.
fn line(one: &calibration::CoordinateEstimate) -> String {
    let (correction, std_dev) = if one.coordinate.is_shift() {
        (format!("{:+.4} m", one.correction), format!("{:.4} m", one.std_dev))
    } else {
        let degrees = |radians: f64| radians.to_degrees();
        (format!("{:+.3} deg", degrees(one.correction)), format!("{:.3} deg", degrees(one.std_dev)))
    };
    let how = if one.is_estimated() {
        ""
    } else if one.is_held() {
        "   held: as it was, the deviation is that of a ruler"
    } else {
        "   in part: known only together with another"
    };
    format!("{:<6} {correction:>12}   std dev {std_dev:>11}{how}", one.coordinate.name())
}

/// Writes the parameter file, under a temporary name first: a reader never finds half a file.
pub(super) fn write_parameters(
    path: &Path,
    bag: &Path,
    found: &Calibration,
    start: &StartingMounts,
) -> Result<(), Failure> {
    let name = bag.file_name().unwrap_or(bag.as_os_str()).to_string_lossy();
    let mut text = format!("# Where `stillmap calibrate {name}` found the scanner.\n");
    for line in lines(found) {
        text.push_str(&format!("#   {line}\n"));
    }
    text.push_str(&parameters(found, start));
    write_whole_file(path, text.as_bytes())
        .map_err(|error| Failure::new(format!("cannot write {}: {error}", path.display())))
}

/// The sections of a parameter file. The mounts hold in place of those of tf, where these were to be read.
fn parameters(found: &Calibration, start: &StartingMounts) -> String {
    let mut text = "/**:\n  ros__parameters:\n".to_owned();
    if start.source != ExtrinsicsSource::Parameters {
        text.push_str("    extrinsics: parameters\n");
    }
    text.push_str("    # [x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]\n");
    if start.source != ExtrinsicsSource::Parameters {
        let camera = pose_vector(&start.mounts.rig_from_camera);
        text.push_str(&format!("    rig_from_camera: [{}]\n", numbers(&camera)));
    }
    text.push_str(&format!("    rig_from_lidar: [{}]\n", numbers(&found.rig_from_lidar)));
    text
}

/// To a tenth of a millimetre, a thousandth of a degree.
fn numbers(pose: &[f64; 6]) -> String {
    let numbers: Vec<String> = pose.iter().map(|number| format!("{:.6}", number + 0.0)).collect();
    numbers.join(", ")
}
