//! What the sensors saw in a cycle, small enough to be kept for the report: the scan, the reduced cloud and a small depth image.

use geometry::{CameraModel, DepthFrame, Scan};
use nalgebra::{Isometry3, Point3};

/// A step of [`ScanView::ranges`]: finer than any scanner's noise, and 131 m at most.
pub const RANGE_STEP_M: f32 = 0.002;
/// A step of [`CycleView::cloud`]: a twentieth of the voxels of the reduction, and 131 m to each side at most.
pub const CLOUD_STEP_M: f32 = 0.004;
/// Columns of the kept depth image, at most.
const MAX_DEPTH_COLUMNS: usize = 160;

/// What the sensors saw in a cycle.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct CycleView {
    /// The scan; absent where it was not received.
    pub scan: Option<ScanView>,
    /// The reduced cloud in the rig frame, in steps of [`CLOUD_STEP_M`]. Points too far away are left out.
    pub cloud: Vec<[i16; 3]>,
    /// The depth image; absent where the method uses none.
    pub depth: Option<SmallDepth>,
}

/// A scan: a range a beam.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ScanView {
    /// Azimuth of the first beam in the scanner's frame.
    pub first_azimuth_rad: f32,
    /// From a beam to the next.
    pub azimuth_step_rad: f32,
    /// In steps of [`RANGE_STEP_M`]; 0 where nothing was measured.
    pub ranges: Vec<u16>,
}

/// A depth image of every n-th pixel of every n-th row.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SmallDepth {
    /// Columns that are kept.
    pub columns: usize,
    /// Rows that are kept.
    pub rows: usize,
    /// Pixels of the whole image from one that is kept to the next.
    pub pixel_step: usize,
    /// Row by row; 0 where nothing was measured.
    pub depths_mm: Vec<u16>,
}

/// The depth camera of a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RigCamera {
    /// Its model.
    pub model: CameraModel,
    /// Its optical frame in the rig.
    pub rig_from_camera: Isometry3<f64>,
}

impl CycleView {
    /// The points of the cloud in the rig frame.
    pub fn cloud_m(&self) -> impl Iterator<Item = Point3<f32>> {
        self.cloud
            .iter()
            .map(|steps| Point3::from(steps.map(|step| f32::from(step) * CLOUD_STEP_M)))
    }
}

/// A point in steps of [`CLOUD_STEP_M`]; none if it is too far away or not finite.
pub fn cloud_steps(point_m: &Point3<f32>) -> Option<[i16; 3]> {
    let steps = point_m.coords.map(|value_m| (value_m / CLOUD_STEP_M).round());
    let fits = |step: &f32| step.abs() <= f32::from(i16::MAX);
    // The casts keep every number: it was compared with the limit.
    steps.iter().all(fits).then(|| [steps.x as i16, steps.y as i16, steps.z as i16])
}

impl From<&Scan> for ScanView {
    fn from(scan: &Scan) -> Self {
        let steps = |beam| {
            let range_m = scan.measured_range_m(beam)?;
            let steps = (range_m / RANGE_STEP_M).round();
            (steps <= f32::from(u16::MAX)).then_some(steps as u16)
        };
        Self {
            first_azimuth_rad: scan.angle_min_rad,
            azimuth_step_rad: scan.angle_increment_rad,
            ranges: (0..scan.ranges_m.len()).map(|beam| steps(beam).unwrap_or(0)).collect(),
        }
    }
}

impl From<&DepthFrame> for SmallDepth {
    fn from(frame: &DepthFrame) -> Self {
        let (width_px, height_px) = (frame.image().width_px(), frame.image().height_px());
        let pixel_step = width_px.div_ceil(MAX_DEPTH_COLUMNS).max(1);
        let (columns, rows) = (width_px.div_ceil(pixel_step), height_px.div_ceil(pixel_step));
        let mut depths_mm = Vec::with_capacity(columns * rows);
        for row in frame.depths_mm().chunks_exact(width_px).step_by(pixel_step) {
            depths_mm.extend(row.iter().step_by(pixel_step));
        }
        Self { columns, rows, pixel_step, depths_mm }
    }
}

impl SmallDepth {
    /// The depth at a pixel of the whole image, of the kept pixel nearest to it: none out of the image, and 0 where nothing was
    /// measured.
    pub(crate) fn depth_at_m(&self, column_px: f64, row_px: f64) -> Option<f32> {
        let nearest = |at_px: f64, count: usize| {
            let index = (at_px / self.pixel_step as f64).round();
            (index >= 0.0 && index < count as f64).then_some(index as usize)
        };
        let (column, row) = (nearest(column_px, self.columns)?, nearest(row_px, self.rows)?);
        self.depths_mm.get(row * self.columns + column).map(|depth_mm| f32::from(*depth_mm) * 1e-3)
    }
}

#[cfg(test)]
mod tests {
    use geometry::{DepthImage, DepthPixels, Distortion, Stamp};

    use super::*;

    #[test]
    fn a_point_is_kept_to_half_a_step() {
        let point_m = Point3::new(1.2345, -0.5, 131.0);
        let view =
            CycleView { cloud: vec![cloud_steps(&point_m).unwrap()], ..CycleView::default() };
        let kept_m = view.cloud_m().next().unwrap();
        assert!((kept_m - point_m).amax() <= CLOUD_STEP_M / 2.0 + 1e-5, "{kept_m}");
        for far in [f32::NAN, f32::INFINITY, 132.0, -132.0] {
            assert_eq!(cloud_steps(&Point3::new(0.0, far, 0.0)), None, "{far}");
        }
    }

    #[test]
    fn a_scan_keeps_its_beams_and_0_for_no_return() {
        let scan = Scan {
            angle_min_rad: -1.0,
            angle_increment_rad: 0.5,
            range_min_m: 0.1,
            range_max_m: 200.0,
            ranges_m: vec![2.0, f32::INFINITY, 0.05, 150.0],
            ..Scan::default()
        };
        let view = ScanView::from(&scan);
        assert_eq!(view.ranges, [1000, 0, 0, 0], "150 m are more than can be said");
        assert_eq!((view.first_azimuth_rad, view.azimuth_step_rad), (-1.0, 0.5));
    }

    #[test]
    fn a_small_image_has_every_nth_pixel_of_every_nth_row() {
        let (width_px, height_px) = (320, 6);
        let pixels: Vec<u16> = (0..width_px * height_px).map(|pixel| pixel as u16).collect();
        let (size_px, pixels) = ((width_px, height_px), DepthPixels::Millimetres(pixels));
        let image =
            DepthImage::new(Stamp::default(), "camera".to_owned(), size_px, pixels).unwrap();
        let model = CameraModel {
            width_px,
            height_px,
            fx_px: 300.0,
            fy_px: 300.0,
            cx_px: 160.0,
            cy_px: 3.0,
            distortion: Distortion::None,
        };
        let small = SmallDepth::from(&DepthFrame::new(image, model).unwrap());
        assert_eq!((small.columns, small.rows, small.pixel_step), (160, 3, 2));
        assert!((small.depth_at_m(4.0, 2.0).unwrap() - 0.644).abs() < 1e-6);
        assert_eq!(small.depth_at_m(320.0, 2.0), None);
        assert_eq!(small.depth_at_m(-1.1, 2.0), None);
    }
}
