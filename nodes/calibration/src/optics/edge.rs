//! The edge of something near, as the depth image shows it.

use geometry::DepthImage;
use nalgebra::{Point2, Point3, Vector3};

use super::{DepthOptics, Surface};
use crate::config::CalibrationConfig;

/// Rows that must show the edge, of those looked at: 2 above and 2 below the middle.
const MIN_ROWS: usize = 4;
/// At an edge at most this many pixels are between near and far.
const TRANSITION_PX: usize = 2;
/// A camera that projects its pattern from the side leaves a shadow beside what is near: 7.5 cm of baseline between
/// 2 m and far away.
const SHADOW_RAD: f64 = 0.04;
/// An edge is straight within this many pixels, ...
const STRAIGHT_PX: f64 = 1.5;
/// ... and upright within 20 degrees: of a slanting one the scanner's height would decide where it is hit.
const MAX_SLANT: f64 = 0.364;
/// However deep it goes behind an edge: what is farther from the near distance than half of this is not near, and what
/// is farther beyond is far. Twice seven deviations of a depth at 4 m.
const MOST_JUMP_M: f64 = 0.4;
/// Standard deviation of where an edge is between two pixels.
const EDGE_NOISE_PX: f64 = 0.5;

/// An edge that the scanner has hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeSought {
    /// Where, in the camera frame: at the distance of what is near.
    pub(crate) point_in_camera_m: Point3<f64>,
    /// Whether what is near lies at the larger columns.
    pub(crate) near_is_right: bool,
    /// How much farther it is behind the edge.
    pub(crate) jump_m: f64,
}

/// The plane through the camera's centre and the edge; `None` where the image shows no such edge.
pub(crate) fn edge_at(
    sought: &EdgeSought,
    image: &DepthImage,
    optics: DepthOptics<'_>,
    config: &CalibrationConfig,
) -> Option<Surface> {
    let camera = optics.camera;
    if sought.point_in_camera_m.z > config.max_depth_m {
        return None;
    }
    let middle = camera.project(&sought.point_in_camera_m)?;
    let search = RowSearch { image, sought, shadow_px: (SHADOW_RAD * camera.fx_px).round() as i64 };
    let row_px = middle.y.round();
    let column_px = search.near(row_px, middle.x, config.edge_search_rad * camera.fx_px)?;

    let step_px = (0.5 * config.patch_half_angle_rad * camera.fy_px).round().max(1.0);
    let found: Vec<(f64, f64)> = [-2.0, -1.0, 0.0, 1.0, 2.0]
        .into_iter()
        .filter_map(|step: f64| {
            let below_px = step * step_px;
            let reach_px = MAX_SLANT * below_px.abs() + STRAIGHT_PX;
            let column_px = search.near(row_px + below_px, column_px, reach_px)?;
            Some((below_px, column_px))
        })
        .collect();
    let line = Line::through(&found)?;
    if line.slant.abs() > MAX_SLANT {
        return None;
    }
    let ray = |below_px: f64| {
        let pixel = Point2::new(line.column_px + line.slant * below_px, row_px + below_px);
        camera.ray(&pixel).map(|ray| Vector3::new(ray.x, ray.y, 1.0))
    };
    let half_px = 2.0 * step_px;
    let normal = ray(-half_px)?.cross(&ray(half_px)?).try_normalize(f64::EPSILON)?;
    let depth_m = sought.point_in_camera_m.z;
    Some(Surface {
        normal,
        offset_m: 0.0,
        std_dev_m: EDGE_NOISE_PX * depth_m / camera.fx_px,
        normal_std_dev_rad: EDGE_NOISE_PX / half_px,
    })
}

/// Looks for the edge in the rows of an image.
struct RowSearch<'a> {
    image: &'a DepthImage,
    sought: &'a EdgeSought,
    shadow_px: i64,
}

impl RowSearch<'_> {
    /// The column of the edge in a row, the nearest to `around_px`, at most `reach_px` away.
    fn near(&self, row_px: f64, around_px: f64, reach_px: f64) -> Option<f64> {
        if row_px < 0.0 {
            return None;
        }
        let row_px = row_px as usize;
        let first = (around_px - reach_px).floor() as i64;
        let last = (around_px + reach_px).ceil() as i64;
        // From the near side to the far one.
        let outwards = if self.sought.near_is_right { -1 } else { 1 };
        (first..=last)
            .filter(|column| self.is_last_near(row_px, *column, outwards))
            .map(|column| column as f64 + 0.5 * outwards as f64)
            .filter(|edge_px| (edge_px - around_px).abs() <= reach_px)
            .min_by(|a, b| (a - around_px).abs().total_cmp(&(b - around_px).abs()))
    }

    /// Whether a pixel is the last one of what is near, with something far beyond it.
    fn is_last_near(&self, row_px: usize, column: i64, outwards: i64) -> bool {
        let depth_m = |column: i64| {
            let column = usize::try_from(column).ok()?;
            self.image.depth_m(column, row_px).map(f64::from)
        };
        let half_jump_m = 0.5 * self.sought.jump_m.min(MOST_JUMP_M);
        let near_m = self.sought.point_in_camera_m.z;
        let is_near = |depth_m: f64| (depth_m - near_m).abs() <= half_jump_m;
        let (Some(last_m), Some(before_m)) = (depth_m(column), depth_m(column - outwards)) else {
            return false;
        };
        if !is_near(last_m) || !is_near(before_m) {
            return false;
        }
        // The first two measured pixels beyond are far, but for those of the transition.
        let beyond: Vec<f64> = (1..=self.shadow_px + 2)
            .filter_map(|away| depth_m(column + outwards * away))
            .take(TRANSITION_PX + 2)
            .collect();
        let far_m = last_m + half_jump_m;
        let between = beyond.iter().take_while(|depth_m| **depth_m < far_m).count();
        between <= TRANSITION_PX
            && beyond.iter().take(between).all(|depth_m| *depth_m > last_m + 0.5 * half_jump_m)
            && beyond.iter().skip(between).take(2).filter(|depth_m| **depth_m >= far_m).count() == 2
    }
}

/// The columns of an edge, row by row.
struct Line {
    column_px: f64,
    /// Columns a row.
    slant: f64,
}

impl Line {
    /// The line through (rows below the middle, column); `None` unless they lie on one.
    fn through(found: &[(f64, f64)]) -> Option<Self> {
        if found.len() < MIN_ROWS {
            return None;
        }
        let count = found.len() as f64;
        let mean_row = found.iter().map(|(row, _)| row).sum::<f64>() / count;
        let mean_column = found.iter().map(|(_, column)| column).sum::<f64>() / count;
        let (mut along, mut across) = (0.0, 0.0);
        for (row, column) in found {
            along += (row - mean_row).powi(2);
            across += (row - mean_row) * (column - mean_column);
        }
        let slant = across / along;
        let line = Self { column_px: mean_column - slant * mean_row, slant };
        let straight = found
            .iter()
            .all(|(row, column)| (line.column_px + slant * row - column).abs() <= STRAIGHT_PX);
        straight.then_some(line)
    }
}
