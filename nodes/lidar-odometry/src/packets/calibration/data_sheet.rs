//! The calibrations of the data sheets and user's manuals.

use super::{Calibration, LaserCalibration};
use crate::packets::model::Model;

impl Calibration {
    /// The calibration in the manual of a model, for every scanner of it.
    ///
    /// The lasers of an HDL-64E differ from scanner to scanner by degrees sideways and by decimetres in range: with
    /// these values, the nominal ones, its clouds are coarse. Its own calibration should be given.
    #[must_use]
    pub fn of_data_sheet(model: Model) -> Self {
        let lasers = match model {
            Model::Hdl32e => hdl_32e(),
            Model::Vlp16 => vlp_16(),
            Model::PuckHiRes => puck_hi_res(),
            Model::Vlp32c => vlp_32c(),
            Model::Hdl64e => hdl_64e(),
        };
        Self { range_step_m: model.range_step_m(), lasers }
    }
}

fn at_elevation(elevation_deg: f64) -> LaserCalibration {
    LaserCalibration { elevation_deg, ..LaserCalibration::default() }
}

/// Elevations of two halves that take turns, each from its lowest up.
fn alternating(count: u32, lowest_deg: f64, step_deg: f64) -> Vec<LaserCalibration> {
    let half = f64::from(count / 2);
    (0..count)
        .map(|laser| {
            let in_half = f64::from(laser / 2);
            let upper = f64::from(laser % 2) * half;
            at_elevation(lowest_deg + (in_half + upper) * step_deg)
        })
        .collect()
}

/// Road LiDAR, table 2.2: 4/3 of a degree apart, which the table rounds to hundredths.
fn hdl_32e() -> Vec<LaserCalibration> {
    alternating(32, -92.0 / 3.0, 4.0 / 3.0)
}

/// VLP-16 user's manual, table 9-1, with its vertical correction.
fn vlp_16() -> Vec<LaserCalibration> {
    const HEIGHTS_MM: [f64; 16] =
        [11.2, -0.7, 9.7, -2.2, 8.1, -3.7, 6.6, -5.1, 5.1, -6.6, 3.7, -8.1, 2.2, -9.7, 0.7, -11.2];
    with_heights(alternating(16, -15.0, 2.0), &HEIGHTS_MM)
}

/// The same table for the Puck Hi-Res: 4/3 of a degree apart.
fn puck_hi_res() -> Vec<LaserCalibration> {
    const HEIGHTS_MM: [f64; 16] =
        [7.4, -0.9, 6.5, -1.8, 5.5, -2.7, 4.6, -3.7, 3.7, -4.6, 2.7, -5.5, 1.8, -6.5, 0.9, -7.4];
    with_heights(alternating(16, -10.0, 4.0 / 3.0), &HEIGHTS_MM)
}

fn with_heights(lasers: Vec<LaserCalibration>, heights_mm: &[f64]) -> Vec<LaserCalibration> {
    let with_height = |(laser, height_mm): (LaserCalibration, &f64)| LaserCalibration {
        height_m: height_mm / 1000.0,
        ..laser
    };
    lasers.into_iter().zip(heights_mm).map(with_height).collect()
}

/// VLP-32C user's manual, table 9-2: elevation, and the azimuth offset in tenths, which is clockwise.
fn vlp_32c() -> Vec<LaserCalibration> {
    const LASERS: [(f64, f64); 32] = [
        (-25.0, 1.4),
        (-1.0, -4.2),
        (-1.667, 1.4),
        (-15.639, -1.4),
        (-11.31, 1.4),
        (0.0, -1.4),
        (-0.667, 4.2),
        (-8.843, -1.4),
        (-7.254, 1.4),
        (0.333, -4.2),
        (-0.333, 1.4),
        (-6.148, -1.4),
        (-5.333, 4.2),
        (1.333, -1.4),
        (0.667, 4.2),
        (-4.0, -1.4),
        (-4.667, 1.4),
        (1.667, -4.2),
        (1.0, 1.4),
        (-3.667, -4.2),
        (-3.333, 4.2),
        (3.333, -1.4),
        (2.333, 1.4),
        (-2.667, -1.4),
        (-3.0, 1.4),
        (7.0, -1.4),
        (4.667, 1.4),
        (-2.333, -4.2),
        (-2.0, 4.2),
        (15.0, -1.4),
        (10.333, 1.4),
        (-1.333, -1.4),
    ];
    LASERS
        .into_iter()
        .map(|(elevation_deg, offset_deg)| LaserCalibration {
            elevation_deg,
            rotation_deg: -offset_deg,
            ..LaserCalibration::default()
        })
        .collect()
}

/// The HDL-64E's data sheet: the upper bank from 2 to -8.33 degrees by thirds, the lower from -8.83 to -24.33 by
/// halves. In which order a bank fires them is the same for all scanners.
fn hdl_64e() -> Vec<LaserCalibration> {
    /// The place of each laser in its bank, from the highest, 0.
    const UPPER: [u32; 32] = [
        27, 26, 5, 4, 25, 24, 31, 30, 23, 22, 29, 28, 15, 14, 21, 20, 13, 12, 19, 18, 11, 10, 17,
        16, 3, 2, 9, 8, 1, 0, 7, 6,
    ];
    let upper = UPPER.into_iter().map(|place| at_elevation(2.0 - f64::from(place) / 3.0));
    // The lower bank is built alike.
    let lower = UPPER.into_iter().map(|place| at_elevation(-53.0 / 6.0 - f64::from(place) / 2.0));
    upper.chain(lower).collect()
}
