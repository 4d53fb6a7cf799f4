//! One scan in the map's horizontal plane, each beam moved to the time of the pose.

use std::ops::Range;

use geometry::{BeamOrder, Scan, Stamp};
use nalgebra::{Isometry3, Point2, Point3, Vector2};

use super::platform_motion::Motion;
use crate::aperture::Beam;
use crate::config::FreeSpaceConfig;

/// Bounds are at so many standard deviations: one beam in eighty is beyond, and no decision depends on one beam.
pub(super) const SIGMAS: f64 = 2.5;
/// Beams of a scan are neighbours when they are at most so many mean steps apart.
pub(super) const NEIGHBOUR_STEPS: f64 = 1.5;
/// A beam is measured at most so long before or after the pose; otherwise the stamps are wrong.
const LONGEST_SKEW_S: f64 = 1.0;
/// A surface at a more grazing angle is not distinguished from a step in depth: tan(80 degrees).
const GRAZING_TAN: f64 = 5.67;
/// The surface of one object does not step by more than this between two of its beams: a body with its
/// arms stretched out.
pub(super) const LARGEST_STEP_M: f64 = 0.4;
/// The standard deviation of a bearing that is uniform within one step.
const UNIFORM_STEP: f64 = 0.288_675;

/// The return of a beam.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Return {
    /// As measured.
    pub(super) range_m: f32,
    /// In the map's plane.
    pub(super) in_map_m: Point2<f64>,
    /// In the map, above its plane.
    pub(super) height_m: f64,
    /// In the rig frame of the cycle's pose.
    pub(super) in_rig_m: Point3<f64>,
    /// The error of its position in the map, in any direction.
    pub(super) error_m: f64,
}

impl Return {
    /// Its place in the map.
    pub(super) fn place_m(&self) -> Point3<f64> {
        Point3::new(self.in_map_m.x, self.in_map_m.y, self.height_m)
    }

    /// Its distance from the rig's z axis.
    pub(super) fn distance_m(&self) -> f64 {
        self.in_rig_m.x.hypot(self.in_rig_m.y)
    }
}

/// One beam of the scan.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct DeskewedBeam {
    /// Its direction in the rig frame, ascending within the scan.
    pub(super) azimuth_rad: f64,
    /// Where it starts in the map's plane.
    pub(super) origin_m: Point2<f64>,
    /// Where it starts above the map's plane.
    pub(super) origin_height_m: f64,
    /// Where it starts, in the rig frame of the cycle's pose.
    pub(super) origin_in_rig_m: Point3<f64>,
    /// Its direction in the map's plane, of length 1 for a level scanner.
    pub(super) direction: Vector2<f64>,
    /// By how much it rises over a metre of range; 0 for a level scanner.
    pub(super) rise: f64,
    /// Its return; `None` if it has none, which is no observation.
    pub(super) hit: Option<Return>,
    /// The error of its direction, without the noise of the range.
    pub(super) bearing_error_rad: f64,
}

impl DeskewedBeam {
    /// The place of the map at a range along it.
    pub(super) fn at_m(&self, range_m: f64) -> Point3<f64> {
        let in_plane_m = self.origin_m + self.direction * range_m;
        Point3::new(in_plane_m.x, in_plane_m.y, self.origin_height_m + self.rise * range_m)
    }
}

/// All beams of one scan, by their azimuths in the rig frame.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct DeskewedScan {
    pub(super) map_from_rig: Isometry3<f64>,
    pub(super) beams: Vec<DeskewedBeam>,
    /// The mean angle from a beam to the next.
    pub(super) step_rad: f64,
    /// Whether the last beam is a neighbour of the first.
    pub(super) is_closed: bool,
}

/// The input of a deskewed scan.
pub(super) struct DeskewInput<'a> {
    pub(super) scan: &'a Scan,
    /// All beams of the scan, by azimuth.
    pub(super) beams: &'a [Beam],
    pub(super) rig_from_lidar: &'a Isometry3<f64>,
    pub(super) map_from_rig: &'a Isometry3<f64>,
    /// The stamp of the pose.
    pub(super) pose_stamp: Stamp,
    pub(super) motion: &'a Motion,
}

impl DeskewedScan {
    /// Deskews a scan. Each beam is moved by the platform's twist from where it was measured into the rig frame of the cycle's
    /// pose; on a static platform no beam is moved. Without a time increment all beams are measured at the scan's stamp.
    pub(super) fn new(input: &DeskewInput<'_>, config: &FreeSpaceConfig) -> Self {
        let DeskewInput { scan, beams, rig_from_lidar, map_from_rig, motion, .. } = *input;
        let step_rad = f64::from(scan.angle_increment_rad).abs();
        let clock = BeamClock::new(input, config.beam_order);
        let deskewed = |beam: &Beam| {
            let (sin, cos) = scan.azimuth_rad(beam.index).sin_cos();
            let time = clock.of(beam.index);
            let rig_from_beam = if motion.twist.is_zero() || time.after_pose_s == 0.0 {
                *rig_from_lidar
            } else {
                motion.twist.after(time.after_pose_s) * rig_from_lidar
            };
            let map_from_beam = map_from_rig * rig_from_beam;
            let direction = map_from_beam.rotation * nalgebra::Vector3::new(cos, sin, 0.0);
            let change = &motion.twist_change;
            let drift =
                |rate: f64, change: f64| rate * time.uncertain_s + change * time.after_pose_s.abs();
            let bearing_error_rad = SIGMAS * motion.pose_noise_rad
                + drift(motion.twist.angular_rad_per_s.norm(), change.angular_rad_per_s.norm());
            let origin_error_m = SIGMAS * motion.pose_noise_m
                + drift(motion.twist.linear_m_per_s.norm(), change.linear_m_per_s.norm());
            let hit = beam.range_m.map(|range_m| {
                let far_m = f64::from(range_m);
                let in_rig_m = rig_from_beam * Point3::new(far_m * cos, far_m * sin, 0.0);
                let in_map_m = map_from_rig * in_rig_m;
                let noise_m = config.range_noise_m.hypot(config.range_noise_ratio * far_m);
                let aside_m = UNIFORM_STEP * step_rad * far_m;
                Return {
                    range_m,
                    in_rig_m,
                    in_map_m: in_map_m.xy(),
                    height_m: in_map_m.z,
                    error_m: SIGMAS * noise_m.hypot(aside_m)
                        + bearing_error_rad * far_m
                        + origin_error_m,
                }
            });
            DeskewedBeam {
                azimuth_rad: beam.azimuth_rad,
                origin_m: Point2::from(map_from_beam.translation.vector.xy()),
                origin_height_m: map_from_beam.translation.z,
                origin_in_rig_m: Point3::from(rig_from_beam.translation.vector),
                direction: direction.xy(),
                rise: direction.z,
                hit,
                bearing_error_rad,
            }
        };
        let mut all = Self {
            map_from_rig: *map_from_rig,
            beams: beams.iter().map(deskewed).collect(),
            step_rad,
            is_closed: false,
        };
        if let (Some(first), Some(last)) = (all.beams.first(), all.beams.last()) {
            let seam_rad = first.azimuth_rad + std::f64::consts::TAU - last.azimuth_rad;
            all.is_closed = all.beams.len() > 2 && seam_rad <= NEIGHBOUR_STEPS * step_rad;
        }
        all
    }

    /// The beam `offset` beams to the left (to the right when negative), across the seam of a full turn of the scanner.
    pub(super) fn neighbour(&self, beam: usize, offset: isize) -> Option<usize> {
        let beams = self.beams.len() as isize;
        let place = beam as isize + offset;
        if (0..beams).contains(&place) {
            Some(place as usize)
        } else if self.is_closed && offset.abs() < beams {
            Some(place.rem_euclid(beams) as usize)
        } else {
            None
        }
    }

    /// The beam to the left of `beam`, unless some are missing between the two.
    pub(super) fn next(&self, beam: usize) -> Option<usize> {
        let next = self.neighbour(beam, 1)?;
        let step_rad = self.beams[next].azimuth_rad - self.beams[beam].azimuth_rad;
        (next < beam || step_rad <= NEIGHBOUR_STEPS * self.step_rad).then_some(next)
    }

    /// The returns of an object with these beams, with the beam of each. A beam between a person's legs passes the object: a
    /// return that is farther than the object's previous one by more than a step of its surface is behind the object.
    pub(super) fn returns_of_object(
        &self,
        beams: Range<usize>,
    ) -> impl Iterator<Item = (usize, &Return)> {
        let mut last_m = None;
        let returns = beams.filter_map(|beam| {
            let hit = self.beams.get(beam)?.hit.as_ref()?;
            Some((beam, hit))
        });
        returns.filter(move |(_, hit)| {
            let range_m = f64::from(hit.range_m);
            let is_behind = last_m.is_some_and(|last_m| range_m > last_m + LARGEST_STEP_M);
            if !is_behind {
                last_m = Some(range_m);
            }
            !is_behind
        })
    }

    /// Whether two returns of neighbouring beams may lie on one surface: their ranges differ by no more than
    /// noise, or than a surface seen at 80 degrees would make them.
    pub(super) fn is_one_surface(&self, a: &Return, b: &Return) -> bool {
        let (a_m, b_m) = (f64::from(a.range_m), f64::from(b.range_m));
        let slope_m = GRAZING_TAN * self.step_rad * a_m.min(b_m);
        (a_m - b_m).abs() <= slope_m.max(0.5 * (a.error_m + b.error_m))
    }
}

/// The times of the beams of a scan, relative to the pose.
struct BeamClock {
    first_after_pose_s: f64,
    increment_s: f64,
    beams: usize,
    order: BeamOrder,
}

struct BeamTime {
    after_pose_s: f64,
    uncertain_s: f64,
}

impl BeamClock {
    fn new(input: &DeskewInput<'_>, order: BeamOrder) -> Self {
        let scan = input.scan;
        let increment_s = f64::from(scan.time_increment_s);
        let first_after_pose_s = scan.stamp.seconds_since(input.pose_stamp);
        let beams = scan.ranges_m.len();
        let is_near = first_after_pose_s.abs() <= LONGEST_SKEW_S;
        let is_increment = increment_s > 0.0 && increment_s * beams as f64 <= LONGEST_SKEW_S;
        Self {
            first_after_pose_s: if is_near { first_after_pose_s } else { 0.0 },
            increment_s: if is_near && is_increment { increment_s } else { 0.0 },
            beams,
            order,
        }
    }

    fn of(&self, index: usize) -> BeamTime {
        let last = self.beams.saturating_sub(1) as f64;
        let index = index as f64;
        let (places, uncertain) = match self.order {
            BeamOrder::Unknown => (0.5 * last, (index - 0.5 * last).abs()),
            BeamOrder::FirstToLast => (index, 0.0),
            BeamOrder::LastToFirst => (last - index, 0.0),
        };
        BeamTime {
            after_pose_s: self.first_after_pose_s + places * self.increment_s,
            uncertain_s: uncertain * self.increment_s,
        }
    }
}

#[cfg(test)]
mod tests;
