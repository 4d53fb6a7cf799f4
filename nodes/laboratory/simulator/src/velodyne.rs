//! A rotating multi-beam LiDAR, as published by its driver.

mod model;

use estimation::Executor;
use estimation::executor::for_each;
use geometry::{Stamp, pose_from_vector};
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::noise::{FrameNoise, Stream};
use crate::solid::STATIC_ID;
use crate::still::StillSolids;
use crate::{Path, Ray, Scene};

pub use model::VelodyneModel;

/// The model of the scanner.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Velodyne {
    /// The arrangement and timing of its lasers.
    pub model: VelodyneModel,
    /// The pose in the rig: `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]`.
    pub rig_from_velodyne: [f64; 6],
    /// The frame of the clouds.
    pub frame_id: String,
    /// Revolutions per second.
    pub turn_rate_hz: f64,
    /// The least measurable range.
    pub range_min_m: f64,
    /// The largest measurable range.
    pub range_max_m: f64,
    /// Standard deviation of a range.
    pub range_noise_m: f64,
    /// The resolution of ranges.
    pub range_step_m: f64,
    /// Standard deviation of an intensity, as a share of it.
    pub intensity_noise: f64,
    /// The share of shots that fail at random.
    pub dropout_ratio: f64,
    /// The least reflectivity of a measurable target at 1 m and normal incidence.
    pub min_signal: f64,
}

impl Default for Velodyne {
    /// An HDL-32E at 10 Hz in the rig's origin: ranges from 1 m on, in steps of 2 mm with a standard deviation of 2 cm; a
    /// target of 10 % reflectivity is measured at 80 m (its data sheet).
    fn default() -> Self {
        Self {
            model: VelodyneModel::Hdl32e,
            rig_from_velodyne: [0.0; 6],
            frame_id: "velodyne".to_owned(),
            turn_rate_hz: 10.0,
            range_min_m: 1.0,
            range_max_m: 100.0,
            range_noise_m: 0.02,
            range_step_m: 0.002,
            intensity_noise: 0.05,
            dropout_ratio: 0.002,
            min_signal: 0.1 / (80.0 * 80.0),
        }
    }
}

/// The cloud of a revolution: a row for each laser, from the lowest to the highest, a column for each firing of all of
/// them.
#[derive(Clone, PartialEq, Debug)]
pub struct VelodyneTurn {
    /// The time of the first shot.
    pub stamp: Stamp,
    /// The frame of the scanner.
    pub frame_id: String,
    /// The number of columns.
    pub columns: usize,
    /// The number of lasers.
    pub rings: usize,
    /// The points, row by row. Each is in the frame of the scanner at the time of its shot: motion of the platform distorts
    /// the cloud.
    pub points: Vec<VelodynePoint>,
    /// The object of each point; 0 for the static scene and for shots without a return.
    pub labels: Vec<u16>,
}

/// The measurement of one shot of a laser.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct VelodynePoint {
    /// The position in the scanner's frame at the time of the shot; NaN without a return.
    pub position_m: [f32; 3],
    /// 0 to 100 for a reflectivity of 0 to 1, as from the calibrated scanner.
    pub intensity: f32,
    /// The index of the laser, from the lowest, 0, to the highest.
    pub ring: u16,
    /// The time of the shot, in seconds since the stamp.
    pub time_s: f32,
}

impl VelodynePoint {
    /// Whether there was a return.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        self.position_m.iter().all(|value| value.is_finite())
    }
}

/// The intensity of a target of reflectivity 1.
const FULL_INTENSITY: f64 = 100.0;
/// The variation of the returned light between shots.
const STRENGTH_FLUTTER: f64 = 0.2;
/// Columns measured by one thread at a time.
const CHUNK_COLUMNS: usize = 64;

/// The other inputs of a revolution.
pub(crate) struct VelodyneView<'a> {
    pub(crate) seed: u64,
    pub(crate) start: Stamp,
    pub(crate) path: &'a Path,
    pub(crate) scene: &'a Scene,
    pub(crate) still: &'a StillSolids,
    pub(crate) executor: &'a dyn Executor,
}

impl Velodyne {
    /// The start of a revolution, in seconds since the start of the scenario.
    pub(crate) fn turn_start_s(&self, turn: u64) -> f64 {
        turn as f64 / self.turn_rate_hz
    }

    /// Columns per revolution.
    #[must_use]
    pub fn columns(&self) -> usize {
        (1.0 / (self.turn_rate_hz * self.model.firing_period_s())).floor().max(1.0) as usize
    }

    pub(crate) fn turn(&self, view: &VelodyneView<'_>, turn: u64) -> VelodyneTurn {
        let lasers = self.model.lasers();
        let (columns, rings) = (self.columns(), lasers.len());
        let nothing = Shot { point: self.nothing(0, 0.0), label: STATIC_ID };
        // Column by column, in the order of the rotation.
        let mut shots = vec![nothing; columns * rings];
        let chunks = shots.chunks_mut((CHUNK_COLUMNS * rings).max(1)).enumerate();
        let mut chunks: Vec<(usize, &mut [Shot])> = chunks.collect();
        for_each(view.executor, &mut chunks, |(chunk, shots)| {
            for (index, column) in shots.chunks_mut(rings.max(1)).enumerate() {
                self.fire(view, turn, *chunk * CHUNK_COLUMNS + index, &lasers, column);
            }
        });
        let by_rows = (0..rings)
            .flat_map(|ring| (0..columns).map(move |column| column * rings + ring))
            .filter_map(|index| shots.get(index));
        let (points, labels) = by_rows.map(|shot| (shot.point, shot.label)).unzip();
        VelodyneTurn {
            stamp: view.start.plus_seconds(self.turn_start_s(turn)),
            frame_id: self.frame_id.clone(),
            columns,
            rings,
            points,
            labels,
        }
    }

    /// One firing of all lasers; `shots` are by rings.
    fn fire(
        &self,
        view: &VelodyneView<'_>,
        turn: u64,
        column: usize,
        lasers: &[Laser],
        shots: &mut [Shot],
    ) {
        let after_s = column as f64 * self.model.firing_period_s();
        let time_s = self.turn_start_s(turn) + after_s;
        // A firing takes 50 us: at 20 m/s the scanner moves by a millimetre.
        let room_from_velodyne =
            view.path.pose_at(time_s) * pose_from_vector(&self.rig_from_velodyne);
        let moving = view.scene.moving_solids(time_s);
        let noise = FrameNoise::new(view.seed, Stream::VelodyneRange, turn);
        for laser in lasers {
            let shot_s = after_s + laser.delay_s;
            // Seen from above it rotates clockwise; it starts and ends behind.
            let azimuth_rad =
                std::f64::consts::PI - std::f64::consts::TAU * shot_s * self.turn_rate_hz;
            let (sin, cos) = laser.elevation_rad.sin_cos();
            let direction = Vector3::new(cos * azimuth_rad.cos(), cos * azimuth_rad.sin(), sin);
            let ray = Ray {
                origin: room_from_velodyne * Point3::origin(),
                direction: room_from_velodyne * direction,
            };
            let draw = |which: usize| {
                noise.draw(2 * (column * lasers.len() + usize::from(laser.ring)) + which)
            };
            let Some(shot) = shots.get_mut(usize::from(laser.ring)) else { continue };
            *shot = Shot { point: self.nothing(laser.ring, shot_s), label: STATIC_ID };
            let Some(sighting) = view.still.nearest_sighting(&moving, &ray, self.min_signal) else {
                continue;
            };
            let chance = f64::from(draw(0).uniform());
            let needed = 1.0 + STRENGTH_FLUTTER * (chance - 0.5);
            if chance < self.dropout_ratio || sighting.strength < needed {
                continue;
            }
            let noisy_m = sighting.distance_m + self.range_noise_m * f64::from(draw(0).normal());
            let range_m = (noisy_m / self.range_step_m).round() * self.range_step_m;
            if range_m < self.range_min_m || range_m > self.range_max_m {
                continue;
            }
            let brightness = 1.0 + self.intensity_noise * f64::from(draw(1).normal());
            let intensity = (sighting.brightness * FULL_INTENSITY * brightness).round();
            shot.point.position_m = (direction * range_m).map(|value| value as f32).into();
            shot.point.intensity = intensity.clamp(0.0, 255.0) as f32;
            shot.label = sighting.id;
        }
    }

    fn nothing(&self, ring: u16, time_s: f64) -> VelodynePoint {
        VelodynePoint { position_m: [f32::NAN; 3], intensity: 0.0, ring, time_s: time_s as f32 }
    }
}

#[derive(Clone, Copy)]
struct Shot {
    point: VelodynePoint,
    label: u16,
}

/// One laser of a scanner.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Laser {
    /// The elevation above the horizon.
    pub(crate) elevation_rad: f64,
    /// The delay of its shot after the first laser's.
    pub(crate) delay_s: f64,
    /// The index from the lowest, 0, to the highest.
    pub(crate) ring: u16,
}

#[cfg(test)]
mod tests;
