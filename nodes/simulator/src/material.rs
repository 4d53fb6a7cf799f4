//! What a surface gives back.

use serde::{Deserialize, Serialize};

/// How much of a sensor's light a surface sends back to it.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// The share of near infrared light that it scatters, in `[0, 1]`.
    pub reflectivity: f64,
    /// Beyond this angle between ray and normal it mirrors the light away and returns nothing; in
    /// `(0, pi/2)`. A matt surface stays visible to about 80 degrees, a polished one to much less.
    pub max_incidence_rad: f64,
}

impl Material {
    /// Painted plaster.
    pub const PLASTER: Self = Self::matt(0.8);
    /// Light wood.
    pub const WOOD: Self = Self::matt(0.55);
    /// Clothes of a middling shade.
    pub const CLOTH: Self = Self::matt(0.35);
    /// Skin.
    pub const SKIN: Self = Self::matt(0.5);
    /// White card: the robot's screen.
    pub const CARD: Self = Self::matt(0.75);
    /// Dark plastic.
    pub const DARK_PLASTIC: Self = Self::matt(0.2);
    /// A display that is off: near black. Depth cameras leave a hole there.
    pub const BLACK_GLASS: Self = Self { reflectivity: 0.03, max_incidence_rad: 0.7 };

    /// A matt surface: visible up to 80 degrees of incidence.
    #[must_use]
    pub const fn matt(reflectivity: f64) -> Self {
        Self { reflectivity, max_incidence_rad: 1.396 }
    }
}
