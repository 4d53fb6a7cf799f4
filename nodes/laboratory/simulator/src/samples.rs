//! The output of a scenario: the sensors' readings in the order of their stamps.

mod images;

use std::collections::VecDeque;
use std::sync::Arc;

use estimation::{Executor, Serial};
use geometry::{CameraModel, DepthImage, LabelImage, Scan, Stamp, StampedPose};

use crate::colour_image::ColourSensor;
use crate::depth_image::{Canvas, Sensor};
use crate::imu::ImuReader;
use crate::lidar::LidarView;
use crate::solid::Solid;
use crate::still::StillSolids;
use crate::velodyne::VelodyneView;
use crate::wheels::WheelReader;
use crate::{
    ColourImage, ImuReading, ObjectPoses, Scenario, ScenarioError, VelodyneTurn, WheelReading,
};

/// One reading with its ground truth.
#[derive(Clone, PartialEq, Debug)]
pub enum Sample {
    /// The pose of the rig.
    Pose(StampedPose),
    /// The camera's intrinsics; published with every depth image, just before it.
    CameraInfo {
        /// The stamp of the depth image.
        stamp: Stamp,
        /// The optical frame.
        frame_id: String,
        /// Size and intrinsics.
        camera: CameraModel,
    },
    /// A depth image in millimetres.
    Depth {
        /// The measurement.
        image: DepthImage,
        /// The object of each measured pixel; 0 for the static scene and for pixels without a measurement.
        labels: LabelImage,
    },
    /// The poses of the objects at the depth image before it.
    ObjectPoses(ObjectPoses),
    /// The true pose of the rig, whose origin is the depth camera's, at the next sample: a colour image, or the first shot
    /// of a revolution of the 3D scanner.
    TruePose(StampedPose),
    /// The intrinsics of the colour camera; published with every colour image, just before it.
    ColourCameraInfo {
        /// The stamp of the colour image.
        stamp: Stamp,
        /// The optical frame.
        frame_id: String,
        /// Size and intrinsics.
        camera: CameraModel,
    },
    /// A colour image.
    Colour(ColourImage),
    /// A reading of the IMU.
    Imu(ImuReading),
    /// A reading of the wheel odometry.
    Wheels(WheelReading),
    /// A revolution of the 3D scanner, stamped with its start; the true pose of that time comes just before it.
    Velodyne(VelodyneTurn),
    /// A revolution of the scanner, stamped with its start.
    Scan {
        /// The measurement.
        scan: Scan,
        /// The object of each beam; 0 for the static scene and for beams without a measurement.
        labels: Vec<u16>,
    },
}

impl Sample {
    /// The time of the measurement.
    #[must_use]
    pub fn stamp(&self) -> Stamp {
        match self {
            Self::Pose(pose) | Self::TruePose(pose) => pose.stamp,
            Self::CameraInfo { stamp, .. } | Self::ColourCameraInfo { stamp, .. } => *stamp,
            Self::Colour(image) => image.stamp,
            Self::Imu(reading) => reading.stamp,
            Self::Wheels(reading) => reading.stamp,
            Self::Velodyne(turn) => turn.stamp,
            Self::Depth { image, .. } => image.stamp,
            Self::ObjectPoses(poses) => poses.stamp,
            Self::Scan { scan, .. } => scan.stamp,
        }
    }
}

/// The samples of a scenario, in the order of their stamps. At one stamp the order is pose, camera info,
/// depth image, object poses, true pose, colour camera info, colour image,
/// inertial unit, wheels, scan, true pose, 3D scan.
///
/// A revolution of the scanner that is incomplete at the end is not published, as with a real driver; so the last scan
/// always has depth images and poses after it.
#[derive(Debug)]
pub struct Samples {
    scenario: Scenario,
    statics: Vec<Solid>,
    sensor: Sensor,
    colour_sensor: Option<ColourSensor>,
    /// For the 3D scanner.
    still: Option<StillSolids>,
    next_velodyne: u64,
    imu: Option<ImuReader>,
    wheels: Option<WheelReader>,
    executor: Arc<dyn Executor>,
    /// The static opaque scene, drawn once, when the rig does not move.
    still_background: Option<Canvas>,
    next_pose: u64,
    next_image: u64,
    next_colour: u64,
    next_turn: u64,
    ready: VecDeque<Sample>,
}

impl Samples {
    pub(crate) fn new(scenario: &Scenario) -> Result<Self, ScenarioError> {
        scenario.validate()?;
        let rig = &scenario.rig;
        let mut samples = Self {
            statics: scenario.scene.static_solids(),
            sensor: Sensor::new(&rig.depth_camera),
            colour_sensor: rig
                .colour_camera
                .as_ref()
                .map(|config| ColourSensor::new(config, config.model(&rig.depth_camera))),
            still: rig.velodyne.as_ref().map(|_| StillSolids::new(&scenario.scene.static_solids())),
            next_velodyne: 0,
            imu: rig.imu.as_ref().map(|config| ImuReader::new(config, scenario.seed)),
            wheels: rig.wheels.as_ref().map(|config| WheelReader::new(config, scenario.seed)),
            executor: Arc::new(Serial),
            still_background: None,
            next_pose: 0,
            next_image: 0,
            next_colour: 0,
            next_turn: 0,
            ready: VecDeque::new(),
            scenario: scenario.clone(),
        };
        if rig.path.is_still() {
            samples.still_background = Some(samples.background(&samples.room_from_camera(0.0)));
        }
        Ok(samples)
    }

    /// Uses this executor to draw images; the samples are the same with any number of threads.
    #[must_use]
    pub fn with_executor(self, executor: Arc<dyn Executor>) -> Self {
        Self { executor, ..self }
    }

    fn pose(&self, frame: u64, time_s: f64) -> StampedPose {
        let source = &self.scenario.rig.pose_source;
        let rig_from_noisy_rig = source.rig_from_published_rig(self.scenario.seed, frame);
        let truth = self.true_pose(self.scenario.start.plus_seconds(time_s), time_s);
        StampedPose { map_from_rig: truth.map_from_rig * rig_from_noisy_rig, ..truth }
    }

    /// The pose of the rig at a time, in seconds since the start.
    fn true_pose(&self, stamp: Stamp, time_s: f64) -> StampedPose {
        StampedPose {
            stamp,
            frame_id: self.scenario.rig.pose_source.map_frame_id.clone(),
            map_from_rig: self.scenario.map_from_rig(time_s),
        }
    }

    fn turn(&self, turn: u64) -> Sample {
        let view = LidarView {
            seed: self.scenario.seed,
            start: self.scenario.start,
            path: &self.scenario.rig.path,
            scene: &self.scenario.scene,
            statics: &self.statics,
        };
        let (scan, labels) = self.scenario.rig.lidar.scan(&view, turn);
        Sample::Scan { scan, labels }
    }

    /// The start of the next revolution of the 3D scanner, if it is complete before the end.
    fn velodyne_s(&self) -> f64 {
        let Some(config) = &self.scenario.rig.velodyne else { return f64::INFINITY };
        let complete = config.turn_start_s(self.next_velodyne + 1) <= self.scenario.duration_s;
        if complete { config.turn_start_s(self.next_velodyne) } else { f64::INFINITY }
    }

    /// A revolution of the 3D scanner, with the true pose at its start before it.
    fn velodyne(&self, turn: u64) -> Option<[Sample; 2]> {
        let rig = &self.scenario.rig;
        let config = rig.velodyne.as_ref()?;
        let view = VelodyneView {
            seed: self.scenario.seed,
            start: self.scenario.start,
            path: &rig.path,
            scene: &self.scenario.scene,
            still: self.still.as_ref()?,
            executor: &*self.executor,
        };
        let turned = config.turn(&view, turn);
        let truth = self.true_pose(turned.stamp, config.turn_start_s(turn));
        Some([Sample::TruePose(truth), Sample::Velodyne(turned)])
    }

    /// The next time of each kind of sample, in their order at equal stamps; infinite for kinds without further samples.
    fn due_s(&self) -> [(Kind, f64); 7] {
        let rig = &self.scenario.rig;
        let turn_start = |turn| rig.lidar.turn_start_s(self.scenario.seed, turn);
        let scan_s = if turn_start(self.next_turn + 1) <= self.scenario.duration_s {
            rig.lidar.turn_stamp_s(self.scenario.seed, self.next_turn)
        } else {
            f64::INFINITY
        };
        [
            (Kind::Pose, self.next_pose as f64 / rig.pose_source.rate_hz),
            (Kind::Image, self.image_stamp_s(self.next_image)),
            (Kind::Colour, self.colour_stamp_s(self.next_colour)),
            (Kind::Imu, self.imu.as_ref().map_or(f64::INFINITY, ImuReader::next_s)),
            (Kind::Wheels, self.wheels.as_ref().map_or(f64::INFINITY, WheelReader::next_s)),
            (Kind::Scan, scan_s),
            (Kind::Velodyne, self.velodyne_s()),
        ]
    }

    /// Generates the samples of the next time; false at the end.
    fn advance(&mut self) -> bool {
        let due_s = self.due_s();
        let first_s = due_s.iter().map(|(_, time_s)| *time_s).fold(f64::INFINITY, f64::min);
        if first_s > self.scenario.duration_s {
            return false;
        }
        // In the order of the stamps, which are whole nanoseconds.
        let stamp = |time_s: f64| self.scenario.start.plus_seconds(time_s);
        let first = due_s.iter().find(|(_, time_s)| stamp(*time_s) == stamp(first_s));
        let (path, start) = (&self.scenario.rig.path, self.scenario.start);
        match first {
            Some((Kind::Pose, time_s)) => {
                self.ready.push_back(Sample::Pose(self.pose(self.next_pose, *time_s)));
                self.next_pose += 1;
            }
            Some((Kind::Image, _)) => {
                self.ready.extend(self.image(self.next_image).into_iter().flatten());
                self.next_image += 1;
            }
            Some((Kind::Colour, _)) => {
                self.ready.extend(self.colour(self.next_colour).into_iter().flatten());
                self.next_colour += 1;
            }
            Some((Kind::Imu, _)) => {
                let reading = self.imu.as_mut().map(|imu| imu.read(path, start));
                self.ready.extend(reading.map(Sample::Imu));
            }
            Some((Kind::Wheels, _)) => {
                let reading = self.wheels.as_mut().map(|wheels| wheels.read(path, start));
                self.ready.extend(reading.map(Sample::Wheels));
            }
            Some((Kind::Velodyne, _)) => {
                self.ready.extend(self.velodyne(self.next_velodyne).into_iter().flatten());
                self.next_velodyne += 1;
            }
            Some((Kind::Scan, _)) | None => {
                self.ready.push_back(self.turn(self.next_turn));
                self.next_turn += 1;
            }
        }
        true
    }
}

/// The kinds of samples with their own rate.
#[derive(Clone, Copy)]
enum Kind {
    Pose,
    Image,
    Colour,
    Imu,
    Wheels,
    Scan,
    Velodyne,
}

impl Iterator for Samples {
    type Item = Sample;

    fn next(&mut self) -> Option<Sample> {
        while self.ready.is_empty() {
            if !self.advance() {
                return None;
            }
        }
        self.ready.pop_front()
    }
}

#[cfg(test)]
mod tests;
