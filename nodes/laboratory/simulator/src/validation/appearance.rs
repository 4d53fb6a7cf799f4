//! Paint, lighting and the colour camera.

use super::ranging::check_intrinsics;
use super::{Checked, MAX_LENGTH_M, check_pose, not_negative, number, positive, ratio};
use crate::{ColourCamera, DepthCamera, Lighting, Paint, Texture};

/// The finest pattern: a tenth of a millimetre.
const MIN_PATTERN_M: f64 = 1e-4;
/// The most rays per pixel along an axis, and the most sub-exposures.
const MAX_SUPERSAMPLING: f64 = 8.0;
const MAX_SUB_EXPOSURES: f64 = 256.0;

pub(super) fn check_colour_camera(colour: &ColourCamera, depth: &DepthCamera) -> Checked {
    if let Some(camera) = &colour.camera {
        check_intrinsics("colour_camera", camera)?;
    }
    if let Some(pose) = &colour.rig_from_camera {
        check_pose(pose, "the colour camera")?;
    }
    number(
        "colour_camera.delay_s",
        colour.delay_s,
        |v| v >= 0.0 && v * depth.rate_hz <= 0.5,
        "0 to half of the depth camera's period",
    )?;
    number(
        "colour_camera.exposure_s",
        colour.exposure_s,
        |v| v >= 0.0 && v * depth.rate_hz <= 1.0,
        "0 to the depth camera's period",
    )?;
    let count = |what: &str, value: usize, most: f64, accepted: &'static str| {
        number(what, value as f64, |v| (1.0..=most).contains(&v), accepted)
    };
    let sub_exposures = colour.sub_exposures;
    count("colour_camera.sub_exposures", sub_exposures, MAX_SUB_EXPOSURES, "1 to 256")?;
    count("colour_camera.supersampling", colour.supersampling, MAX_SUPERSAMPLING, "1 to 8")?;
    not_negative("colour_camera.brightness", colour.brightness)?;
    number(
        "colour_camera.white_electrons",
        colour.white_electrons,
        |v| (1.0..=1e15).contains(&v),
        "1 to 1e15",
    )?;
    not_negative("colour_camera.read_noise_electrons", colour.read_noise_electrons)
}

pub(super) fn check_lighting(lighting: &Lighting) -> Checked {
    not_negative("lighting.ambient", lighting.ambient)?;
    for time_s in lighting.dark_s.into_iter().flatten() {
        number("lighting.dark_s", time_s, f64::is_finite, "finite numbers")?;
    }
    for lamp in &lighting.lamps {
        for value in lamp.position_m {
            let what = "the position of a lamp";
            number(what, value, |v| v.abs() <= MAX_LENGTH_M, "-1e6 to 1e6")?;
        }
        number(
            "the brightness of a lamp",
            lamp.brightness,
            |v| (0.0..=1e12).contains(&v),
            "0 to 1e12",
        )?;
    }
    Ok(())
}

pub(super) fn check_paint(paint: &Paint, of: &str) -> Checked {
    let colour = |what: &str, colour: &[f64; 3]| {
        colour.iter().try_for_each(|&channel| ratio(&format!("{what} of {of}"), channel))
    };
    let size = |what: &str, value_m: f64| {
        number(
            &format!("{what} of {of}"),
            value_m,
            |v| (MIN_PATTERN_M..=MAX_LENGTH_M).contains(&v),
            "0.0001 to 1e6",
        )
    };
    colour("paint.colour", &paint.colour)?;
    ratio(&format!("paint.grain of {of}"), paint.grain)?;
    match &paint.texture {
        Texture::Plain => Ok(()),
        Texture::Noise { size_m, contrast } => {
            size("noise.size_m", *size_m)?;
            ratio(&format!("noise.contrast of {of}"), *contrast)
        }
        Texture::Checker { size_m, other } => {
            size("checker.size_m", *size_m)?;
            colour("checker.other", other)
        }
        Texture::Boards { size_m, joint_m, contrast, staggered: _ } => {
            size_m.iter().try_for_each(|&edge_m| size("boards.size_m", edge_m))?;
            not_negative(&format!("boards.joint_m of {of}"), *joint_m)?;
            ratio(&format!("boards.contrast of {of}"), *contrast)
        }
        Texture::Posters { spacing_m, share } => {
            size("posters.spacing_m", *spacing_m)?;
            ratio(&format!("posters.share of {of}"), *share)
        }
        Texture::Spines { width_m } => positive(format!("spines.width_m of {of}"), *width_m),
    }
}
