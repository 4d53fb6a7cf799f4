//! The compared variants.

use std::sync::Arc;
use std::time::Instant;

use clap::ValueEnum;
use estimation::Executor;
use geometry::{LidarCloud, Stamp};
use lidar_odometry::loop_closing::{LoopCloser, LoopClosingConfig};
use lidar_odometry::odometry::{
    Follower, FollowerConfig, Guess, LidarPose, MotionHint, OdometryMethod, deskewed_cloud,
};
use lidar_odometry::registration::{Method, RegistrationConfig};
use lidar_odometry::selection::{GroundFilter, PointChoice, RayFilter, RoadIntensityFilter};
use nalgebra::Isometry3;

use super::score::Candidate;
use robot::Failure;

/// A variant of the odometry.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(super) enum Variant {
    /// None
    None,
    /// Our odometry, with a local map
    Ours,
    /// Our odometry with loop closing
    OursLoops,
    /// Our odometry without the ground
    OursGround,
    /// ICP from scan to scan, point to point (table 4.1)
    Icp,
    /// GICP from scan to scan without an initial guess (tables 4.1 and 4.3)
    GicpStanding,
    /// GICP from scan to scan, with the previous motion as the initial guess (tables 4.3 and 4.6)
    Gicp,
    /// The same without points of the road's intensity, mean +- sigma (table 4.4)
    #[value(name = "gicp-intensity-1")]
    GicpIntensity1,
    /// The same, +- 1.25 sigma (tables 4.5 and 4.6)
    GicpIntensity,
    /// The same, +- 1.5 sigma (table 4.4)
    #[value(name = "gicp-intensity-1.5")]
    GicpIntensity15,
    /// The same with the upper 22 of 32 rays, or the same share of others (table 4.4)
    #[value(name = "gicp-rays-22")]
    GicpRays22,
    /// The upper 18
    #[value(name = "gicp-rays-18")]
    GicpRays18,
    /// The upper 14
    #[value(name = "gicp-rays-14")]
    GicpRays14,
    /// The upper 10
    #[value(name = "gicp-rays-10")]
    GicpRays10,
    /// The upper 6
    #[value(name = "gicp-rays-6")]
    GicpRays6,
    /// The same without the ground, by its shape
    GicpGround,
}

/// The number of rays of the thesis' scanner.
const THESIS_RAYS: u16 = 32;

impl Variant {
    pub(super) fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// The number of used rays of the thesis' scanner, from the top.
    fn rays(self) -> Option<u16> {
        match self {
            Self::GicpRays22 => Some(22),
            Self::GicpRays18 => Some(18),
            Self::GicpRays14 => Some(14),
            Self::GicpRays10 => Some(10),
            Self::GicpRays6 => Some(6),
            _ => None,
        }
    }

    /// Those of a scanner with this number of rays.
    fn config(self, rays: u16) -> FollowerConfig {
        let odometry_method = match self {
            Self::None | Self::Ours | Self::OursGround | Self::OursLoops => {
                OdometryMethod::LocalMap
            }
            _ => OdometryMethod::ScanToScan,
        };
        let road = |deviations| {
            let filter = RoadIntensityFilter { deviations, ..RoadIntensityFilter::default() };
            PointChoice::NotRoadIntensity(filter)
        };
        let points = match self {
            Self::GicpIntensity1 => road(1.0),
            Self::GicpIntensity => road(1.25),
            Self::GicpIntensity15 => road(1.5),
            Self::GicpGround | Self::OursGround => PointChoice::NotGround(GroundFilter::default()),
            _ => self.rays().map_or(PointChoice::All, |kept| {
                let left_out = u32::from(rays) * u32::from(THESIS_RAYS - kept);
                let lowest_left_out = left_out.div_ceil(u32::from(THESIS_RAYS)) as u16;
                PointChoice::Rays(RayFilter { lowest_left_out, every: 1 })
            }),
        };
        let guess = match self {
            Self::GicpStanding => Guess::Standing,
            _ => Guess::PreviousMotion,
        };
        let method = match self {
            Self::Icp => Method::PointToPoint,
            _ => Method::Generalised,
        };
        let registration = RegistrationConfig { method, ..RegistrationConfig::default() };
        FollowerConfig {
            method: odometry_method,
            guess,
            points,
            registration,
            ..FollowerConfig::default()
        }
    }
}

/// A running variant.
pub(super) struct Follow {
    variant: Variant,
    follower: Follower,
    poses: Vec<(Stamp, Isometry3<f64>)>,
    troubles: usize,
    times_ms: Vec<f64>,
    executor: Arc<dyn Executor>,
    loops: Option<LoopCloser>,
}

impl Follow {
    pub(super) fn new(
        variant: Variant,
        executor: &Arc<dyn Executor>,
    ) -> Result<Option<Self>, Failure> {
        if variant == Variant::None {
            return Ok(None);
        }
        let follower = Follower::new(variant.config(THESIS_RAYS), Arc::clone(executor))
            .map_err(|error| Failure::new(error.to_string()))?;
        let loops = (variant == Variant::OursLoops)
            .then(|| LoopCloser::new(LoopClosingConfig::default(), Arc::clone(executor)))
            .transpose()
            .map_err(|error| Failure::new(error.to_string()))?;
        let (poses, times_ms) = (Vec::new(), Vec::new());
        Ok(Some(Self {
            variant,
            follower,
            poses,
            troubles: 0,
            times_ms,
            executor: Arc::clone(executor),
            loops,
        }))
    }

    pub(super) fn step(&mut self, cloud: &LidarCloud) {
        self.fit_rays(cloud);
        let start = Instant::now();
        let stepped = self.follower.step(cloud, &MotionHint::default());
        if let Ok(pose) = &stepped {
            self.look_for_a_loop(cloud, pose);
        }
        self.times_ms.push(1e3 * start.elapsed().as_secs_f64());
        match stepped {
            Ok(pose) => {
                self.troubles += usize::from(pose.quality.trouble().is_some());
                self.poses.push((pose.stamp, pose.odom_from_lidar));
            }
            Err(_) => self.troubles += 1,
        }
    }

    fn look_for_a_loop(&mut self, cloud: &LidarCloud, pose: &LidarPose) {
        let Some(loops) = self.loops.as_mut().filter(|loops| loops.wants(&pose.odom_from_lidar))
        else {
            return;
        };
        let at_once_m = self.poses.last().map(|(stamp, last)| {
            let motion = last.inv_mul(&pose.odom_from_lidar);
            deskewed_cloud(cloud, &motion, pose.stamp.seconds_since(*stamp))
        });
        let points_m = at_once_m.as_ref().unwrap_or(&cloud.points_m);
        loops.take(pose.stamp, &pose.odom_from_lidar, points_m);
    }

    /// The same share of the rays as of the thesis' scanner. The first scan gives their number.
    fn fit_rays(&mut self, cloud: &LidarCloud) {
        if self.variant.rays().is_none() || !self.times_ms.is_empty() {
            return;
        }
        let Some(highest) = cloud.rings.as_ref().and_then(|rings| rings.iter().max()) else {
            return;
        };
        let config = self.variant.config(highest.saturating_add(1));
        if let Ok(follower) = Follower::new(config, Arc::clone(&self.executor)) {
            self.follower = follower;
        }
    }

    /// The last pose of the scanner.
    pub(super) fn last(&self) -> Option<Isometry3<f64>> {
        Some(self.poses.last()?.1)
    }

    pub(super) fn finish(self) -> Candidate {
        let Self { variant, mut poses, troubles, times_ms, loops, .. } = self;
        if let Some(known) = loops.map(|loops| loops.known()) {
            for (stamp, pose) in &mut poses {
                *pose = known.map_from_vehicle(*stamp, pose);
            }
        }
        Candidate { name: variant.name(), poses, troubles, times_ms }
    }
}
