//! What the stages of the thesis' table 4.2 take here, besides the transform.

use std::path::Path;
use std::time::Instant;

use geometry::LidarCloud;
use lidar_odometry::drawing::{DrawnTrajectory, DrawnView, drawn};
use lidar_odometry::panorama::PanoramaConfig;
use lidar_odometry::recorded::revolution_from_cloud;
use lidar_odometry::road_map::{RoadMap, RoadMapConfig};
use nalgebra::Isometry3;

use robot::Failure;
use robot::lidar::RoadTiles;

/// The stages that need not be timed at each scan are at one of so many.
const EVERY: usize = 10;
/// The edge of the drawing, half of a screen.
const DRAWING_PX: usize = 800;

/// Sums of times.
pub(super) struct StageTimes {
    map: RoadMap,
    last: Instant,
    read: Mean,
    cloud: Mean,
    mapped: Mean,
    drawing: Mean,
    panoramas: Mean,
    scans: usize,
}

#[derive(Default)]
struct Mean {
    sum_ms: f64,
    count: u32,
}

impl Mean {
    fn since(&mut self, start: Instant) {
        self.sum_ms += 1e3 * start.elapsed().as_secs_f64();
        self.count += 1;
    }

    fn ms(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum_ms / f64::from(self.count))
    }
}

impl StageTimes {
    /// No times yet. The tiles of the map wait in a folder of their own below `temporary`, which goes with it.
    ///
    /// # Errors
    /// When nothing can be written there.
    pub(super) fn below(temporary: &Path) -> Result<Self, Failure> {
        let tiles = RoadTiles::below(temporary).map_err(|failure| {
            failure.fix("name a folder that can be written in the environment variable TMPDIR")
        })?;
        let map = RoadMap::new(RoadMapConfig::default(), Box::new(tiles))
            .map_err(|error| Failure::new(error.to_string()))?;
        Ok(Self {
            map,
            last: Instant::now(),
            read: Mean::default(),
            cloud: Mean::default(),
            mapped: Mean::default(),
            drawing: Mean::default(),
            panoramas: Mean::default(),
            scans: 0,
        })
    }

    /// A scan was read: as long as nothing else was done.
    pub(super) fn has_read(&mut self) {
        self.read.since(self.last);
    }

    /// A cloud was made since.
    pub(super) fn has_made_cloud(&mut self, start: Instant) {
        self.cloud.since(start);
    }

    /// A scan has its pose, the last one of the way.
    pub(super) fn take(
        &mut self,
        cloud: &LidarCloud,
        way: &[Isometry3<f64>],
    ) -> Result<(), Failure> {
        self.scans += 1;
        if let Some(pose) = way.last().filter(|_| self.scans % EVERY == 1) {
            let start = Instant::now();
            self.map
                .add(&cloud.points_m, cloud.intensities.as_deref(), pose)
                .map_err(|error| Failure::new(error.to_string()).fix("is the disk full?"))?;
            self.mapped.since(start);
            let start = Instant::now();
            let way = DrawnTrajectory { map_from_vehicle: way, truth: None, surroundings_m: &[] };
            drop(drawn(&way, DrawnView::Whole, DRAWING_PX));
            self.drawing.since(start);
            let start = Instant::now();
            if let Some(revolution) = revolution_from_cloud(cloud) {
                for config in [PanoramaConfig::pink_intensities(), PanoramaConfig::hsv_ranges()] {
                    config.draw(&revolution).map_err(|error| Failure::new(error.to_string()))?;
                }
                self.panoramas.since(start);
            }
        }
        Ok(())
    }

    /// From now on it is read again.
    pub(super) fn done(&mut self) {
        self.last = Instant::now();
    }

    /// The thesis' stages in its order, but for the transform and the view.
    pub(super) fn ms(&self) -> StageMs {
        StageMs {
            read: self.read.ms(),
            cloud: self.cloud.ms(),
            map: self.mapped.ms(),
            odometry: self.drawing.ms(),
            panoramas: self.panoramas.ms(),
        }
    }
}

/// The means, in ms.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub(super) struct StageMs {
    /// Reading a scan, its points in rows.
    pub(super) read: Option<f64>,
    /// The cloud that is registered.
    pub(super) cloud: Option<f64>,
    /// A scan into the road map.
    pub(super) map: Option<f64>,
    /// The drawing of the way.
    pub(super) odometry: Option<f64>,
    /// Both panoramas.
    pub(super) panoramas: Option<f64>,
}
