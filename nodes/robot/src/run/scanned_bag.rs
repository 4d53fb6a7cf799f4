//! Whether a recording has a 2D scanner, and a copy with scans of one that has none.

use std::path::{Path, PathBuf};

use bag_player::{Bag, BagInfo, TemporaryFolder};
use msgs::RosMessage;
use msgs::sensor_msgs::LaserScan;

use crate::failure::Failure;
use crate::import::AddedScans;
use crate::import::bag::copy_to;
use crate::interrupt::Interrupt;
use crate::lidar::LidarSource;
use crate::open_bag::open_bag_while;

/// A folder of its own, which is gone afterwards.
pub(super) fn folder_for_bag() -> Result<TemporaryFolder, Failure> {
    TemporaryFolder::new()
        .map_err(|error| Failure::new(format!("no folder for the imported bag: {error}")))
}

/// A copy of a bag with scans, which is gone afterwards.
pub(super) struct ScannedBag {
    pub(super) bag: PathBuf,
    _folder: TemporaryFolder,
}

impl ScannedBag {
    pub(super) fn of(
        (bag, info): (&Bag, &BagInfo),
        name: &str,
        added: AddedScans,
        interrupt: &Interrupt,
    ) -> Result<Self, Failure> {
        let folder = folder_for_bag()?;
        let path = folder.path().join(format!("{name}.mcap"));
        copy_to(&path, (bag, info), Some(added), interrupt)?;
        Ok(Self { bag: path, _folder: folder })
    }
}

/// Whether a recording is a bag with a 2D scanner.
pub(super) fn has_scanner(path: &Path, interrupt: &Interrupt) -> Result<bool, Failure> {
    if LidarSource::is_no_bag(path) {
        return Ok(false);
    }
    let bag = open_bag_while(path, interrupt)?;
    let info = bag.info().map_err(|error| Failure::new(error.to_string()))?;
    let is_one = |topic: &bag_player::TopicInfo| {
        topic.type_name == LaserScan::TYPE_NAME
            && topic.message_count > 0
            && !topic.topic.starts_with("/truth/")
    };
    Ok(info.topics.iter().any(is_one))
}
