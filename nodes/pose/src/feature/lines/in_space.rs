//! Where a line segment lies in space, by a depth image.

mod config;
mod inverse_depth;
#[cfg(test)]
mod tests;

use geometry::{CameraModel, DepthImage};
use nalgebra::{Point2, Point3, Vector2};

pub use config::{DepthSensor, SegmentDepthConfig};
use inverse_depth::{Sample, Straight};

use super::segment::LineSegment;

/// Depths of neighbouring pixels err alike: structured light is matched in windows of about 9 pixels (Khoshelham and
/// Elberink 2012), of which the half counts as one measurement.
const CORRELATED_PX: f64 = 5.0;

/// A line segment in the camera frame, as far as depth shows it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SegmentInSpace {
    /// The first place along the segment whose depth lies on the line; nearest to the segment's start.
    pub start_m: Point3<f64>,
    /// The last one.
    pub end_m: Point3<f64>,
    /// Standard deviation of the depth of the start.
    pub start_std_dev_m: f64,
    /// Standard deviation of the depth of the end.
    pub end_std_dev_m: f64,
    /// By how much the measured depths that lie on the line deviate from it: root of the mean square.
    pub rms_m: f64,
    /// Which share of the segment's length has depths that lie on the line.
    pub support: f64,
}

/// A segment's depths make no line in space.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum NoLineInSpace {
    /// The camera has no rays through the segment's ends, or these are one.
    #[error("a segment without length, or beyond what the camera sees")]
    NoRay,
    /// Too little of it has a depth.
    #[error("{measured} of {places} places along the segment have a depth: too few")]
    TooFewDepths {
        /// Places with a depth.
        measured: usize,
        /// Places along the segment, a pixel apart.
        places: usize,
    },
    /// Too few of the depths lie on one line.
    #[error("{on_line} of {places} places along the segment lie on a line in space: too few")]
    NotStraight {
        /// Places whose depth lies on the best line.
        on_line: usize,
        /// Places along the segment.
        places: usize,
    },
    /// The depths lie on an arc.
    #[error("the segment's middle is off the line of its ends by {std_devs} standard deviations")]
    Bent {
        /// By how many standard deviations of a depth.
        std_devs: f64,
    },
}

/// Where a segment of a rectified image lies in space, by the depth image that belongs to it, pixel by pixel.
///
/// On both sides of the segment the depth is looked up, next to it and not on it, where an edge blurs it. Where the
/// sides differ the nearer surface is taken: an edge belongs to what hides the rest.
///
/// The inverse of the depth of a straight line is a straight line over the image; and the deviation of a structured
/// light or stereo camera's depth, which grows with its square, is the same everywhere for the inverse (Khoshelham and
/// Elberink 2012). So the line is fitted to inverse depths: the consensus of most of the pairs, then least squares over
/// its inliers. The rays are exact in comparison.
///
/// # Errors
/// When too few places have a depth, or these do not lie on a straight line.
pub fn segment_in_space(
    segment: &LineSegment,
    depth: &DepthImage,
    camera: &CameraModel,
    sensor: DepthSensor,
    config: &SegmentDepthConfig,
) -> Result<SegmentInSpace, NoLineInSpace> {
    let image_line = ImageLine::new(segment, camera).ok_or(NoLineInSpace::NoRay)?;
    let places = image_line.places;
    let mut beside_m = Vec::new();
    let samples: Vec<Sample> = (0..places)
        .filter_map(|place| image_line.sample(place, depth, sensor, config, &mut beside_m))
        .collect();
    let least = (config.min_support * places as f64).max(config.min_samples as f64);
    if (samples.len() as f64) < least {
        return Err(NoLineInSpace::TooFewDepths { measured: samples.len(), places });
    }
    let tolerance = config.max_std_devs * sensor.inverse_depth_std_dev;
    let straight = Straight::through(&samples, tolerance);
    let least = least.max(config.min_agreement * samples.len() as f64);
    let Some(straight) = straight.filter(|straight| straight.count as f64 >= least) else {
        let on_line = straight.map_or(0, |straight| straight.count);
        return Err(NoLineInSpace::NotStraight { on_line, places });
    };
    let std_devs = straight.bend(&samples, tolerance) / sensor.inverse_depth_std_dev;
    if std_devs > config.max_bend_std_devs {
        return Err(NoLineInSpace::Bent { std_devs });
    }
    let on_line: Vec<&Sample> =
        samples.iter().filter(|sample| straight.residual(sample).abs() <= tolerance).collect();
    let (Some(first), Some(last)) = (on_line.first(), on_line.last()) else {
        return Err(NoLineInSpace::NotStraight { on_line: 0, places });
    };
    let point = |sample: &Sample| {
        let depth_m = 1.0 / straight.at(sample.along_px);
        let ray = image_line.ray(sample.along_px);
        let std_dev =
            straight.std_dev(sample.along_px, sensor.inverse_depth_std_dev) * CORRELATED_PX.sqrt();
        (Point3::new(ray.x * depth_m, ray.y * depth_m, depth_m), std_dev * depth_m * depth_m)
    };
    let squares = on_line.iter().map(|sample| {
        let off_m = 1.0 / sample.inverse_depth - 1.0 / straight.at(sample.along_px);
        off_m * off_m
    });
    let ((start_m, start_std_dev_m), (end_m, end_std_dev_m)) = (point(first), point(last));
    Ok(SegmentInSpace {
        start_m,
        end_m,
        start_std_dev_m,
        end_std_dev_m,
        rms_m: (squares.sum::<f64>() / on_line.len() as f64).sqrt(),
        support: on_line.len() as f64 / places as f64,
    })
}

/// A segment in the image, with places a pixel apart, and the rays through them.
struct ImageLine {
    start_px: Point2<f64>,
    /// Of length 1.
    direction: Vector2<f64>,
    places: usize,
    step_px: f64,
    start_ray: Vector2<f64>,
    ray_per_px: Vector2<f64>,
}

impl ImageLine {
    fn new(segment: &LineSegment, camera: &CameraModel) -> Option<Self> {
        let [start_px, end_px] =
            [segment.start_px, segment.end_px].map(|px| Point2::from(px.map(f64::from)));
        let length_px = (end_px - start_px).norm();
        // Longer than any image, or not a number.
        let longest_px = (camera.width_px + camera.height_px) as f64;
        if !(length_px > 0.0 && length_px <= longest_px) {
            return None;
        }
        let (start_ray, end_ray) = (camera.ray(&start_px)?, camera.ray(&end_px)?);
        let places = length_px.ceil() as usize + 1;
        Some(Self {
            start_px,
            direction: (end_px - start_px) / length_px,
            places,
            step_px: length_px / (places - 1) as f64,
            start_ray,
            ray_per_px: (end_ray - start_ray) / length_px,
        })
    }

    /// The ray through a place: without distortion a straight line over a straight line.
    fn ray(&self, along_px: f64) -> Vector2<f64> {
        self.start_ray + along_px * self.ray_per_px
    }

    /// The inverse depth at a place; `None` where neither side has one. `beside_m` is memory to be used again.
    fn sample(
        &self,
        place: usize,
        depth: &DepthImage,
        sensor: DepthSensor,
        config: &SegmentDepthConfig,
        beside_m: &mut Vec<f32>,
    ) -> Option<Sample> {
        let along_px = place as f64 * self.step_px;
        let middle_px = self.start_px + along_px * self.direction;
        let left = Vector2::new(self.direction.y, -self.direction.x);
        let mut side = |outwards: Vector2<f64>| {
            beside_m.clear();
            for offset in config.nearest_side_px..=config.farthest_side_px {
                // Half a pixel more, since the nearest is sought; what is left of the image would be cast to its border.
                let pixel = middle_px + offset as f64 * outwards + Vector2::new(0.5, 0.5);
                if pixel.x >= 0.0
                    && pixel.y >= 0.0
                    && let Some(depth_m) = depth.depth_m(pixel.x as usize, pixel.y as usize)
                    && f64::from(depth_m) <= sensor.max_depth_m
                {
                    beside_m.push(depth_m);
                }
            }
            beside_m.sort_by(f32::total_cmp);
            // The middle one, of two the nearer.
            let median_m = beside_m.get(beside_m.len().checked_sub(1)? / 2)?;
            Some(1.0 / f64::from(*median_m))
        };
        let inverse_depth = match (side(left), side(-left)) {
            (Some(one), Some(other)) => {
                let step = config.step_std_devs * sensor.inverse_depth_std_dev;
                if (one - other).abs() <= step { 0.5 * (one + other) } else { one.max(other) }
            }
            (one, other) => one.or(other)?,
        };
        Some(Sample { along_px, inverse_depth })
    }
}
