//! The node `reconstruction`: static clouds in, the static map out.

mod map_file;
#[cfg(test)]
mod tests;

use std::process::ExitCode;
use std::time::Duration;

use msgs::convert;
use msgs::sensor_msgs::PointCloud2;
use node_shell::{Node, NodeFailure, Program, Publisher, Qos, StageReporter, StepTimer};
use serde::{Deserialize, Serialize};
use tokio::time::MissedTickBehavior;

use crate::{Addition, ReconstructionConfig, StaticMap};
use map_file::MapFile;

const PROGRAM: Program = Program {
    name: "reconstruction",
    about: "Builds the static map out of the static clouds of the cycles.",
    topics: "in  static_cloud (sensor_msgs/msg/PointCloud2, map frame), reliable
             out static_map (sensor_msgs/msg/PointCloud2, map frame), reliable and transient local
             out ~/report (stillmap_msgs/msg/StageReport), reliable",
};

/// Cycles that may wait here without one being lost: seven seconds of the RPLIDAR A1.
const CYCLES_KEPT: usize = 50;

/// The parameters of the node.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct ReconstructionParameters {
    /// The map is published at most once in this time, and only when a cloud has come since and somebody
    /// subscribes.
    pub map_publish_period_s: f64,
    /// Where the map is saved when the node ends: a path that ends in .ply or .pcd, or nothing.
    pub save_map_on_exit: String,
    /// The parameters of the method.
    #[serde(flatten)]
    pub config: ReconstructionConfig,
}

impl Default for ReconstructionParameters {
    fn default() -> Self {
        Self {
            // Often enough to watch the map grow; a map of 10^5 points is 1.2 MB.
            map_publish_period_s: 1.0,
            save_map_on_exit: String::new(),
            config: ReconstructionConfig::default(),
        }
    }
}

/// Runs the node until SIGINT or SIGTERM, with the arguments behind the program's name.
pub fn run(arguments: impl IntoIterator<Item = String>) -> ExitCode {
    PROGRAM.run(arguments, serve)
}

/// The node's body: serves until the node is to end, and then saves the map where that was asked for.
///
/// # Errors
/// When a parameter is out of its range, a topic cannot be had, or the map cannot be saved.
pub async fn serve(node: &Node, parameters: ReconstructionParameters) -> Result<(), NodeFailure> {
    let map_file = MapFile::new(&parameters.save_map_on_exit)?;
    let mut publish_time = tokio::time::interval(period(parameters.map_publish_period_s)?);
    publish_time.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut stage = Stage {
        map: StaticMap::new(parameters.config)?,
        has_news: false,
        cycles: 0,
        maps: node.publisher("static_map", &Qos::latched())?,
        reporter: StageReporter::new(node, PROGRAM.name)?,
    };
    let clouds = node.subscription::<PointCloud2>("static_cloud", &Qos::reliable(CYCLES_KEPT))?;
    let shutdown = node.shutdown_signal();
    loop {
        tokio::select! {
            biased;
            () = shutdown.wait() => break,
            _ = publish_time.tick() => stage.publish_news(),
            received = clouds.next() => stage.take(&received.message),
        }
    }
    while let Some(received) = clouds.try_next() {
        stage.take(&received.message);
    }
    if let Some(map_file) = map_file {
        map_file.save(&stage.map)?;
    }
    Ok(())
}

fn period(seconds: f64) -> Result<Duration, NodeFailure> {
    Duration::try_from_secs_f64(seconds).ok().filter(|period| !period.is_zero()).ok_or_else(|| {
        format!(
            "parameter map_publish_period_s must be a positive number of seconds, not {seconds}"
        )
        .into()
    })
}

/// The core with its topics.
struct Stage {
    map: StaticMap,
    /// Whether a cloud has come since the map was published last, even one that changed nothing: the map's
    /// stamp tells how far it has come.
    has_news: bool,
    cycles: u32,
    maps: Publisher<PointCloud2>,
    reporter: StageReporter,
}

impl Stage {
    fn take(&mut self, message: &PointCloud2) {
        let mut timer = StepTimer::start();
        match self.add(message, &mut timer) {
            Ok((points_in, addition)) => {
                let counts = [
                    ("points_in", points_in as u64),
                    ("voxels", self.map.len() as u64),
                    ("voxels_new", addition.new_voxels as u64),
                    ("points_refused", addition.refused_points as u64),
                    ("points_not_finite", addition.not_finite_points as u64),
                    ("map_bytes", self.map.memory_bytes() as u64),
                ];
                self.reporter.processed(message.header.clone(), self.cycles, &counts, &timer);
                self.cycles = self.cycles.wrapping_add(1);
            }
            Err(error) => self.reporter.dropped(
                message.header.clone(),
                self.cycles,
                ("static cloud refused", &error.to_string()),
                &[],
            ),
        }
    }

    fn add(
        &mut self,
        message: &PointCloud2,
        timer: &mut StepTimer,
    ) -> Result<(usize, Addition), NodeFailure> {
        let cloud = convert::cloud_from_message(message)?;
        timer.end_of("convert");
        let addition = self.map.add(&cloud)?;
        timer.end_of("add");
        self.has_news = true;
        Ok((cloud.points_m.len(), addition))
    }

    /// What is not taken now comes again at the next time. The whole map is the one thing here whose cost
    /// grows with it, so nobody gets it unasked; who subscribes later gets it at the next time.
    fn publish_news(&mut self) {
        if self.has_news && self.maps.subscriber_count() > 0 {
            let message = convert::message_from_cloud(&self.map.cloud());
            self.has_news = !self.maps.publish_or_warn(&message);
        }
    }
}
