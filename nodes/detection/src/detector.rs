//! One cycle of detection, from scan, cloud and pose to the reduced cloud with its zones.

mod cycle;
mod found;
mod steady;
mod surround;

use geometry::{
    CameraModel, CameraModelError, Cloud, DepthCameraError, DepthLimits, DepthProjector,
    DetectedCycle, RayTable, ReducedDepth, Scan, SteadyFrame, VoxelAccumulator, VoxelGrid,
    check_pose, pose_from_vector, pose_vector,
};
use nalgebra::Isometry3;

use crate::aperture::{Aperture, Beam, ScanAnglesError};
use crate::config::{ConfigError, DetectionConfig, Method};
use crate::gap_fill::{FilledRanges, RangeLimits, TooFewReturns, fill_gaps};
use crate::stillmap::{MotionFinder, MotionInput};
use crate::variability::VariabilityWindow;
use crate::zone_finder::{Unmeasured, ZoneFinder, ZoneSearch};
pub use cycle::{CycleInput, CycleStatistics, Detected, DetectionError, Step, View};
use found::Found;
use surround::Surround;

/// Finds the dynamic zone of each cycle and reduces its cloud (Rec-HV 3.3.2).
#[derive(Clone, Debug)]
pub struct Detector {
    config: DetectionConfig,
    rig_from_camera: Isometry3<f64>,
    rig_from_lidar: Isometry3<f64>,
    aperture: Option<Aperture>,
    window: VariabilityWindow,
    finder: ZoneFinder,
    /// Of the method `stillmap`.
    motion_finder: Option<MotionFinder>,
    surround: Option<Surround>,
    voxels: VoxelAccumulator,
    next_index: u32,
    steady: SteadyFrame,
}

impl Detector {
    /// A detector that has seen nothing yet.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(config: DetectionConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        Ok(Self {
            rig_from_camera: pose_from_vector(&config.rig_from_camera),
            rig_from_lidar: pose_from_vector(&config.rig_from_lidar),
            aperture: None,
            window: VariabilityWindow::new(config.window_scans),
            finder: ZoneFinder::new(&config),
            motion_finder: match config.method {
                Method::RecHv => None,
                Method::Stillmap => Some(MotionFinder::new(&config)),
            },
            surround: None,
            voxels: VoxelAccumulator::new(VoxelGrid::new(config.voxel_edge_m)?),
            next_index: 0,
            steady: SteadyFrame::default(),
            config,
        })
    }

    /// The projector from the depth images of `camera` to the rig frame. It holds a ray for each pixel:
    /// make one for each camera, not for each image.
    ///
    /// # Errors
    /// When the numbers do not describe a camera.
    pub fn depth_projector(
        &self,
        camera: &CameraModel,
    ) -> Result<DepthProjector, CameraModelError> {
        let rays = RayTable::new(camera)?;
        let frame_id = &self.config.rig_frame_id;
        Ok(DepthProjector::new(rays, DepthLimits::default(), &self.rig_from_camera, frame_id))
    }

    /// One cycle. `observe` is called at the end of each stage.
    ///
    /// A scan that has no deviations still makes a cycle, without a zone or with the held one;
    /// [`CycleStatistics::unmeasured`] tells why. An empty cloud makes one too. A scan with fewer than
    /// two returns does not enter the window. A scan with other angles or another number of beams than
    /// the one before starts the window anew.
    ///
    /// # Errors
    /// When the scan's angles, the depth image or the pose mean nothing. The cycle then takes no number.
    pub fn step(
        &mut self,
        input: &CycleInput<'_>,
        mut observe: impl FnMut(Step),
    ) -> Result<Detected, DetectionError> {
        check_pose(input.map_from_rig)?;

        // 3.2.1, eq. 1: the beams of the aperture.
        let (beams, window_restarted) = self.crop(input.scan)?;
        let found = if self.motion_finder.is_some() {
            self.find_by_free_space(input, &beams, &mut observe)?
        } else {
            self.find_by_variability(input.scan, &beams, &mut observe)
        };

        // 3.2.3: the voxel grid of the cloud.
        let ReducedDepth { cloud: reduced_cloud, voxel_points, points_before_reduction } =
            self.reduce(input.view)?;
        observe(Step::Reduction);

        // 3.3.2: the cloud, the pose and the angles of one cycle travel together.
        let index = self.next_index;
        self.next_index = self.next_index.wrapping_add(1);
        let cycle = DetectedCycle {
            index,
            scan_stamp: input.scan.stamp,
            reduced_cloud,
            voxel_points,
            points_before_reduction,
            map_from_rig: *input.map_from_rig,
            map_frame_id: input.map_frame_id.to_owned(),
            camera_in_rig_m: self.rig_from_camera.translation.vector.into(),
            zones: found.zones,
        };
        let statistics = CycleStatistics {
            beams: beams.len(),
            filled_beams: found.filled_beams,
            max_std_dev_m: found.max_std_dev_m,
            high_variability_beams: found.high_variability_beams,
            moving_beams: found.moving_beams,
            unknown_beams: found.unknown_beams,
            unmeasured: found.unmeasured,
            window_restarted,
        };
        Ok(Detected { cycle, statistics })
    }

    /// Forgets the scans and the zone of the past, as after a jump of the clock. The cycles count on.
    pub fn forget(&mut self) {
        self.aperture = None;
        self.window.clear();
        self.finder.clear();
        self.surround = None;
        self.steady.clear();
        if let Some(motion_finder) = &mut self.motion_finder {
            motion_finder.clear();
        }
    }

    /// Takes another pose of the scanner in the rig than the configuration's. What was seen is forgotten; the cycles
    /// count on.
    ///
    /// # Errors
    /// When it holds a number that is not finite; nothing is changed then.
    pub fn mount_lidar(&mut self, rig_from_lidar: &Isometry3<f64>) -> Result<(), ConfigError> {
        let config =
            DetectionConfig { rig_from_lidar: pose_vector(rig_from_lidar), ..self.config.clone() };
        config.validate()?;
        self.rig_from_lidar = *rig_from_lidar;
        self.forget();
        if self.motion_finder.is_some() {
            self.motion_finder = Some(MotionFinder::new(&config));
        }
        self.config = config;
        Ok(())
    }

    /// Rec-HV 3.2.1.1 to 3.2.2.
    fn find_by_variability(
        &mut self,
        scan: &Scan,
        beams: &[Beam],
        observe: &mut impl FnMut(Step),
    ) -> Found {
        // 3.2.1.1: a range for each of the beams.
        let limits = RangeLimits { min_m: scan.range_min_m, max_m: scan.range_max_m };
        let filled = fill_gaps(beams, limits);
        let filled_beams = filled.as_ref().map_or(0, FilledRanges::filled_beams);
        observe(Step::GapFill);

        // 3.2.1.2, eq. 2 and 3: mean and deviation of each beam over the window.
        let deviations = self.deviations(filled);
        observe(Step::Variability);

        // 3.2.2, eq. 5: the angles between which something moves.
        let search = self.find_zone(beams, deviations);
        observe(Step::ZoneSearch);
        let unknown_beams = beams.iter().filter(|beam| beam.range_m.is_none()).count();
        Found::by_variability(search, filled_beams, unknown_beams)
    }

    /// The method `stillmap`: see [`crate::stillmap`].
    fn find_by_free_space(
        &mut self,
        input: &CycleInput<'_>,
        in_aperture: &[Beam],
        observe: &mut impl FnMut(Step),
    ) -> Result<Found, ScanAnglesError> {
        let steady_from_rig = self.steady_from_rig(input);
        let finder = self.motion_finder.get_or_insert_with(|| MotionFinder::new(&self.config));
        let surround = match &mut self.surround {
            Some(surround) if surround.fits(input.scan) => surround,
            other => {
                finder.clear_window();
                other.insert(Surround::new(input.scan, &self.rig_from_lidar, in_aperture)?)
            }
        };
        let beams = surround.beams(input.scan);
        observe(Step::GapFill);
        let motion_input = MotionInput {
            scan: input.scan,
            beams: &beams,
            map_from_rig: &steady_from_rig,
            map_frame_id: input.map_frame_id,
            pose_stamp: input.view.stamp(),
        };
        let deviations = finder.take_in(&motion_input);
        observe(Step::Variability);
        let search = finder.find(&deviations, surround.within());
        observe(Step::ZoneSearch);
        Ok(Found::by_free_space(search))
    }

    /// The scan's beams in the aperture, and whether its geometry is another than before.
    fn crop(&mut self, scan: &Scan) -> Result<(Vec<Beam>, bool), ScanAnglesError> {
        if let Some(aperture) = &self.aperture
            && aperture.fits(scan)
        {
            return Ok((aperture.crop(scan), false));
        }
        let aperture = Aperture::new(scan, &self.rig_from_lidar, self.config.aperture_rad)?;
        let beams = aperture.crop(scan);
        let window_restarted = self.aperture.replace(aperture).is_some();
        self.window.clear();
        Ok((beams, window_restarted))
    }

    fn deviations(
        &mut self,
        filled: Result<FilledRanges, TooFewReturns>,
    ) -> Result<Vec<f32>, Unmeasured> {
        let filled =
            filled.map_err(|TooFewReturns { returns }| Unmeasured::TooFewReturns { returns })?;
        self.window.push(filled.ranges_m);
        let statistics = self.window.statistics().ok_or(Unmeasured::WindowFilling {
            scans: self.window.len(),
            window_scans: self.config.window_scans,
        })?;
        Ok(statistics.std_dev_m)
    }

    fn find_zone(
        &mut self,
        beams: &[Beam],
        deviations: Result<Vec<f32>, Unmeasured>,
    ) -> ZoneSearch {
        match deviations {
            Ok(std_dev_m) => {
                let azimuths_rad: Vec<f64> = beams.iter().map(|beam| beam.azimuth_rad).collect();
                self.finder.find(&azimuths_rad, &std_dev_m)
            }
            // Nothing tells of a motion that would widen the zone.
            Err(why) => self.finder.hold(why, 0.0),
        }
    }

    /// The reduced cloud in the rig frame.
    fn reduce(&mut self, view: View<'_>) -> Result<ReducedDepth, DepthCameraError> {
        let frame_id = &self.config.rig_frame_id;
        let moved;
        let cloud = match view {
            View::Depth { image, projector } => {
                return projector.reduce(image, &mut self.voxels);
            }
            View::PointsInRig(cloud) => cloud,
            View::PointsInCamera(cloud) => {
                moved = cloud.transformed(&self.rig_from_camera, frame_id);
                &moved
            }
        };
        self.voxels.clear();
        self.voxels.push_all(&cloud.points_m);
        let (points_m, voxel_points) = self.voxels.finish_counted();
        let points_before_reduction = cloud.points_m.len();
        let cloud = Cloud { stamp: cloud.stamp, frame_id: frame_id.clone(), points_m };
        Ok(ReducedDepth { cloud, voxel_points, points_before_reduction })
    }
}

#[cfg(test)]
mod tests;
