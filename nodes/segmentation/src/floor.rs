//! The floor: the lowest horizontal plane, so that feet are cut from it.

use nalgebra::{Matrix3, Point3, Vector3};

/// The layers in which the lowest plane is looked for are so high.
const LAYER_M: f64 = 0.02;
/// Points this far from the plane still belong to it: the noise of depth, and a carpet's edge.
const INLIER_M: f64 = 0.05;
/// A floor has at least so many points: 0.25 m2 at the thesis' edge.
const MIN_POINTS: usize = 40;
/// And reaches at least so far along x and along y, which no seat and no shelf board does.
const MIN_REACH_M: f64 = 0.8;
/// Nothing is so far below a floor: where more than a few points of noise are, the plane is a table.
const BELOW_M: f64 = 0.12;
/// The share of points that may lie below.
const MAX_SHARE_BELOW: f64 = 0.01;
/// Floors are level to this slope: the map's z axis may be off by a camera that looks down a little.
const MAX_SLOPE: f64 = 0.15;
/// Rounds in which the plane is fitted to its own inliers; it moves no more after two.
const FITS: usize = 3;

/// The plane `z = along_x * x + along_y * y + height_m` in the map frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Floor {
    along_x: f64,
    along_y: f64,
    height_m: f64,
}

impl Floor {
    /// How high a point of the map is above the floor; negative below.
    #[must_use]
    pub fn height_above_m(&self, point_in_map: &Point3<f64>) -> f64 {
        point_in_map.z
            - self.along_x * point_in_map.x
            - self.along_y * point_in_map.y
            - self.height_m
    }

    /// The floor under these points, or `None` where they show none.
    ///
    /// Every point must be finite. The lowest layer with enough points that reach far enough is fitted by
    /// least squares; with more than a few points below it, it is a table, not the floor.
    #[must_use]
    pub fn of(points_in_map: &[Point3<f64>]) -> Option<Self> {
        let mut sorted_m: Vec<f64> = points_in_map.iter().map(|point| point.z).collect();
        sorted_m.sort_unstable_by(f64::total_cmp);
        // From the lowest up, the first height at which a window of twice the inliers' width is full.
        let mut from_m = *sorted_m.first()?;
        let may_be_below = (MAX_SHARE_BELOW * sorted_m.len() as f64) as usize;
        loop {
            let below = sorted_m.partition_point(|&z_m| z_m < from_m);
            if below > may_be_below {
                return None;
            }
            let within = sorted_m.partition_point(|&z_m| z_m <= from_m + 2.0 * INLIER_M) - below;
            if within >= MIN_POINTS {
                break;
            }
            // On to the next layer that holds anything new.
            let next_m = *sorted_m.get(below)?;
            let higher_m = (from_m + LAYER_M).max(next_m);
            // Numbers so large that a layer is nothing to them are no floor.
            if higher_m <= from_m {
                return None;
            }
            from_m = higher_m;
        }
        let mut floor = Self { along_x: 0.0, along_y: 0.0, height_m: from_m + INLIER_M };
        for _ in 0..FITS {
            floor = floor.fitted(points_in_map)?;
        }
        floor.is_under(points_in_map).then_some(floor)
    }

    /// Whether hardly anything lies below.
    #[must_use]
    pub fn is_under(&self, points_in_map: &[Point3<f64>]) -> bool {
        let below =
            points_in_map.iter().filter(|point| self.height_above_m(point) < -BELOW_M).count();
        below as f64 <= MAX_SHARE_BELOW * points_in_map.len() as f64
    }

    fn fitted(&self, points_in_map: &[Point3<f64>]) -> Option<Self> {
        let inliers: Vec<&Point3<f64>> = points_in_map
            .iter()
            .filter(|point| self.height_above_m(point).abs() <= INLIER_M)
            .collect();
        if inliers.len() < MIN_POINTS {
            return None;
        }
        let sum: Vector3<f64> = inliers.iter().map(|point| point.coords).sum();
        let mean = sum / inliers.len() as f64;
        let mut scatter = Matrix3::zeros();
        let (mut least, mut most) = (mean, mean);
        for point in inliers {
            let offset = point.coords - mean;
            scatter += offset * offset.transpose();
            least = least.inf(&point.coords);
            most = most.sup(&point.coords);
        }
        if (most - least).xy().min() < MIN_REACH_M {
            return None;
        }
        let horizontal = scatter.fixed_view::<2, 2>(0, 0).into_owned();
        let slopes = horizontal.try_inverse()? * scatter.fixed_view::<2, 1>(0, 2);
        (slopes.norm() <= MAX_SLOPE).then(|| Self {
            along_x: slopes.x,
            along_y: slopes.y,
            height_m: mean.z - slopes.dot(&mean.xy()),
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A level patch of points 8 cm apart, some millimetres up and down.
    fn patch(
        x_m: std::ops::Range<i32>,
        y_m: std::ops::Range<i32>,
        z_m: f64,
        slope: f64,
    ) -> Vec<Point3<f64>> {
        x_m.flat_map(|x| y_m.clone().map(move |y| (x, y)))
            .map(|(x, y)| {
                let (x_m, y_m) = (0.08 * f64::from(x), 0.08 * f64::from(y));
                let noise_m = 0.004 * f64::from((x * 7 + y * 3) % 5 - 2);
                Point3::new(x_m, y_m, z_m + slope * x_m + noise_m)
            })
            .collect()
    }

    #[test]
    fn a_floor_is_found_under_furniture_whatever_its_height() {
        for (height_m, slope) in [(-0.1, 0.0), (-1.2, 0.05), (-2.0, -0.05)] {
            let mut points = patch(20..50, -15..15, height_m, slope);
            points.extend(patch(20..30, -15..15, height_m + 0.7, slope));
            points.push(Point3::new(2.0, 0.0, height_m - 1.0));
            let floor = Floor::of(&points).unwrap();
            let foot = Point3::new(3.0, 0.5, height_m + slope * 3.0 + 0.06);
            assert!((floor.height_above_m(&foot) - 0.06).abs() < 0.01);
        }
    }

    #[test]
    fn a_table_over_what_lies_lower_and_a_wall_alone_are_none() {
        let mut table = patch(20..40, -10..10, -0.5, 0.0);
        let legs = (0..20).map(|z| Point3::new(2.0, 0.0, -1.2 + 0.03 * f64::from(z)));
        table.extend(legs);
        assert_eq!(Floor::of(&table), None);
        let wall: Vec<_> = (0..20)
            .flat_map(|y| {
                (0..20).map(move |z| Point3::new(4.0, 0.08 * f64::from(y), 0.08 * f64::from(z)))
            })
            .collect();
        assert_eq!(Floor::of(&wall), None);
        assert_eq!(Floor::of(&[]), None);
    }

    proptest! {
        #[test]
        fn no_cloud_does_harm(
            coordinates in prop::collection::vec(prop::array::uniform3(-1e6..1e6_f64), 0..80),
        ) {
            let points: Vec<_> = coordinates.into_iter().map(Point3::from).collect();
            let _ = Floor::of(&points);
        }
    }
}
