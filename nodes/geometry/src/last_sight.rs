//! How a map was seen last: what has gone by the next start is then told from what the camera cannot see, as within one run.

use nalgebra::Point3;

/// From where a part of a map was seen when it was seen last, and for how long it had been there by then.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LastSight {
    /// The middle of the part, in the frame of the map, in metres: of a block of 8 voxels an axis.
    pub middle_m: Point3<f32>,
    /// Where the camera was, in the frame of the map, in metres.
    pub from_m: Point3<f32>,
    /// The time from the first image that showed it to the last, in seconds.
    pub lasted_s: f32,
}

impl LastSight {
    /// Middle, place of the camera, time.
    pub(crate) const NUMBERS: usize = 7;

    pub(crate) fn numbers(&self) -> [f32; Self::NUMBERS] {
        let ([x, y, z], [from_x, from_y, from_z]) = (self.middle_m.into(), self.from_m.into());
        [x, y, z, from_x, from_y, from_z, self.lasted_s]
    }

    /// `None` of numbers that are not finite, or of a negative time.
    pub(crate) fn of_numbers(numbers: [f32; Self::NUMBERS]) -> Option<Self> {
        let [x, y, z, from_x, from_y, from_z, lasted_s] = numbers;
        let (middle_m, from_m) = (Point3::new(x, y, z), Point3::new(from_x, from_y, from_z));
        let is_one = numbers.iter().all(|number| number.is_finite()) && lasted_s >= 0.0;
        is_one.then_some(Self { middle_m, from_m, lasted_s })
    }
}
