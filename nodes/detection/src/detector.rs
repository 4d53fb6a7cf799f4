//! One cycle of detection, from scan, cloud and pose to the reduced cloud with its zones.

mod cycle;
mod finder;
mod found;
mod surround;

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::config::DetectionConfig;
pub use cycle::{CycleInput, CycleStatistics, Detected, DetectionError, Step, View};
use finder::Finder;
use geometry::{
    Cloud, CloudCamera, CycleSetup, DepthFrame, DepthLimits, DepthProjector, DetectedCycle,
    MapPath, Method, ParameterError, PinholeFitError, PixelVoxels, ProjectableDepth, RayTable,
    ReducedDepth, RigConfig, RigMounts, RobotPixels, Scan, ScanError, UnusablePose,
    VoxelAccumulator, check_pose, pose_vector,
};
use nalgebra::{Isometry3, Vector3};
use surround::{ScanBeams, Surround};

/// A camera whose optical axis is nearer to the vertical than this, in its sine, looks in no direction of the plane.
const LEAST_ASIDE: f64 = 0.1;
/// An optical axis farther from the rig's x axis than this share of the aperture looks beside it: then a part of the Kinect's view, of 57
/// degrees, is not in the default aperture of 90.
const MOST_ASIDE_OF_APERTURE: f64 = 0.25;

/// Finds the dynamic zones of each cycle and reduces its cloud (Rec-HV 3.3.2).
#[derive(Clone, Debug)]
pub struct Detector {
    config: DetectionConfig,
    /// What each cycle is made with.
    setup: CycleSetup,
    surround: Option<Surround>,
    finder: Finder,
    voxels: VoxelAccumulator,
    /// Kept as long as the cycle may be asked for them, and for their memory.
    pixel_voxels: Arc<PixelVoxels>,
    cloud_camera: CloudCamera,
    next_index: u32,
}

impl Detector {
    /// A detector that has seen nothing yet.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(config: DetectionConfig) -> Result<Self, ParameterError> {
        config.validate()?;
        let setup = CycleSetup { robot: config.robot()?, ..config.pipeline.setup() };
        let grid = config.pipeline.voxel_grid()?;
        let mut detector = Self {
            setup,
            surround: None,
            finder: Finder::new(&config),
            voxels: VoxelAccumulator::new(grid),
            pixel_voxels: Arc::default(),
            cloud_camera: CloudCamera::default(),
            next_index: 0,
            config,
        };
        detector.finder.set_aperture(detector.aperture_rad());
        Ok(detector)
    }

    /// The aperture that is used: the configuration's, or for the method `free_space` all directions where the camera looks beside it.
    fn aperture_rad(&self) -> f64 {
        let aperture_rad = self.config.aperture_rad;
        let ahead = self.setup.mounts.rig_from_camera * Vector3::z();
        let azimuth_rad = ahead.y.atan2(ahead.x);
        let looks_beside = ahead.xy().norm() > LEAST_ASIDE
            && azimuth_rad.abs() > MOST_ASIDE_OF_APERTURE * aperture_rad;
        let is_free_space = self.config.pipeline.method == Method::FreeSpace;
        if is_free_space && looks_beside { TAU } else { aperture_rad }
    }

    /// The projector from the depth images of a camera to the rig frame. The rays of its pixels go with its cycles: make one for
    /// each camera, not for each image.
    #[must_use]
    pub fn depth_projector(&self, rays: RayTable) -> DepthProjector {
        let frame_id = &self.config.pipeline.rig.rig_frame_id;
        let rig_from_camera = &self.setup.mounts.rig_from_camera;
        let robot = self.setup.robot.map(|robot| RobotPixels::new(&robot, &rays, rig_from_camera));
        let projector =
            DepthProjector::new(rays, DepthLimits::default(), rig_from_camera, frame_id);
        match robot {
            Some(robot) => projector.without_robot(robot),
            None => projector,
        }
    }

    /// One cycle. `observe` is called at the end of each stage.
    ///
    /// A scan that has no deviations still makes a cycle, without a zone or with the held one;
    /// [`CycleStatistics::unmeasured`] tells why. An empty cloud makes one too. A scan with fewer than
    /// two returns does not enter the window. A scan with other angles or another number of beams than
    /// the one before starts the window anew.
    ///
    /// # Errors
    /// When the scan's angles or the pose mean nothing. The cycle then takes no number.
    pub fn step(
        &mut self,
        input: &CycleInput<'_>,
        mut observe: impl FnMut(Step),
    ) -> Result<Detected, DetectionError> {
        check_pose(input.map_from_rig)?;
        let (depth, not_pinhole) = self.depth_frame(input.view);

        // 3.2.1, eq. 1: the beams, and those of the aperture.
        let (mut beams, window_restarted) = self.crop(input.scan)?;
        if let Some(robot) = &self.setup.robot {
            beams.leave_out(robot, input.scan, &self.setup.mounts.rig_from_lidar);
        }
        // 3.2.1.1 to 3.2.2, or what stands in observed free space: where something moves.
        let rig_from_lidar = &self.setup.mounts.rig_from_lidar;
        let found = self.finder.find(input, &beams, rig_from_lidar, &mut observe);

        // 3.2.3: the voxel grid of the cloud.
        let ReducedDepth { cloud: reduced_cloud, voxel_points, points_before_reduction } =
            self.reduce(input.view, depth.as_deref());
        observe(Step::Reduction);

        // 3.3.2: the cloud, the pose and the angles of one cycle travel together.
        let index = self.next_index;
        self.next_index = self.next_index.wrapping_add(1);
        let cycle = DetectedCycle {
            index,
            setup: self.setup,
            scan_stamp: input.scan.stamp,
            reduced_cloud,
            voxel_points,
            points_before_reduction,
            map_from_rig: *input.map_from_rig,
            map_from_continuous: found.map_from_continuous,
            map_frame_id: input.map_frame_id.to_owned(),
            zones: found.zones,
            moving_beams: found.hits,
            depth,
            scan_rays: Arc::new(found.rays),
        };
        let statistics = CycleStatistics {
            beams: beams.within.len(),
            filled_beams: found.filled_beams,
            max_std_dev_m: found.max_std_dev_m,
            high_variability_beams: found.high_variability_beams,
            moving_beams: found.moving_beams,
            unknown_beams: found.unknown_beams,
            unmeasured: found.unmeasured,
            window_restarted,
            not_pinhole,
            pose_jump: found.pose_jump,
        };
        Ok(Detected { cycle, statistics })
    }

    /// Forgets the scans, the zones and the clouds of the past, as after a jump of the clock. The cycles count on.
    pub fn forget(&mut self) {
        self.surround = None;
        self.finder.clear();
        self.cloud_camera = CloudCamera::default();
    }

    /// The mounts that the cycles have: the configuration's, until others were given.
    #[must_use]
    pub fn mounts(&self) -> &RigMounts {
        &self.setup.mounts
    }

    /// Takes other mounts than before: they were corrected, and what was seen is forgotten. The cycles count on. Projectors that
    /// were made before have the camera's former mount.
    ///
    /// # Errors
    /// When they hold a number that is not finite; nothing is changed then.
    pub fn mount(&mut self, mounts: &RigMounts) -> Result<(), ParameterError> {
        self.follow_mounts(mounts)?;
        self.forget();
        Ok(())
    }

    /// The same, where a joint has moved the sensors on the rig: what was seen stays where it was in the map.
    ///
    /// # Errors
    /// As [`Detector::mount`].
    pub fn follow_mounts(&mut self, mounts: &RigMounts) -> Result<(), ParameterError> {
        let rig = RigConfig {
            rig_from_camera: pose_vector(&mounts.rig_from_camera),
            rig_from_lidar: pose_vector(&mounts.rig_from_lidar),
            ..RigConfig::default()
        };
        rig.validate()?;
        self.setup.mounts = *mounts;
        let aperture_rad = self.aperture_rad();
        self.finder.set_aperture(aperture_rad);
        if let Some(surround) = &mut self.surround {
            surround.set_aperture(aperture_rad);
        }
        Ok(())
    }

    /// Takes the place of the colour camera, for who masks its images: the cycles carry it.
    ///
    /// # Errors
    /// When it is none.
    pub fn set_colour_from_depth(
        &mut self,
        colour_from_depth: &Isometry3<f64>,
    ) -> Result<(), UnusablePose> {
        check_pose(colour_from_depth)?;
        self.setup.colour_from_depth = *colour_from_depth;
        Ok(())
    }

    /// Takes the trajectory of the platform as the map of its poses has it by now: a map that is corrected is no motion.
    /// Cycles have the pose that they are given.
    pub fn follow_path(&mut self, path: MapPath) {
        self.finder.follow_path(path);
    }

    /// The scan's beams, and whether its geometry is another than before.
    fn crop(&mut self, scan: &Scan) -> Result<(ScanBeams, bool), ScanError> {
        scan.validate()?;
        let rig_from_lidar = &self.setup.mounts.rig_from_lidar;
        let is_same_scan = match &self.surround {
            Some(surround) if surround.fits(scan, rig_from_lidar) => {
                return Ok((surround.crop(scan), false));
            }
            Some(surround) => surround.has_angles_of(scan),
            None => false,
        };
        let surround = Surround::new(scan, rig_from_lidar, self.aperture_rad())?;
        let beams = surround.crop(scan);
        let is_first = self.surround.replace(surround).is_none();
        if !is_same_scan {
            self.finder.clear_window();
        }
        Ok((beams, !is_first && !is_same_scan))
    }

    /// The depth image of the cycle, or one that is made of its cloud; and why the points of an organised cloud were rendered.
    fn depth_frame(
        &mut self,
        view: View<'_>,
    ) -> (Option<Arc<DepthFrame>>, Option<PinholeFitError>) {
        if !self.config.pipeline.needs_depth() {
            return (None, None);
        }
        let camera = &mut self.cloud_camera;
        let mut not_pinhole = None;
        let frame = match view {
            View::Depth(depth) => depth.frame(),
            View::PointsInCamera(cloud) => camera.frame_of_points(cloud),
            View::OrganisedPoints(cloud) => {
                camera.frame_of_organised(cloud).unwrap_or_else(|error| {
                    not_pinhole = Some(error);
                    camera.frame_of_points(cloud.cloud())
                })
            }
        };
        (Some(Arc::new(frame)), not_pinhole)
    }

    /// The reduced cloud in the rig frame.
    fn reduce(&mut self, view: View<'_>, frame: Option<&DepthFrame>) -> ReducedDepth {
        let frame_id = &self.config.pipeline.rig.rig_frame_id;
        let in_camera = match view {
            View::Depth(depth) => return self.reduce_image(depth, frame),
            View::PointsInCamera(cloud) => cloud,
            View::OrganisedPoints(cloud) => cloud.cloud(),
        };
        let mut cloud = in_camera.clone().transformed(&self.setup.mounts.rig_from_camera, frame_id);
        if let Some(robot) = &self.setup.robot {
            cloud.points_m.retain(|point| !robot.contains(&point.cast()));
        }
        self.voxels.clear();
        self.voxels.push_all(&cloud.points_m);
        let (points_m, voxel_points) = self.voxels.finish_counted();
        let points_before_reduction = cloud.points_m.len();
        let cloud = Cloud { points_m, ..cloud };
        ReducedDepth { cloud, voxel_points, points_before_reduction }
    }

    /// The same of a depth image. Who holds its frame gets the voxels of its pixels from it.
    fn reduce_image(
        &mut self,
        depth: ProjectableDepth<'_>,
        frame: Option<&DepthFrame>,
    ) -> ReducedDepth {
        let Some(frame) = frame else { return depth.reduce(&mut self.voxels) };
        // The memory of the last image's, where nobody uses them any more.
        let mut noted = Arc::try_unwrap(std::mem::take(&mut self.pixel_voxels)).unwrap_or_default();
        let reduced = depth.reduce_and_note(&mut self.voxels, &mut noted);
        self.pixel_voxels = Arc::new(noted);
        frame.share(&self.pixel_voxels);
        reduced
    }
}

#[cfg(test)]
mod tests;
