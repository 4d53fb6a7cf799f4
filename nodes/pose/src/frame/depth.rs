//! How far a corner is.

use geometry::DepthImage;
use nalgebra::Point2;

use super::FrameConfig;

/// A depth and how sure it is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MeasuredDepth {
    /// The z coordinate in the camera frame.
    pub depth_m: f64,
    /// Its standard deviation.
    pub std_dev_m: f64,
}

/// The standard deviation of a depth of structured light or stereo: that of the inverse depth is the same everywhere
/// (Khoshelham and Elberink 2012, eq. 7).
#[must_use]
pub fn depth_noise_m(depth_m: f64, inverse_depth_std_dev: f64) -> f64 {
    inverse_depth_std_dev * depth_m * depth_m
}

/// The depth at a corner: the mean of the pixels around it, when they are of one surface. At an edge a corner belongs to
/// what is nearer, but the camera's depth ends some pixels off the edge, or beyond: it is open where it is.
pub(super) fn depth_at(
    depth: &DepthImage,
    pixel: Point2<f32>,
    config: &FrameConfig,
) -> Option<MeasuredDepth> {
    let middle = pixel.map(|coordinate| coordinate.round());
    let reach = config.depth_window_px as f32;
    let (mut sum_m, mut count) = (0.0, 0_u32);
    let (mut nearest_m, mut farthest_m) = (f64::INFINITY, 0.0_f64);
    let mut row = middle.y - reach;
    while row <= middle.y + reach {
        let mut column = middle.x - reach;
        while column <= middle.x + reach {
            // What is left of the image would be cast to its border.
            if column >= 0.0
                && row >= 0.0
                && let Some(depth_m) = depth.depth_m(column as usize, row as usize)
            {
                let depth_m = f64::from(depth_m);
                sum_m += depth_m;
                count += 1;
                nearest_m = nearest_m.min(depth_m);
                farthest_m = farthest_m.max(depth_m);
            }
            column += 1.0;
        }
        row += 1.0;
    }
    let depth_m = sum_m / f64::from(count);
    let std_dev_m = depth_noise_m(depth_m, config.inverse_depth_std_dev);
    let is_one_surface = farthest_m - nearest_m <= config.edge_std_devs * std_dev_m;
    // The middle of an empty window is not a number, and neither comparison holds.
    let is_measured = depth_m <= config.max_depth_m && is_one_surface;
    is_measured.then_some(MeasuredDepth { depth_m, std_dev_m })
}
