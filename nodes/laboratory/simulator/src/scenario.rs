//! All inputs of a simulation.

use estimation::Serial;
use geometry::{Cloud, Stamp, pose_from_vector};
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use crate::depth_image::{Canvas, Sensor};
use crate::noise::{FrameNoise, Stream};
use crate::{
    Figure, MeshError, PoseSource, Rig, Samples, ScenarioError, Scene, Shape, StampError, Triangles,
};

/// A scene, a rig, a duration and a seed. The same scenario gives the same samples, bit for bit.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// The name.
    pub name: String,
    /// The seed of all noise.
    pub seed: u64,
    /// The stamp of the start.
    pub start: Stamp,
    /// The duration.
    pub duration_s: f64,
    /// The scene.
    pub scene: Scene,
    /// The platform and its sensors.
    pub rig: Rig,
}

/// The default stamp of the start: a moment of 2023, since drivers stamp with the wall clock.
pub(crate) const START: Stamp = Stamp::from_secs_nanos(1_700_000_000, 0);

impl Default for Scenario {
    /// Ten seconds of an empty scene, with the rig of [`Rig::default`].
    fn default() -> Self {
        Self {
            name: "scenario".to_owned(),
            seed: 1,
            start: START,
            duration_s: 10.0,
            scene: Scene::default(),
            rig: Rig::default(),
        }
    }
}

impl Scenario {
    /// With another seed: the same scene with other noise.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// With depth images of another size, over the same field of view.
    #[must_use]
    pub fn with_depth_size(mut self, width_px: usize, height_px: usize) -> Self {
        self.rig.depth_camera = self.rig.depth_camera.with_size(width_px, height_px);
        self
    }

    /// With another duration; the times of the paths stay the same.
    #[must_use]
    pub fn with_duration_s(mut self, duration_s: f64) -> Self {
        self.duration_s = duration_s;
        self
    }

    /// With another stamp of the start.
    #[must_use]
    pub fn starting_at(mut self, start: Stamp) -> Self {
        self.start = start;
        self
    }

    /// With noise on the published pose: standard deviations of each coordinate and about each axis.
    #[must_use]
    pub fn with_pose_noise(mut self, position_noise_m: f64, rotation_noise_rad: f64) -> Self {
        let pose_source =
            PoseSource { position_noise_m, rotation_noise_rad, ..self.rig.pose_source };
        self.rig.pose_source = pose_source;
        self
    }

    /// With the depth camera's clock ahead of the scanner's and the pose's by `skew_s` (behind when
    /// negative), and with stamps of both sensors that deviate by `jitter_s`.
    #[must_use]
    pub fn with_stamp_errors(mut self, skew_s: f64, jitter_s: f64) -> Self {
        self.rig.depth_camera.stamps = StampError { skew_s, jitter_s };
        self.rig.lidar.stamps = StampError { skew_s: 0.0, jitter_s };
        self
    }

    /// With an error of the scanner's mount: each coordinate, and the rotation about each axis, has a random error (by the
    /// seed) with these standard deviations.
    #[must_use]
    pub fn with_mounting_error(mut self, position_m: f64, rotation_rad: f64) -> Self {
        let noise = FrameNoise::new(self.seed, Stream::Mounting, 0);
        for (axis, value) in self.rig.lidar.rig_from_lidar.iter_mut().enumerate() {
            let std_dev = if axis < 3 { position_m } else { rotation_rad };
            *value += std_dev * f64::from(noise.draw(axis).normal());
        }
        self
    }

    /// With the triangles of all mesh files of the scene; `read` returns the vertices and triangles of a file.
    ///
    /// # Errors
    /// Those of `read`, or when the triangles are invalid.
    pub fn with_meshes<E: From<MeshError>>(
        mut self,
        mut read: impl FnMut(&str) -> Result<Triangles, E>,
    ) -> Result<Self, E> {
        let moving = self.scene.objects.iter_mut().filter_map(|object| match &mut object.figure {
            Figure::Rigid(bodies) => Some(bodies),
            Figure::Walker(_) => None,
        });
        for body in self.scene.bodies.iter_mut().chain(moving.flatten()) {
            if let Shape::Mesh(mesh) = &mut body.shape
                && let Some(file) = mesh.missing_file()
            {
                let (vertices_m, triangles) = read(file)?;
                *mesh = mesh.filled(vertices_m, triangles)?;
            }
        }
        Ok(self)
    }

    /// Without moving objects.
    #[must_use]
    pub fn without_objects(self) -> Self {
        self.with_only_objects(&[])
    }

    /// With only the objects of these ids.
    #[must_use]
    pub fn with_only_objects(mut self, ids: &[u16]) -> Self {
        self.scene.objects.retain(|object| ids.contains(&object.id));
        self
    }

    /// Everything that the sensors publish, in the order of the stamps, with the ground truth. Computed lazily.
    ///
    /// # Errors
    /// When the scenario cannot be simulated; see [`Scenario::validate`].
    pub fn samples(&self) -> Result<Samples, ScenarioError> {
        Samples::new(self)
    }

    /// The transform from the room to the map, which is the rig's frame at the start.
    #[must_use]
    pub fn map_from_room(&self) -> Isometry3<f64> {
        self.rig.path.pose_at(0.0).inverse()
    }

    /// The true pose of the rig in the map at a time, in seconds since the start.
    #[must_use]
    pub fn map_from_rig(&self, time_s: f64) -> Isometry3<f64> {
        self.map_from_room() * self.rig.path.pose_at(time_s)
    }

    /// The true surface of the room without moving objects, in the map frame: a point for every pixel that a depth camera
    /// without noise would measure. For a moving rig there is one view per second, but at most 100, which bounds the
    /// cloud.
    ///
    /// # Errors
    /// When the scenario cannot be simulated; see [`Scenario::validate`].
    pub fn static_scene_cloud(&self) -> Result<Cloud, ScenarioError> {
        const MAX_LOOKS: f64 = 100.0;
        self.validate()?;
        let config = &self.rig.depth_camera;
        let sensor = Sensor::new(config);
        let solids = self.scene.static_solids();
        let still = self.rig.path.is_still();
        let period_s = (self.duration_s / MAX_LOOKS).max(1.0);
        let looks = if still { 0 } else { (self.duration_s / period_s) as u32 };
        let mut points_m = Vec::new();
        for look in 0..=looks {
            let room_from_camera = self.rig.path.pose_at(f64::from(look) * period_s)
                * pose_from_vector(&config.rig_from_camera);
            let map_from_camera = self.map_from_room() * room_from_camera;
            let mut canvas = Canvas::new(&config.camera);
            canvas.draw(
                &config.camera,
                &room_from_camera,
                solids.iter(),
                config.min_signal,
                &Serial,
            );
            points_m.extend(
                sensor
                    .measurable(&canvas)
                    .into_iter()
                    .filter_map(|index| canvas.point_m(&config.camera, index))
                    .map(|point| (map_from_camera * point).cast::<f32>()),
            );
        }
        let frame_id = self.rig.pose_source.map_frame_id.clone();
        Ok(Cloud { stamp: self.start, frame_id, points_m })
    }
}
