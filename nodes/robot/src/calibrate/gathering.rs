//! The chosen scans with their images.

use bag_player::BagMessage;
use calibration::{Cycle, returns_of};
use geometry::BeamOrder;
use geometry::{CameraModel, DepthImage, Scan, Stamp};
use msgs::convert;
use msgs::sensor_msgs::CameraInfo;

use super::choice::Chosen;
use super::poses::{Poses, beam_stamp};
use super::reader::{Topics, Turn, Turns, read_scan};
use crate::run::view_topics::depth_image;

/// The chosen scans and the images nearest to the middle of their turns.
pub(super) struct Gathering {
    wanted: Vec<Wanted>,
    next_scan: usize,
    max_offset_s: f64,
    /// The first calibration of the camera.
    pub(super) camera: Option<CameraModel>,
    /// Images that could not be read.
    pub(super) unusable: usize,
}

struct Wanted {
    number: usize,
    turn: Turn,
    scan: Option<Scan>,
    image: Option<DepthImage>,
}

impl Wanted {
    fn offset_s(&self, stamp: Stamp) -> f64 {
        let middle = self.turn.stamp.plus_seconds(0.5 * self.turn.turn_s);
        stamp.seconds_since(middle).abs()
    }
}

impl Gathering {
    pub(super) fn new(turns: &Turns, chosen: &Chosen, max_offset_s: f64) -> Self {
        let wanted = chosen
            .scans
            .iter()
            .filter_map(|number| {
                let turn = *turns.turns.get(*number)?;
                Some(Wanted { number: *number, turn, scan: None, image: None })
            })
            .collect();
        Self { wanted, next_scan: 0, max_offset_s, camera: None, unusable: 0 }
    }

    pub(super) fn take(&mut self, message: &BagMessage, topics: &Topics) {
        if *message.topic == *topics.scan {
            let number = self.next_scan;
            self.next_scan += 1;
            let wanted = self.wanted.iter_mut().find(|wanted| wanted.number == number);
            if let Some(wanted) = wanted {
                wanted.scan = read_scan(message);
            }
        } else if *message.topic == *topics.image {
            self.take_image(message);
        } else if self.camera.is_none() {
            let info = message.decode::<CameraInfo>().ok();
            self.camera = info.and_then(|info| convert::camera_of_image(&info, &topics.image).ok());
        }
    }

    fn take_image(&mut self, message: &BagMessage) {
        let Ok(image) = depth_image(message) else {
            self.unusable += 1;
            return;
        };
        let stamp = image.stamp;
        let max_offset_s = self.max_offset_s;
        let is_better = |wanted: &Wanted| {
            let offset_s = wanted.offset_s(stamp);
            offset_s <= max_offset_s
                && wanted.image.as_ref().is_none_or(|image| offset_s < wanted.offset_s(image.stamp))
        };
        for wanted in self.wanted.iter_mut().filter(|wanted| is_better(wanted)) {
            wanted.image = Some(image.clone());
        }
    }

    pub(super) fn cycles(self, poses: &Poses, beam_order: BeamOrder) -> Vec<Cycle> {
        self.wanted
            .into_iter()
            .filter_map(|Wanted { turn, scan, image, .. }| {
                let (scan, image) = (scan?, image?);
                let map_from_rig = poses.at(image.stamp)?;
                let image_rig_from_map = map_from_rig.inverse();
                let returns = returns_of(&scan, |beam| {
                    let stamp = beam_stamp(&scan, beam, turn.turn_s, beam_order);
                    Some(image_rig_from_map * poses.at(stamp)?)
                });
                Some(Cycle { returns, image, map_from_rig: Some(map_from_rig) })
            })
            .collect()
    }
}
