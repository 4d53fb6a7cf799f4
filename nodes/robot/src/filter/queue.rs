//! The messages of a bag in their order, those that are filtered among them: they wait for what takes their place.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use bag_player::BagMessage;
use msgs::cdr::{self, CdrError};
use msgs::sensor_msgs::{Image, LaserScan, PointCloud2};
use serde::Serialize;

/// What was given to the pipeline.
pub(super) enum Outgoing {
    Scan(Arc<LaserScan>),
    Image(Arc<Image>),
    Colour(Arc<Image>),
    Points(Arc<PointCloud2>),
}

/// How many messages were replaced.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub(super) struct Replaced {
    pub(super) messages: u64,
    /// The others are byte for byte as they were.
    pub(super) changed: u64,
    /// Beams, or pixels or points.
    pub(super) taken_out: u64,
}

struct Entry {
    message: BagMessage,
    /// Until its filtered message has come.
    awaits: Option<Outgoing>,
}

/// The messages that are not written yet.
#[derive(Default)]
pub(super) struct Queue {
    entries: VecDeque<Entry>,
    scans: Replaced,
    views: Replaced,
    colours: Replaced,
}

impl Queue {
    pub(super) fn push(&mut self, message: BagMessage, awaits: Option<Outgoing>) {
        self.entries.push_back(Entry { message, awaits });
    }

    /// The next message, once it is certain what it is.
    pub(super) fn pop(&mut self) -> Option<BagMessage> {
        self.entries.front().filter(|entry| entry.awaits.is_none())?;
        self.entries.pop_front().map(|entry| entry.message)
    }

    /// What still waits stays as it is; returns how many messages of each topic.
    pub(super) fn give_up(&mut self) -> BTreeMap<String, u64> {
        let mut left = BTreeMap::new();
        for entry in self.entries.iter_mut().filter(|entry| entry.awaits.is_some()) {
            entry.awaits = None;
            *left.entry(entry.message.topic.to_string()).or_default() += 1;
        }
        left
    }

    /// What was replaced: of scans, of depth images or clouds, of colour images.
    pub(super) fn replaced(&self) -> [Replaced; 3] {
        [self.scans, self.views, self.colours]
    }

    /// The filtered scan has come whose own is the first that waits.
    pub(super) fn scan_came(&mut self, filtered: &Arc<LaserScan>) -> Result<(), CdrError> {
        let is_scan = |awaits: &Outgoing| matches!(awaits, Outgoing::Scan(_));
        let Some((message, Outgoing::Scan(raw))) = first(&mut self.entries, is_scan) else {
            return Ok(());
        };
        self.scans.messages += 1;
        if !Arc::ptr_eq(&raw, filtered) {
            let pairs = raw.ranges.iter().zip(&filtered.ranges);
            let others = pairs.filter(|(raw, now)| raw.to_bits() != now.to_bits());
            self.scans.changed += 1;
            self.scans.taken_out += others.count() as u64;
            message.data = cdr::encode(&**filtered)?;
        }
        Ok(())
    }

    /// The filtered image has come whose own is the first that waits.
    pub(super) fn image_came(&mut self, filtered: &Arc<Image>) -> Result<(), CdrError> {
        let is_image = |awaits: &Outgoing| matches!(awaits, Outgoing::Image(_));
        let Some((message, Outgoing::Image(raw))) = first(&mut self.entries, is_image) else {
            return Ok(());
        };
        self.views.messages += 1;
        if !Arc::ptr_eq(&raw, filtered) {
            let pixel_bytes = if raw.encoding == "32FC1" { 4 } else { 2 };
            self.views.changed += 1;
            self.views.taken_out += changed(&raw.data, &filtered.data, pixel_bytes);
            message.data = cdr::encode(&**filtered)?;
        }
        Ok(())
    }

    /// The filtered colour image has come whose own is the first that waits.
    pub(super) fn colour_came(&mut self, filtered: &Arc<Image>) -> Result<(), CdrError> {
        let is_colour = |awaits: &Outgoing| matches!(awaits, Outgoing::Colour(_));
        let Some((message, Outgoing::Colour(raw))) = first(&mut self.entries, is_colour) else {
            return Ok(());
        };
        self.colours.messages += 1;
        // The visual odometry is fed with another copy of it.
        if raw.data != filtered.data {
            let pixel_bytes = raw.step.checked_div(raw.width).unwrap_or(0);
            self.colours.changed += 1;
            self.colours.taken_out += changed(&raw.data, &filtered.data, pixel_bytes as usize);
            message.data = cdr::encode(&**filtered)?;
        }
        Ok(())
    }

    /// The filtered cloud has come whose own is the first that waits.
    pub(super) fn points_came(&mut self, filtered: &Arc<PointCloud2>) -> Result<(), CdrError> {
        let are_points = |awaits: &Outgoing| matches!(awaits, Outgoing::Points(_));
        let Some((message, Outgoing::Points(raw))) = first(&mut self.entries, are_points) else {
            return Ok(());
        };
        self.views.messages += 1;
        if !Arc::ptr_eq(&raw, filtered) {
            self.views.changed += 1;
            self.views.taken_out += changed(&raw.data, &filtered.data, raw.point_step as usize);
            message.data = cdr::encode(&**filtered)?;
        }
        Ok(())
    }
}

/// The first entry that waits for something of this kind. It waits no more: of each topic filtered messages come in their order.
fn first(
    entries: &mut VecDeque<Entry>,
    is_kind: impl Fn(&Outgoing) -> bool,
) -> Option<(&mut BagMessage, Outgoing)> {
    let entry = entries.iter_mut().find(|entry| entry.awaits.as_ref().is_some_and(&is_kind))?;
    let awaited = entry.awaits.take()?;
    Some((&mut entry.message, awaited))
}

/// How many records of so many bytes differ.
fn changed(raw: &[u8], filtered: &[u8], record_bytes: usize) -> u64 {
    let record_bytes = record_bytes.max(1);
    let pairs = raw.chunks(record_bytes).zip(filtered.chunks(record_bytes));
    pairs.filter(|(raw, now)| raw != now).count() as u64
}
