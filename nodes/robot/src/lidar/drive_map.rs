//! The road map of a drive, scan by scan.

use std::path::Path;

use geometry::LidarCloud;
use lidar_odometry::odometry::deskewed_cloud;
use lidar_odometry::road_map::{RoadMap, RoadMapConfig};
use nalgebra::Isometry3;

use super::files::TileFolder;
use super::follower::FollowedScan;
use crate::failure::Failure;

/// A map that grows by scans. Each is laid out as the vehicle moved meanwhile, which for the first one the second tells.
pub(super) struct DriveMap {
    map: RoadMap,
    base_from_lidar: Isometry3<f64>,
    first: Option<(LidarCloud, FollowedScan, Isometry3<f64>)>,
    last: Option<FollowedScan>,
}

impl DriveMap {
    /// An empty one; what memory has no room for waits in the folder.
    pub(super) fn new(
        config: RoadMapConfig,
        base_from_lidar: Isometry3<f64>,
        folder: &Path,
    ) -> Result<Self, Failure> {
        let map = RoadMap::new(config, Box::new(TileFolder::create(folder)?)).map_err(|error| {
            Failure::new(error.to_string()).fix("see --road-voxel and --road-memory")
        })?;
        Ok(Self { map, base_from_lidar, first: None, last: None })
    }

    pub(super) fn map(&self) -> &RoadMap {
        &self.map
    }

    /// Takes in the next scan, at its place in the map.
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

    /// A recording of one scan has a map, too.
    pub(super) fn finish(&mut self) -> Result<(), Failure> {
        let Some((cloud, first, place)) = self.first.take() else { return Ok(()) };
        self.add(&cloud, &first, &place, (&first, &first))
    }

    /// While the vehicle moved as between two poses.
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
