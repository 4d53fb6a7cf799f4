//! From where a map is seen, and which of its places lie at which pixels. The projection is parallel: equal lengths are equally long.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point3, Rotation3, Vector3};

/// How steeply an oblique view looks down: a wall of a room's height hides a strip of the floor behind it that is not wider than it.
const OBLIQUE_RAD: f64 = 0.87;
/// How far an oblique view is from the right of the direction in which the rig looks.
const ASIDE_RAD: f64 = 0.5;
/// Share of the picture that is free at each of its sides.
const MARGIN_SHARE: f64 = 0.04;
/// A smaller map is drawn no larger than one of this size.
const LEAST_SIZE_M: f64 = 1.0;

/// From where.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Eye {
    /// From above: x to the right, y up.
    Above,
    /// From obliquely above, from behind the rig and from its right.
    Oblique,
}

/// A view: its axes in the map frame, its scale, and its place in the picture.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Projection {
    right: Vector3<f64>,
    up: Vector3<f64>,
    px_per_m: f64,
    /// What lies at the left and the lower edge of the picture, along `right` and `up`.
    origin_m: [f64; 2],
    size_px: (usize, usize),
}

impl Projection {
    /// The axes of a view; a picture of one pixel. `heading` is level and of length 1.
    pub(super) fn towards(eye: Eye, heading: &Vector3<f64>) -> Self {
        let (ahead, down_rad) = match eye {
            Eye::Above => (Vector3::y(), FRAC_PI_2),
            Eye::Oblique => {
                (Rotation3::from_axis_angle(&Vector3::z_axis(), ASIDE_RAD) * heading, OBLIQUE_RAD)
            }
        };
        let (sine, cosine) = down_rad.sin_cos();
        Self {
            right: ahead.cross(&Vector3::z()),
            up: ahead * sine + Vector3::z() * cosine,
            px_per_m: 1.0,
            origin_m: [0.0; 2],
            size_px: (1, 1),
        }
    }

    /// The same view in a picture that has these ranges across and upwards within its margins, of such a size at most.
    pub(super) fn fitted(
        self,
        ranges_m: [Option<[f64; 2]>; 2],
        (width_px, height_px): (usize, usize),
    ) -> Self {
        let ends_m = ranges_m.map(|range_m| range_m.unwrap_or([0.0; 2]));
        // Of half the values first: the differences of the largest numbers are none.
        let middles_m = ends_m.map(|[low_m, high_m]| low_m / 2.0 + high_m / 2.0);
        let sizes_m = ends_m.map(|[low_m, high_m]| (high_m - low_m).max(LEAST_SIZE_M));
        let inner_px = |px: usize| (px as f64 * (1.0 - 2.0 * MARGIN_SHARE)).max(1.0);
        let px_per_m = (inner_px(width_px) / sizes_m[0]).min(inner_px(height_px) / sizes_m[1]);
        let px = |size_m: f64, most_px: usize| {
            let wanted_px = (size_m * px_per_m / (1.0 - 2.0 * MARGIN_SHARE)).ceil();
            (wanted_px as usize).clamp(1, most_px.max(1))
        };
        let size_px = (px(sizes_m[0], width_px), px(sizes_m[1], height_px));
        let origin_m = [
            middles_m[0] - size_px.0 as f64 / 2.0 / px_per_m,
            middles_m[1] - size_px.1 as f64 / 2.0 / px_per_m,
        ];
        Self { px_per_m, origin_m, size_px, ..self }
    }

    /// Columns and rows of the picture.
    pub(super) fn size_px(&self) -> (usize, usize) {
        self.size_px
    }

    pub(super) fn px_per_m(&self) -> f64 {
        self.px_per_m
    }

    /// The direction to the eye, of length 1.
    pub(super) fn eye_direction(&self) -> Vector3<f64> {
        self.right.cross(&self.up)
    }

    /// The direction to the light: over the left shoulder. Of length 1.
    pub(super) fn light_direction(&self) -> Vector3<f64> {
        (self.eye_direction() - 0.5 * self.right + 0.5 * self.up).normalize()
    }

    /// How far a place is to the right, in metres.
    pub(super) fn across(&self, at_m: &Point3<f64>) -> f64 {
        self.right.dot(&at_m.coords)
    }

    /// How far up in the picture a place is, in metres.
    pub(super) fn upwards(&self, at_m: &Point3<f64>) -> f64 {
        self.up.dot(&at_m.coords)
    }

    /// How near to the eye a place is, in metres from the origin of the map.
    pub(super) fn nearness_m(&self, at_m: &Point3<f64>) -> f64 {
        self.eye_direction().dot(&at_m.coords)
    }

    /// The place in the picture: columns from its left edge, rows from its upper edge. It may lie outside.
    pub(super) fn place_px(&self, at_m: &Point3<f64>) -> [f64; 2] {
        let column = (self.across(at_m) - self.origin_m[0]) * self.px_per_m;
        let row = self.size_px.1 as f64 - (self.upwards(at_m) - self.origin_m[1]) * self.px_per_m;
        [column, row]
    }

    /// The pixel that a place is in, also outside of the picture.
    pub(super) fn pixel_of(&self, at_m: &Point3<f64>) -> (i64, i64) {
        // The casts saturate.
        let [column, row] = self.place_px(at_m).map(|px| px.floor() as i64);
        (column, row)
    }
}
