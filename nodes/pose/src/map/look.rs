//! The appearance of a landmark, by all keyframes that see it.

use nalgebra::{Point3, Vector3};

use super::{Keyframe, LineId, Map, MapConfig, MapError, PointId, PointLook};

impl Map {
    /// Recomputes the appearance of a point, after others have seen it or it has moved: the descriptor that differs least
    /// from all others (by the median), the mean direction it is seen from, and the range of distances, by the keyframe
    /// that has seen it longest (Mur-Artal et al. 2015, section III-C).
    ///
    /// # Errors
    /// When it is not there.
    pub fn refresh_point(&mut self, id: PointId) -> Result<(), MapError> {
        let point = self.points.get(id).ok_or(MapError::NoLandmark)?;
        let mut descriptors = Vec::with_capacity(point.sightings.count());
        let mut direction = Vector3::zeros();
        let mut first: Option<(u64, PointLook)> = None;
        for (keyframe, corner) in point.sightings.iter() {
            let Some(keyframe) = self.keyframes.get(keyframe) else { continue };
            let look = of_one(&self.config, keyframe, corner, &point.position_m);
            let Some(look) = look else { continue };
            descriptors.push(look.descriptor);
            direction += look.towards_cameras;
            if first.is_none_or(|(number, _)| keyframe.number < number) {
                first = Some((keyframe.number, look));
            }
        }
        let Some((_, mut look)) = first else { return Ok(()) };
        if let Some(typical) = typical(&descriptors, |one, other| one.distance(other)) {
            look.descriptor = descriptors[typical];
        }
        look.towards_cameras = direction.try_normalize(0.0).unwrap_or(look.towards_cameras);
        if let Some(point) = self.points.get_mut(id) {
            point.look = look;
        }
        Ok(())
    }

    /// Recomputes the appearance of a line.
    ///
    /// # Errors
    /// When it is not there.
    pub fn refresh_line(&mut self, id: LineId) -> Result<(), MapError> {
        let line = self.lines.get(id).ok_or(MapError::NoLandmark)?;
        let descriptors: Vec<_> = line
            .sightings
            .iter()
            .filter_map(|(keyframe, segment)| {
                Some(self.keyframes.get(keyframe)?.frame.lines.get(segment)?.descriptor)
            })
            .collect();
        let typical = typical(&descriptors, |one, other| one.distance_bits(other));
        if let (Some(typical), Some(line)) = (typical, self.lines.get_mut(id)) {
            line.descriptor = descriptors[typical];
        }
        Ok(())
    }
}

/// The descriptor of a point in one keyframe. `None` where there is no such corner, or the point is at the camera's centre.
pub(super) fn of_one(
    config: &MapConfig,
    keyframe: &Keyframe,
    corner: usize,
    position_m: &Point3<f64>,
) -> Option<PointLook> {
    let corner = keyframe.frame.corners.get(corner)?;
    let camera_m = keyframe.camera_from_map.inverse_transform_point(&Point3::origin());
    let to_camera = camera_m - position_m;
    let distance_m = to_camera.norm();
    let towards_cameras = to_camera.try_normalize(f64::EPSILON)?;
    let steps = |levels: i32| config.scale_factor.powi(levels);
    let farthest_m = distance_m * steps(i32::from(corner.level));
    let nearest_m = farthest_m / steps(i32::from(config.levels) - 1);
    Some(PointLook { descriptor: corner.descriptor, towards_cameras, nearest_m, farthest_m })
}

/// Which of them has the least median distance from the others; of equal ones the first.
fn typical<D>(descriptors: &[D], distance: impl Fn(&D, &D) -> u32) -> Option<usize> {
    let median = |one: &D| {
        let mut distances: Vec<u32> =
            descriptors.iter().map(|other| distance(one, other)).collect();
        distances.sort_unstable();
        distances.get(distances.len() / 2).copied()
    };
    (0..descriptors.len()).min_by_key(|index| median(&descriptors[*index]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_typical_one_is_in_the_middle_of_most() {
        let distance = |one: &i32, other: &i32| one.abs_diff(*other);
        assert_eq!(typical(&[0, 100, 9, 10, 11], distance), Some(3));
        assert_eq!(typical(&[5, 5], distance), Some(0));
        assert_eq!(typical(&[], distance), None);
    }
}
