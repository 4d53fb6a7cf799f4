//! The road map of a drive, scan by scan.

use std::path::Path;

use geometry::LidarCloud;
use lidar_odometry::odometry::deskewed_cloud;
use lidar_odometry::road_map::{RoadMap, RoadMapConfig};
use nalgebra::Isometry3;

use super::follower::FollowedScan;
use super::road_tiles::RoadTiles;
use crate::failure::Failure;

/// A map that scans are added to. Each scan is corrected for the motion of the vehicle during it; the motion during the first
/// one is known only with the second.
pub(super) struct DriveMap {
    map: RoadMap,
    base_from_lidar: Isometry3<f64>,
    first: Option<(LidarCloud, FollowedScan, Isometry3<f64>)>,
    last: Option<FollowedScan>,
}

impl DriveMap {
    /// An empty map; voxels beyond the memory limit are kept in files below the folder of the results.
    pub(super) fn new(
        config: RoadMapConfig,
        base_from_lidar: Isometry3<f64>,
        out: &Path,
    ) -> Result<Self, Failure> {
        let tiles = RoadTiles::below(out)
            .map_err(|failure| failure.fix("give a folder that can be written with --out"))?;
        let map = RoadMap::new(config, Box::new(tiles))
            .map_err(|error| Failure::new(format!("the road map: {error}")))?;
        Ok(Self { map, base_from_lidar, first: None, last: None })
    }

    pub(super) fn map(&self) -> &RoadMap {
        &self.map
    }

    /// Adds the next scan at its pose in the map.
    pub(super) fn take(
        &mut self,
        cloud: &LidarCloud,
        now: FollowedScan,
        map_from_base: &Isometry3<f64>,
    ) -> Result<(), Failure> {
        match self.last.replace(now) {
            None => self.first = Some((cloud.clone(), now, *map_from_base)),
            Some(last) => {
                if let Some((cloud, first, place)) = self.first.take() {
                    self.add(&cloud, &first, &place, (&last, &now))?;
                }
                self.add(cloud, &now, map_from_base, (&last, &now))?;
            }
        }
        Ok(())
    }

    /// Adds the scan of a recording with only one.
    pub(super) fn finish(&mut self) -> Result<(), Failure> {
        let Some((cloud, first, place)) = self.first.take() else { return Ok(()) };
        self.add(&cloud, &first, &place, (&first, &first))
    }

    /// Adds a scan, with the motion between two poses as the motion during it.
    fn add(
        &mut self,
        cloud: &LidarCloud,
        scan: &FollowedScan,
        map_from_base: &Isometry3<f64>,
        (from, to): (&FollowedScan, &FollowedScan),
    ) -> Result<(), Failure> {
        if !scan.is_measured {
            return Ok(());
        }
        let from_to = from.odom_from_base.inv_mul(&to.odom_from_base);
        let motion = self.base_from_lidar.inv_mul(&(from_to * self.base_from_lidar));
        let points_m = deskewed_cloud(cloud, &motion, to.stamp.seconds_since(from.stamp));
        let map_from_lidar = map_from_base * self.base_from_lidar;
        self.map
            .add(&points_m, cloud.intensities.as_deref(), &map_from_lidar)
            .map_err(|error| Failure::new(error.to_string()).fix("is the disk full?"))
    }
}
