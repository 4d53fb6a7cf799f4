//! The score of a trajectory.

use std::path::PathBuf;

use evaluation::trajectory::{
    Alignment, AssociationConfig, RawPose, Trajectory, TrajectoryScoreConfig, parse_trajectory,
    score_trajectory,
};
use geometry::Stamp;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::rows_of;
use crate::errors::{computed, error, error_of_file};

/// The numbers of a pose: time, position, quaternion.
const NUMBERS: usize = 8;

/// A file, or poses.
#[derive(FromPyObject)]
pub(crate) enum Source<'py> {
    #[pyo3(transparent)]
    File(PathBuf),
    #[pyo3(transparent)]
    Poses(Bound<'py, PyAny>),
}

impl Source<'_> {
    fn read(self, py: Python<'_>) -> PyResult<Trajectory> {
        match self {
            Self::File(path) => computed(py, || {
                let wrong = |reason: &dyn std::fmt::Display| {
                    error_of_file(&path, format_args!("{}: {reason}", path.display()))
                };
                let text = std::fs::read(&path).map_err(|error| wrong(&error))?;
                let parsed = parse_trajectory(&text).map_err(|error| wrong(&error))?;
                Ok(parsed.trajectory)
            }),
            Self::Poses(poses) => {
                let wanted = "N x 8 (seconds, x, y, z, qx, qy, qz, qw)";
                let poses: Vec<[f64; NUMBERS]> = rows_of(&poses, wanted)?;
                if poses.iter().any(|[stamp_s, ..]| !stamp_s.is_finite()) {
                    return Err(PyValueError::new_err("a stamp of the poses is no number"));
                }
                let pose = |[stamp_s, x, y, z, qx, qy, qz, qw]: [f64; NUMBERS]| {
                    let pose = RawPose { position_m: [x, y, z], quaternion_xyzw: [qx, qy, qz, qw] };
                    (Stamp::default().plus_seconds(stamp_s), pose)
                };
                Ok(Trajectory::stamped(poses.into_iter().map(pose)))
            }
        }
    }
}

/// The score of an estimate as JSON: that of `stillmap eval trajectory --json`, without the names of the files.
#[pyfunction]
pub(crate) fn score_trajectories(
    py: Python<'_>,
    estimate: Source<'_>,
    reference: Source<'_>,
    align: &str,
    max_difference_s: f64,
    offset_s: f64,
) -> PyResult<String> {
    let (estimate, reference) = (estimate.read(py)?, reference.read(py)?);
    let alignment: Alignment = serde_json::from_value(align.into())
        .map_err(|error| PyValueError::new_err(format!("align: {error}")))?;
    let config = TrajectoryScoreConfig {
        association: AssociationConfig { max_difference_s, offset_s },
        alignment,
        ..TrajectoryScoreConfig::default()
    };
    config.validate().map_err(|error| PyValueError::new_err(error.to_string()))?;
    computed(py, || {
        let scored = score_trajectory(&estimate, &reference, &config).map_err(error)?;
        serde_json::to_string(&scored.score).map_err(error)
    })
}
