//! The images of one time, with their ground truth.

use geometry::{DepthImage, DepthPixels, LabelImage, Stamp, pose_from_vector};
use nalgebra::{Isometry3, Point3, Vector3};

use super::{Sample, Samples};
use crate::colour_image::Moment;
use crate::depth_image::{Canvas, Reading};
use crate::noise::{FrameNoise, Stream};
use crate::truth::Hull;
use crate::{ColourImage, DepthEncoding, ObjectPose, ObjectPoses};

impl Samples {
    pub(super) fn room_from_camera(&self, time_s: f64) -> Isometry3<f64> {
        let rig = &self.scenario.rig;
        rig.path.pose_at(time_s) * pose_from_vector(&rig.depth_camera.rig_from_camera)
    }

    pub(super) fn background(&self, room_from_camera: &Isometry3<f64>) -> Canvas {
        let config = &self.scenario.rig.depth_camera;
        let mut canvas = Canvas::new(&config.camera);
        let solids = self.statics.iter().filter(|solid| !solid.is_pane());
        canvas.draw(&config.camera, room_from_camera, solids, config.min_signal, &*self.executor);
        canvas
    }

    /// The time of an image, in seconds since the start.
    pub(super) fn image_s(&self, frame: u64) -> f64 {
        let config = &self.scenario.rig.depth_camera;
        config.first_image_s + frame as f64 / config.rate_hz
    }

    /// Its stamp.
    pub(super) fn image_stamp_s(&self, frame: u64) -> f64 {
        let stamps = self.scenario.rig.depth_camera.stamps;
        self.image_s(frame) + stamps.at(self.scenario.seed, Stream::ImageStamp, frame)
    }

    /// A depth image, the camera info before it and the object poses after it.
    pub(super) fn image(&self, frame: u64) -> Option<[Sample; 3]> {
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
        canvas.draw(&camera, &room_from_camera, solids, config.min_signal, &*self.executor);
        let noise = FrameNoise::new(self.scenario.seed, Stream::DepthPixel, frame);
        let reading = self.sensor.read(&canvas, &noise);
        let truth = self.object_poses(stamp, time_s, &canvas, &reading);
        let size_px = (camera.width_px, camera.height_px);
        let pixels = match config.encoding {
            DepthEncoding::Millimetres => DepthPixels::Millimetres(reading.depth_mm),
            DepthEncoding::Metres => {
                let none_m = config.no_return.value();
                let metres = |mm: &u16| if *mm == 0 { none_m } else { f32::from(*mm) * 1e-3 };
                DepthPixels::Metres(reading.depth_mm.iter().map(metres).collect())
            }
        };
        // Both have one value per pixel, so neither can be rejected.
        let image = DepthImage::new(stamp, config.frame_id.clone(), size_px, pixels).ok()?;
        let labels =
            LabelImage::new(stamp, config.frame_id.clone(), size_px, reading.labels).ok()?;
        Some([
            Sample::CameraInfo { stamp, frame_id: config.frame_id.clone(), camera },
            Sample::Depth { image, labels },
            Sample::ObjectPoses(truth),
        ])
    }

    pub(super) fn object_poses(
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

    /// The stamp of a colour image, in seconds since the start; infinite without a colour camera.
    pub(super) fn colour_stamp_s(&self, frame: u64) -> f64 {
        let delay_s = self.scenario.rig.colour_camera.as_ref().map(|config| config.delay_s);
        delay_s.map_or(f64::INFINITY, |delay_s| self.image_stamp_s(frame) + delay_s)
    }

    /// A colour image, preceded by its true pose and its camera info.
    pub(super) fn colour(&self, frame: u64) -> Option<[Sample; 3]> {
        let rig = &self.scenario.rig;
        let config = rig.colour_camera.as_ref()?;
        let camera = config.model(&rig.depth_camera);
        let frame_id = config.image_frame_id(&rig.depth_camera).to_owned();
        let time_s = self.image_s(frame) + config.delay_s;
        let stamp = self.scenario.start.plus_seconds(self.colour_stamp_s(frame));
        let rig_from_camera = pose_from_vector(&config.mounting(&rig.depth_camera));
        let count = config.sub_exposures.max(1);
        let moments: Vec<Moment> = (0..count)
            .map(|moment| {
                let share = (moment as f64 + 0.5) / count as f64 - 0.5;
                let time_s = time_s + share * config.exposure_s;
                Moment {
                    room_from_camera: rig.path.pose_at(time_s) * rig_from_camera,
                    moving: self.scenario.scene.moving_solids(time_s),
                }
            })
            .collect();
        let rgb = self.colour_sensor.as_ref()?.take(
            &self.statics,
            &moments,
            &self.scenario.scene.lighting.at(time_s),
            (self.scenario.seed, frame),
            &*self.executor,
        );
        let image = ColourImage {
            stamp,
            frame_id: frame_id.clone(),
            width_px: camera.width_px,
            height_px: camera.height_px,
            rgb,
        };
        Some([
            Sample::TruePose(self.true_pose(stamp, time_s)),
            Sample::ColourCameraInfo { stamp, frame_id, camera },
            Sample::Colour(image),
        ])
    }
}
