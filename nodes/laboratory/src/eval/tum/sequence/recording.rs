//! A sequence in a bag: simulated, or recorded with a ground-truth pose.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use bag_player::{Bag, BagError, BagMessage, Messages, Selection};
use evaluation::trajectory::Trajectory;
use geometry::{CameraModel, DepthImage, Stamp};
use msgs::convert::{camera_of_image, depth_from_message, stamp_from_time};
use msgs::sensor_msgs::{CameraInfo, Image};

use super::{ColorImage, Images, Pair, Pairing, Pairs, paired};
use crate::eval::trajectory::true_poses_of_bag;
use robot::visual::{VisualTopicArgs, VisualTopics, depth_info_topic, depth_topic};
use robot::{Failure, Offer};

/// The topic of the ground truth of a simulation.
const TRUTH: &str = "/truth/pose";

/// A bag with colour images, depth images registered to them, their calibration, and the ground-truth pose.
#[derive(Debug)]
pub(in super::super) struct Recording {
    path: PathBuf,
    color: String,
    depth: String,
    camera_info: String,
    /// The images, by stamp.
    pub(super) pairs: Pairs<Stamp>,
}

impl Recording {
    /// Whether a file or a folder is a bag.
    pub(super) fn is_at(path: &Path) -> bool {
        let is_file = path.extension().is_some_and(|extension| extension == "mcap");
        (is_file && path.is_file()) || path.join("metadata.yaml").is_file()
    }

    /// Reads the stamps of the images, and the poses on `truth`.
    pub(super) fn open(
        path: &Path,
        truth: Option<&str>,
        pairing: Pairing,
    ) -> Result<(Self, Trajectory), Failure> {
        let bag = Bag::open(path).map_err(failure)?;
        let info = bag.info().map_err(failure)?;
        let offer = Offer::of_bag(&info);
        let depth = depth_topic(None, &offer)?;
        let args = VisualTopicArgs::default();
        let topics = VisualTopics::choose(&args, &depth, &depth_info_topic(&depth), &offer)?;
        if topics.is_compressed {
            return Err(Failure::new(format!("{} carries compressed images", topics.image))
                .within(path.display())
                .fix("stillmap odometry follows them, and stillmap eval trajectory scores that"));
        }
        let is_simulated = info.topics.iter().any(|topic| topic.topic == TRUTH);
        let truth = true_poses_of_bag(path, truth.or(is_simulated.then_some(TRUTH)), "--truth")?;
        let mut recording = Self {
            path: path.to_owned(),
            color: topics.image,
            depth,
            camera_info: topics.camera_info,
            pairs: Pairs { pairs: Vec::new(), alone: 0 },
        };
        let (mut colors, mut depths) = (Vec::new(), Vec::new());
        for message in recording.messages(&bag)? {
            let message = message.map_err(failure)?;
            let is_color = *message.topic == recording.color;
            if is_color || *message.topic == recording.depth {
                let stamp =
                    stamp_from_time(message.decode::<Image>().map_err(failure)?.header.stamp);
                if is_color { &mut colors } else { &mut depths }.push((stamp, stamp));
            }
        }
        recording.pairs = paired(colors, depths, pairing);
        Ok((recording, truth))
    }

    fn messages(&self, bag: &Bag) -> Result<Messages, Failure> {
        let topics = [&self.color, &self.depth, &self.camera_info].map(Clone::clone);
        let selection = Selection { topics: Some(topics.to_vec()), ..Selection::default() };
        bag.messages(&selection).map_err(failure)
    }

    /// The images of each pair.
    pub(super) fn images(&self) -> Result<RecordedImages<'_>, Failure> {
        let bag = Bag::open(&self.path).map_err(failure)?;
        Ok(RecordedImages {
            recording: self,
            messages: self.messages(&bag)?,
            pairs: self.pairs.pairs.iter(),
            camera: None,
            colors: BTreeMap::new(),
            depths: BTreeMap::new(),
        })
    }
}

/// The pairs of a bag in their order, while it is read.
pub(super) struct RecordedImages<'a> {
    recording: &'a Recording,
    messages: Messages,
    pairs: std::slice::Iter<'a, Pair<Stamp>>,
    camera: Option<CameraModel>,
    /// Images that were read, and may still be part of a pair.
    colors: BTreeMap<Stamp, ColorImage>,
    depths: BTreeMap<Stamp, DepthImage>,
}

impl RecordedImages<'_> {
    fn take(&mut self, message: &BagMessage) -> Result<(), Failure> {
        let within =
            |error: &dyn std::fmt::Display| Failure::new(error.to_string()).within(&*message.topic);
        if *message.topic == self.recording.camera_info {
            let info = message.decode::<CameraInfo>().map_err(failure)?;
            let camera = camera_of_image(&info, &self.recording.color);
            self.camera = Some(camera.map_err(|error| within(&error))?);
        }
        if *message.topic == self.recording.depth {
            let image = message.decode::<Image>().map_err(failure)?;
            let depth = depth_from_message(&image).map_err(|error| within(&error))?;
            self.depths.insert(depth.stamp, depth);
        }
        if *message.topic == self.recording.color {
            let image = message.decode::<Image>().map_err(failure)?;
            let color = ColorImage {
                is_big_endian: image.is_bigendian != 0,
                step_bytes: image.step as usize,
                size_px: (image.width as usize, image.height as usize),
                encoding: image.encoding,
                data: image.data,
            };
            self.colors.insert(stamp_from_time(image.header.stamp), color);
        }
        Ok(())
    }

    /// Reads until a pair is complete.
    fn read(&mut self, pair: &Pair<Stamp>) -> Result<Images, Failure> {
        loop {
            let is_there =
                self.colors.contains_key(&pair.color) && self.depths.contains_key(&pair.depth);
            if let (true, Some(camera)) = (is_there, self.camera) {
                // A depth image may belong to several colour images.
                self.colors = self.colors.split_off(&pair.color);
                self.depths = self.depths.split_off(&pair.depth);
                let color = self.colors.remove(&pair.color);
                let depth = self.depths.get(&pair.depth).cloned();
                if let Some((color, depth)) = color.zip(depth) {
                    return Ok(Images { stamp: pair.stamp, camera, color, depth });
                }
            }
            let message = self.messages.next().ok_or_else(|| {
                Failure::new("the bag ends before its images do, or has no calibration")
                    .within(self.recording.path.display())
            })?;
            self.take(&message.map_err(failure)?)?;
        }
    }
}

impl Iterator for RecordedImages<'_> {
    type Item = Result<Images, Failure>;

    fn next(&mut self) -> Option<Self::Item> {
        let pair = self.pairs.next()?.clone();
        Some(self.read(&pair))
    }
}

fn failure(error: BagError) -> Failure {
    Failure::new(error.to_string())
}
