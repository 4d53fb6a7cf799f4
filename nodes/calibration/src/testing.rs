//! What several tests share: cycles of a simulated room, planes as a depth image shows them, and noise.

pub(crate) use estimation::Random;
use estimation::perturbation::composite::perturbation_between;
use geometry::{
    CameraModel, DepthImage, DepthPixels, Distortion, PoseBuffer, RayTable, Scan, Stamp,
    pose_from_vector,
};
use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Point2, Vector3, Vector6};
use simulator::{Path, Sample, Scenario};

use crate::{Calibration, Cycle, DepthOptics, RigMounts, calibrate, returns_of};
use crate::{CalibrationConfig, CalibrationError};

/// The mounts that nodes have by default.
pub(crate) fn usual_mounts() -> RigMounts {
    use std::f64::consts::FRAC_PI_2;
    RigMounts {
        rig_from_camera: pose_from_vector(&[0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2]),
        rig_from_lidar: pose_from_vector(&[0.0, 0.0, -0.05, 0.0, 0.0, 0.0]),
    }
}

/// A small camera of a Kinect's field of view.
pub(crate) fn small_camera(distortion: Distortion) -> CameraModel {
    CameraModel {
        width_px: 320,
        height_px: 240,
        fx_px: 288.0,
        fy_px: 288.0,
        cx_px: 157.0,
        cy_px: 117.5,
        distortion,
    }
}

/// A camera with its rays.
pub(crate) struct Eye {
    pub(crate) camera: CameraModel,
    pub(crate) rays: RayTable,
}

impl Eye {
    pub(crate) fn new(camera: CameraModel) -> Self {
        Self { camera, rays: RayTable::new(&camera).unwrap() }
    }

    pub(crate) fn optics(&self) -> DepthOptics<'_> {
        DepthOptics { camera: &self.camera, rays: &self.rays }
    }

    /// The image of a scene that gives the depth along each ray `(x / z, y / z)`.
    pub(crate) fn image(&self, mut depth_m: impl FnMut(f64, f64) -> Option<f64>) -> DepthImage {
        let CameraModel { width_px, height_px, .. } = self.camera;
        let pixels = (0..height_px)
            .flat_map(|row| (0..width_px).map(move |column| (column, row)))
            .map(|(column, row)| {
                let ray = self.camera.ray(&Point2::new(column as f64, row as f64)).unwrap();
                depth_m(ray.x, ray.y).map_or(f32::NAN, |depth_m| depth_m as f32)
            })
            .collect();
        let size_px = (width_px, height_px);
        DepthImage::new(Stamp::default(), String::new(), size_px, DepthPixels::Metres(pixels))
            .unwrap()
    }
}

/// The depth at which a ray hits the plane of points with `normal . point = offset_m`.
pub(crate) fn depth_of_plane_m(normal: &Vector3<f64>, offset_m: f64, x: f64, y: f64) -> f64 {
    offset_m / normal.dot(&Vector3::new(x, y, 1.0))
}

/// A furnished room, seen into a corner: two walls, a shelf, a table.
pub(crate) fn corner(seed: u64) -> Scenario {
    let mut scenario = Scenario::demo().without_objects().with_seed(seed).with_duration_s(10.0);
    scenario.rig.path = Path::still([2.6, 0.8, 1.2, 0.74, 0.0, 0.0]);
    scenario
}

/// What the sensors of a scenario saw, a cycle for each scan that has an image within half of an image's period.
pub(crate) struct Recording {
    pub(crate) eye: Eye,
    pub(crate) cycles: Vec<Cycle>,
    /// Where the scanner is in truth.
    pub(crate) rig_from_lidar: Isometry3<f64>,
}

impl Recording {
    /// Runs a scenario with one image a turn of the scanner. Of the last beam first, as its driver has it.
    pub(crate) fn of(scenario: &Scenario) -> Self {
        let mut scenario = scenario.clone();
        let lidar = &scenario.rig.lidar;
        let rate_hz = lidar.turn_rate_hz;
        let rig_from_lidar = pose_from_vector(&lidar.rig_from_lidar);
        scenario.rig.depth_camera.rate_hz = rate_hz;
        // Before the scanner points forward: 36 ms at 7 Hz, in which a moving platform continues.
        scenario.rig.depth_camera.first_image_s = 0.25 / rate_hz;
        let eye = Eye::new(scenario.rig.depth_camera.camera);
        let mut poses = PoseBuffer::new(1 << 16);
        let (mut scans, mut images) = (Vec::new(), Vec::new());
        for sample in scenario.samples().unwrap() {
            match sample {
                Sample::Pose(pose) => poses.push(pose).unwrap(),
                Sample::Scan { scan, .. } => scans.push(scan),
                Sample::Depth { image, .. } => images.push(image),
                _ => {}
            }
        }
        let cycles = scans.iter().filter_map(|scan| cycle_of(scan, &images, &poses)).collect();
        Self { eye, cycles, rig_from_lidar }
    }

    /// The same from a later cycle on.
    pub(crate) fn starting_at_cycle(&self, first: usize) -> Self {
        let cycles = self.cycles.get(first..).unwrap_or_default().to_vec();
        Self { eye: Eye::new(self.eye.camera), cycles, rig_from_lidar: self.rig_from_lidar }
    }

    pub(crate) fn calibrate(&self, mounts: &RigMounts) -> Result<Calibration, CalibrationError> {
        calibrate(&self.cycles, self.eye.optics(), mounts, &CalibrationConfig::default())
    }

    /// The true correction of the usual mounts.
    pub(crate) fn true_correction(&self, mounts: &RigMounts) -> Vector6<f64> {
        perturbation_between(&mounts.rig_from_lidar, &self.rig_from_lidar)
    }
}

fn cycle_of(scan: &Scan, images: &[DepthImage], poses: &PoseBuffer) -> Option<Cycle> {
    let beams = scan.ranges_m.len();
    let beam_s = f64::from(scan.scan_time_s) / beams as f64;
    let middle = scan.stamp.plus_seconds(0.5 * f64::from(scan.scan_time_s));
    let away_s = |image: &DepthImage| image.stamp.seconds_since(middle).abs();
    let image = images.iter().min_by(|a, b| away_s(a).total_cmp(&away_s(b)))?;
    if away_s(image) > 0.05 {
        return None;
    }
    let map_from_rig = poses.at(image.stamp).ok()?.map_from_rig;
    let returns = returns_of(scan, |beam| {
        let stamp = scan.stamp.plus_seconds((beams - 1 - beam) as f64 * beam_s);
        Some(map_from_rig.inverse() * poses.at(stamp).ok()?.map_from_rig)
    });
    Some(Cycle { returns, image: image.clone(), map_from_rig: Some(map_from_rig) })
}

/// The squared error of the estimated coordinates in units of their covariance, and how many these are.
pub(crate) fn normalised_error_squared(
    calibration: &Calibration,
    truth: &Vector6<f64>,
) -> (f64, usize) {
    let estimated: Vec<usize> = calibration
        .coordinates
        .iter()
        .filter(|one| one.is_estimated())
        .map(|one| one.coordinate as usize)
        .collect();
    let count = estimated.len();
    let covariance = DMatrix::from_fn(count, count, |row, column| {
        calibration.covariance[estimated[row]][estimated[column]]
    });
    let error = DVector::from_fn(count, |row, _| {
        calibration.coordinates[estimated[row]].correction - truth[estimated[row]]
    });
    (error.dot(&(covariance.try_inverse().unwrap() * &error)), count)
}

/// Whether a matrix is symmetric and has no negative eigenvalue.
pub(crate) fn is_covariance(rows: &[[f64; 6]; 6]) -> bool {
    let matrix = Matrix6::from_fn(|row, column| rows[row][column]);
    let size = matrix.norm();
    (matrix - matrix.transpose()).norm() < 1e-9 * size
        && matrix.symmetric_eigenvalues().iter().all(|value| *value > -1e-9 * size)
}
