//! A cloud with a place for each pixel of the camera that measured it.

use nalgebra::Point3;

use crate::cloud::is_finite;
use crate::{Cloud, Stamp};

/// A cloud whose points are those of an image's pixels, as depth cameras send them (`height` of `PointCloud2` above 1).
#[derive(Clone, PartialEq, Debug, Default)]
pub struct OrganisedCloud {
    cloud: Cloud,
    pixels: Vec<u32>,
    width_px: usize,
    height_px: usize,
}

impl OrganisedCloud {
    /// The cloud of `points_m`, which has a point for each pixel, row by row: one that is not finite where nothing was
    /// measured. The last row may be short.
    #[must_use]
    pub fn from_rows(
        stamp: Stamp,
        frame_id: String,
        width_px: usize,
        points_m: &[Point3<f32>],
    ) -> Self {
        let measured = points_m.iter().zip(0_u32..).filter(|(point, _)| is_finite(point));
        let (points_m_kept, pixels) = measured.map(|(point, pixel)| (*point, pixel)).unzip();
        Self {
            cloud: Cloud { stamp, frame_id, points_m: points_m_kept },
            pixels,
            width_px,
            height_px: if width_px == 0 { 0 } else { points_m.len().div_ceil(width_px) },
        }
    }

    /// Its points, in the order of their pixels.
    #[must_use]
    pub fn cloud(&self) -> &Cloud {
        &self.cloud
    }

    /// The points, each with the column and the row of its pixel.
    pub fn with_pixels(&self) -> impl Iterator<Item = (&Point3<f32>, [usize; 2])> {
        // Without a width there are no rows to look up.
        let width_px = self.width_px.max(1);
        self.cloud.points_m.iter().zip(&self.pixels).map(move |(point_m, pixel)| {
            let pixel = *pixel as usize;
            (point_m, [pixel % width_px, pixel / width_px])
        })
    }

    /// Columns.
    #[must_use]
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Rows.
    #[must_use]
    pub fn height_px(&self) -> usize {
        self.height_px
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_keep_their_pixels_when_others_measured_nothing() {
        let (none, some) = (f32::NAN, |z| Point3::new(0.0, 0.0, z));
        let rows = [some(1.0), some(none), some(2.0), some(f32::INFINITY), some(3.0)];
        let cloud = OrganisedCloud::from_rows(Stamp::from_nanos(7), "camera".to_owned(), 2, &rows);
        assert_eq!((cloud.width_px(), cloud.height_px()), (2, 3));
        let depths: Vec<_> = cloud.with_pixels().map(|(point, pixel)| (point.z, pixel)).collect();
        assert_eq!(depths, [(1.0, [0, 0]), (2.0, [0, 1]), (3.0, [0, 2])]);
        assert_eq!(cloud.cloud().points_m.len(), 3);
        assert_eq!(
            OrganisedCloud::from_rows(Stamp::default(), String::new(), 0, &[]).height_px(),
            0
        );
    }
}
