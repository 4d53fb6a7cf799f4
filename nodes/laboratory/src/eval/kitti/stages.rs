//! The times of the stages of the thesis' table 4.2, without the transform.

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

/// Slow stages are timed at one of this many scans.
const EVERY: usize = 10;
/// The edge of the drawing in pixels, half of a screen.
const DRAWING_PX: usize = 800;

/// The sums of the times.
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
    /// No times yet. The tiles of the map are stored in a temporary folder below `temporary`, which is removed when this is dropped.
    ///
    /// # Errors
    /// When the folder cannot be created.
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

    /// Ends the time of reading a scan.
    pub(super) fn has_read(&mut self) {
        self.read.since(self.last);
    }

    /// Ends the time of the cloud.
    pub(super) fn has_made_cloud(&mut self, start: Instant) {
        self.cloud.since(start);
    }

    /// Adds a scan with its pose, the last one of the path.
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

    /// Starts the time of reading the next scan.
    pub(super) fn done(&mut self) {
        self.last = Instant::now();
    }

    /// The thesis' stages in its order, without the transform and the view.
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
    /// Reading a scan as an organised cloud.
    pub(super) read: Option<f64>,
    /// The cloud that is registered.
    pub(super) cloud: Option<f64>,
    /// Adding a scan to the road map.
    pub(super) map: Option<f64>,
    /// Drawing the path.
    pub(super) odometry: Option<f64>,
    /// Both panoramas.
    pub(super) panoramas: Option<f64>,
}
