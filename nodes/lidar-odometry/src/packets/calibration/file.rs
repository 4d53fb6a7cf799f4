//! Calibration files as ROS' `velodyne_pointcloud` keeps them (YAML, made from the scanner's `db.xml`).

use serde::Deserialize;

use super::{Calibration, LaserCalibration};

/// The file is no calibration.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum CalibrationFileError {
    /// It is no such YAML.
    #[error("the calibration cannot be read: {reason}")]
    Yaml {
        /// The reader's error, in a line.
        reason: String,
    },
    /// A laser is missing, or occurs twice.
    #[error("laser {laser} occurs {times} times among {lasers} lasers, not once")]
    Laser {
        /// Which laser, from 0.
        laser: usize,
        /// How often it is there.
        times: usize,
        /// Lasers of the file.
        lasers: usize,
    },
}

impl Calibration {
    /// The calibration in the text of a file: `lasers`, each with `laser_id`, `vert_correction` and `rot_correction` in
    /// radians, distances in metres; and `distance_resolution` in metres. What compensates intensities is not read:
    /// intensities are left as the scanner sends them.
    ///
    /// # Errors
    /// When it is no such file, or the lasers are not numbered from 0 without gaps.
    pub fn from_yaml(text: &str) -> Result<Self, CalibrationFileError> {
        let file: File = serde_saphyr::from_str(text).map_err(|error| {
            // The reader's message goes on with an excerpt of the file.
            let reason = error.to_string().lines().next().unwrap_or_default().to_owned();
            CalibrationFileError::Yaml { reason }
        })?;
        let count = file.lasers.len();
        let mut entries = file.lasers;
        entries.sort_by_key(|entry| entry.laser_id);
        for (laser, entry) in entries.iter().enumerate() {
            if entry.laser_id != laser {
                // Sorted, the first that is not in its place is one that is missing, or the second of one.
                let laser = laser.min(entry.laser_id);
                let times = entries.iter().filter(|entry| entry.laser_id == laser).count();
                return Err(CalibrationFileError::Laser { laser, times, lasers: count });
            }
        }
        let lasers = entries.iter().map(Laser::calibration).collect();
        Ok(Self { range_step_m: file.distance_resolution, lasers })
    }
}

#[derive(Deserialize)]
struct File {
    lasers: Vec<Laser>,
    #[serde(default = "two_millimetres")]
    distance_resolution: f64,
}

/// The resolution in files from before `distance_resolution` was written.
fn two_millimetres() -> f64 {
    0.002
}

#[derive(Deserialize)]
struct Laser {
    laser_id: usize,
    vert_correction: f64,
    #[serde(default)]
    rot_correction: f64,
    #[serde(default)]
    dist_correction: f64,
    #[serde(default)]
    dist_correction_x: f64,
    #[serde(default)]
    dist_correction_y: f64,
    #[serde(default)]
    vert_offset_correction: f64,
    #[serde(default)]
    horiz_offset_correction: f64,
}

impl Laser {
    fn calibration(&self) -> LaserCalibration {
        LaserCalibration {
            elevation_deg: self.vert_correction.to_degrees(),
            rotation_deg: self.rot_correction.to_degrees(),
            range_offset_m: self.dist_correction,
            near_range_offset_m: [self.dist_correction_x, self.dist_correction_y],
            height_m: self.vert_offset_correction,
            horizontal_offset_m: self.horiz_offset_correction,
        }
    }
}
