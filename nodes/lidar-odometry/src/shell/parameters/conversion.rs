//! Converts the parameters to the configuration of the core.

use std::net::IpAddr;
use std::num::NonZeroUsize;
use std::sync::Arc;

use estimation::{Executor, ScopedThreads};
use geometry::pose_from_vector;
use msgs::convert::TimeUnit;
use nalgebra::Isometry3;
use node_shell::NodeFailure;

use super::{EchoChoice, FilterChoice, LidarOdometryParameters, ModelChoice, TimeUnitChoice};
use crate::live::LiveConfig;
use crate::odometry::{FollowerConfig, LidarOdometryConfig};
use crate::packets::{Calibration, DecoderConfig, Model};
use crate::panorama::PanoramaConfig;
use crate::revolution::{KeptEcho, RevolutionConfig};
use crate::road_map::RoadMapConfig;
use crate::selection::{GroundFilter, PointChoice, RayFilter, RoadIntensityFilter};

/// A road map begins farther from the scanner by this factor: at the default, where that of the core begins.
const NEAR_IN_MAP: f64 = 1.25;

impl LidarOdometryParameters {
    /// How revolutions are cut out of packets.
    pub(in crate::shell) fn revolution(&self) -> RevolutionConfig {
        RevolutionConfig {
            frame_id: self.lidar_frame_id.clone(),
            cut_azimuth_deg: self.cut_azimuth_deg,
            kept_echo: match self.echo {
                EchoChoice::Strongest => KeptEcho::Strongest,
                EchoChoice::Last => KeptEcho::Last,
            },
            ..RevolutionConfig::default()
        }
    }

    /// How packets are decoded; reads the calibration, where there is one.
    pub(in crate::shell) fn decoder(&self) -> Result<DecoderConfig, NodeFailure> {
        let model = match self.model {
            ModelChoice::Auto => None,
            ModelChoice::Hdl32e => Some(Model::Hdl32e),
            ModelChoice::Vlp16 => Some(Model::Vlp16),
            ModelChoice::PuckHiRes => Some(Model::PuckHiRes),
            ModelChoice::Vlp32c => Some(Model::Vlp32c),
            ModelChoice::Hdl64e => Some(Model::Hdl64e),
        };
        let path = &self.calibration_file;
        let calibration = if path.is_empty() {
            None
        } else {
            let text = std::fs::read_to_string(path).map_err(|error| {
                format!("parameter calibration_file: cannot read {path}: {error}")
            })?;
            let calibration = Calibration::from_yaml(&text);
            Some(
                calibration
                    .map_err(|error| format!("parameter calibration_file: {path}: {error}"))?,
            )
        };
        Ok(DecoderConfig { model, calibration, ..DecoderConfig::default() })
    }

    /// The address to listen on for packets.
    pub(in crate::shell) fn live(&self) -> Result<LiveConfig, NodeFailure> {
        let address = |name: &str, text: &str| {
            text.parse::<IpAddr>()
                .map_err(|error| format!("parameter {name} is {text:?}, no address: {error}"))
        };
        let scanner = (!self.udp_scanner.is_empty())
            .then(|| address("udp_scanner", &self.udp_scanner))
            .transpose()?;
        Ok(LiveConfig {
            address: address("udp_address", &self.udp_address)?,
            data_port: self.udp_port,
            position_port: (self.udp_position_port != 0).then_some(self.udp_position_port),
            scanner,
            ..LiveConfig::default()
        })
    }

    /// How the sensor is followed.
    #[must_use]
    pub fn follower(&self) -> FollowerConfig {
        let sensor_height_m = self.sensor_height_m;
        let mut local_map = LidarOdometryConfig {
            min_range_m: self.min_range_m,
            max_range_m: self.max_range_m,
            map_voxel_edge_m: self.map_voxel_edge_m,
            max_map_voxels: self.max_map_voxels,
            max_held_scans: self.max_held_scans,
            ..LidarOdometryConfig::default()
        };
        local_map.preparation.voxel_edge_m = self.scan_voxel_edge_m;
        local_map.preparation.neighbours = self.neighbours;
        FollowerConfig {
            method: self.odometry_method,
            points: match self.filter {
                FilterChoice::None => PointChoice::All,
                FilterChoice::Rays => PointChoice::Rays(RayFilter {
                    lowest_left_out: self.lowest_rays_left_out,
                    every: self.every_ray,
                }),
                FilterChoice::RoadIntensity => PointChoice::NotRoadIntensity(RoadIntensityFilter {
                    sensor_height_m,
                    radius_m: self.road_radius_m,
                    deviations: self.road_deviations,
                    ..RoadIntensityFilter::default()
                }),
                FilterChoice::Ground => PointChoice::NotGround(GroundFilter {
                    sensor_height_m,
                    ..GroundFilter::default()
                }),
            },
            local_map,
            guess: self.guess,
            ..FollowerConfig::default()
        }
    }

    /// Which points a road map takes in: those that the odometry uses, up to the map's own limit, and without some that are near. A few points
    /// of the vehicle itself do not move a pose, but each stays in a map.
    #[must_use]
    pub fn road_map(&self) -> RoadMapConfig {
        let map = RoadMapConfig::default();
        RoadMapConfig {
            min_range_m: NEAR_IN_MAP * self.min_range_m,
            max_range_m: self.max_range_m.min(map.max_range_m),
            ..map
        }
    }

    /// The panoramas of intensity and of range.
    pub(in crate::shell) fn panoramas(&self) -> [PanoramaConfig; 2] {
        let (width_px, row_height_px) = (self.panorama_width_px, self.panorama_row_px);
        let mut intensity = PanoramaConfig {
            colour_map: self.intensity_colours,
            width_px,
            row_height_px,
            ..PanoramaConfig::intensities()
        };
        intensity.limits[1] = self.panorama_intensity as f32;
        let mut range = PanoramaConfig {
            colour_map: self.range_colours,
            width_px,
            row_height_px,
            ..PanoramaConfig::default()
        };
        range.limits[1] = self.panorama_range_m as f32;
        [intensity, range]
    }

    pub(in crate::shell) fn executor(&self) -> Arc<dyn Executor> {
        let threads = NonZeroUsize::new(self.threads.into()).unwrap_or(NonZeroUsize::MIN);
        Arc::new(ScopedThreads::new(threads))
    }

    pub(in crate::shell) fn base_from_lidar(&self) -> Isometry3<f64> {
        pose_from_vector(&self.base_from_lidar)
    }

    /// The unit of the times of a cloud's points; `None` for the one that makes a revolution of them.
    #[must_use]
    pub fn unit(&self) -> Option<TimeUnit> {
        match self.time_unit {
            TimeUnitChoice::Auto => None,
            TimeUnitChoice::S => Some(TimeUnit::Seconds),
            TimeUnitChoice::Ms => Some(TimeUnit::Milliseconds),
            TimeUnitChoice::Us => Some(TimeUnit::Microseconds),
            TimeUnitChoice::Ns => Some(TimeUnit::Nanoseconds),
        }
    }
}
