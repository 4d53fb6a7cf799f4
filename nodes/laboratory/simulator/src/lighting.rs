//! The light on surfaces.

use std::borrow::Cow;

use nalgebra::{Isometry3, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// Fixed lights. Surfaces are Lambertian; there are no shadows.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Lighting {
    /// Ambient light: at 1 a white surface is white in the image.
    pub ambient: f64,
    /// Point lights.
    pub lamps: Vec<Lamp>,
    /// Start and end of a time without light, in seconds since the start. A depth camera has its own light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dark_s: Option<[f64; 2]>,
}

/// A point light. One that is far away and correspondingly brighter is a sun.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lamp {
    /// The position in the room.
    pub position_m: [f64; 3],
    /// The light on a surface that faces it from 1 m away: at 1 a white surface is white in the image. It falls with the
    /// square of the distance.
    pub brightness: f64,
}

/// The size of a lamp, which bounds the light on near surfaces.
const LAMP_SIZE_M: f64 = 0.6;
/// How much more of the ambient light comes from above than from below, as a share of it.
const AMBIENT_FROM_ABOVE: f64 = 0.15;

impl Default for Lighting {
    /// A bright day: a sun behind, to the left and above, and ambient light.
    fn default() -> Self {
        let position_m = [-300.0, 200.0, 450.0];
        let distance_m = Point3::from(position_m).coords.norm();
        let sun = Lamp { position_m, brightness: 0.6 * distance_m * distance_m };
        Self::of_lamps(0.5, vec![sun])
    }
}

impl Lighting {
    /// Ambient light and lamps.
    #[must_use]
    pub fn of_lamps(ambient: f64, lamps: Vec<Lamp>) -> Self {
        Self { ambient, lamps, dark_s: None }
    }

    /// Two lamps below the ceiling of a room that reaches from x = 0 to `depth_m`, with y = 0 in its middle.
    #[must_use]
    pub fn of_room(depth_m: f64, width_m: f64, height_m: f64) -> Self {
        /// Of a room 6 m wide; larger ones have brighter lamps.
        const BRIGHTNESS: f64 = 1.9;
        let lamp = |x_share: f64, y_share: f64| Lamp {
            position_m: [x_share * depth_m, y_share * width_m, height_m - 0.3],
            brightness: BRIGHTNESS * (depth_m * width_m / 30.0).max(0.5),
        };
        Self::of_lamps(0.38, vec![lamp(0.3, -0.2), lamp(0.7, 0.23)])
    }

    /// The light at a time, in seconds since the start.
    pub(crate) fn at(&self, time_s: f64) -> Cow<'_, Self> {
        match self.dark_s {
            Some([from_s, until_s]) if time_s >= from_s && time_s < until_s => {
                Cow::Owned(Self::of_lamps(0.0, Vec::new()))
            }
            _ => Cow::Borrowed(self),
        }
    }

    /// The lights as seen from a solid.
    pub(crate) fn in_frame(&self, solid_from_room: &Isometry3<f64>) -> LocalLighting {
        LocalLighting {
            ambient: self.ambient,
            up: solid_from_room * Vector3::z(),
            lamps: self
                .lamps
                .iter()
                .map(|lamp| (solid_from_room * Point3::from(lamp.position_m), lamp.brightness))
                .collect(),
        }
    }
}

/// Lights in the frame of a solid.
#[derive(Clone, Debug)]
pub(crate) struct LocalLighting {
    ambient: f64,
    up: Vector3<f64>,
    lamps: Vec<(Point3<f64>, f64)>,
}

impl LocalLighting {
    /// The light on a point of a surface with this unit normal, which points to the visible side.
    pub(crate) fn on(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        let ambient = self.ambient * (1.0 + AMBIENT_FROM_ABOVE * normal.dot(&self.up));
        let from_lamp = |(position, brightness): &(Point3<f64>, f64)| {
            let towards = position - point;
            let squared_m2 = towards.norm_squared();
            let cos = normal.dot(&towards) / squared_m2.sqrt();
            if cos > 0.0 {
                brightness * cos / (squared_m2 + LAMP_SIZE_M * LAMP_SIZE_M)
            } else {
                0.0
            }
        };
        ambient + self.lamps.iter().map(from_lamp).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_falls_with_cosine_and_distance_and_not_on_what_faces_away() {
        let lighting =
            Lighting::of_lamps(0.2, vec![Lamp { position_m: [0.0, 0.0, 100.0], brightness: 5e3 }]);
        let local = lighting.in_frame(&Isometry3::identity());
        let on = |normal: Vector3<f64>| local.on(&Point3::origin(), &normal);
        let aslant = Vector3::new(60.0_f64.to_radians().sin(), 0.0, 0.5);
        assert!((on(Vector3::z()) - 0.2 * 1.15 - 0.5).abs() < 1e-3);
        assert!((on(aslant) - 0.2 * 1.075 - 0.25).abs() < 1e-3);
        assert!((on(-Vector3::z()) - 0.2 * 0.85).abs() < 1e-12);
        let nearer = local.on(&Point3::new(0.0, 0.0, 50.0), &Vector3::z());
        assert!((nearer - 0.23 - 2.0).abs() < 1e-2, "{nearer}");
        // A rotated solid has the same light on the same surface.
        let turn = Isometry3::rotation(Vector3::new(0.3, -0.4, 0.9));
        let turned = lighting.in_frame(&turn).on(&Point3::origin(), &(turn * aslant));
        assert!((turned - on(aslant)).abs() < 1e-9);
    }
}
