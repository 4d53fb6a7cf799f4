//! What comes out of a scenario: the sensors' readings in the order of their stamps.

use std::collections::VecDeque;

use geometry::{
    CameraModel, DepthImage, DepthPixels, LabelImage, Scan, Stamp, StampedPose, pose_from_vector,
};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::depth_image::{Canvas, Reading, Sensor};
use crate::lidar::LidarView;
use crate::noise::{FrameNoise, Stream};
use crate::solid::Solid;
use crate::truth::Hull;
use crate::{ObjectPose, ObjectPoses, Scenario, ScenarioError};

/// One reading, with the truth beside it.
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
        /// What was measured.
        image: DepthImage,
        /// Which object each measured pixel shows; 0 for what never moves and where nothing was measured.
        labels: LabelImage,
    },
    /// Where the objects were when the depth image before it was taken.
    ObjectPoses(ObjectPoses),
    /// A turn of the scanner, stamped with its start.
    Scan {
        /// What was measured.
        scan: Scan,
        /// Which object each beam met; 0 for what never moves and where nothing was measured.
        labels: Vec<u16>,
    },
}

impl Sample {
    /// When it was measured.
    #[must_use]
    pub fn stamp(&self) -> Stamp {
        match self {
            Self::Pose(pose) => pose.stamp,
            Self::CameraInfo { stamp, .. } => *stamp,
            Self::Depth { image, .. } => image.stamp,
            Self::ObjectPoses(poses) => poses.stamp,
            Self::Scan { scan, .. } => scan.stamp,
        }
    }
}

/// The samples of a scenario, in the order of their stamps. At one stamp the order is pose, camera info,
/// depth image, object poses, scan.
///
/// A turn of the scanner that is not complete at the end is not published, as a driver would not; so the
/// last scan always has depth images and poses after it.
#[derive(Debug)]
pub struct Samples {
    scenario: Scenario,
    statics: Vec<Solid>,
    sensor: Sensor,
    /// What never moves and is no pane, drawn once, where the rig stands still.
    still_background: Option<Canvas>,
    next_pose: u64,
    next_image: u64,
    next_turn: u64,
    ready: VecDeque<Sample>,
}

impl Samples {
    pub(crate) fn new(scenario: &Scenario) -> Result<Self, ScenarioError> {
        scenario.validate()?;
        let mut samples = Self {
            statics: scenario.scene.static_solids(),
            sensor: Sensor::new(&scenario.rig.depth_camera),
            still_background: None,
            next_pose: 0,
            next_image: 0,
            next_turn: 0,
            ready: VecDeque::new(),
            scenario: scenario.clone(),
        };
        if scenario.rig.path.is_still() {
            samples.still_background = Some(samples.background(&samples.room_from_camera(0.0)));
        }
        Ok(samples)
    }

    fn room_from_camera(&self, time_s: f64) -> Isometry3<f64> {
        let rig = &self.scenario.rig;
        rig.path.pose_at(time_s) * pose_from_vector(&rig.depth_camera.rig_from_camera)
    }

    fn background(&self, room_from_camera: &Isometry3<f64>) -> Canvas {
        let config = &self.scenario.rig.depth_camera;
        let mut canvas = Canvas::new(&config.camera);
        for solid in self.statics.iter().filter(|solid| !solid.is_pane()) {
            canvas.draw(&config.camera, room_from_camera, solid, config.min_signal);
        }
        canvas
    }

    fn pose(&self, frame: u64, time_s: f64) -> StampedPose {
        let source = &self.scenario.rig.pose_source;
        let noise = FrameNoise::new(self.scenario.seed, Stream::Pose, frame);
        let error = |first: usize, std_dev: f64| {
            Vector3::from_fn(|axis, _| std_dev * f64::from(noise.draw(first + axis).normal()))
        };
        let rig_from_noisy_rig =
            Isometry3::new(error(0, source.position_noise_m), error(3, source.rotation_noise_rad));
        StampedPose {
            stamp: self.scenario.start.plus_seconds(time_s),
            frame_id: source.map_frame_id.clone(),
            map_from_rig: self.scenario.map_from_rig(time_s) * rig_from_noisy_rig,
        }
    }

    /// When an image is taken, in seconds since the start.
    fn image_s(&self, frame: u64) -> f64 {
        let config = &self.scenario.rig.depth_camera;
        config.first_image_s + frame as f64 / config.rate_hz
    }

    /// What it is stamped with.
    fn image_stamp_s(&self, frame: u64) -> f64 {
        let stamps = self.scenario.rig.depth_camera.stamps;
        self.image_s(frame) + stamps.at(self.scenario.seed, Stream::ImageStamp, frame)
    }

    /// A depth image, the camera info before it and the object poses after it.
    fn image(&self, frame: u64) -> Option<[Sample; 3]> {
        let config = &self.scenario.rig.depth_camera;
        let camera = config.camera;
        let time_s = self.image_s(frame);
        let stamp = self.scenario.start.plus_seconds(self.image_stamp_s(frame));
        let room_from_camera = self.room_from_camera(time_s);
        let mut canvas = match &self.still_background {
            Some(background) => background.clone(),
            None => self.background(&room_from_camera),
        };
        let moving = self.scenario.scene.moving_solids(time_s);
        let static_panes = self.statics.iter().filter(|solid| solid.is_pane());
        let solids = moving.iter().chain(static_panes);
        canvas.draw_all(&camera, &room_from_camera, solids, config.min_signal);
        let noise = FrameNoise::new(self.scenario.seed, Stream::DepthPixel, frame);
        let reading = self.sensor.read(&canvas, &noise);
        let truth = self.object_poses(stamp, time_s, &canvas, &reading);
        let size_px = (camera.width_px, camera.height_px);
        let pixels = DepthPixels::Millimetres(reading.depth_mm);
        // Both hold a value a pixel, so neither can be refused.
        let image = DepthImage::new(stamp, config.frame_id.clone(), size_px, pixels).ok()?;
        let labels =
            LabelImage::new(stamp, config.frame_id.clone(), size_px, reading.labels).ok()?;
        Some([
            Sample::CameraInfo { stamp, frame_id: config.frame_id.clone(), camera },
            Sample::Depth { image, labels },
            Sample::ObjectPoses(truth),
        ])
    }

    fn object_poses(
        &self,
        stamp: Stamp,
        time_s: f64,
        canvas: &Canvas,
        reading: &Reading,
    ) -> ObjectPoses {
        let objects = &self.scenario.scene.objects;
        let camera = &self.scenario.rig.depth_camera.camera;
        let map_from_room = self.scenario.map_from_room();
        let map_from_camera = map_from_room * self.room_from_camera(time_s);
        let mut seen = vec![(0_usize, Vector3::zeros()); objects.len()];
        for (index, &label) in reading.labels.iter().enumerate().filter(|(_, label)| **label > 0) {
            let object = objects.iter().position(|object| object.id == label);
            if let (Some(object), Some(point)) = (object, canvas.point_m(camera, index)) {
                seen[object].0 += 1;
                seen[object].1 += point.coords;
            }
        }
        let objects = objects
            .iter()
            .zip(seen)
            .map(|(object, (visible_pixels, sum))| {
                let hull = Hull::of(&object.solids(time_s), &map_from_room);
                ObjectPose {
                    id: object.id,
                    name: object.name.clone(),
                    map_from_object: map_from_room * object.room_from_object(time_s),
                    centre_m: hull.centre_m,
                    extent_m: hull.extent_m,
                    velocity_m_per_s: object.velocity_of(time_s, &map_from_room, &hull.centre_m),
                    visible_pixels,
                    visible_centroid_m: (visible_pixels > 0)
                        .then(|| map_from_camera * Point3::from(sum / visible_pixels as f64)),
                }
            })
            .collect();
        let frame_id = self.scenario.rig.pose_source.map_frame_id.clone();
        ObjectPoses { stamp, frame_id, objects }
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

    /// Makes the samples of the next moment; false at the end.
    fn advance(&mut self) -> bool {
        let rig = &self.scenario.rig;
        let pose_s = self.next_pose as f64 / rig.pose_source.rate_hz;
        let image_s = self.image_stamp_s(self.next_image);
        let turn_start = |turn| rig.lidar.turn_start_s(self.scenario.seed, turn);
        let scan_s = if turn_start(self.next_turn + 1) <= self.scenario.duration_s {
            rig.lidar.turn_stamp_s(self.scenario.seed, self.next_turn)
        } else {
            f64::INFINITY
        };
        // The order is that of the stamps, which are whole nanoseconds.
        let stamp = |time_s: f64| self.scenario.start.plus_seconds(time_s);
        let first_s = pose_s.min(image_s).min(scan_s);
        if first_s > self.scenario.duration_s {
            return false;
        }
        let is_first = |time_s: f64| stamp(time_s) == stamp(first_s);
        if is_first(pose_s) {
            self.ready.push_back(Sample::Pose(self.pose(self.next_pose, pose_s)));
            self.next_pose += 1;
        } else if is_first(image_s) {
            self.ready.extend(self.image(self.next_image).into_iter().flatten());
            self.next_image += 1;
        } else {
            self.ready.push_back(self.turn(self.next_turn));
            self.next_turn += 1;
        }
        true
    }
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
