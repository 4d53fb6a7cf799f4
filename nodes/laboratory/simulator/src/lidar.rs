//! A rotating 2D scanner, as published by its driver.

use std::f64::consts::PI;

use geometry::{Scan, Stamp, pose_from_vector};
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::noise::{FrameNoise, Stream};
use crate::solid::{STATIC_ID, Solid, nearest_sighting};
use crate::{NoReturn, Path, Ray, Scene, StampError};

/// A scanner that measures one beam after the other while it rotates.
///
/// The scanner rotates clockwise, seen from above, and its driver reverses the readings: the last beam of the message
/// is the first that was measured. As with the real driver, the message's `time_increment_s` does not show that.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Lidar {
    /// The scanner's pose in the rig: `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]`.
    pub rig_from_lidar: [f64; 6],
    /// The frame that scans are stamped with.
    pub frame_id: String,
    /// Beams per revolution, evenly spaced.
    pub beams: usize,
    /// Azimuths of the first and of the last beam of the message; the increment is negative when the first is the larger
    /// one. By default a full turn whose last beam points backwards (azimuth pi).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub azimuths_rad: Option<[f64; 2]>,
    /// Revolutions per second.
    pub turn_rate_hz: f64,
    /// Standard deviation of the start of a revolution as a share of it: the motor's speed varies.
    pub turn_jitter: f64,
    /// The least measurable range.
    pub range_min_m: f64,
    /// The largest measurable range.
    pub range_max_m: f64,
    /// The constant part of the standard deviation of a range, ...
    pub range_noise_m: f64,
    /// ... and the part proportional to the range.
    pub range_noise_ratio: f64,
    /// The resolution of ranges.
    pub range_step_m: f64,
    /// A beam is measured anywhere within this angle around its own azimuth.
    pub azimuth_spread_rad: f64,
    /// The share of beams that fail at random.
    pub dropout_ratio: f64,
    /// The least reflectivity of a measurable target at 1 m and normal incidence.
    pub min_signal: f64,
    /// The range of a beam without a return.
    pub no_return: NoReturn,
    /// The errors of its stamps.
    pub stamps: StampError,
}

impl Default for Lidar {
    /// The scanner of Rec-HV.
    fn default() -> Self {
        Self::rplidar_a1()
    }
}

impl Lidar {
    /// An RPLIDAR A1 with `rplidar_ros`: frame `laser`, 360 beams from -pi to pi, about 7 turns a second
    /// (Rec-HV 3.4.1), 0.15 .. 12 m, `+Inf` for no return, ranges in quarters of a millimetre, readings
    /// filed by whole degrees. White walls (reflectivity 0.8) come back from 12 m, black ones from 2.5 m.
    ///
    /// The data sheet gives the error as below 1 % of the range; half of that as the deviation fits
    /// the 0.0008 .. 0.0423 m that Rec-HV (4.3) reports for the deviation over three turns in an empty room
    /// of 4 m. 5 cm below the rig's origin (Rec-HV 3.4.2).
    #[must_use]
    pub fn rplidar_a1() -> Self {
        Self {
            rig_from_lidar: [0.0, 0.0, -0.05, 0.0, 0.0, 0.0],
            frame_id: "laser".to_owned(),
            beams: 360,
            azimuths_rad: None,
            turn_rate_hz: 7.0,
            turn_jitter: 0.004,
            range_min_m: 0.15,
            range_max_m: 12.0,
            range_noise_m: 0.001,
            range_noise_ratio: 0.005,
            range_step_m: 0.000_25,
            azimuth_spread_rad: PI / 180.0,
            dropout_ratio: 0.01,
            min_signal: 0.8 / (12.0 * 12.0),
            no_return: NoReturn::Inf,
            stamps: StampError::default(),
        }
    }

    /// The start of revolution `turn`, in seconds since the start of the scenario. Revolution 0 starts at 0.
    pub(crate) fn turn_start_s(&self, seed: u64, turn: u64) -> f64 {
        let jitter = if turn == 0 {
            0.0
        } else {
            self.turn_jitter
                * f64::from(FrameNoise::new(seed, Stream::TurnStart, turn).draw(0).normal())
        };
        (turn as f64 + jitter) / self.turn_rate_hz
    }

    /// The stamp of revolution `turn`, in seconds since the start of the scenario.
    pub(crate) fn turn_stamp_s(&self, seed: u64, turn: u64) -> f64 {
        self.turn_start_s(seed, turn) + self.stamps.at(seed, Stream::ScanStamp, turn)
    }

    /// The scan of a revolution, and for each beam the object that it hit.
    pub(crate) fn scan(&self, view: &LidarView<'_>, turn: u64) -> (Scan, Vec<u16>) {
        let start_s = self.turn_start_s(view.seed, turn);
        let turn_time_s = self.turn_start_s(view.seed, turn + 1) - start_s;
        let gaps = self.beams.saturating_sub(1).max(1) as f64;
        let (last_rad, azimuth_step_rad) = match self.azimuths_rad {
            Some([first_rad, last_rad]) => (last_rad, (last_rad - first_rad) / gaps),
            None => (PI, 2.0 * PI / self.beams.max(1) as f64),
        };
        // A scanner that does not look all round is idle for the rest of its turn.
        let measuring_s = turn_time_s * self.beams as f64 * azimuth_step_rad.abs() / (2.0 * PI);
        let scan = Scan {
            stamp: view.start.plus_seconds(self.turn_stamp_s(view.seed, turn)),
            frame_id: self.frame_id.clone(),
            angle_min_rad: (last_rad - (self.beams as f64 - 1.0) * azimuth_step_rad) as f32,
            angle_increment_rad: azimuth_step_rad as f32,
            time_increment_s: (measuring_s / gaps) as f32,
            scan_time_s: turn_time_s as f32,
            range_min_m: self.range_min_m as f32,
            range_max_m: self.range_max_m as f32,
            ranges_m: Vec::new(),
        };
        let range_noise = FrameNoise::new(view.seed, Stream::BeamRange, turn);
        let azimuth_noise = FrameNoise::new(view.seed, Stream::BeamAzimuth, turn);
        let (ranges_m, labels) = (0..self.beams)
            .map(|beam| {
                let measured_after = (self.beams - 1 - beam) as f64 / self.beams as f64;
                let spread = f64::from(azimuth_noise.draw(beam).uniform()) - 0.5;
                let azimuth_rad = last_rad - (self.beams - 1 - beam) as f64 * azimuth_step_rad
                    + spread * self.azimuth_spread_rad;
                let time_s = start_s + measured_after * measuring_s;
                self.measure(view, azimuth_rad, time_s, range_noise.draw(beam))
            })
            .unzip();
        (Scan { ranges_m, ..scan }, labels)
    }

    fn measure(
        &self,
        view: &LidarView<'_>,
        azimuth_rad: f64,
        time_s: f64,
        draw: crate::noise::Draw,
    ) -> (f32, u16) {
        /// The variation of the returned light between revolutions.
        const STRENGTH_FLUTTER: f64 = 0.4;
        let no_return = (self.no_return.value(), STATIC_ID);

        let room_from_lidar = view.path.pose_at(time_s) * pose_from_vector(&self.rig_from_lidar);
        let ray = Ray {
            origin: room_from_lidar * Point3::origin(),
            direction: room_from_lidar * Vector3::new(azimuth_rad.cos(), azimuth_rad.sin(), 0.0),
        };
        let moving = view.scene.moving_solids(time_s);
        let Some(sighting) =
            nearest_sighting(view.statics.iter().chain(&moving), &ray, self.min_signal)
        else {
            return no_return;
        };
        let chance = f64::from(draw.uniform());
        let needed = 1.0 + STRENGTH_FLUTTER * (chance - 0.5);
        if chance < self.dropout_ratio || sighting.strength < needed {
            return no_return;
        }
        let std_dev_m = self.range_noise_m + self.range_noise_ratio * sighting.distance_m;
        let noisy_m = sighting.distance_m + std_dev_m * f64::from(draw.normal());
        let range_m = (noisy_m / self.range_step_m).round() * self.range_step_m;
        if range_m < self.range_min_m || range_m > self.range_max_m {
            return no_return;
        }
        (range_m as f32, sighting.id)
    }
}

/// The other inputs of a revolution of the scanner.
pub(crate) struct LidarView<'a> {
    pub(crate) seed: u64,
    pub(crate) start: Stamp,
    pub(crate) path: &'a Path,
    pub(crate) scene: &'a Scene,
    pub(crate) statics: &'a [Solid],
}

#[cfg(test)]
mod tests;
