//! Which images have no pose, and why: by the node's counters and its reports.

use std::collections::BTreeMap;

use geometry::Stamp;
use msgs::convert::stamp_from_time;
use msgs::stillmap_msgs::StageReport;
use pose::shell::Stage;

use super::lost::{LostSpan, LostSpans};

/// Images without a partner are missing where there is no pair for longer than this: a camera that is twice as fast as the other one has
/// many, and loses nothing. After as long without a pose a robot does not know where it is.
const LONGEST_ALONE_S: f64 = 1.0;

/// What the node has reported of images without a pose.
#[derive(Clone, Debug, Default)]
pub(crate) struct WithoutPose {
    reports_seen: usize,
    drops: BTreeMap<String, DropsOfCause>,
    pairs: usize,
    stretch: Stretch,
    missing_partners: u64,
    /// Of images without a partner, by the reason: each camera has its own.
    alone: BTreeMap<String, Vec<Stamp>>,
    lost: LostSpans,
}

/// What was dropped for one cause.
#[derive(Clone, Debug, Default)]
pub(crate) struct DropsOfCause {
    pub(crate) count: u64,
    /// Why the first was, where the node has said it.
    pub(crate) first_reason: Option<String>,
}

/// A part of a recording without any pair.
#[derive(Clone, Copy, Debug, Default)]
struct Stretch {
    start: Option<Stamp>,
    end: Option<Stamp>,
    images: u64,
    depths: u64,
}

impl WithoutPose {
    /// Takes the reports and the counters as they are after a message.
    pub(super) fn note(&mut self, reports: &[StageReport], counts: BTreeMap<String, u64>) {
        let new = reports.get(self.reports_seen..).unwrap_or_default();
        self.reports_seen = reports.len();
        let risen = self.count(counts);
        let more = |cause: &str| risen.get(cause).copied().unwrap_or(0);
        let (images, depths) = (more(Stage::IMAGE_WITHOUT_DEPTH), more(Stage::DEPTH_WITHOUT_IMAGE));
        // Images without a partner come before the pair that has shown it.
        let mut alone = images + depths;
        self.stretch.images += images;
        self.stretch.depths += depths;
        for report in new {
            let stamp = stamp_from_time(report.header.stamp);
            let is_of_a_pair = report.processed || alone == 0;
            if is_of_a_pair {
                self.pairs += 1;
                self.lost.note(report);
                self.stretch_ends(Some(stamp));
            } else {
                alone -= 1;
                self.stretch.start.get_or_insert(stamp);
                self.stretch.end = Some(stamp);
                self.alone.entry(report.drop_reason.clone()).or_default().push(stamp);
            }
            let mut causes = risen.keys().filter(|cause| is_alone(cause) != is_of_a_pair);
            if let (false, Some(cause), None) = (report.processed, causes.next(), causes.next()) {
                let drops = self.drops.entry(cause.clone()).or_default();
                drops.first_reason.get_or_insert_with(|| report.drop_reason.clone());
            }
        }
    }

    /// Takes the counters as they are now. Returns by how much those have risen that have.
    fn count(&mut self, counts: BTreeMap<String, u64>) -> BTreeMap<String, u64> {
        let risen = counts.into_iter().map(|(cause, count)| {
            let before = &mut self.drops.entry(cause.clone()).or_default().count;
            (cause, count - std::mem::replace(before, count))
        });
        risen.filter(|(_, more)| *more > 0).collect()
    }

    /// A pair begins at its stamp where the stretch before it ends; `None` at the end of the recording.
    fn stretch_ends(&mut self, pair: Option<Stamp>) {
        self.missing_partners += self.missing_of_stretch(pair);
        self.stretch = Stretch { start: pair, ..Stretch::default() };
    }

    fn missing_of_stretch(&self, pair: Option<Stamp>) -> u64 {
        let Stretch { start, end, images, depths } = self.stretch;
        let length_s = start.zip(pair.or(end)).map_or(0.0, |(start, end)| end.seconds_since(start));
        if length_s > LONGEST_ALONE_S { images.max(depths) } else { 0 }
    }

    /// The number of pairs of images.
    pub(crate) fn pairs(&self) -> usize {
        self.pairs
    }

    /// The pairs without a pose, where this many have one, and the images whose camera was alone for long.
    pub(crate) fn missing(&self, poses: usize) -> u64 {
        let partners = self.missing_partners + self.missing_of_stretch(None);
        self.pairs.saturating_sub(poses) as u64 + partners
    }

    /// When the camera was lost, but for moments.
    pub(crate) fn lost(&self) -> impl Iterator<Item = &LostSpan> {
        self.lost.longer_than(LONGEST_ALONE_S)
    }

    /// How often there was no pose, and what could not be used, by cause.
    pub(crate) fn drops(&self) -> &BTreeMap<String, DropsOfCause> {
        &self.drops
    }

    /// The causes with the first reason of each, and how often. Images without a partner are none while their camera is not alone for long.
    pub(super) fn losses(&self) -> Vec<(String, u64)> {
        let partners = self.missing_partners + self.missing_of_stretch(None);
        let is_lost = |cause: &str| !is_alone(cause) || partners > 0;
        let lost = self.drops.iter().filter(|(cause, _)| is_lost(cause));
        let with_reason = |(cause, drops): (&String, &DropsOfCause)| match &drops.first_reason {
            Some(reason) => (format!("{cause}; the first: {reason}"), drops.count),
            None => (cause.clone(), drops.count),
        };
        lost.map(with_reason).collect()
    }

    /// How far an image without a partner is from the nearest one of the other camera: the median. `None` where one camera has none.
    pub(crate) fn median_gap_s(&self) -> Option<f64> {
        let mut of_cameras = self.alone.values();
        let (one, other) = (of_cameras.next()?, of_cameras.next()?);
        let mut other = other.clone();
        other.sort_unstable();
        let nearest_s = |image: &Stamp| {
            let after = other.partition_point(|of_other| of_other < image);
            let around = [after.checked_sub(1), Some(after)].into_iter().flatten();
            around
                .filter_map(|index| other.get(index))
                .map(|of_other| of_other.seconds_since(*image).abs())
                .min_by(f64::total_cmp)
        };
        let mut gaps_s: Vec<f64> = one.iter().filter_map(nearest_s).collect();
        estimation::quantile::upper_median(&mut gaps_s)
    }
}

fn is_alone(cause: &str) -> bool {
    [Stage::IMAGE_WITHOUT_DEPTH, Stage::DEPTH_WITHOUT_IMAGE].contains(&cause)
}

#[cfg(test)]
mod tests;
