//! The labelled legs, and which scan they are of.
//!
//! Labelled recordings often hold the scans with somebody alone: who has the whole recording, too, gives detection what
//! was there meanwhile.

use std::collections::BTreeMap;
use std::path::Path;

use bag_player::{Bag, BagMessage, Selection};
use geometry::Stamp;
use msgs::RosMessage;
use msgs::convert;
use msgs::geometry_msgs::PoseArray;
use msgs::sensor_msgs::LaserScan;
use nalgebra::{Isometry3, Point3};

use super::failure;
use robot::Failure;

/// Labels, each at home in a scan.
#[derive(Debug, Default)]
pub(super) struct Labels {
    rig_from_lidar: Isometry3<f64>,
    /// Those of the scan that follows.
    of_next: Option<Vec<Point3<f64>>>,
    of_stamps: BTreeMap<Stamp, Vec<Point3<f64>>>,
    /// Messages whose scan other labels took, or that no scan followed.
    displaced: usize,
}

impl Labels {
    /// Labels that come among the scans.
    pub(super) fn among(rig_from_lidar: Isometry3<f64>) -> Self {
        Self { rig_from_lidar, ..Self::default() }
    }

    /// The labels on a topic of another bag: each is at home in the scan of its stamp, or, where it has none, of the stamp
    /// of the scan that follows it there.
    pub(super) fn apart(
        rig_from_lidar: Isometry3<f64>,
        path: &Path,
        topic: &str,
    ) -> Result<Self, Failure> {
        let bag = Bag::open(path).map_err(failure)?;
        let scans = bag.topics().map_err(failure)?.into_iter();
        let scans = scans.filter(|one| one.type_name == LaserScan::TYPE_NAME);
        let topics: Vec<_> = scans.map(|one| one.topic).chain([topic.to_owned()]).collect();
        let selection = Selection { topics: Some(topics), ..Selection::default() };
        let mut labels = Self::among(rig_from_lidar);
        for message in bag.messages(&selection).map_err(failure)? {
            let message = message.map_err(failure)?;
            if message.is_on(topic) {
                if let Some(stamp) = labels.take(&message)? {
                    labels.next_is_of(stamp);
                }
            } else if labels.of_next.is_some() {
                let scan = message.decode::<LaserScan>().map_err(failure)?;
                labels.next_is_of(convert::stamp_from_time(scan.header.stamp));
            }
        }
        labels.displaced += usize::from(labels.of_next.take().is_some());
        Ok(labels)
    }

    fn next_is_of(&mut self, stamp: Stamp) {
        let displaced = self.of_next.take().and_then(|next| self.of_stamps.insert(stamp, next));
        self.displaced += usize::from(displaced.is_some());
    }

    /// Takes the labels of the scan that follows; returns the stamp that they have themselves, where they have one.
    pub(super) fn take(&mut self, message: &BagMessage) -> Result<Option<Stamp>, Failure> {
        let labels = message.decode::<PoseArray>().map_err(failure)?;
        let places = labels.poses.iter().map(|pose| pose.position);
        let in_rig_m = places.map(|at| self.rig_from_lidar * Point3::new(at.x, at.y, at.z));
        let displaced = self.of_next.replace(in_rig_m.collect());
        self.displaced += usize::from(displaced.is_some());
        let stamp = convert::stamp_from_time(labels.header.stamp);
        Ok((stamp != Stamp::default()).then_some(stamp))
    }

    /// The labels of a scan, in the rig's frame; `None` where nobody has labelled it.
    pub(super) fn of(&mut self, scan: Stamp) -> Option<Vec<Point3<f64>>> {
        self.of_next.take().or_else(|| self.of_stamps.remove(&scan))
    }

    /// How many messages of labels no scan has taken.
    pub(super) fn left(&self) -> usize {
        self.displaced + self.of_stamps.len() + usize::from(self.of_next.is_some())
    }
}

#[cfg(test)]
mod tests;
