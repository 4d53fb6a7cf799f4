//! A camera's calibration.

use std::collections::BTreeSet;

use msgs::sensor_msgs::CameraInfo;

use super::{Check, Finding, Subject};

/// Places in K, row by row: fx, cx, fy, cy.
const FX: usize = 0;
const CX: usize = 2;
const FY: usize = 4;
const CY: usize = 5;
/// Lenses with narrower and with wider views are no depth cameras.
const LEAST_VIEW_RAD: f64 = 0.1;
const MOST_VIEW_RAD: f64 = 2.9;
/// By the calibration of another resolution the optical centre is off the middle on both axes to the same side: at a quarter of the
/// image with that of half as many pixels, at an edge with that of twice as many. On one axis it is by more than this share of the size,
const MOST_OFF_CENTRE: f64 = 0.2;
/// on the other, where the ratio of the sides may be another, by more than this. An image that was cropped at the top or at a side is
/// off on one axis.
const LEAST_OFF_CENTRE: f64 = 0.1;
/// Sizes that are kept at most.
const MOST_SIZES: usize = 4;

/// What is known of calibrations.
#[derive(Clone, PartialEq, Debug, Default)]
pub(in crate::doctor) struct CameraFacts {
    /// Columns and rows.
    pub(in crate::doctor) sizes_px: BTreeSet<(u32, u32)>,
    messages: u64,
    first: Option<[f64; 9]>,
    /// Messages that differ from the first.
    changed: u64,
}

impl CameraFacts {
    pub(super) fn take(&mut self, info: &CameraInfo) {
        self.messages += 1;
        if self.sizes_px.len() < MOST_SIZES {
            self.sizes_px.insert((info.width, info.height));
        }
        let first = *self.first.get_or_insert(info.k);
        // Compared by their bits, so that NaN equals itself.
        self.changed += u64::from(first.map(f64::to_bits) != info.k.map(f64::to_bits));
    }

    pub(super) fn findings(&self, subject: &Subject<'_>) -> Vec<Finding> {
        let topic = subject.topic;
        let mut findings = Vec::new();
        let Some(k) = self.first else { return findings };
        let size = self.sizes_px.first().copied().unwrap_or_default();
        if let Some(wrong) = wrong(&k, size) {
            findings.push(subject.grave(
                Check::Calibration,
                format!("{topic}: {wrong} (K = {k:?}, {} x {} pixels)", size.0, size.1),
                "calibrate the camera (ros2 run camera_calibration cameracalibrator) and let its driver load the file; \
                 or name one with the parameter camera_info_file",
            ));
        } else if let Some(share) = off_centre(&k, size) {
            findings.push(Finding::warn(
                Check::Calibration,
                format!(
                    "{topic}: by K the optical centre lies at {share:.2} of the image: K is likely that of an image of {:.1} times as many \
                     columns and rows (K = {k:?}, {} x {} pixels)",
                    2.0 * share, size.0, size.1
                ),
                "let the driver load the calibration of the mode that it runs in, and where a node resizes images, resize their calibration \
                 too (image_proc's resize does); of an image that was cropped at a corner it is right",
            ));
        }
        if self.changed > 0 {
            findings.push(Finding::warn(
                Check::Calibration,
                format!(
                    "{topic}: the calibration changes, {} of {} messages differ from the first",
                    self.changed, self.messages
                ),
                "see that one driver alone publishes it, and that the camera keeps its mode and zoom",
            ));
        }
        findings
    }

    /// Images of another size than the calibration is for.
    pub(in crate::doctor) fn sizes_differ(
        &self,
        info_topic: &str,
        images: &BTreeSet<(u32, u32)>,
        subject: &Subject<'_>,
    ) -> Option<Finding> {
        if self.sizes_px.is_empty() || images.is_empty() || self.sizes_px == *images {
            return None;
        }
        let sizes = |sizes: &BTreeSet<(u32, u32)>| {
            let sizes: Vec<String> =
                sizes.iter().map(|(width, height)| format!("{width} x {height}")).collect();
            sizes.join(" and ")
        };
        Some(subject.grave(
            Check::Calibration,
            format!(
                "{} has images of {} pixels, and {info_topic} is for {}",
                subject.topic,
                sizes(images),
                sizes(&self.sizes_px)
            ),
            "let the driver load the calibration of the mode that it runs in, or choose the one beside the image with \
             --camera-info",
        ))
    }
}

/// Where the optical centre is, as a share of the image on the axis where it is farther from the middle, if it is far from it.
fn off_centre(k: &[f64; 9], (width, height): (u32, u32)) -> Option<f64> {
    if width == 0 || height == 0 {
        return None;
    }
    // The middle of the first pixel is 0.
    let off = |centre_px: f64, size: u32| (centre_px + 0.5) / f64::from(size) - 0.5;
    let (x, y) = (off(k[CX], width), off(k[CY], height));
    let (more, less) = if x.abs() > y.abs() { (x, y) } else { (y, x) };
    let is_far = more.abs() > MOST_OFF_CENTRE && less * more.signum() > LEAST_OFF_CENTRE;
    is_far.then_some(more + 0.5)
}

/// What is wrong with a calibration.
pub(crate) fn wrong(k: &[f64; 9], (width, height): (u32, u32)) -> Option<String> {
    if k.iter().all(|one| *one == 0.0) {
        return Some("the camera is not calibrated, K is all zero".to_owned());
    }
    let axes = [("x", k[FX], k[CX], width), ("y", k[FY], k[CY], height)];
    axes.into_iter().find_map(|(axis, focal_px, centre_px, size)| {
        let size_px = f64::from(size);
        let view_rad = 2.0 * (0.5 * size_px / focal_px).atan();
        if !(focal_px > 0.0 && focal_px.is_finite()) {
            Some(format!("the focal length f{axis} is {focal_px}"))
        } else if size > 0 && !(LEAST_VIEW_RAD..=MOST_VIEW_RAD).contains(&view_rad) {
            Some(format!(
                "f{axis} = {focal_px} px gives a view of {:.0} degrees",
                view_rad.to_degrees()
            ))
        } else if size > 0 && !(0.0..=size_px).contains(&centre_px) {
            Some(format!("the optical centre c{axis} = {centre_px} px lies outside the image"))
        } else {
            None
        }
    })
}
