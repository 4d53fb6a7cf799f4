//! One turn of the scanner: its returns, and where they lie in the frame of its middle.

use std::f64::consts::TAU;

use geometry::{BeamOrder, Scan, Stamp};
use nalgebra::{Point2, UnitComplex, Vector2};

use crate::ScanOdometryConfig;
use crate::twist::Twist;

/// A turn that takes longer is not one: the increment is wrong.
const LONGEST_TURN_S: f64 = 1.0;
/// The last beam is a neighbour of the first when it is at most this many angle increments away.
const SEAM_STEPS: f64 = 1.5;
/// The standard deviation of a bearing that is uniform within one step: where in its step a beam was measured, or
/// how far its light spreads.
const UNIFORM_STEP: f64 = 0.288_675;

/// A beam that hit something.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Return {
    /// Its beam in the scan.
    pub(crate) beam: usize,
    pub(crate) range_m: f64,
    /// Of length 1, in the frame that the scanner had at that moment.
    pub(crate) direction: Vector2<f64>,
    /// When it was measured.
    pub(crate) after_middle_s: f64,
    /// Of the range.
    pub(crate) std_dev_m: f64,
}

impl Return {
    /// The variance of where it lies along a normal, for a beam that points in `direction` in the normal's frame.
    pub(crate) fn variance_along_m2(
        &self,
        normal: &Vector2<f64>,
        direction: &Vector2<f64>,
        step_rad: f64,
    ) -> f64 {
        let squarely = normal.dot(direction);
        let aside_m = UNIFORM_STEP * step_rad * self.range_m;
        (self.std_dev_m * squarely).powi(2)
            + aside_m * aside_m * (1.0 - squarely * squarely).max(0.0)
    }
}

/// A return in the frame of the middle of its turn.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct DeskewedReturn {
    pub(crate) point_m: Point2<f64>,
    /// Of the beam, of length 1.
    pub(crate) direction: Vector2<f64>,
}

/// The returns of a scan in the order of its beams.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct ScanReturns {
    pub(crate) returns: Vec<Return>,
    /// The angle from a beam to the next, positive.
    pub(crate) step_rad: f64,
    /// Whether the last beam is a neighbour of the first.
    pub(crate) is_closed: bool,
    /// How many beams the scan has.
    pub(crate) beams: usize,
    /// The moment between its first beam and its last.
    pub(crate) middle: Stamp,
    /// Half of the time from the first beam to the last, where it is known when each was measured; 0 otherwise, and
    /// then there is nothing to deskew.
    pub(crate) half_s: f64,
}

impl ScanReturns {
    /// The returns of a scan within the reach, but for those of the platform itself. None of a scan whose angles are not finite, or all the same.
    pub(crate) fn new(scan: &Scan, config: &ScanOdometryConfig) -> Self {
        let beams = scan.ranges_m.len();
        let gaps = beams.saturating_sub(1) as f64;
        let step_rad = f64::from(scan.angle_increment_rad).abs();
        let has_angles = scan.angle_min_rad.is_finite() && step_rad.is_finite() && step_rad > 0.0;
        let stated_s = f64::from(scan.time_increment_s);
        let is_sane = stated_s > 0.0 && stated_s * gaps <= LONGEST_TURN_S;
        let increment_s = if is_sane { stated_s } else { 0.0 };
        let later_a_beam_s = match config.beam_order {
            BeamOrder::Unknown => 0.0,
            BeamOrder::FirstToLast => increment_s,
            BeamOrder::LastToFirst => -increment_s,
        };
        let measured = |beam: usize| {
            let range_m = f64::from(scan.measured_range_m(beam)?);
            let (sin, cos) = scan.azimuth_rad(beam).sin_cos();
            (range_m <= config.reach_m).then(|| Return {
                beam,
                range_m,
                direction: Vector2::new(cos, sin),
                after_middle_s: (beam as f64 - 0.5 * gaps) * later_a_beam_s,
                std_dev_m: config.range_std_dev_m(range_m),
            })
        };
        let mut returns: Vec<Return> =
            if has_angles { (0..beams).filter_map(measured).collect() } else { Vec::new() };
        leave_out_own_body(&mut returns, config.body_radius_m);
        Self {
            returns,
            step_rad,
            is_closed: beams > 2 && TAU - gaps * step_rad <= SEAM_STEPS * step_rad,
            beams,
            middle: scan.stamp.plus_seconds(0.5 * gaps * increment_s),
            half_s: 0.5 * gaps * later_a_beam_s.abs(),
        }
    }

    /// Where the returns lie in the frame of the middle, for a scanner that moves evenly within the turn.
    pub(crate) fn deskewed(&self, velocity: &Twist) -> Vec<DeskewedReturn> {
        let is_static = self.half_s == 0.0 || *velocity == Twist::default();
        let place = |one: &Return| {
            let point_m = Point2::from(one.range_m * one.direction);
            if is_static {
                return DeskewedReturn { point_m, direction: one.direction };
            }
            let middle_from_beam = velocity.after(one.after_middle_s);
            let rotation: UnitComplex<f64> = middle_from_beam.rotation;
            DeskewedReturn {
                point_m: middle_from_beam * point_m,
                direction: rotation * one.direction,
            }
        };
        self.returns.iter().map(place).collect()
    }

    /// How far its returns lie, as the root of the mean square: the lever of a turn.
    pub(crate) fn lever_m(&self) -> f64 {
        let squares: f64 = self.returns.iter().map(|one| one.range_m * one.range_m).sum();
        (squares / self.returns.len().max(1) as f64).sqrt()
    }
}

/// A return nearer than this may be of the platform itself, which moves with the scanner and would hold the pose where
/// it is. Where most of what is seen is as near, it is no platform.
fn leave_out_own_body(returns: &mut Vec<Return>, radius_m: f64) {
    let beyond = returns.iter().filter(|one| one.range_m > radius_m).count();
    if 2 * beyond >= returns.len() {
        returns.retain(|one| one.range_m > radius_m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(beams: usize, step_rad: f32) -> Scan {
        Scan {
            angle_min_rad: -1.0,
            angle_increment_rad: step_rad,
            time_increment_s: 0.001,
            range_min_m: 0.1,
            range_max_m: 10.0,
            ranges_m: vec![2.0; beams],
            ..Scan::default()
        }
    }

    fn turn(scan: &Scan, beam_order: BeamOrder) -> ScanReturns {
        ScanReturns::new(scan, &ScanOdometryConfig { beam_order, ..ScanOdometryConfig::default() })
    }

    #[test]
    fn only_real_returns_within_reach_are_taken() {
        let mut odd = scan(8, 0.1);
        odd.range_max_m = 100.0;
        odd.ranges_m[1..7].copy_from_slice(&[
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            0.0,
            -1.0,
            99.0,
        ]);
        let beams: Vec<_> =
            turn(&odd, BeamOrder::Unknown).returns.iter().map(|one| one.beam).collect();
        assert_eq!(beams, [0, 7]);
    }

    #[test]
    fn what_is_near_is_left_out_unless_everything_is() {
        let mut near = scan(8, 0.1);
        near.ranges_m[..3].fill(0.3);
        assert_eq!(turn(&near, BeamOrder::Unknown).returns.len(), 5);
        near.ranges_m[..5].fill(0.3);
        assert_eq!(turn(&near, BeamOrder::Unknown).returns.len(), 8);
    }

    #[test]
    fn angles_that_point_nowhere_give_no_returns() {
        for (angle_min_rad, angle_increment_rad) in
            [(f32::NAN, 0.1), (0.0, 0.0), (0.0, f32::INFINITY)]
        {
            let bad = Scan { angle_min_rad, angle_increment_rad, ..scan(9, 0.1) };
            assert!(turn(&bad, BeamOrder::Unknown).returns.is_empty());
        }
        assert!(turn(&scan(0, 0.1), BeamOrder::FirstToLast).returns.is_empty());
    }

    #[test]
    fn a_full_turn_is_closed_and_others_are_not() {
        let degree = 1_f32.to_radians();
        for (beams, closed) in [(360, true), (361, true), (359, false), (270, false), (2, false)] {
            assert_eq!(turn(&scan(beams, degree), BeamOrder::Unknown).is_closed, closed, "{beams}");
            assert_eq!(
                turn(&scan(beams, -degree), BeamOrder::Unknown).is_closed,
                closed,
                "{beams}"
            );
        }
    }

    #[test]
    fn beams_are_timed_by_their_order_around_the_middle() {
        let times = |order| {
            let turn = turn(&scan(3, 0.1), order);
            assert_eq!(turn.middle.as_nanos(), 1_000_000);
            turn.returns.iter().map(|one| (one.after_middle_s * 1e3).round()).collect::<Vec<_>>()
        };
        assert_eq!(times(BeamOrder::FirstToLast), [-1.0, 0.0, 1.0]);
        assert_eq!(times(BeamOrder::LastToFirst), [1.0, 0.0, -1.0]);
        assert_eq!(times(BeamOrder::Unknown), [0.0, 0.0, 0.0]);
        let slow = Scan { time_increment_s: 1.0, ..scan(3, 0.1) };
        assert_eq!(turn(&slow, BeamOrder::FirstToLast).half_s, 0.0);
    }

    #[test]
    fn a_wall_that_a_moving_scanner_bends_is_straight_again() {
        // A wall at x = 3, a scanner that drives towards it and turns.
        let velocity = Twist { linear_m_per_s: Vector2::new(1.0, -0.2), angular_rad_per_s: 1.5 };
        let mut scan = scan(100, 0.01);
        for beam in 0..100 {
            let pose = velocity.after((beam as f64 - 49.5) * 0.001);
            let azimuth_rad = scan.azimuth_rad(beam) + pose.rotation.angle();
            scan.ranges_m[beam] = ((3.0 - pose.translation.x) / azimuth_rad.cos()) as f32;
        }
        let off = |sightings: Vec<DeskewedReturn>| {
            sightings.iter().map(|one| (one.point_m.x - 3.0).abs()).fold(0.0, f64::max)
        };
        let turn = turn(&scan, BeamOrder::FirstToLast);
        assert!(off(turn.deskewed(&velocity)) < 1e-6);
        assert!(off(turn.deskewed(&Twist::default())) > 0.05);
    }
}
