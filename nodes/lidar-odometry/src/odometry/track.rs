//! The state after a scan; the first scans, and those that do not fit.

use estimation::Twist;
use geometry::Stamp;
use nalgebra::{Isometry3, Matrix6, Point3, Vector6};

use super::deskew::{Span, deskewed};
use super::pose::{LidarPose, Outcome, Quality, Refusal};
use super::threshold::AdaptiveThreshold;
use super::{LidarOdometry, LidarScan};
use crate::registration::{
    PreparedCloud, Registration, RegistrationConfig, RegistrationError, register,
};
use crate::revolution::LONGEST_S;

/// The map is cut to its reach when the vehicle has gone this share of it.
const CUT_SHARE: f64 = 0.05;

/// After a longer pause the vehicle's motion is unknown: it is predicted for at most this time.
pub(super) const LONGEST_PREDICTION_S: f64 = 1.0;

/// When a scan was measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    /// The middle of it: for this the pose is found.
    pub(super) stamp: Stamp,
    span: Option<Span>,
}

impl Moment {
    pub(super) fn of(scan: &LidarScan<'_>) -> Result<Self, Refusal> {
        let Some(times_s) = scan.times_s else { return Ok(Self { stamp: scan.stamp, span: None }) };
        if times_s.len() != scan.points_m.len() {
            return Err(Refusal::Times { points: scan.points_m.len(), times: times_s.len() });
        }
        let far = |time_s: &f32| f64::from(time_s.abs()) > LONGEST_S;
        let far_times = times_s.iter().filter(|time_s| time_s.is_finite() && far(time_s)).count();
        if 2 * far_times > times_s.len() {
            return Err(Refusal::FarTimes { points: scan.points_m.len(), far: far_times });
        }
        let span = Span::of(times_s).ok_or(Refusal::NoPoints { points: scan.points_m.len() })?;
        Ok(Self { stamp: scan.stamp.plus_seconds(span.middle_s()), span: Some(span) })
    }
}

/// The state after a scan.
#[derive(Clone, Debug)]
pub(super) struct Track {
    pub(super) stamp: Stamp,
    pub(super) odom_from_lidar: Isometry3<f64>,
    /// Unknown after the first scan of a map.
    pub(super) velocity: Option<Twist>,
    pub(super) threshold: AdaptiveThreshold,
    /// From the pose before to this one; 0 for the first.
    pub(super) interval_s: f64,
    /// The map's first scan, until the second one shows how the vehicle moved in it.
    first: Option<FirstScan>,
    /// Counts the scans.
    scans: u64,
    held_scans: usize,
    /// Where the map was cut to its reach last.
    cut_at: Isometry3<f64>,
}

#[derive(Clone, Debug)]
struct FirstScan {
    stamp: Stamp,
    points_m: Vec<Point3<f32>>,
    times_s: Option<Vec<f32>>,
}

impl FirstScan {
    fn of(scan: &LidarScan<'_>) -> Self {
        let times_s = scan.times_s.map(<[f32]>::to_vec);
        Self { stamp: scan.stamp, points_m: scan.points_m.to_vec(), times_s }
    }

    fn scan(&self) -> LidarScan<'_> {
        LidarScan { stamp: self.stamp, points_m: &self.points_m, times_s: self.times_s.as_deref() }
    }
}

impl Track {
    /// The motion of the vehicle in this many seconds at its velocity, for a limited time.
    pub(super) fn expected_motion(&self, passed_s: f64) -> Isometry3<f64> {
        let passed_s = passed_s.min(LONGEST_PREDICTION_S);
        self.velocity.map_or_else(Isometry3::identity, |velocity| velocity.displacement(passed_s))
    }

    /// The next pose.
    pub(super) fn arrive(&mut self, moment: &Moment, odom_from_lidar: Isometry3<f64>) {
        self.interval_s = moment.stamp.seconds_since(self.stamp);
        self.stamp = moment.stamp;
        self.odom_from_lidar = odom_from_lidar;
        self.scans += 1;
        self.held_scans = 0;
    }
}

impl LidarOdometry {
    /// The first scan is the origin.
    pub(super) fn start(
        &mut self,
        scan: &LidarScan<'_>,
        moment: Moment,
    ) -> Result<LidarPose, Refusal> {
        let config = &self.config;
        let cloud = self.prepared(scan, &moment, None)?;
        let threshold = AdaptiveThreshold::new(
            config.first_deviation_m,
            config.min_deviation_m,
            config.max_range_m,
        );
        let origin = Isometry3::identity();
        let mut track = Track {
            stamp: moment.stamp,
            odom_from_lidar: origin,
            velocity: None,
            threshold,
            interval_s: 0.0,
            first: Some(FirstScan::of(scan)),
            scans: 0,
            held_scans: 0,
            cut_at: origin,
        };
        self.map.clear();
        self.take_in(&cloud, &mut track);
        let rules = self.rules(&threshold);
        let quality = self.quality(&cloud, &rules, Outcome::Started, None);
        self.track = Some(track);
        Ok(LidarPose {
            stamp: moment.stamp,
            odom_from_lidar: origin,
            covariance: Matrix6::zeros(),
            quality,
        })
    }

    /// The second scan of a map, registered to the first one, shows how the vehicle moves: the map is made again of the first
    /// one, which was mapped as if the vehicle were static. The scans are too far apart for the map's voxels to show it.
    pub(super) fn set_out(
        &mut self,
        track: &mut Track,
        scan: &LidarScan<'_>,
        moment: &Moment,
        passed_s: f64,
    ) -> Result<(), Refusal> {
        let cloud = self.prepared(scan, moment, None)?;
        let Some(first) = track.first.take() else { return Ok(()) };
        let first_moment = Moment::of(&first.scan())?;
        let mut motion = Isometry3::identity();
        for _ in 0..2 {
            // Once as if the vehicle were static, once with the estimated motion.
            let target = self.prepared(&first.scan(), &first_moment, track.velocity)?;
            let source = match track.velocity {
                Some(_) => self.prepared(scan, moment, track.velocity)?,
                None => cloud.clone(),
            };
            let Ok(found) =
                register(&source, &target, &motion, &self.config.registration, &*self.executor)
            else {
                return Ok(());
            };
            motion = found.target_from_source;
            track.velocity = Twist::between(&motion, passed_s);
            if moment.span.is_none() {
                return Ok(());
            }
        }
        let cloud = self.prepared(&first.scan(), &first_moment, track.velocity)?;
        self.map.clear();
        self.take_in(&cloud, track);
        Ok(())
    }

    /// The scan does not fit the map: constant velocity is assumed, for a limited time.
    pub(super) fn hold(
        &mut self,
        track: &mut Track,
        scan: &LidarScan<'_>,
        cloud: &PreparedCloud,
        (moment, predicted): (&Moment, &Isometry3<f64>),
        error: RegistrationError,
    ) -> LidarPose {
        let held_scans = track.held_scans + 1;
        track.arrive(moment, *predicted);
        track.held_scans = held_scans;
        let mut outcome = Outcome::Held(error);
        if held_scans > self.config.max_held_scans {
            outcome = Outcome::BegunAnew(error);
            track.held_scans = 0;
            track.velocity = None;
            track.first = Some(FirstScan::of(scan));
            self.map.clear();
            self.take_in(cloud, track);
        }
        let rules = self.rules(&track.threshold);
        let reach_m2 = rules.max_correspondence_m.powi(2);
        let turn_rad2 = reach_m2 / self.config.max_range_m.powi(2);
        LidarPose {
            stamp: moment.stamp,
            odom_from_lidar: *predicted,
            // Only constant velocity is known: the farthest points are as far off as one may be.
            covariance: Matrix6::from_diagonal(&Vector6::new(
                reach_m2, reach_m2, reach_m2, turn_rad2, turn_rad2, turn_rad2,
            )),
            quality: self.quality(cloud, &rules, outcome, None),
        }
    }

    /// The points within range, as if measured at once, thinned out and with normals.
    pub(super) fn prepared(
        &self,
        scan: &LidarScan<'_>,
        moment: &Moment,
        velocity: Option<Twist>,
    ) -> Result<PreparedCloud, Refusal> {
        let config = &self.config;
        let squares_m2 = (config.min_range_m.powi(2) as f32)..=(config.max_range_m.powi(2) as f32);
        let within = |point: &Point3<f32>| squares_m2.contains(&point.coords.norm_squared());
        let points_m: Vec<Point3<f32>> = match (scan.times_s, moment.span, velocity) {
            (Some(times_s), Some(span), Some(velocity)) => {
                deskewed(scan.points_m, times_s, &span, &velocity)
                    .into_iter()
                    .filter(within)
                    .collect()
            }
            _ => scan.points_m.iter().copied().filter(within).collect(),
        };
        PreparedCloud::new(&points_m, &config.preparation, &*self.executor)
            .map_err(|_| Refusal::NoPoints { points: scan.points_m.len() })
    }

    /// How the next scan is registered to the map.
    pub(super) fn rules(&self, threshold: &AdaptiveThreshold) -> RegistrationConfig {
        let mut rules = self.config.registration;
        rules.max_correspondence_m = threshold.reach_m();
        rules.coarse.max_correspondence_m = threshold.reach_m();
        rules.kernel_width_m = threshold.kernel_width_m();
        rules
    }

    /// The map takes in a scan where the track says that it is.
    pub(super) fn take_in(&mut self, cloud: &PreparedCloud, track: &mut Track) {
        let Track { odom_from_lidar, scans, .. } = *track;
        let rotation = odom_from_lidar.rotation.to_rotation_matrix().into_inner();
        let place_m = odom_from_lidar.translation.vector;
        for number in 0..cloud.len() {
            let (point_m, normal) = cloud.point(number);
            let (point_m, normal) = (rotation * point_m + place_m, rotation * normal);
            self.map.add(&point_m, &normal, self.config.map_memory_points, scans);
        }
        let (reach_m, most) = (self.config.max_range_m, self.config.max_map_voxels);
        let travelled_m = (track.cut_at.translation.vector - place_m).norm();
        if travelled_m > CUT_SHARE * reach_m || self.map.len() > most {
            self.map.keep_near(&place_m, reach_m, most);
            track.cut_at = odom_from_lidar;
        }
    }

    pub(super) fn quality(
        &self,
        cloud: &PreparedCloud,
        rules: &RegistrationConfig,
        outcome: Outcome,
        found: Option<&Registration>,
    ) -> Quality {
        Quality {
            outcome,
            points: cloud.len(),
            map_voxels: self.map.len(),
            reach_m: rules.max_correspondence_m,
            iterations: found.map_or(0, |found| found.iterations),
            converged: found.is_some_and(|found| found.converged),
            overlap: found.map_or(0.0, |found| found.overlap),
            residual_rms_m: found.map_or(0.0, |found| found.residual_rms_m),
            unknown_s: 0.0,
            degenerate: found
                .map(|found| found.observability.weak().copied().collect())
                .unwrap_or_default(),
        }
    }
}
