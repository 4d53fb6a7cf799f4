//! Features of things that move: no landmarks.

use geometry::{CameraModel, Track};
use nalgebra::{Isometry3, Point2, Point3, Vector3};

use super::Frame;

/// A thing that is known to move, in the map.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MovingThing {
    /// The middle of a box around it, along the axes of the map.
    pub middle_in_map_m: Point3<f64>,
    /// From the middle to the faces.
    pub half_extent_m: Vector3<f64>,
}

/// Which features are left out; all that are not in a list are not.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct LeftOut {
    /// One for each corner.
    pub corners: Vec<bool>,
    /// One for each segment.
    pub lines: Vec<bool>,
}

impl MovingThing {
    /// Where a tracked object is `later_s` after it was seen, with a margin on all sides and three standard deviations of
    /// its track's uncertainty.
    #[must_use]
    pub fn of_track(track: &Track, later_s: f64, margin_m: f64) -> Self {
        const STD_DEVS: f64 = 3.0;
        let shift = track.velocity_m_per_s * later_s;
        let std_dev_m = |axis: usize| {
            let place = track.covariance[(axis, axis)].max(0.0);
            let velocity = track.covariance[(axis + 3, axis + 3)].max(0.0);
            (place + velocity * later_s * later_s).sqrt()
        };
        let unsure_m = STD_DEVS * Vector3::new(std_dev_m(0), std_dev_m(1), std_dev_m(2));
        Self {
            middle_in_map_m: track.position_m + shift,
            half_extent_m: 0.5 * track.extent_m + unsure_m + Vector3::repeat(margin_m),
        }
    }

    /// The same in another frame: a box around the box.
    #[must_use]
    pub fn moved(&self, target_from_map: &Isometry3<f64>) -> Self {
        let rotation = target_from_map.rotation.to_rotation_matrix().into_inner();
        Self {
            middle_in_map_m: target_from_map * self.middle_in_map_m,
            half_extent_m: rotation.abs() * self.half_extent_m,
        }
    }

    fn holds(&self, point_in_map_m: &Point3<f64>) -> bool {
        let off = (point_in_map_m - self.middle_in_map_m).abs();
        (0..3).all(|axis| off[axis] <= self.half_extent_m[axis])
    }

    /// Whether a ray from the camera hits the box.
    fn is_hit_by(&self, origin_m: &Point3<f64>, direction: &Vector3<f64>) -> bool {
        let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let off = self.middle_in_map_m[axis] - origin_m[axis];
            let half = self.half_extent_m[axis];
            // Along an axis that the ray does not follow both are infinite, and of the same sign only outside the box.
            let (one, other) = ((off - half) / direction[axis], (off + half) / direction[axis]);
            enters = enters.max(one.min(other));
            leaves = leaves.min(one.max(other));
        }
        enters <= leaves
    }
}

impl LeftOut {
    /// The features that lie on moving things, as far as depth shows it; what has no depth and lies in front of or behind
    /// one is left out, too.
    #[must_use]
    pub fn on_things(
        things: &[MovingThing],
        frame: &Frame,
        camera: &CameraModel,
        camera_from_map: &Isometry3<f64>,
    ) -> Self {
        if things.is_empty() {
            return Self::default();
        }
        let map_from_camera = camera_from_map.inverse();
        let origin_m = Point3::from(map_from_camera.translation.vector);
        let is_on_thing = |pixel: Point2<f64>, depth_m: Option<f64>| {
            let Some(ray) = camera.ray(&pixel) else { return false };
            let direction = map_from_camera.rotation * ray.push(1.0);
            things.iter().any(|thing| match depth_m {
                Some(depth_m) => thing.holds(&(origin_m + direction * depth_m)),
                None => thing.is_hit_by(&origin_m, &direction),
            })
        };
        let corners = frame.corners.iter().zip(&frame.corner_depths).map(|(corner, depth)| {
            is_on_thing(corner.pixel.cast(), depth.map(|depth| depth.depth_m))
        });
        let lines = frame.lines.iter().zip(&frame.lines_in_space).map(|(line, in_space)| {
            let [start, end] = [line.segment.start_px, line.segment.end_px]
                .map(|pixel| Point2::from(pixel.map(f64::from)));
            let depths_m = in_space.map(|line| [line.start_m.z, line.end_m.z]);
            is_on_thing(start, depths_m.map(|depths_m| depths_m[0]))
                || is_on_thing(end, depths_m.map(|depths_m| depths_m[1]))
        });
        Self { corners: corners.collect(), lines: lines.collect() }
    }

    /// Leaves out more.
    pub fn add(
        &mut self,
        corners: impl Iterator<Item = usize>,
        lines: impl Iterator<Item = usize>,
    ) {
        let mark = |list: &mut Vec<bool>, index: usize| {
            if list.len() <= index {
                list.resize(index + 1, false);
            }
            if let Some(is_left_out) = list.get_mut(index) {
                *is_left_out = true;
            }
        };
        corners.for_each(|index| mark(&mut self.corners, index));
        lines.for_each(|index| mark(&mut self.lines, index));
    }

    /// Leaves out what the other does, too.
    pub fn extend(&mut self, other: &Self) {
        self.add(marked(&other.corners), marked(&other.lines));
    }

    /// Whether a corner is left out.
    #[must_use]
    pub fn has_corner(&self, index: usize) -> bool {
        self.corners.get(index).copied().unwrap_or(false)
    }

    /// Whether a segment is left out.
    #[must_use]
    pub fn has_line(&self, index: usize) -> bool {
        self.lines.get(index).copied().unwrap_or(false)
    }
}

/// The indices of what is marked.
fn marked(list: &[bool]) -> impl Iterator<Item = usize> {
    list.iter().enumerate().filter_map(|(index, is_marked)| is_marked.then_some(index))
}

impl Frame {
    /// The frame without the features that are left out.
    #[must_use]
    pub fn without(&self, left_out: &LeftOut) -> Self {
        let mut frame = self.clone();
        let mut kept = (0..).map(|index| !left_out.has_corner(index));
        frame.corners.retain(|_| kept.next().unwrap_or(true));
        let mut kept = (0..).map(|index| !left_out.has_corner(index));
        frame.corner_depths.retain(|_| kept.next().unwrap_or(true));
        let mut kept = (0..).map(|index| !left_out.has_line(index));
        frame.lines.retain(|_| kept.next().unwrap_or(true));
        let mut kept = (0..).map(|index| !left_out.has_line(index));
        frame.lines_in_space.retain(|_| kept.next().unwrap_or(true));
        frame
    }
}
