//! A point of the map.

use geometry::CameraModel;
use nalgebra::{Isometry3, Matrix3, Point2, Point3, Vector2, Vector3};

use super::place::{InverseDepth, Place, image_slopes};
use super::{LocalMapConfig, View};
use crate::feature::points::{Corner, Descriptor};
use crate::frame::MeasuredDepth;
use crate::matching::points::PredictedCorner;
use crate::solve::PointObservation;

/// A point that was seen as a corner.
#[derive(Clone, PartialEq, Debug)]
pub struct PointLandmark {
    /// Its number; no other landmark of the same map has ever had it.
    pub id: u64,
    /// Where it is in the map frame.
    pub position_m: Point3<f64>,
    /// The same, with what it may be off by.
    place: Place,
    /// Its descriptor when it was last seen.
    pub descriptor: Descriptor,
    /// From where it was last seen: a unit vector of the map frame from the point to the camera.
    pub towards_camera: Vector3<f64>,
    /// How far from the camera it was then.
    pub distance_m: f64,
    /// On which level of the pyramid it was found then.
    pub level: u8,
    /// Its angle in the image then.
    pub angle_rad: f32,
    /// The frame that saw it last.
    pub seen_in_frame: u64,
    /// The frame that brought it in.
    pub arrival: u64,
    /// Frames that saw it.
    pub seen: u32,
    /// Frames that should have.
    pub expected: u32,
}

/// A corner, with its depth where it has one.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct SeenPoint<'a> {
    pub(super) corner: &'a Corner,
    pub(super) depth: Option<MeasuredDepth>,
}

impl PointLandmark {
    /// A landmark that a corner shows for the first time. Without a depth it is somewhere along the corner's ray.
    pub(super) fn new(
        id: u64,
        seen: SeenPoint<'_>,
        view: &View<'_>,
        config: &LocalMapConfig,
    ) -> Option<Self> {
        let View { camera, camera_from_map, .. } = view;
        let pixel = seen.corner.pixel.cast::<f64>();
        let map_from_camera = camera_from_map.inverse();
        let pixel_std_dev = config.pixel_std_dev_px(seen.corner.level);
        let depth = seen.depth.map_or_else(|| config.unmeasured_depth(), InverseDepth::from);
        let mut place = Place::seen(camera, map_from_camera, &pixel, pixel_std_dev, depth)?;
        let in_camera_m = camera_from_map * place.in_map_m();
        let readout_derivative_m_per_s =
            view.readout_derivative.of_measured(&in_camera_m, pixel.y, camera)
                - view.readout_derivative.of_pose(&in_camera_m);
        place.set_readout_derivative(&(map_from_camera.rotation * readout_derivative_m_per_s));
        let mut landmark = Self {
            id,
            position_m: place.in_map_m(),
            place,
            descriptor: seen.corner.descriptor,
            towards_camera: Vector3::zeros(),
            distance_m: 0.0,
            level: 0,
            angle_rad: 0.0,
            seen_in_frame: view.number,
            arrival: view.number,
            seen: 0,
            expected: 1,
        };
        landmark.look(view.number, seen.corner, &map_from_camera);
        Some(landmark)
    }

    /// Where it should be in an image, as far as a camera there would see it at all.
    pub(super) fn expected(
        &self,
        view: &View<'_>,
        config: &LocalMapConfig,
    ) -> Option<PredictedCorner> {
        let View { camera, camera_from_map, .. } = view;
        let in_camera_m = camera_from_map * self.position_m;
        let pixel = camera.project(&in_camera_m).filter(|pixel| camera.contains(pixel))?;
        let distance_m = in_camera_m.coords.norm();
        let towards_camera =
            -(camera_from_map.rotation.inverse() * in_camera_m.coords) / distance_m;
        if self.towards_camera.dot(&towards_camera) < config.max_viewing_angle_rad.cos() {
            return None;
        }
        let levels_nearer = (self.distance_m / distance_m).ln() / config.pyramid.scale_factor.ln();
        let level = f64::from(self.level) + levels_nearer;
        let top = f64::from(config.pyramid.levels.saturating_sub(1) as u32);
        // A level beyond those that are looked at: too near or too far to be found again.
        (level >= -1.0 && level <= top + 1.0).then(|| PredictedCorner {
            pixel: pixel.cast(),
            level: level.round().clamp(0.0, top) as u8,
            // The turn of the camera is the same for all only since the last frame.
            angle_rad: (self.seen_in_frame + 1 == view.number).then_some(self.angle_rad),
            descriptor: self.descriptor,
        })
    }

    /// Whether what has this depth may be it: neither hides the other.
    pub(super) fn may_lie_at(
        &self,
        depth: Option<&MeasuredDepth>,
        view: &View<'_>,
        config: &LocalMapConfig,
    ) -> bool {
        let Some(depth) = depth.filter(|_| self.is_located(config)) else { return true };
        let depth_m = (view.camera_from_map * self.position_m).z;
        config.may_be_one(depth.depth_m, depth_m)
    }

    /// The observation of the pose by a corner, were it this landmark and its place known.
    pub(super) fn observation_if_known(
        &self,
        seen: SeenPoint<'_>,
        config: &LocalMapConfig,
    ) -> PointObservation {
        PointObservation {
            point_in_map_m: self.position_m,
            pixel_px: seen.corner.pixel.cast(),
            depth_m: seen.depth.map(|depth| depth.depth_m),
            pixel_std_dev_px: config.pixel_std_dev_px(seen.corner.level),
            spread_px: Vector2::zeros(),
            depth_std_dev_m: seen.depth.map_or(0.0, |depth| depth.std_dev_m),
        }
    }

    /// The observation with the uncertainty of the place.
    pub(super) fn observation(
        &self,
        seen: SeenPoint<'_>,
        view: &View<'_>,
        config: &LocalMapConfig,
    ) -> PointObservation {
        let spread = self.place.spread(view);
        let [along_px, across_px] = spread.axes_px();
        let known = self.observation_if_known(seen, config);
        PointObservation {
            pixel_std_dev_px: known.pixel_std_dev_px.hypot(across_px.norm()),
            spread_px: self.place.error_factor(config) * along_px,
            depth_std_dev_m: known.depth_std_dev_m.hypot(spread.depth_std_dev_m),
            ..known
        }
    }

    /// The same where no pose is known: as unsure as it is in the mean of all directions.
    pub(super) fn blind_observation(
        &self,
        seen: SeenPoint<'_>,
        camera: &CameraModel,
        config: &LocalMapConfig,
    ) -> PointObservation {
        let std_dev_m = (self.covariance_m2().trace() / 3.0).sqrt();
        let distance_m = seen.depth.map_or(self.distance_m, |depth| depth.depth_m);
        let known = self.observation_if_known(seen, config);
        PointObservation {
            pixel_std_dev_px: known.pixel_std_dev_px.hypot(std_dev_m * camera.fx_px / distance_m),
            depth_std_dev_m: known.depth_std_dev_m.hypot(std_dev_m),
            ..known
        }
    }

    /// A corner that the pose explains makes its place surer.
    pub(super) fn learn(&mut self, seen: SeenPoint<'_>, view: &View<'_>, config: &LocalMapConfig) {
        let View { camera, camera_from_map, .. } = view;
        let in_camera_m = camera_from_map * self.position_m;
        let Some(pixel) = camera.project(&in_camera_m) else { return };
        let rotation = camera_from_map.rotation.to_rotation_matrix().into_inner();
        let slopes = image_slopes(camera, &in_camera_m) * rotation;
        let off = seen.corner.pixel.cast::<f64>() - pixel;
        let variance = config.pixel_std_dev_px(seen.corner.level).powi(2);
        // The measurement depends on the readout time, and so does the pose that the landmark is compared at.
        let derivative =
            view.readout_derivative.of_measured(&in_camera_m, seen.corner.pixel.y.into(), camera)
                - view.readout_derivative.of_pose(&in_camera_m);
        let derivative = rotation.transpose() * derivative;
        for row in 0..2 {
            self.place.correct(&slopes.row(row).transpose(), off[row], variance, &derivative);
        }
        if let Some(depth) = seen.depth {
            self.place.correct_depth(camera_from_map, depth, &derivative);
        }
        // A landmark that is known too well could not be corrected any more.
        self.place.loosen(config.landmark_noise_m);
        self.position_m = self.place.in_map_m();
        self.descriptor = seen.corner.descriptor;
        self.look(view.number, seen.corner, &camera_from_map.inverse());
    }

    /// Covariance of its position, with the poses from which it was seen held to be known.
    #[must_use]
    pub fn covariance_m2(&self) -> Matrix3<f64> {
        self.place.covariance_m2()
    }

    /// How its place changes with each second that the camera takes longer to read an image than was thought.
    #[must_use]
    pub fn readout_derivative_m_per_s(&self) -> Vector3<f64> {
        self.place.readout_derivative_m_per_s()
    }

    /// From where it was last seen, in the map frame.
    pub(super) fn seen_from_m(&self) -> Point3<f64> {
        self.position_m + self.distance_m * self.towards_camera
    }

    /// Whether its depth is known, and not only its ray.
    pub(super) fn is_located(&self, config: &LocalMapConfig) -> bool {
        self.place.is_located(config)
    }

    /// Moves it to where it is when the camera takes this much longer to read an image.
    pub(super) fn correct_readout(&mut self, longer_s: f64) {
        self.place.correct_readout(longer_s);
        self.position_m = self.place.in_map_m();
    }

    /// As the corner that it last was; it has no place in an image.
    pub(super) fn as_corner(&self) -> Corner {
        Corner {
            pixel: Point2::origin(),
            level: self.level,
            angle_rad: self.angle_rad,
            response: 0.0,
            descriptor: self.descriptor,
        }
    }

    fn look(&mut self, frame: u64, corner: &Corner, map_from_camera: &Isometry3<f64>) {
        let to_camera = map_from_camera.translation.vector - self.position_m.coords;
        self.distance_m = to_camera.norm();
        self.towards_camera = to_camera / self.distance_m;
        self.level = corner.level;
        self.angle_rad = corner.angle_rad;
        self.seen_in_frame = frame;
        self.seen += 1;
    }
}
