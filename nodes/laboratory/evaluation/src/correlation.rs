//! The correlation by localised views (Rec-HV 3.2.9, 3.3.5, eq. 10): how similar two clouds of one scene look.
//!
//! Each cloud is rendered as a grey image, and the two images are compared pixel by pixel. The thesis renders one
//! view, from the front; here there are also views from above and from the side, since errors in depth alone hardly
//! show from the front.
//!
//! What the thesis leaves open:
//! - Both pictures have one frame and one scale of grey, those of both clouds together. The frame reaches from the
//!   least to the greatest coordinate, as the pixels of eq. 10 do: squares are cut there. A rim beyond, which nothing
//!   but the halves of the outermost squares reach, is empty or not by the millimetre, and in the picture of a room
//!   that is all wall nothing else would be empty: two measurements of an empty room correlated by 85 to 96 % for it.
//! - A point is a square of one and a half of the clouds' voxel edge, so that a reduced surface has no holes: the
//!   means of two voxels side by side lie up to two edges apart, and with squares of one edge the cracks between
//!   them, which noise moves about, cost two maps that differ by half a millimetre a tenth of their correlation.
//!   Of points on one pixel the nearest to the viewer is seen: the thesis sorts from far to near and paints in this
//!   order.
//! - A pixel without a point is 0, and points use the upper half of the scale. As printed, the nearest
//!   point is 0 too: a ghost object in front of everything would not show at all.
//! - Template matching of two pictures of one size has one place to match; its normalised coefficient
//!   (`TM_CCOEFF_NORMED`) there is Pearson's correlation of the pixels, which is what the thesis calls the
//!   linear correlation.

#[cfg(test)]
mod tests;

use geometry::is_finite;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// Eq. 10: a pixel is a centimetre.
const PX_PER_M: f64 = 100.0;
/// Eq. 10: the grey of the farthest point.
const WHITE: f64 = 255.0;
/// The grey of the nearest point: the presence of a point weighs as much as the whole range of depth.
const NEAREST: f64 = 128.0;
/// The edge of a point's square, in voxel edges.
const SQUARE_EDGES: f64 = 1.5;
/// The most pixels of an image; a larger scene is rendered at a coarser scale.
const MOST_PIXELS: f64 = 16e6;
/// The most pixels along a side of an image: 2 km at the scale of eq. 10, so that no real scene is rendered coarser
/// because of it, and images of a thin one stay bounded.
const MOST_SIDE_PX: f64 = 2e5;

/// A viewing direction.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LocalisedView {
    /// Along x, as in the thesis: y to the side, z up, grey by x.
    Front,
    /// Along z from above: y to the side, x up, grey by z.
    Top,
    /// Along y: x to the side, z up, grey by y.
    Side,
}

impl LocalisedView {
    /// All views.
    pub const ALL: [Self; 3] = [Self::Front, Self::Top, Self::Side];

    /// Across, up, and away from the viewer.
    fn axes(self, point: &Point3<f32>) -> [f64; 3] {
        let [x, y, z] = [point.x, point.y, point.z].map(f64::from);
        match self {
            // Eq. 10 lets y grow to the right; the left-right turn changes no correlation.
            Self::Front => [y, z, x],
            Self::Top => [y, x, -z],
            Self::Side => [x, z, y],
        }
    }
}

/// The correlation of two clouds in each view.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Correlation {
    /// From the front, as in the thesis.
    pub front: f64,
    /// From above.
    pub top: f64,
    /// From the side.
    pub side: f64,
}

impl Correlation {
    /// The least of the three: no view may hide an error.
    #[must_use]
    pub fn least(&self) -> f64 {
        self.front.min(self.top).min(self.side)
    }
}

/// The clouds cannot be compared.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum CorrelationError {
    /// A cloud has no points.
    #[error("the {which} cloud has no point with finite coordinates")]
    Empty {
        /// `reference` or `map`.
        which: &'static str,
    },
    /// The edge is not a length.
    #[error("the edge of a point's square must be a positive number of metres, not {edge_m}")]
    Edge {
        /// The requested edge.
        edge_m: f64,
    },
}

/// The correlation of `map_m` with `reference_m`, both in one frame and reduced to voxels of `edge_m`: 1 for
/// the same cloud, about 0 for unrelated ones. Non-finite points are left out.
///
/// # Errors
/// When a cloud is empty, or the edge is not a positive number.
pub fn correlation(
    reference_m: &[Point3<f32>],
    map_m: &[Point3<f32>],
    edge_m: f64,
) -> Result<Correlation, CorrelationError> {
    if !(edge_m.is_finite() && edge_m > 0.0) {
        return Err(CorrelationError::Edge { edge_m });
    }
    for (which, cloud) in [("reference", reference_m), ("map", map_m)] {
        if !cloud.iter().any(is_finite) {
            return Err(CorrelationError::Empty { which });
        }
    }
    let of = |view| view_correlation(view, reference_m, map_m, edge_m);
    Ok(Correlation {
        front: of(LocalisedView::Front),
        top: of(LocalisedView::Top),
        side: of(LocalisedView::Side),
    })
}

fn view_correlation(
    view: LocalisedView,
    reference_m: &[Point3<f32>],
    map_m: &[Point3<f32>],
    edge_m: f64,
) -> f64 {
    let frame = Frame::around(view, &[reference_m, map_m], SQUARE_EDGES * edge_m);
    pearson(&frame.paint(view, reference_m), &frame.paint(view, map_m))
}

/// The frame and scale shared by both images of a view.
struct Frame {
    px_per_m: f64,
    min_m: [f64; 3],
    max_away_m: f64,
    columns: usize,
    rows: usize,
    /// Half of a point's square.
    half_px: f64,
}

impl Frame {
    fn around(view: LocalisedView, clouds: &[&[Point3<f32>]], square_m: f64) -> Self {
        let mut min_m = [f64::INFINITY; 3];
        let mut max_m = [f64::NEG_INFINITY; 3];
        for point in clouds.iter().flat_map(|cloud| cloud.iter()).filter(|point| is_finite(point)) {
            for (axis, value) in view.axes(point).into_iter().enumerate() {
                min_m[axis] = min_m[axis].min(value);
                max_m[axis] = max_m[axis].max(value);
            }
        }
        // A frame of zero extent would have no pixels: a single point, or points one above the other.
        let extent_m = |axis: usize| (max_m[axis] - min_m[axis]).max(1.0 / PX_PER_M);
        let pixels = extent_m(0) * extent_m(1) * PX_PER_M * PX_PER_M;
        // A thin scene has at least one row or column of pixels, so its length is bounded as well.
        let longest_m = extent_m(0).max(extent_m(1));
        let px_per_m =
            (PX_PER_M * (MOST_PIXELS / pixels).sqrt().min(1.0)).min(MOST_SIDE_PX / longest_m);
        let count = |axis: usize| (extent_m(axis) * px_per_m).ceil().max(1.0) as usize;
        Self {
            px_per_m,
            min_m,
            max_away_m: max_m[2],
            columns: count(0),
            rows: count(1),
            half_px: 0.5 * square_m * px_per_m,
        }
    }

    /// The image of a cloud, row by row; 0 without a point.
    fn paint(&self, view: LocalisedView, cloud_m: &[Point3<f32>]) -> Vec<u8> {
        let mut points: Vec<[f64; 3]> =
            cloud_m.iter().filter(|point| is_finite(point)).map(|point| view.axes(point)).collect();
        // From far to near, and then by position, so that the order of the cloud does not matter.
        points.sort_unstable_by(|a, b| {
            b[2].total_cmp(&a[2]).then(a[0].total_cmp(&b[0])).then(a[1].total_cmp(&b[1]))
        });
        let mut picture = vec![0; self.columns * self.rows];
        for [across_m, up_m, away_m] in points {
            let grey = self.grey(away_m);
            let columns = self.pixels(across_m - self.min_m[0], self.columns);
            for row in self.pixels(up_m - self.min_m[1], self.rows) {
                picture[row * self.columns..][columns.clone()].fill(grey);
            }
        }
        picture
    }

    /// The pixels along one axis of a point's square.
    fn pixels(&self, from_min_m: f64, count: usize) -> std::ops::Range<usize> {
        let middle_px = from_min_m * self.px_per_m;
        let first = (middle_px - self.half_px).round().max(0.0) as usize;
        let end = ((middle_px + self.half_px).round() as usize).max(first + 1);
        first.min(count - 1)..end.min(count)
    }

    /// Eq. 10: `255 (X - x_min) / x_max`. Printed so, it is a scale from 0 to 255 where x_min is near 0 or
    /// small against x_max; the scale's length `x_max - x_min` is what holds for every frame.
    fn grey(&self, away_m: f64) -> u8 {
        let length_m = self.max_away_m - self.min_m[2];
        let share = if length_m > 0.0 { (away_m - self.min_m[2]) / length_m } else { 0.0 };
        (NEAREST + (WHITE - NEAREST) * share).round() as u8
    }
}

/// Pearson's correlation of two images of one size. For two images of a single grey each it is 1 when they are equal.
fn pearson(a: &[u8], b: &[u8]) -> f64 {
    let count = a.len() as f64;
    let sum = |picture: &[u8]| picture.iter().map(|grey| u64::from(*grey)).sum::<u64>() as f64;
    let (mean_a, mean_b) = (sum(a) / count, sum(b) / count);
    let (mut covariance, mut variance_a, mut variance_b) = (0.0, 0.0, 0.0);
    for (&a, &b) in a.iter().zip(b) {
        let (a, b) = (f64::from(a) - mean_a, f64::from(b) - mean_b);
        covariance += a * b;
        variance_a += a * a;
        variance_b += b * b;
    }
    if variance_a == 0.0 || variance_b == 0.0 {
        return if a == b { 1.0 } else { 0.0 };
    }
    covariance / (variance_a * variance_b).sqrt()
}
