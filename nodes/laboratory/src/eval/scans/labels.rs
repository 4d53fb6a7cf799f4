//! The labelled legs, and their scans.
//!
//! Labelled recordings often contain only the scans with people. With the whole recording as well, detection gets
//! the scans in between, too.

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

/// Labels by scan.
#[derive(Debug, Default)]
pub(super) struct Labels {
    rig_from_lidar: Isometry3<f64>,
    /// The labels of the scan that follows.
    of_next: Option<Vec<Point3<f64>>>,
    of_stamps: BTreeMap<Stamp, Vec<Point3<f64>>>,
    /// Messages whose scan already has labels, or that no scan followed.
    displaced: usize,
}

impl Labels {
    /// Labels in the same bag as the scans.
    pub(super) fn among(rig_from_lidar: Isometry3<f64>) -> Self {
        Self { rig_from_lidar, ..Self::default() }
    }

    /// The labels on a topic of another bag: each belongs to the scan with its stamp or, without a stamp, with the stamp
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

    /// Adds the labels of the scan that follows; returns their own stamp, if they have one.
    pub(super) fn take(&mut self, message: &BagMessage) -> Result<Option<Stamp>, Failure> {
        let labels = message.decode::<PoseArray>().map_err(failure)?;
        let places = labels.poses.iter().map(|pose| pose.position);
        let in_rig_m = places.map(|at| self.rig_from_lidar * Point3::new(at.x, at.y, at.z));
        let displaced = self.of_next.replace(in_rig_m.collect());
        self.displaced += usize::from(displaced.is_some());
        let stamp = convert::stamp_from_time(labels.header.stamp);
        Ok((stamp != Stamp::default()).then_some(stamp))
    }

    /// The labels of a scan, in the rig's frame; `None` if it has none.
    pub(super) fn of(&mut self, scan: Stamp) -> Option<Vec<Point3<f64>>> {
        self.of_next.take().or_else(|| self.of_stamps.remove(&scan))
    }

    /// The number of messages of labels without a scan.
    pub(super) fn left(&self) -> usize {
        self.displaced + self.of_stamps.len() + usize::from(self.of_next.is_some())
    }
}

#[cfg(test)]
mod tests;
