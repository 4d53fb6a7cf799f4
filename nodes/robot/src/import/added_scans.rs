//! Scans for a bag without a scanner: cut out of its depth images.

use std::sync::Arc;

use bag_player::{Bag, BagInfo, BagMessage, CDR, Selection, TopicInfo};
use geometry::{CameraModel, Scan};
use msgs::geometry_msgs::TransformStamped;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan};
use msgs::std_msgs::Header;
use msgs::tf2_msgs::TFMessage;
use msgs::{RosMessage, cdr, convert};
use nalgebra::Translation3;

use super::scan_cut::{ScanCut, ScanCutArgs};
use crate::failure::Failure;
use crate::offer::Offer;
use crate::rig::rig_from_camera;
use crate::run::inputs::{MULTI_ECHO, TF_STATIC, TopicArgs, ViewTopics, view_of};
use crate::run::view_topics::depth_image;
use crate::sensor_bag::SCAN;

/// Whether images are depths is told by the first of them, of which one may be damaged.
const IMAGES_TRIED: usize = 5;
/// The frame of the scans is named after the camera's.
const FRAME_SUFFIX: &str = "_scan";

/// Cuts a scan out of each depth image of a bag.
pub(crate) struct AddedScans {
    cut: ScanCut,
    image: String,
    camera_info: String,
    camera: Option<CameraModel>,
    /// Whether it has been said where the scans are; `None` where the bag has no fixed transforms, and the parameters say it.
    has_placed: Option<bool>,
}

impl AddedScans {
    /// Those of a bag; `None` if none are requested.
    pub(super) fn new(args: &ScanCutArgs, info: &BagInfo) -> Result<Option<Self>, Failure> {
        if !args.is_requested() {
            return Ok(None);
        }
        if info.topic(SCAN).is_some() {
            return Err(Failure::new(format!("--scan-from-depth: the bag has a topic {SCAN}"))
                .fix("leave it out: the bag needs no other scan"));
        }
        match view_of(info, &TopicArgs::default())? {
            ViewTopics::Depth { image, camera_info } => {
                let cut = ScanCut::new(args);
                let has_placed = has_placed(info);
                Ok(Some(Self { cut, image, camera_info, camera: None, has_placed }))
            }
            ViewTopics::Points(_) => Err(Failure::new(
                "--scan-from-depth needs depth images, and the bag has only clouds",
            )),
        }
    }

    /// Those of a bag without a scanner, as the arguments have them where nothing else is said; `None` of one that has a scanner,
    /// or no depth images.
    ///
    /// # Errors
    /// When several topics may be its depth images, or they have no calibration.
    pub(crate) fn where_needed(
        topics: &TopicArgs,
        (bag, info): (&Bag, &BagInfo),
    ) -> Result<Option<Self>, Failure> {
        let offer = Offer::of_bag(info);
        let has = |type_name: &str| offer.of_type(type_name).next().is_some();
        let is_other = |topic: &TopicInfo| topic.type_name != LaserScan::TYPE_NAME;
        let has_scanner = topics.scan.is_some()
            || has(LaserScan::TYPE_NAME)
            || has(MULTI_ECHO)
            || info.topic(SCAN).is_some_and(is_other);
        if has_scanner || !(has(Image::TYPE_NAME) || has(CompressedImage::TYPE_NAME)) {
            return Ok(None);
        }
        let view = view_of(info, topics).map_err(|failure| {
            failure
                .within("the bag has no 2D laser scan, so that scans are cut out of depth images")
        })?;
        let ViewTopics::Depth { image, camera_info } = view else { return Ok(None) };
        // The only images of a bag may be those of a colour camera.
        let selection = Selection { topics: Some(vec![image.clone()]), ..Selection::default() };
        let messages = bag.messages(&selection).map_err(|error| Failure::new(error.to_string()))?;
        let is_depth = messages
            .take(IMAGES_TRIED)
            .any(|message| message.is_ok_and(|message| depth_image(&message).is_ok()));
        let (cut, has_placed) = (ScanCut::usual(), has_placed(info));
        Ok(is_depth.then_some(Self { cut, image, camera_info, camera: None, has_placed }))
    }

    /// The content of the bag with the scans.
    pub(crate) fn listed_in(&self, mut info: BagInfo) -> BagInfo {
        let messages = info.topic(&self.image).map_or(0, |images| images.message_count);
        info.topics.retain(|topic| topic.topic != SCAN);
        info.topics.push(TopicInfo {
            topic: SCAN.to_owned(),
            type_name: LaserScan::TYPE_NAME.to_owned(),
            definition: None,
            type_hash: None,
            encoding: CDR.to_owned(),
            message_count: messages,
            rate_hz: None,
            qos: None,
        });
        info
    }

    /// The topic of the depth images.
    pub(crate) fn image(&self) -> &str {
        &self.image
    }

    /// What is added before a message: the scan of a depth image, and with the first one where it is, where the bag has fixed transforms. Nothing before
    /// other messages, and before the calibration.
    pub(crate) fn before(&mut self, message: &BagMessage) -> Result<Vec<BagMessage>, Failure> {
        let failed = |error: String| Failure::new(format!("{}: {error}", message.topic));
        if *message.topic == *self.camera_info {
            let info = message.decode::<CameraInfo>().map_err(|error| failed(error.to_string()))?;
            let camera = convert::camera_of_image(&info, &self.image);
            self.camera = Some(camera.map_err(|error| failed(error.to_string()))?);
        }
        let Some(camera) = self.camera.filter(|_| *message.topic == *self.image) else {
            return Ok(Vec::new());
        };
        let image = depth_image(message).map_err(|error| failed(error.to_string()))?;
        let Some(mut scan) = self.cut.scan(&image, &camera)? else { return Ok(Vec::new()) };
        let mut added = Vec::new();
        if let Some(has_placed) = &mut self.has_placed {
            scan.frame_id = format!("{}{FRAME_SUFFIX}", image.frame_id);
            if !std::mem::replace(has_placed, true) {
                let mount = placed(&scan, &image.frame_id, self.cut.height_m());
                added.push(beside(message, TF_STATIC, &mount).map_err(failed)?);
            }
        }
        let scan: LaserScan = convert::message_from_scan(&scan);
        added.push(beside(message, SCAN, &scan).map_err(failed)?);
        Ok(added)
    }
}

/// A message at the time of another one.
fn beside<M: RosMessage>(
    other: &BagMessage,
    topic: &str,
    message: &M,
) -> Result<BagMessage, String> {
    Ok(BagMessage {
        topic: topic.into(),
        type_name: M::TYPE_NAME.into(),
        encoding: Arc::clone(&other.encoding),
        log_time: other.log_time,
        publish_time: other.publish_time,
        data: cdr::encode(message).map_err(|error| error.to_string())?,
    })
}

/// Where a scan is from the camera that it is cut from: the camera looks level and ahead.
fn placed(scan: &Scan, camera_frame: &str, height_m: f64) -> TFMessage {
    let camera_from_scan = rig_from_camera().inverse() * Translation3::new(0.0, 0.0, height_m);
    let header =
        Header { stamp: convert::time_from_stamp(scan.stamp), frame_id: camera_frame.to_owned() };
    let transform = TransformStamped {
        header,
        child_frame_id: scan.frame_id.clone(),
        transform: convert::transform_from_isometry(&camera_from_scan),
    };
    TFMessage { transforms: vec![transform] }
}

/// Whether a bag has fixed transforms, and where scans are is still to be said there.
fn has_placed(info: &BagInfo) -> Option<bool> {
    info.topic(TF_STATIC).is_some_and(|topic| topic.message_count > 0).then_some(false)
}
