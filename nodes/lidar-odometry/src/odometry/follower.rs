//! Both odometry methods behind one call, with the choice of points: for the node and the comparisons.

use std::sync::Arc;

use estimation::Executor;
use geometry::{LidarCloud, Stamp};
use nalgebra::{Matrix6, Point3};

use super::{
    Guess, LidarOdometry, LidarOdometryConfig, LidarPose, LidarScan, MotionHint, Outcome, Quality,
    Refusal, ScanToScan,
};
use crate::registration::{ParameterError, PreparationConfig, RegistrationConfig};
use crate::selection::{PointChoice, PointChoiceError};

geometry::choices! {
    /// What a scan is registered to.
    #[derive(Default)]
    pub enum OdometryMethod {
        /// A map of the last scans.
        LocalMap = "local_map" as default,
        /// The previous scan, as in the road thesis.
        ScanToScan = "scan_to_scan",
    }
}

/// The parameters of a [`Follower`].
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct FollowerConfig {
    /// What a scan is registered to.
    pub method: OdometryMethod,
    /// Which points take part.
    pub points: PointChoice,
    /// The parameters of [`OdometryMethod::LocalMap`].
    pub local_map: LidarOdometryConfig,
    /// Where [`OdometryMethod::ScanToScan`] begins each registration.
    pub guess: Guess,
    /// How [`OdometryMethod::ScanToScan`] prepares a scan.
    pub preparation: PreparationConfig,
    /// How it registers it to the one before.
    pub registration: RegistrationConfig,
}

/// Why there is no pose.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum FollowerError {
    /// The points that should take part cannot be determined.
    #[error(transparent)]
    Choice(#[from] PointChoiceError),
    /// The scan is of no use.
    #[error(transparent)]
    Scan(#[from] Refusal),
}

/// Follows a turning LiDAR.
#[derive(Clone, Debug)]
pub struct Follower {
    config: FollowerConfig,
    odometry: Odometry,
}

#[derive(Clone, Debug)]
enum Odometry {
    Map(Box<LidarOdometry>),
    Scan(Box<ScanToScan>, Option<Stamp>),
}

impl Follower {
    /// One that has seen nothing.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(
        config: FollowerConfig,
        executor: Arc<dyn Executor>,
    ) -> Result<Self, ParameterError> {
        config.points.validate()?;
        config.preparation.validate()?;
        config.registration.validate()?;
        let odometry = match config.method {
            OdometryMethod::LocalMap => {
                Odometry::Map(Box::new(LidarOdometry::new(config.local_map, executor)?))
            }
            OdometryMethod::ScanToScan => {
                config.local_map.validate()?;
                let FollowerConfig { preparation, registration, guess, .. } = config;
                let odometry = ScanToScan::new(preparation, registration, guess, executor);
                Odometry::Scan(Box::new(odometry), None)
            }
        };
        Ok(Self { config, odometry })
    }

    /// Forgets everything: the next scan is the first one.
    pub fn forget(&mut self) {
        match &mut self.odometry {
            Odometry::Map(odometry) => odometry.forget(),
            Odometry::Scan(odometry, last) => {
                odometry.forget();
                *last = None;
            }
        }
    }

    /// From when to when the motion that leads to a cloud would be of use: see [`LidarOdometry::interval`]. `None` from scan to scan, which takes
    /// no hints.
    #[must_use]
    pub fn interval(&self, cloud: &LidarCloud) -> Option<(Stamp, Stamp)> {
        match &self.odometry {
            Odometry::Map(odometry) => odometry.interval(&scan_of(cloud)),
            Odometry::Scan(..) => None,
        }
    }

    /// The points of the local map, in the odometry's frame; none from scan to scan.
    #[must_use]
    pub fn local_map(&self) -> Vec<Point3<f32>> {
        match &self.odometry {
            Odometry::Map(odometry) => odometry.local_map(),
            Odometry::Scan(..) => Vec::new(),
        }
    }

    /// Takes in the next cloud.
    ///
    /// # Errors
    /// When it has no usable point, does not come after the one before, or lacks what the choice of points needs.
    pub fn step(
        &mut self,
        cloud: &LidarCloud,
        hint: &MotionHint,
    ) -> Result<LidarPose, FollowerError> {
        let chosen;
        let cloud = match self.config.points.keeps(cloud)? {
            Some(keep) => {
                chosen = cloud.kept(&keep);
                &chosen
            }
            None => cloud,
        };
        match &mut self.odometry {
            Odometry::Map(odometry) => Ok(odometry.step_with(&scan_of(cloud), hint)?),
            Odometry::Scan(odometry, last) => {
                let range_m = self.config.local_map.min_range_m..=self.config.local_map.max_range_m;
                Ok(scan_to_scan(odometry, last, cloud, &range_m)?)
            }
        }
    }
}

fn scan_of(cloud: &LidarCloud) -> LidarScan<'_> {
    LidarScan { stamp: cloud.stamp, points_m: &cloud.points_m, times_s: cloud.times_s.as_deref() }
}

/// The thesis takes a scan as if it had been measured at its stamp.
fn scan_to_scan(
    odometry: &mut ScanToScan,
    last: &mut Option<Stamp>,
    cloud: &LidarCloud,
    range_m: &std::ops::RangeInclusive<f64>,
) -> Result<LidarPose, Refusal> {
    if let Some(since_s) = last.map(|last| cloud.stamp.seconds_since(last))
        && since_s <= 0.0
    {
        return Err(Refusal::NotLater { since_s });
    }
    let within = |point: &&Point3<f32>| range_m.contains(&f64::from(point.coords.norm()));
    let points_m: Vec<Point3<f32>> = cloud.points_m.iter().filter(within).copied().collect();
    if points_m.is_empty() {
        return Err(Refusal::NoPoints { points: cloud.points_m.len() });
    }
    let before = odometry.pose();
    let (odom_from_lidar, outcome, found) = match odometry.step(&points_m) {
        Ok((pose, None)) => (pose, Outcome::Started, None),
        Ok((pose, Some(found))) => (pose, Outcome::Matched, Some(found)),
        Err(error) => (before, Outcome::Held(error), None),
    };
    *last = Some(cloud.stamp);
    let turn = before.rotation.to_rotation_matrix().into_inner();
    let covariance = found.as_ref().map_or_else(Matrix6::zeros, |found| {
        // From the axes of the scan before to those of the odometry.
        let mut turned = Matrix6::zeros();
        turned.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
        turned.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
        turned * found.covariance * turned.transpose()
    });
    let quality = Quality {
        outcome,
        points: points_m.len(),
        map_voxels: 0,
        reach_m: odometry.reach_m(),
        iterations: found.as_ref().map_or(0, |found| found.iterations),
        converged: found.as_ref().is_some_and(|found| found.converged),
        overlap: found.as_ref().map_or(0.0, |found| found.overlap),
        residual_rms_m: found.as_ref().map_or(0.0, |found| found.residual_rms_m),
        unknown_s: 0.0,
        degenerate: found
            .as_ref()
            .map(|found| found.observability.weak().copied().collect())
            .unwrap_or_default(),
    };
    Ok(LidarPose { stamp: cloud.stamp, odom_from_lidar, covariance, quality })
}

impl Quality {
    /// Why the pose is not to be trusted as others are; `None` where it is.
    #[must_use]
    pub fn trouble(&self) -> Option<String> {
        /// A street's scan has a place for nine of ten points in its map: for less than this it is mostly new.
        const LEAST_OVERLAP: f64 = 0.3;
        match self.outcome {
            Outcome::Started => return None,
            Outcome::Held(error) => {
                return Some(format!("the scan does not fit: {error}{}", self.lack_of_points()));
            }
            Outcome::BegunAnew(error) => {
                return Some(format!("the map begins anew: {error}{}", self.lack_of_points()));
            }
            Outcome::Matched => {}
        }
        if self.unknown_s > 0.0 {
            return Some(format!(
                "{:.1} s without a scan: the motion in them is not known, and the pose is where the scan fits the map best",
                self.unknown_s
            ));
        }
        if !self.degenerate.is_empty() {
            return Some(format!(
                "{} of 6 directions are predicted, since the scene does not determine them",
                self.degenerate.len()
            ));
        }
        if self.overlap < LEAST_OVERLAP {
            let percent = 100.0 * self.overlap;
            return Some(format!("only {percent:.0} % of the points match the map"));
        }
        (!self.converged).then(|| format!("no convergence after {} steps", self.iterations))
    }

    /// In a small room, or with a scanner that is all but covered.
    fn lack_of_points(&self) -> &'static str {
        /// A street's scan has thousands.
        const FEW: usize = 200;
        if self.points >= FEW {
            return "";
        }
        "; few points are left of the scan: they are nearer than min_range_m, or within few cubes of scan_voxel_edge_m (in a small \
         room 0.3, 0.1, and 0.2 for map_voxel_edge_m)"
    }
}

#[cfg(test)]
mod tests;
