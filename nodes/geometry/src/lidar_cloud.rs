//! One revolution of a spinning LiDAR, as its driver lists it.

use std::ops::RangeInclusive;

use nalgebra::Point3;

use crate::{Revolution, Stamp};

/// The points of about one revolution, in the order of their message, each with what its driver says of it.
///
/// Every list that is there is as long as that of the points. Points are finite, and none is at the scanner itself.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct LidarCloud {
    /// The origin of the times.
    pub stamp: Stamp,
    /// The frame of the scanner: x forward, y left, z up.
    pub frame_id: String,
    /// The points, each in the scanner's frame of when it was measured.
    pub points_m: Vec<Point3<f32>>,
    /// In the scanner's own unit.
    pub intensities: Option<Vec<f32>>,
    /// The laser that measured each.
    pub rings: Option<Vec<u16>>,
    /// When each was measured, in seconds since the stamp; `None` where all are as if measured at once.
    pub times_s: Option<Vec<f32>>,
}

impl LidarCloud {
    /// The points that are kept, with their fields. Points without an answer are dropped.
    #[must_use]
    pub fn kept(&self, keep: &[bool]) -> Self {
        fn of<T: Copy>(items: &[T], keep: &[bool]) -> Vec<T> {
            items.iter().zip(keep).filter(|(_, keep)| **keep).map(|(item, _)| *item).collect()
        }
        Self {
            stamp: self.stamp,
            frame_id: self.frame_id.clone(),
            points_m: of(&self.points_m, keep),
            intensities: self.intensities.as_deref().map(|items| of(items, keep)),
            rings: self.rings.as_deref().map(|items| of(items, keep)),
            times_s: self.times_s.as_deref().map(|items| of(items, keep)),
        }
    }
}

impl From<&Revolution> for LidarCloud {
    /// Rings count from the lowest row, 0. A revolution whose times are all the same has none.
    fn from(revolution: &Revolution) -> Self {
        let count = revolution.measured().count();
        let (mut points_m, mut intensities) =
            (Vec::with_capacity(count), Vec::with_capacity(count));
        let (mut rings, mut times_s) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for row in 0..revolution.rows() {
            let ring = u16::try_from(revolution.rows() - 1 - row).unwrap_or(u16::MAX);
            for found in revolution.row(row).iter().flatten() {
                points_m.push(found.position_m);
                intensities.push(found.intensity);
                rings.push(ring);
                times_s.push(found.time_s);
            }
        }
        let same = times_s.windows(2).all(|pair| matches!(pair, [a, b] if a == b));
        Self {
            stamp: revolution.stamp,
            frame_id: revolution.frame_id.clone(),
            points_m,
            intensities: Some(intensities),
            rings: Some(rings),
            times_s: (!same).then_some(times_s),
        }
    }
}

/// From the first to the last of the times of a scan's points, without strays: a hundredth at each end may be wrong, and is where it is
/// farther from the rest than this lasts. Times that are not finite are left out; `None` without any other.
#[must_use]
pub fn span_without_strays(times: impl Iterator<Item = f64>) -> Option<RangeInclusive<f64>> {
    const STRAYS_IN: usize = 100;
    const FEW: usize = 100;
    const ENDS_OF_FEW_IN: usize = 5;
    let mut times: Vec<f64> = times.filter(|time| time.is_finite()).collect();
    let whole = span(times.iter().copied());
    // What is near the middle of a few of them is near the rest of all: mostly both ends are, and not all need be ordered.
    let mut few: Vec<f64> = times.iter().copied().step_by(times.len() / FEW + 1).collect();
    let near = near_the_rest(&mut few, ENDS_OF_FEW_IN)?;
    if near.contains(whole.start()) && near.contains(whole.end()) {
        return Some(whole);
    }
    let near = near_the_rest(&mut times, STRAYS_IN)?;
    Some(span(times.into_iter().filter(|time| near.contains(time))))
}

/// What is no farther from all but one in so many times at each end than these last.
fn near_the_rest(times: &mut [f64], one_in: usize) -> Option<RangeInclusive<f64>> {
    let last = times.len().checked_sub(1)?;
    let ends = times.len() / one_in;
    let low = *times.select_nth_unstable_by(ends, f64::total_cmp).1;
    let high = *times.select_nth_unstable_by(last - ends, f64::total_cmp).1;
    Some(low - (high - low)..=high + (high - low))
}

fn span(times: impl Iterator<Item = f64>) -> RangeInclusive<f64> {
    times.fold(f64::INFINITY..=f64::NEG_INFINITY, |span, time| {
        span.start().min(time)..=span.end().max(time)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LidarReturn;

    fn revolution(times_s: [f32; 2]) -> Revolution {
        let at = |x_m: f32, time_s| {
            let position_m = Point3::new(x_m, 0.0, 0.0);
            Some(LidarReturn { position_m, intensity: 10.0 * x_m, time_s })
        };
        let returns = vec![at(1.0, times_s[0]), None, None, at(2.0, times_s[1])];
        Revolution::new(Stamp::from_nanos(5), "v".into(), vec![0.1, -0.1], vec![0.0, 0.1], returns)
            .unwrap()
    }

    #[test]
    fn a_revolution_becomes_a_list_with_the_lowest_ring_first() {
        let cloud = LidarCloud::from(&revolution([0.0, 0.1]));
        assert_eq!(cloud.rings, Some(vec![1, 0]));
        assert_eq!(cloud.times_s, Some(vec![0.0, 0.1]));
        assert_eq!(cloud.intensities, Some(vec![10.0, 20.0]));
        let kept = cloud.kept(&[false, true]);
        assert_eq!(
            (kept.points_m.len(), kept.rings, kept.times_s),
            (1, Some(vec![0]), Some(vec![0.1]))
        );
        assert_eq!((kept.stamp, kept.frame_id.as_str()), (Stamp::from_nanos(5), "v"));
    }

    #[test]
    fn times_that_do_not_differ_are_none() {
        assert_eq!(LidarCloud::from(&revolution([0.0, 0.0])).times_s, None);
    }

    #[test]
    fn a_hundredth_of_the_times_may_be_strays() {
        let span = |strays: &[f64]| {
            let turn = (0..1000).map(|point| 0.1 * f64::from(point) / 999.0);
            span_without_strays(turn.chain(strays.iter().copied()))
        };
        assert_eq!(span(&[]), Some(0.0..=0.1));
        assert_eq!(span(&[f64::NAN, f64::INFINITY]), Some(0.0..=0.1));
        assert_eq!(span(&[3.0, -1e30, 1e30, -0.11]), Some(0.0..=0.1));
        // Before and after the rest, but near it.
        assert_eq!(span(&[-0.05, 0.19]), Some(-0.05..=0.19));
        // More are no strays, nor are there any among few.
        assert_eq!(span(&[3.0; 20]), Some(0.0..=3.0));
        assert_eq!(span_without_strays([3.0, 0.0, f64::NAN].into_iter()), Some(0.0..=3.0));
        assert_eq!(span_without_strays([f64::NAN].into_iter()), None);
    }
}
