//! How far the camera sees to the sides and up, in slopes: how far to the left, or up, a ray goes for each metre forward.

use nalgebra::Point3;

use crate::cycle_points::{CyclePoints, slopes_of};

/// The right, the left and the upper border of the view. The image has more columns than some cameras ever measure in, so it is the widest
/// that points showed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct View {
    /// The slope of its right border.
    pub right: f64,
    /// The slope of its left border.
    pub left: f64,
    /// The slope of its upper border.
    pub top: f64,
}

impl Default for View {
    fn default() -> Self {
        Self { right: f64::INFINITY, left: f64::NEG_INFINITY, top: f64::NEG_INFINITY }
    }
}

impl View {
    /// Takes in what a cycle shows.
    pub fn widen(&mut self, points: &CyclePoints<'_>) {
        for slopes in points.slopes.iter().flatten() {
            self.right = self.right.min(slopes.x);
            self.left = self.left.max(slopes.x);
            self.top = self.top.max(slopes.y);
        }
    }

    /// Whether a place of the map lies between its borders, however high.
    pub(crate) fn has_bearing_of(
        &self,
        points: &CyclePoints<'_>,
        place_in_map: &Point3<f64>,
    ) -> bool {
        let slopes = slopes_of(&points.ray_to_m(place_in_map));
        slopes.is_some_and(|slopes| (self.right..=self.left).contains(&slopes.x))
    }

    /// Whether a point is no farther from one of its borders than by a slope.
    pub(crate) fn is_at_border(&self, points: &CyclePoints<'_>, point: usize, by: f64) -> bool {
        let slopes = points.slopes.get(point).copied().flatten();
        slopes.is_some_and(|slopes| slopes.x <= self.right + by || slopes.x >= self.left - by)
    }
}

#[cfg(test)]
mod tests {
    use geometry::{Cloud, CycleSetup, DetectedCycle, Stamp, VoxelGrid};

    use super::*;

    fn cycle_of(points_m: Vec<Point3<f32>>) -> DetectedCycle {
        let stamp = Stamp::default();
        DetectedCycle {
            index: 0,
            setup: CycleSetup::default(),
            scan_stamp: stamp,
            voxel_points: vec![1; points_m.len()],
            points_before_reduction: points_m.len(),
            reduced_cloud: Cloud { stamp, frame_id: "rig".to_owned(), points_m },
            map_from_rig: nalgebra::Isometry3::identity(),
            map_from_continuous: None,
            map_frame_id: "map".to_owned(),
            zones: Vec::new(),
            moving_beams: Vec::new(),
            depth: None,
            scan_rays: std::sync::Arc::default(),
        }
    }

    #[test]
    fn it_is_as_wide_as_what_was_seen_before_the_camera() {
        let seen = [[2.0, 1.0, 0.0], [2.0, -0.6, 1.0], [-3.0, 9.0, 0.0], [0.05, 9.0, 0.0]];
        let cycle = cycle_of(seen.map(Point3::from).to_vec());
        let points = CyclePoints::of(&cycle, &VoxelGrid::new(0.08).unwrap());
        let mut view = View::default();
        assert!(!view.has_bearing_of(&points, &Point3::new(2.0, 0.0, 0.0)), "nothing was seen");
        view.widen(&points);
        assert_eq!((view.right as f32, view.left), (-0.3, 0.5));
        for (place, is_between) in [
            ([4.0, 2.0, 5.0], true),
            ([4.0, 2.1, 0.0], false),
            ([4.0, -1.1, -5.0], true),
            ([4.0, -1.3, 0.0], false),
            ([-4.0, 0.0, 0.0], false),
            ([f64::NAN, 0.0, 0.0], false),
        ] {
            assert_eq!(view.has_bearing_of(&points, &place.into()), is_between, "{place:?}");
        }
    }
}
