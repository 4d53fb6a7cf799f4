//! When a camera was lost.

use geometry::Stamp;
use msgs::convert::stamp_from_time;
use msgs::stillmap_msgs::StageReport;

/// A part of a recording in which a camera that was followed before was lost.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct LostSpan {
    /// Since the first pose.
    pub(crate) from_s: f64,
    /// When it was found again, likewise; `None` if it was not.
    pub(crate) to: Option<(f64, Stamp)>,
    /// Why, at first.
    pub(crate) reason: String,
    last_s: f64,
}

/// All of them.
#[derive(Clone, Debug, Default)]
pub(super) struct LostSpans {
    first_pose: Option<Stamp>,
    spans: Vec<LostSpan>,
}

impl LostSpans {
    /// Takes the next pair of images.
    pub(super) fn note(&mut self, pair: &StageReport) {
        let stamp = stamp_from_time(pair.header.stamp);
        let Some(first) = self.first_pose else {
            self.first_pose = pair.processed.then_some(stamp);
            return;
        };
        let at_s = stamp.seconds_since(first);
        match self.spans.last_mut().filter(|span| span.to.is_none()) {
            Some(span) if pair.processed => span.to = Some((at_s, stamp)),
            Some(span) => span.last_s = at_s,
            None if pair.processed => {}
            None => {
                let reason = pair.drop_reason.clone();
                self.spans.push(LostSpan { from_s: at_s, to: None, reason, last_s: at_s });
            }
        }
    }

    /// Those that are longer than this.
    pub(super) fn longer_than(&self, least_s: f64) -> impl Iterator<Item = &LostSpan> {
        let end_s = |span: &LostSpan| span.to.map_or(span.last_s, |(to_s, _)| to_s);
        self.spans.iter().filter(move |span| end_s(span) - span.from_s > least_s)
    }
}
