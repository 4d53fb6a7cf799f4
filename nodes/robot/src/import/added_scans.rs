//! Scans for a bag without a scanner: cut out of its depth images.

use std::sync::Arc;

use bag_player::{BagInfo, BagMessage};
use geometry::CameraModel;
use msgs::sensor_msgs::{CameraInfo, LaserScan};
use msgs::{RosMessage, cdr, convert};

use super::scan_cut::{ScanCut, ScanCutArgs};
use crate::failure::Failure;
use crate::run::inputs::{ViewTopics, view_of};
use crate::run::view_topics::depth_image;
use crate::sensor_bag::SCAN;

/// Cuts a scan out of each depth image of a bag.
pub(super) struct AddedScans {
    cut: ScanCut,
    image: String,
    camera_info: String,
    camera: Option<CameraModel>,
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
        match view_of(info)? {
            ViewTopics::Depth { image, camera_info } => {
                Ok(Some(Self { cut: ScanCut::new(args), image, camera_info, camera: None }))
            }
            ViewTopics::Points(_) => Err(Failure::new(
                "--scan-from-depth needs depth images, and the bag has only clouds",
            )),
        }
    }

    /// The message of the scan of a depth image; `None` of other messages, and before the calibration.
    pub(super) fn scan_of(&mut self, message: &BagMessage) -> Result<Option<BagMessage>, Failure> {
        let failed = |error: String| Failure::new(format!("{}: {error}", message.topic));
        if *message.topic == *self.camera_info {
            let info = message.decode::<CameraInfo>().map_err(|error| failed(error.to_string()))?;
            let camera = convert::camera_from_message(&info);
            self.camera = Some(camera.map_err(|error| failed(error.to_string()))?);
        }
        let Some(camera) = self.camera.filter(|_| *message.topic == *self.image) else {
            return Ok(None);
        };
        let image = depth_image(message).map_err(|error| failed(error.to_string()))?;
        let Some(scan) = self.cut.scan(&image, &camera)? else { return Ok(None) };
        let scan: LaserScan = convert::message_from_scan(&scan);
        Ok(Some(BagMessage {
            topic: SCAN.into(),
            type_name: LaserScan::TYPE_NAME.into(),
            encoding: Arc::clone(&message.encoding),
            log_time: message.log_time,
            publish_time: message.publish_time,
            data: cdr::encode(&scan).map_err(|error| failed(error.to_string()))?,
        }))
    }
}
