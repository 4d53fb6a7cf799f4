//! The content of depth images; of other images only the size.

use std::collections::BTreeSet;

use estimation::quantile::upper_median;
use geometry::DepthPixels;
use msgs::convert;
use msgs::sensor_msgs::Image;

use super::{Check, Finding, Subject, Typical};

/// About how many pixels of an image are sampled.
const SAMPLES: usize = 2000;
/// No depth camera of a robot sees this far.
const FARTHEST_M: f64 = 100.0;
/// Depth images whose largest pixel is below this have whole metres, not millimetres: no camera measures at such a distance.
const NEAREST_MM: f64 = 40.0;
/// No camera of a robot that gives 16UC1 has half of its pixels beyond this.
const FARTHEST_16UC1_MM: f64 = 20e3;
/// A camera that measures less than this share of its pixels is covered, or sees nothing in its range.
const LEAST_SHARE: f64 = 0.01;
/// Sizes that are kept at most.
const MOST_SIZES: usize = 4;

/// What is known of images.
#[derive(Clone, PartialEq, Debug, Default)]
pub(in crate::doctor) struct ImageFacts {
    /// Columns and rows.
    pub(in crate::doctor) sizes_px: BTreeSet<(u32, u32)>,
    samples: u64,
    measured: u64,
    /// The median depth of each image in metres, or in millimetres.
    depth_m: Typical,
    depth_mm: Typical,
}

impl ImageFacts {
    /// Whether at least one of them was a depth image.
    pub(in crate::doctor) fn has_depths(&self) -> bool {
        self.samples > 0
    }

    pub(super) fn take(&mut self, image: &Image) {
        if self.sizes_px.len() < MOST_SIZES {
            self.sizes_px.insert((image.width, image.height));
        }
        let Ok(depth) = convert::depth_from_message(image) else { return };
        let step = (depth.pixels().len() / SAMPLES).max(1) | 1;
        // An odd stride does not hit the same columns in every row.
        let measured = |depth: &f64| depth.is_finite() && *depth > 0.0;
        let mut depths: Vec<f64> = match depth.pixels() {
            DepthPixels::Millimetres(pixels) => pixels
                .iter()
                .step_by(step)
                .map(|depth| f64::from(*depth))
                .filter(measured)
                .collect(),
            DepthPixels::Metres(pixels) => pixels
                .iter()
                .step_by(step)
                .map(|depth| f64::from(*depth))
                .filter(measured)
                .collect(),
        };
        self.samples += depth.pixels().len().div_ceil(step) as u64;
        self.measured += depths.len() as u64;
        let typical = match depth.pixels() {
            DepthPixels::Millimetres(_) => &mut self.depth_mm,
            DepthPixels::Metres(_) => &mut self.depth_m,
        };
        if let Some(depth) = upper_median(&mut depths) {
            typical.add(depth);
        }
    }

    pub(super) fn findings(&self, subject: &Subject<'_>) -> Vec<Finding> {
        let topic = subject.topic;
        let mut findings = Vec::new();
        if let Some(depth_m) = self.depth_m.median()
            && depth_m > FARTHEST_M
        {
            findings.push(subject.grave(
                Check::Units,
                format!(
                    "{topic}: the median depth of its 32FC1 images is {depth_m:.0} m, which is {:.2} m if they are \
                     millimetres",
                    depth_m * 1e-3
                ),
                "32FC1 has metres (REP-118): divide by 1000, or publish 16UC1",
            ));
        }
        if let (Some(largest_mm), Some(depth_mm)) =
            (self.depth_mm.largest(), self.depth_mm.median())
            && largest_mm < NEAREST_MM
        {
            findings.push(subject.grave(
                Check::Units,
                format!(
                    "{topic}: the median depth of its 16UC1 images is {depth_mm:.0} mm, and never above \
                     {largest_mm:.0} mm"
                ),
                "16UC1 has millimetres (REP-118): multiply by 1000 before rounding, or publish 32FC1",
            ));
        }
        if let Some(depth_mm) = self.depth_mm.median()
            && depth_mm > FARTHEST_16UC1_MM
        {
            findings.push(subject.grave(
                Check::Units,
                format!(
                    "{topic}: the median depth of its 16UC1 images is {:.1} m, which is {:.2} m if they are tenths of a millimetre",
                    1e-3 * depth_mm,
                    1e-4 * depth_mm
                ),
                "16UC1 has millimetres (REP-118): multiply by the camera's depth scale in metres and by 1000",
            ));
        }
        let share = self.measured as f64 / self.samples.max(1) as f64;
        if self.samples > 0 && share < LEAST_SHARE {
            findings.push(Finding::grave_if(
                self.measured == 0 && subject.is_read,
                Check::Returns,
                format!(
                    "{topic}: depth is measured at {} of {} pixels ({:.1} %)",
                    self.measured,
                    self.samples,
                    1e2 * share
                ),
                "uncover the camera; bring it into its range, and out of the sun",
            ));
        }
        findings
    }
}
