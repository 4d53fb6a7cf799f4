//! The ways that are compared.

use std::num::NonZeroUsize;
use std::time::Instant;

use clap::ValueEnum;
use geometry::{LidarCloud, Stamp};
use lidar_odometry::loop_closing::{LoopCloser, LoopClosingConfig};
use lidar_odometry::odometry::{
    Follower, FollowerConfig, Guess, LidarPose, MotionHint, Way, deskewed_cloud,
};
use lidar_odometry::registration::{Method, RegistrationConfig};
use lidar_odometry::selection::{GroundFilter, PointChoice, RayFilter, RoadIntensityFilter};
use nalgebra::Isometry3;

use super::Candidate;
use crate::failure::Failure;

/// A way of following the scanner.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(super) enum Variant {
    /// Nothing is run
    None,
    /// Our odometry, onto a local map
    Ours,
    /// ICP from scan to scan, point to point (table 4.1)
    Icp,
    /// GICP from scan to scan without a guess (table 4.3)
    GicpStanding,
    /// GICP from scan to scan, with the previous motion for its guess (tables 4.3 and 4.6)
    Gicp,
    /// The same without what is as bright as the road (tables 4.4 to 4.6)
    GicpIntensity,
    /// The same without the lower half of the rays (table 4.4)
    GicpRays,
    /// The same without the ground, by its shape
    GicpGround,
    /// Our odometry without the ground
    OursGround,
    /// Our odometry with its loops closed
    OursLoops,
}

impl Variant {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Ours => "ours",
            Self::Icp => "icp",
            Self::GicpStanding => "gicp-standing",
            Self::Gicp => "gicp",
            Self::GicpIntensity => "gicp-intensity",
            Self::GicpRays => "gicp-rays",
            Self::GicpGround => "gicp-ground",
            Self::OursGround => "ours-ground",
            Self::OursLoops => "ours-loops",
        }
    }

    fn config(self) -> FollowerConfig {
        let way = match self {
            Self::None | Self::Ours | Self::OursGround | Self::OursLoops => Way::LocalMap,
            _ => Way::ScanToScan,
        };
        let points = match self {
            Self::GicpIntensity => PointChoice::NotRoadIntensity(RoadIntensityFilter::default()),
            // The thesis leaves 22, 18, 14, 10 and 6 of 32; of 64 here the upper half.
            Self::GicpRays => PointChoice::Rays(RayFilter { lowest_left_out: 32, every: 1 }),
            Self::GicpGround | Self::OursGround => PointChoice::NotGround(GroundFilter::default()),
            _ => PointChoice::All,
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
        FollowerConfig { way, guess, points, registration, ..FollowerConfig::default() }
    }
}

/// A variant on its way.
pub(super) struct Follow {
    variant: Variant,
    follower: Follower,
    poses: Vec<(Stamp, Isometry3<f64>)>,
    troubles: usize,
    times_ms: Vec<f64>,
    rays: Option<u16>,
    threads: NonZeroUsize,
    loops: Option<LoopCloser>,
}

impl Follow {
    pub(super) fn new(variant: Variant, threads: NonZeroUsize) -> Result<Option<Self>, Failure> {
        if variant == Variant::None {
            return Ok(None);
        }
        let follower = Follower::new(variant.config(), threads)
            .map_err(|error| Failure::new(error.to_string()))?;
        let loops = (variant == Variant::OursLoops)
            .then(|| LoopCloser::new(LoopClosingConfig::default(), threads))
            .transpose()
            .map_err(|error| Failure::new(error.to_string()))?;
        let (poses, times_ms) = (Vec::new(), Vec::new());
        Ok(Some(Self {
            variant,
            follower,
            poses,
            troubles: 0,
            times_ms,
            rays: None,
            threads,
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

    /// Half of the rays, whatever scanner it is.
    fn fit_rays(&mut self, cloud: &LidarCloud) {
        if self.variant != Variant::GicpRays || self.rays.is_some() {
            return;
        }
        let Some(highest) = cloud.rings.as_ref().and_then(|rings| rings.iter().max()) else {
            return;
        };
        let lowest_left_out = highest.saturating_add(1) / 2;
        let points = PointChoice::Rays(RayFilter { lowest_left_out, every: 1 });
        let config = FollowerConfig { points, ..self.variant.config() };
        if let Ok(follower) = Follower::new(config, self.threads) {
            self.follower = follower;
            self.rays = Some(lowest_left_out);
        }
    }

    pub(super) fn finish(self) -> Candidate {
        let Self { variant, mut poses, troubles, times_ms, loops, .. } = self;
        for ((stamp, pose), loops) in poses.iter_mut().zip(loops.iter().cycle()) {
            *pose = loops.map_from_vehicle(*stamp, pose);
        }
        Candidate { name: variant.name().to_owned(), poses, troubles, times_ms }
    }
}
