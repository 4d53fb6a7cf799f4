//! A camera's calibration.

use std::collections::{BTreeMap, BTreeSet};

use msgs::sensor_msgs::CameraInfo;

use super::{CalibrationFault, Check, Finding, Subject};

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
    /// K and the size that were judged last: most messages have the same.
    judged: Option<([u64; 9], (u32, u32))>,
    /// The first fault of those of each size.
    faults: BTreeMap<(u32, u32), CalibrationFault>,
}

impl CameraFacts {
    pub(super) fn take(&mut self, info: &CameraInfo) {
        self.messages += 1;
        let size_px = (info.width, info.height);
        if self.sizes_px.len() < MOST_SIZES {
            self.sizes_px.insert(size_px);
        }
        let first = *self.first.get_or_insert(info.k);
        // Compared by their bits, so that NaN equals itself.
        let bits = info.k.map(f64::to_bits);
        self.changed += u64::from(first.map(f64::to_bits) != bits);
        if self.judged.replace((bits, size_px)) != Some((bits, size_px)) {
            self.judge(&info.k, size_px);
        }
    }

    fn judge(&mut self, k: &[f64; 9], size_px: (u32, u32)) {
        if self.faults.len() >= MOST_SIZES || self.faults.contains_key(&size_px) {
            return;
        }
        if let Some(fault) = CalibrationFault::of(k, size_px) {
            self.faults.insert(size_px, fault);
        }
    }

    pub(super) fn findings(&self, subject: &Subject<'_>) -> Vec<Finding> {
        let topic = subject.topic;
        let of_fault = |CalibrationFault { is_certain, what, fix }: &CalibrationFault| {
            let is_error = *is_certain && subject.is_read;
            Finding::grave_if(is_error, Check::Calibration, format!("{topic}: {what}"), *fix)
        };
        let mut findings: Vec<Finding> = self.faults.values().map(of_fault).collect();
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
