//! How far the camera sees to the sides, in slopes: how far to the left a ray goes for each metre forward in the rig.

use geometry::DetectedCycle;
use nalgebra::{Point3, Vector2};

/// A point nearer to the camera's plane than this has no slope that means anything.
pub(crate) const MIN_SLOPE_DEPTH_M: f64 = 0.1;

/// The right and the left border of the view. The image has more columns than some cameras ever measure in, so it is the widest
/// that points showed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct View {
    /// The slope of its right border.
    pub right: f64,
    /// The slope of its left border.
    pub left: f64,
}

impl Default for View {
    fn default() -> Self {
        Self { right: f64::INFINITY, left: f64::NEG_INFINITY }
    }
}

impl View {
    /// Takes in what a cycle shows.
    pub fn widen(&mut self, cycle: &DetectedCycle) {
        for point in &cycle.reduced_cloud.points_m {
            if let Some(slopes) = slopes(cycle, &point.cast::<f64>()) {
                self.right = self.right.min(slopes.x);
                self.left = self.left.max(slopes.x);
            }
        }
    }

    /// Whether a point of the map lies between its borders, however high.
    pub(crate) fn has_bearing_of(&self, cycle: &DetectedCycle, point_in_map: &Point3<f64>) -> bool {
        let in_rig = cycle.continuous_from_rig().inverse_transform_point(point_in_map);
        slopes(cycle, &in_rig).is_some_and(|slopes| (self.right..=self.left).contains(&slopes.x))
    }

    /// Whether a point of the rig is no farther from one of its borders than by a slope.
    pub(crate) fn is_at_border(
        &self,
        cycle: &DetectedCycle,
        point_in_rig: &Point3<f64>,
        by: f64,
    ) -> bool {
        slopes(cycle, point_in_rig)
            .is_some_and(|slopes| slopes.x <= self.right + by || slopes.x >= self.left - by)
    }
}

/// Sideways and upward slope of the ray from the camera to a point; `None` beside or behind the camera, and for points that are
/// not finite.
pub(crate) fn slopes(cycle: &DetectedCycle, point_in_rig: &Point3<f64>) -> Option<Vector2<f64>> {
    let ray_m = point_in_rig - cycle.setup.mounts.camera_in_rig_m();
    let is_finite = ray_m.iter().all(|along_m| along_m.is_finite());
    (is_finite && ray_m.x > MIN_SLOPE_DEPTH_M).then(|| Vector2::new(ray_m.y, ray_m.z) / ray_m.x)
}

#[cfg(test)]
mod tests {
    use geometry::{Cloud, CycleSetup, Stamp};

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
        let mut view = View::default();
        assert!(!view.has_bearing_of(&cycle, &Point3::new(2.0, 0.0, 0.0)), "nothing was seen");
        view.widen(&cycle);
        assert_eq!((view.right as f32, view.left), (-0.3, 0.5));
        for (place, is_between) in [
            ([4.0, 2.0, 5.0], true),
            ([4.0, 2.1, 0.0], false),
            ([4.0, -1.1, -5.0], true),
            ([4.0, -1.3, 0.0], false),
            ([-4.0, 0.0, 0.0], false),
            ([f64::NAN, 0.0, 0.0], false),
        ] {
            assert_eq!(view.has_bearing_of(&cycle, &place.into()), is_between, "{place:?}");
        }
    }
}
