//! The files of a sequence: lists of stamps and names, poses, and the camera.

use std::path::Path;

use geometry::{CameraModel, Distortion, Stamp};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use crate::failure::Failure;
use crate::import::depth::camera_of;

/// Depth images of the benchmark have 5000 units per metre (its file format page).
pub const UNITS_PER_METRE: f64 = 5000.0;

/// Intrinsics of the three colour cameras, to which the depth is registered: fx, fy, cx, cy and the
/// five plumb_bob coefficients (the benchmark's calibration page).
const FREIBURG: [(&str, [f64; 4], [f64; 5]); 3] = [
    ("freiburg1", [517.3, 516.5, 318.6, 255.3], [0.2624, -0.9531, -0.0054, 0.0026, 1.1633]),
    ("freiburg2", [520.9, 521.0, 325.1, 249.7], [0.2312, -0.7849, -0.0033, -0.0001, 0.9172]),
    ("freiburg3", [535.4, 539.2, 320.1, 247.6], [0.0; 5]),
];

/// The camera of a sequence.
#[derive(Clone, Copy, Debug)]
pub struct Calibration {
    intrinsics_px: [f64; 4],
    distortion: Distortion,
}

impl Calibration {
    /// By the given intrinsics, or by the name of the folder.
    pub fn of(folder: &Path, intrinsics: Option<[f64; 4]>) -> Result<Self, Failure> {
        if let Some(intrinsics_px) = intrinsics {
            return Ok(Self { intrinsics_px, distortion: Distortion::None });
        }
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let known = FREIBURG.iter().find(|(camera, ..)| name.contains(camera));
        match known {
            Some((_, intrinsics_px, coefficients)) => Ok(Self {
                intrinsics_px: *intrinsics_px,
                distortion: if coefficients.iter().all(|value| *value == 0.0) {
                    Distortion::None
                } else {
                    Distortion::PlumbBob(*coefficients)
                },
            }),
            None => Err(Failure::new(format!("the name '{name}' does not name the camera"))
                .fix("give --intrinsics fx,fy,cx,cy, or keep the folder's name as published (freiburg1, 2 or 3 in it)")),
        }
    }

    /// The camera model for images of this size; a failure if it is not that of such images.
    pub fn camera(&self, size_px: (usize, usize)) -> Result<CameraModel, Failure> {
        camera_of(self.intrinsics_px, self.distortion, size_px)
    }
}

/// Lines of `seconds rest`, and comments that begin with `#`.
pub fn read_list(path: &Path) -> Result<Vec<(Stamp, String)>, Failure> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        Failure::new(format!("cannot read {}: {error}", path.display()))
            .fix("a TUM sequence holds depth.txt, rgb.txt and groundtruth.txt")
    })?;
    let mut list = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let parsed = line
            .split_once(char::is_whitespace)
            .and_then(|(seconds, rest)| Some((parse_stamp(seconds)?, rest.trim().to_owned())));
        list.push(parsed.ok_or_else(|| {
            Failure::new(format!("{} line {}: cannot read '{line}'", path.display(), index + 1))
        })?);
    }
    Ok(list)
}

/// Decimal seconds, parsed digit by digit: a float would lose the nanoseconds.
fn parse_stamp(text: &str) -> Option<Stamp> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    if fraction.len() > 9 {
        return None;
    }
    let nanos = format!("{fraction:0<9}").parse::<u32>().ok()?;
    Some(Stamp::from_secs_nanos(whole.parse().ok()?, nanos))
}

/// `tx ty tz qx qy qz qw`.
pub fn pose_of(text: &str) -> Option<Isometry3<f64>> {
    let numbers: Vec<f64> =
        text.split_whitespace().map(|number| number.parse().ok()).collect::<Option<_>>()?;
    let [x, y, z, qx, qy, qz, qw] = numbers.try_into().ok()?;
    let rotation = UnitQuaternion::try_new(Quaternion::new(qw, qx, qy, qz), 1e-6)?;
    Some(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_keeps_its_microseconds() {
        let stamp = parse_stamp("1305031229.528748").unwrap();
        assert_eq!(stamp.secs_nanos(), (1_305_031_229, 528_748_000));
        assert_eq!(parse_stamp("12").unwrap().secs_nanos(), (12, 0));
        assert_eq!(parse_stamp("12.1234567891"), None);
        assert_eq!(parse_stamp("x.1"), None);
    }

    #[test]
    fn a_pose_needs_seven_numbers_and_a_rotation() {
        let pose = pose_of("1 2 3 0 0 0 1").unwrap();
        assert_eq!(pose, Isometry3::translation(1.0, 2.0, 3.0));
        assert_eq!(pose_of("1 2 3 0 0 0"), None);
        assert_eq!(pose_of("1 2 3 0 0 0 0"), None);
    }
}
