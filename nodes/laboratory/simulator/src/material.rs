//! The optical properties of surfaces.

use serde::{Deserialize, Serialize};

use crate::{Paint, Texture};

/// The share of a sensor's light that a surface returns to it.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// The share of near infrared light that it scatters, in `[0, 1]`.
    pub reflectivity: f64,
    /// Beyond this angle between ray and normal it reflects the light away and returns nothing; in
    /// `(0, pi/2)`. A matt surface stays visible to about 80 degrees, a polished one to much less.
    pub max_incidence_rad: f64,
    /// The share of transmitted light, in `[0, 1]`; 0 for opaque surfaces.
    ///
    /// A surface that transmits light is a pane: it returns nothing itself, attenuates the signal from behind it on both
    /// ways, and beyond `max_incidence_rad` it reflects the light away.
    #[serde(default)]
    pub transmission: f64,
    /// The appearance in a colour image; by default gray, as bright as it is reflective, with some grain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paint: Option<Paint>,
}

impl Material {
    /// Painted plaster.
    pub const PLASTER: Self = Self::matt(0.8).painted(Paint::grained([0.72, 0.7, 0.64], 0.05));
    /// Light wood.
    pub const WOOD: Self = Self::matt(0.55).painted(Paint::with(
        [0.36, 0.21, 0.1],
        Texture::Boards { size_m: [1.1, 0.11], joint_m: 0.002, contrast: 0.25, staggered: true },
        0.12,
    ));
    /// Clothes of a medium shade.
    pub const CLOTH: Self = Self::matt(0.35).painted(Paint::with(
        [0.1, 0.15, 0.32],
        Texture::Noise { size_m: 0.25, contrast: 0.4 },
        0.2,
    ));
    /// Skin.
    pub const SKIN: Self = Self::matt(0.5).painted(Paint::grained([0.55, 0.34, 0.25], 0.08));
    /// White card: the robot's screen.
    pub const CARD: Self = Self::matt(0.75).painted(Paint::grained([0.8, 0.78, 0.7], 0.05));
    /// Dark plastic.
    pub const DARK_PLASTIC: Self = Self::matt(0.2).painted(Paint::grained([0.05, 0.05, 0.06], 0.1));
    /// A display that is off: near black. Depth cameras leave a hole there.
    pub const BLACK_GLASS: Self =
        Self::polished(0.03, 0.7).painted(Paint::plain([0.015, 0.015, 0.02]));
    /// Leaves: bright in the near infrared, whatever their shade of green.
    pub const LEAVES: Self = Self::matt(0.5).painted(Paint::with(
        [0.07, 0.24, 0.05],
        Texture::Noise { size_m: 0.07, contrast: 0.7 },
        0.0,
    ));
    /// Dark wallpaper, dark wood: measured by a depth camera at 5 m at normal incidence, lost at oblique incidence.
    pub const DARK: Self = Self::matt(0.3).painted(Paint::with(
        [0.13, 0.09, 0.07],
        Texture::Noise { size_m: 0.3, contrast: 0.35 },
        0.1,
    ));
    /// Black velvet, black leather: too dark for both sensors from about 3 m on.
    pub const BLACK: Self = Self::matt(0.04).painted(Paint::grained([0.02, 0.02, 0.02], 0.2));
    /// Varnish and enamel: a fridge, a whiteboard, a cabinet of painted steel.
    pub const VARNISH: Self =
        Self::polished(0.7, 0.6).painted(Paint::grained([0.68, 0.7, 0.69], 0.02));
    /// Bare polished metal: measured only when it faces the sensor, within 20 degrees.
    pub const POLISHED_METAL: Self =
        Self::polished(0.6, 0.35).painted(Paint::grained([0.42, 0.43, 0.45], 0.1));
    /// Window glass: each face returns 4 % of what meets it squarely, so 92 % go through, and from 75
    /// degrees on most is mirrored (Fresnel, refractive index 1.5).
    pub const GLASS: Self =
        Self { reflectivity: 0.0, max_incidence_rad: 1.309, transmission: 0.92, paint: None };

    /// A matt surface: visible up to 80 degrees of incidence.
    #[must_use]
    pub const fn matt(reflectivity: f64) -> Self {
        Self::polished(reflectivity, 1.396)
    }

    /// The same surface in another colour.
    #[must_use]
    pub const fn painted(self, paint: Paint) -> Self {
        Self { paint: Some(paint), ..self }
    }

    /// Its paint in a colour image.
    #[must_use]
    pub fn visible_paint(&self) -> Paint {
        self.paint.unwrap_or(Paint::grained([self.reflectivity; 3], 0.15))
    }

    /// A surface that reflects the light away beyond an angle of incidence.
    #[must_use]
    pub const fn polished(reflectivity: f64, max_incidence_rad: f64) -> Self {
        Self { reflectivity, max_incidence_rad, transmission: 0.0, paint: None }
    }
}
