//! The floor: the lowest horizontal plane, so that feet are cut from it.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

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

/// The plane of the floor, in the frame of the points that it was found in: the map's, or another that sees it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Floor {
    /// How the height above the floor grows along each axis.
    up: Vector3<f64>,
    /// The height of the frame's origin above the floor.
    origin_m: f64,
}

impl Floor {
    /// How high a point is above the floor, along the map's z axis; negative below.
    #[must_use]
    pub fn height_above_m(&self, point: &Point3<f64>) -> f64 {
        self.up.dot(&point.coords) + self.origin_m
    }

    /// How the height above the floor grows along a vector.
    #[must_use]
    pub fn along(&self, vector: &Vector3<f64>) -> f64 {
        self.up.dot(vector)
    }

    /// The floor as another frame sees it.
    #[must_use]
    pub fn seen_from(&self, frame_from_other: &Isometry3<f64>) -> Self {
        Self {
            up: frame_from_other.rotation.inverse_transform_vector(&self.up),
            origin_m: self.height_above_m(&frame_from_other.translation.vector.into()),
        }
    }

    /// The floor under these points, or `None` where they show none.
    ///
    /// Every point must be finite. The lowest layer with enough points that reach far enough is fitted by
    /// least squares; with more than a few points below it, it is a table, not the floor.
    #[must_use]
    pub fn of(points_in_map: &[Point3<f64>]) -> Option<Self> {
        let may_be_below = (MAX_SHARE_BELOW * points_in_map.len() as f64) as usize;
        let sorted_m = lowest_sorted_m(points_in_map, may_be_below);
        // From the lowest up, the first height at which a window of twice the inliers' width is full.
        let mut from_m = *sorted_m.first()?;
        let middle_m = loop {
            let below = sorted_m.partition_point(|&z_m| z_m < from_m);
            if below > may_be_below {
                return None;
            }
            let within = sorted_m.partition_point(|&z_m| z_m <= from_m + 2.0 * INLIER_M) - below;
            if within >= MIN_POINTS {
                let layer_m = sorted_m.get(below..below + within)?;
                break layer_m.iter().sum::<f64>() / within as f64;
            }
            // On to the next layer that holds anything new.
            let next_m = *sorted_m.get(below)?;
            let higher_m = (from_m + LAYER_M).max(next_m);
            // Numbers so large that a layer is nothing to them are no floor.
            if higher_m <= from_m {
                return None;
            }
            from_m = higher_m;
        };
        let mut floor = Self { up: Vector3::z(), origin_m: -middle_m };
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
            up: Vector3::new(-slopes.x, -slopes.y, 1.0),
            origin_m: slopes.dot(&mean.xy()) - mean.z,
        })
    }
}

/// The heights of the points, from the lowest up, as far as a window reaches that begins no higher than the lowest one with so many
/// below it.
fn lowest_sorted_m(points_in_map: &[Point3<f64>], below: usize) -> Vec<f64> {
    let mut heights_m: Vec<f64> = points_in_map.iter().map(|point| point.z).collect();
    if below < heights_m.len() {
        let (_, highest_m, _) = heights_m.select_nth_unstable_by(below, f64::total_cmp);
        let most_m = *highest_m + 2.0 * INLIER_M;
        heights_m.retain(|height_m| *height_m <= most_m);
    }
    heights_m.sort_unstable_by(f64::total_cmp);
    heights_m
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
            // A rig that is tilted sees the foot as high.
            let rig = Isometry3::new(Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.2, 0.4, -0.1));
            let in_rig = rig.inverse_transform_point(&foot);
            let seen_m = floor.seen_from(&rig).height_above_m(&in_rig);
            assert!((seen_m - floor.height_above_m(&foot)).abs() < 1e-12);
        }
    }

    /// Regression: of a floor without any noise, as a simulator's camera sees it, all points were on the border of the first layer, and by
    /// the rounding of its height beyond it.
    #[test]
    fn a_floor_without_noise_is_found_at_each_height() {
        for step in 0..400 {
            let height_m = -2.0 + 0.01 * f64::from(step);
            let points: Vec<_> = patch(20..50, -15..15, 0.0, 0.0)
                .into_iter()
                .map(|point| Point3::new(point.x, point.y, height_m))
                .collect();
            let floor = Floor::of(&points).unwrap_or_else(|| panic!("none at {height_m} m"));
            assert!(floor.height_above_m(&Point3::new(3.0, 0.0, height_m)).abs() < 1e-9);
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

        #[test]
        fn the_lowest_heights_are_the_first_of_all(
            heights_m in prop::collection::vec(-2.0..2.0_f64, 1..300), below in 0..300_usize,
        ) {
            let points: Vec<_> = heights_m.iter().map(|z_m| Point3::new(0.0, 0.0, *z_m)).collect();
            let mut sorted_m = heights_m;
            sorted_m.sort_unstable_by(f64::total_cmp);
            let lowest_m = lowest_sorted_m(&points, below);
            prop_assert_eq!(&lowest_m, &sorted_m[..lowest_m.len()]);
            let highest_m = sorted_m.get(below).copied().unwrap_or(f64::INFINITY);
            let beyond = &sorted_m[lowest_m.len()..];
            prop_assert!(beyond.iter().all(|z_m| *z_m > highest_m + 2.0 * INLIER_M));
        }
    }
}
