//! A scan cut out of a depth image, for recordings without a laser scanner.

#[cfg(test)]
mod tests;

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use crate::{DepthCameraError, DepthImage, DepthLimits, DepthProjector, PixelArea, RayTable, Scan};

/// Which pixels belong to the scan.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ScanBand {
    /// Those that see a point in a layer parallel to the rig's XY plane, as a scanner mounted at that
    /// height would. Which rows these are depends on the depth. A pixel sees a patch as high as the
    /// distance between two rows, and belongs to the layer when its patch intersects it.
    Height {
        /// The middle of the layer, above (positive) or below the rig's origin.
        plane_height_m: f64,
        /// How thick the layer is.
        band_height_m: f64,
    },
    /// Those of fixed rows of the image, whatever height they see.
    Rows {
        /// The uppermost row.
        first_px: usize,
        /// How many rows.
        count: usize,
    },
}

/// How a scan is cut out of a depth image.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScanFromDepth {
    /// The name of the scan's own frame: the rig's, moved up or down to the plane.
    pub frame_id: String,
    /// Which pixels belong to the scan.
    pub band: ScanBand,
    /// Nearer points are no returns. The distance is measured in the plane, from the rig's z axis.
    pub range_min_m: f32,
    /// Farther points are no returns.
    pub range_max_m: f32,
    /// How many beams share the aperture, from 2 to [`ScanFromDepth::MAX_BEAMS`].
    pub beams: usize,
    /// Azimuth of the first (rightmost) and the last beam in the rig; the camera's view if not given.
    pub aperture_rad: Option<(f64, f64)>,
    /// Time from a scan to the next; the whole image is taken at one moment.
    pub scan_time_s: f32,
}

impl ScanFromDepth {
    /// More beams than any scanner has: 40 a degree.
    pub const MAX_BEAMS: usize = 14_400;
}

impl Default for ScanFromDepth {
    /// The thesis' scanner, 5 cm below the camera and with a reach of 8 m and 90 beams (Rec-HV 3.2.1,
    /// 3.2.4), in the image of a Kinect v1, which takes 30 images a second and sees nothing nearer
    /// than 0.45 m. At 8 m its rows lie 1.5 cm apart: a layer of 2 cm always holds one.
    fn default() -> Self {
        Self {
            frame_id: "laser".to_owned(),
            band: ScanBand::Height { plane_height_m: -0.05, band_height_m: 0.02 },
            range_min_m: 0.45,
            range_max_m: 8.0,
            beams: 90,
            aperture_rad: None,
            scan_time_s: 1.0 / 30.0,
        }
    }
}

/// The parameters describe no scan.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum ScanFromDepthError {
    /// Too few beams, or too many.
    #[error("a scan of {beams} beams: it must have between 2 and {}", ScanFromDepth::MAX_BEAMS)]
    Beams {
        /// How many were requested.
        beams: usize,
    },
    /// The limits of the range leave nothing.
    #[error(
        "ranges from {min_m} to {max_m} m: the first must not be negative and the second larger"
    )]
    Range {
        /// The lower limit.
        min_m: f32,
        /// The upper limit.
        max_m: f32,
    },
    /// The layer has no thickness, or its height is not finite.
    #[error(
        "a layer of {band_height_m} m at a height of {plane_height_m} m: the thickness must be \
         positive and both finite"
    )]
    Layer {
        /// The middle of the layer.
        plane_height_m: f64,
        /// Its thickness.
        band_height_m: f64,
    },
    /// The rows are not in the image.
    #[error("{count} rows from row {first_px} on: the image has rows 0 to {}", height_px - 1)]
    Rows {
        /// The uppermost row.
        first_px: usize,
        /// How many rows.
        count: usize,
        /// How many rows the image has.
        height_px: usize,
    },
    /// The aperture is empty or more than a turn.
    #[error(
        "an aperture from {min_rad} to {max_rad} rad: the second must be larger, by a turn at most"
    )]
    Aperture {
        /// Azimuth of the first beam.
        min_rad: f64,
        /// Azimuth of the last beam.
        max_rad: f64,
    },
    /// No pixel has a ray from which an aperture could be taken.
    #[error("the camera's view has no width: state the aperture")]
    NoView,
}

/// Cuts scans out of the depth images of one camera: in each beam's direction the nearest point of
/// the band, as a scanner would see it.
#[derive(Clone, PartialEq, Debug)]
pub struct ScanCutter {
    projector: DepthProjector,
    rows_px: Range<usize>,
    /// The heights that belong to the scan, in the rig.
    heights_m: (f32, f32),
    /// Half of the height that a pixel in the middle of the image covers at a distance of 1.
    half_row_pitch: f32,
    /// A scan without returns, which each scan starts from.
    empty: Scan,
}

impl ScanCutter {
    /// A cutter for the camera of `rays`, which `rig_from_camera` places in the rig.
    ///
    /// # Errors
    /// When the parameters describe no scan, or none that this camera could give.
    pub fn new(
        rays: RayTable,
        rig_from_camera: &Isometry3<f64>,
        parameters: &ScanFromDepth,
    ) -> Result<Self, ScanFromDepthError> {
        let ScanFromDepth { range_min_m: min_m, range_max_m: max_m, beams, .. } = *parameters;
        if !(2..=ScanFromDepth::MAX_BEAMS).contains(&beams) {
            return Err(ScanFromDepthError::Beams { beams });
        }
        // Negated, so that NaN is refused as well.
        if !(min_m >= 0.0 && max_m > min_m) {
            return Err(ScanFromDepthError::Range { min_m, max_m });
        }
        let (rows_px, heights_m) = band_limits(&parameters.band, rays.height_px())?;
        let (angle_min_rad, angle_max_rad) = match parameters.aperture_rad {
            Some((min_rad, max_rad)) if max_rad > min_rad && max_rad - min_rad <= 2.0 * PI => {
                (min_rad, max_rad)
            }
            Some((min_rad, max_rad)) => {
                return Err(ScanFromDepthError::Aperture { min_rad, max_rad });
            }
            None => view(&rays, rig_from_camera).ok_or(ScanFromDepthError::NoView)?,
        };
        let empty = Scan {
            frame_id: parameters.frame_id.clone(),
            angle_min_rad: angle_min_rad as f32,
            angle_increment_rad: ((angle_max_rad - angle_min_rad) / (beams - 1) as f64) as f32,
            time_increment_s: 0.0,
            scan_time_s: parameters.scan_time_s,
            range_min_m: min_m,
            range_max_m: max_m,
            ranges_m: vec![f32::INFINITY; beams],
            ..Scan::default()
        };
        let half_row_pitch = half_row_pitch(&rays);
        let projector = DepthProjector::new(rays, DepthLimits::default(), rig_from_camera, "");
        Ok(Self { projector, rows_px, heights_m, half_row_pitch, empty })
    }

    /// The scan at the moment of a depth image, in its own frame (x forward, y left). A beam in whose
    /// direction the band shows nothing within the range limits is `+Inf` (REP-117).
    ///
    /// # Errors
    /// When the image is of another size than the camera.
    pub fn cut(&self, image: &DepthImage) -> Result<Scan, DepthCameraError> {
        DepthCameraError::check(image, self.projector.rays())?;
        let mut scan = Scan { stamp: image.stamp, ..self.empty.clone() };
        let (lowest_m, highest_m) = self.heights_m;
        let area = PixelArea { rows_px: self.rows_px.clone(), columns_px: 0..image.width_px() };
        self.projector.for_each_block(image, area, |_, block| {
            for point in block.finite_points() {
                let range_m = point.x.hypot(point.y);
                // A pixel shows a patch, not a point: far away the rows lie farther apart than a thin
                // band is high, and the row whose patch intersects the band is the one to take.
                let margin_m = range_m * self.half_row_pitch;
                let in_band = point.z + margin_m >= lowest_m && point.z - margin_m <= highest_m;
                if !in_band || range_m < self.empty.range_min_m || range_m > self.empty.range_max_m
                {
                    continue;
                }
                let azimuth_rad = f64::from(point.y).atan2(f64::from(point.x));
                if let Some(nearest_m) =
                    self.beam(azimuth_rad).and_then(|beam| scan.ranges_m.get_mut(beam))
                {
                    *nearest_m = nearest_m.min(range_m);
                }
            }
        });
        Ok(scan)
    }

    /// The beam nearest to a direction; `None` beside the aperture.
    fn beam(&self, azimuth_rad: f64) -> Option<usize> {
        let increment_rad = f64::from(self.empty.angle_increment_rad);
        let first_edge_rad = f64::from(self.empty.angle_min_rad) - increment_rad / 2.0;
        let beam = (azimuth_rad - first_edge_rad).rem_euclid(2.0 * PI) / increment_rad;
        (beam < self.empty.ranges_m.len() as f64).then_some(beam as usize)
    }
}

/// Half of the distance between two rows in the middle of the image, at a depth of 1; 0 where the image
/// has one row.
fn half_row_pitch(rays: &RayTable) -> f32 {
    let (column_px, row_px) = (rays.width_px() / 2, rays.height_px() / 2);
    match (
        rays.ray(column_px, row_px),
        row_px.checked_sub(1).and_then(|row_px| rays.ray(column_px, row_px)),
    ) {
        (Some(row), Some(row_above)) => (row.y - row_above.y).abs() / 2.0,
        _ => 0.0,
    }
}

/// The rows and the heights of a band.
fn band_limits(
    band: &ScanBand,
    height_px: usize,
) -> Result<(Range<usize>, (f32, f32)), ScanFromDepthError> {
    match *band {
        ScanBand::Height { plane_height_m, band_height_m } => {
            let finite = plane_height_m.is_finite() && band_height_m.is_finite();
            if !finite || band_height_m <= 0.0 {
                return Err(ScanFromDepthError::Layer { plane_height_m, band_height_m });
            }
            let lowest_m = (plane_height_m - band_height_m / 2.0) as f32;
            let highest_m = (plane_height_m + band_height_m / 2.0) as f32;
            Ok((0..height_px, (lowest_m, highest_m)))
        }
        ScanBand::Rows { first_px, count } => match first_px.checked_add(count) {
            Some(end_px) if count > 0 && end_px <= height_px => {
                Ok((first_px..end_px, (f32::NEG_INFINITY, f32::INFINITY)))
            }
            _ => Err(ScanFromDepthError::Rows { first_px, count, height_px }),
        },
    }
}

/// The azimuths of the outermost rays in the rig, the smaller first; `None` where they are one.
fn view(rays: &RayTable, rig_from_camera: &Isometry3<f64>) -> Option<(f64, f64)> {
    let azimuth_rad = |column_px, row_px| {
        let ray = rays.ray(column_px, row_px)?;
        let in_rig = rig_from_camera.rotation * ray.cast::<f64>().push(1.0);
        Some(in_rig.y.atan2(in_rig.x))
    };
    let middle_rad = azimuth_rad(rays.width_px() / 2, rays.height_px() / 2)?;
    let (mut min_rad, mut max_rad) = (0.0_f64, 0.0_f64);
    for row_px in 0..rays.height_px() {
        for column_px in 0..rays.width_px() {
            if let Some(azimuth_rad) = azimuth_rad(column_px, row_px) {
                // From the middle, so that a camera that looks to the rear crosses no seam.
                let offset_rad = (azimuth_rad - middle_rad + PI).rem_euclid(2.0 * PI) - PI;
                (min_rad, max_rad) = (min_rad.min(offset_rad), max_rad.max(offset_rad));
            }
        }
    }
    (max_rad > min_rad).then_some((middle_rad + min_rad, middle_rad + max_rad))
}
