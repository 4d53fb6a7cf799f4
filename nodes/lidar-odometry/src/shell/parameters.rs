//! The parameters of the node.

mod choice;
mod conversion;

use node_shell::NodeFailure;
use node_shell::parameters::{NodeParameters, Range};
use serde::{Deserialize, Serialize};

pub use self::choice::{EchoChoice, FilterChoice, LidarInput, ModelChoice, TimeUnitChoice};
use crate::live::LiveConfig;
use crate::odometry::{Guess, LidarOdometryConfig, Way};
use crate::packets::{DATA_PORT, POSITION_PORT};
use crate::panorama::{ColourMap, PanoramaConfig};
use crate::registration::{ParameterError, check};
use crate::revolution::RevolutionConfig;
use crate::selection::{RayFilter, RoadIntensityFilter};

/// The parameters of the node.
///
/// Every default stands in [`LidarOdometryParameters::default`], or in that of the part which it is of, and nowhere else.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[expect(missing_docs, reason = "config/lidar_odometry.yaml has a text for each")]
pub struct LidarOdometryParameters {
    pub input: LidarInput,
    pub time_unit: TimeUnitChoice,
    pub model: ModelChoice,
    pub calibration_file: String,
    pub echo: EchoChoice,
    pub cut_azimuth_deg: f64,
    pub udp_address: String,
    pub udp_port: u16,
    pub udp_position_port: u16,
    pub udp_scanner: String,
    pub lidar_frame_id: String,

    pub base_from_lidar: [f64; 6],
    pub initial_pose: [f64; 6],
    pub odom_frame_id: String,
    pub base_frame_id: String,
    pub publish_tf: bool,
    pub path_poses: usize,
    pub loop_closing: bool,
    pub loop_closing_in_background: bool,
    pub map_frame_id: String,

    pub use_wheels: bool,
    pub use_imu: bool,
    pub base_from_imu: [f64; 6],

    pub way: Way,
    pub guess: Guess,
    pub filter: FilterChoice,
    pub lowest_rays_left_out: u16,
    pub every_ray: u16,
    pub sensor_height_m: f64,
    pub road_radius_m: f64,
    pub road_deviations: f64,
    pub min_range_m: f64,
    pub max_range_m: f64,
    pub scan_voxel_edge_m: f64,
    pub neighbours: usize,
    pub map_voxel_edge_m: f64,
    pub max_map_voxels: usize,
    pub max_held_scans: usize,
    pub threads: u16,

    pub intensity_colours: ColourMap,
    pub range_colours: ColourMap,
    pub panorama_width_px: usize,
    pub panorama_row_px: usize,
    pub panorama_intensity: f64,
    pub panorama_range_m: f64,
    pub drawing_px: usize,
    pub drawing_radius_m: f64,
}

impl Default for LidarOdometryParameters {
    fn default() -> Self {
        let (local_map, revolution) = (LidarOdometryConfig::default(), RevolutionConfig::default());
        let (rays, road) = (RayFilter::default(), RoadIntensityFilter::default());
        let panorama = PanoramaConfig::default();
        let intensities = PanoramaConfig::intensities();
        Self {
            input: LidarInput::default(),
            time_unit: TimeUnitChoice::default(),
            model: ModelChoice::default(),
            calibration_file: String::new(),
            echo: EchoChoice::default(),
            cut_azimuth_deg: revolution.cut_azimuth_deg,
            udp_address: LiveConfig::default().address.to_string(),
            udp_port: DATA_PORT,
            udp_position_port: POSITION_PORT,
            udp_scanner: String::new(),
            lidar_frame_id: revolution.frame_id,
            base_from_lidar: [0.0; 6],
            initial_pose: [0.0; 6],
            // REP 105.
            odom_frame_id: "odom".to_owned(),
            base_frame_id: "base_link".to_owned(),
            publish_tf: true,
            // A quarter of an hour at ten turns a second.
            path_poses: 10_000,
            // The frame of the map may have another owner: who has none asks for it.
            loop_closing: false,
            // A search takes a second, a scan must not.
            loop_closing_in_background: true,
            map_frame_id: "map".to_owned(),
            use_wheels: false,
            use_imu: false,
            base_from_imu: [0.0; 6],
            way: Way::default(),
            guess: Guess::default(),
            filter: FilterChoice::default(),
            lowest_rays_left_out: rays.lowest_left_out,
            every_ray: rays.every,
            sensor_height_m: road.sensor_height_m,
            road_radius_m: road.radius_m,
            road_deviations: road.deviations,
            min_range_m: local_map.min_range_m,
            max_range_m: local_map.max_range_m,
            scan_voxel_edge_m: local_map.preparation.voxel_edge_m,
            neighbours: local_map.preparation.neighbours,
            map_voxel_edge_m: local_map.map_voxel_edge_m,
            max_map_voxels: local_map.max_map_voxels,
            max_held_scans: local_map.max_held_scans,
            // A robot's computer has more to do.
            threads: 2,
            intensity_colours: intensities.colour_map,
            range_colours: panorama.colour_map,
            panorama_width_px: panorama.width_px,
            panorama_row_px: panorama.row_height_px,
            panorama_intensity: f64::from(intensities.limits[1]),
            panorama_range_m: f64::from(panorama.limits[1]),
            // Half of a screen.
            drawing_px: 800,
            // A few streets.
            drawing_radius_m: 100.0,
        }
    }
}

/// Lengths and times beyond this are mistakes.
const MUCH: f64 = 1e6;
/// Threads beyond this are.
const MOST_THREADS: i64 = 256;
/// Pictures larger than this no viewer opens.
const MOST_PX: i64 = 16_384;

impl NodeParameters for LidarOdometryParameters {
    const FILE: &'static str = include_str!("../../../../config/lidar_odometry.yaml");
    const RANGES: &'static [(&'static str, Range)] = &[
        ("cut_azimuth_deg", Range::real(0.0, 360.0_f64.next_down())),
        ("udp_port", Range::whole(0, 65_535)),
        ("udp_position_port", Range::whole(0, 65_535)),
        ("path_poses", Range::whole(1, 10_000_000)),
        ("lowest_rays_left_out", Range::whole(0, 65_535)),
        ("every_ray", Range::whole(1, 65_535)),
        ("sensor_height_m", Range::above(0.0)),
        ("road_radius_m", Range::above(0.0)),
        ("road_deviations", Range::NOT_NEGATIVE),
        ("min_range_m", Range::real(0.0, MUCH)),
        ("max_range_m", Range::above(0.0)),
        ("scan_voxel_edge_m", Range::NOT_NEGATIVE),
        ("neighbours", Range::whole(4, 32)),
        ("map_voxel_edge_m", Range::above(0.0)),
        ("max_map_voxels", Range::whole(1_000, 10_000_000)),
        ("max_held_scans", Range::whole(0, 1_000_000)),
        ("threads", Range::whole(1, MOST_THREADS)),
        ("panorama_width_px", Range::whole(1, MOST_PX)),
        ("panorama_row_px", Range::whole(1, 64)),
        ("panorama_intensity", Range::real(1e-3, MUCH)),
        ("panorama_range_m", Range::real(3.0, MUCH)),
        ("drawing_px", Range::whole(64, 4096)),
        ("drawing_radius_m", Range::real(1.0, MUCH)),
    ];

    fn validate(&self) -> Result<(), NodeFailure> {
        for (name, vector) in [
            ("base_from_lidar", &self.base_from_lidar),
            ("initial_pose", &self.initial_pose),
            ("base_from_imu", &self.base_from_imu),
        ] {
            let bad = vector.iter().copied().find(|value| !value.is_finite());
            check(name, "six finite numbers", bad.unwrap_or(0.0), bad.is_none())?;
        }
        self.numbers().into_iter().try_for_each(|(name, value)| Self::within(name, value))?;
        self.live()?;
        self.follower().local_map.validate()?;
        self.follower().points.validate()?;
        self.panoramas().iter().try_for_each(PanoramaConfig::validate)?;
        Ok(())
    }
}

impl LidarOdometryParameters {
    /// The numbers that have a range.
    fn numbers(&self) -> [(&'static str, f64); 21] {
        [
            ("cut_azimuth_deg", self.cut_azimuth_deg),
            ("path_poses", self.path_poses as f64),
            ("every_ray", self.every_ray.into()),
            ("sensor_height_m", self.sensor_height_m),
            ("road_radius_m", self.road_radius_m),
            ("road_deviations", self.road_deviations),
            ("min_range_m", self.min_range_m),
            ("max_range_m", self.max_range_m),
            ("scan_voxel_edge_m", self.scan_voxel_edge_m),
            ("neighbours", self.neighbours as f64),
            ("map_voxel_edge_m", self.map_voxel_edge_m),
            ("max_map_voxels", self.max_map_voxels as f64),
            ("max_held_scans", self.max_held_scans as f64),
            ("threads", self.threads.into()),
            ("panorama_width_px", self.panorama_width_px as f64),
            ("panorama_row_px", self.panorama_row_px as f64),
            ("panorama_intensity", self.panorama_intensity),
            ("panorama_range_m", self.panorama_range_m),
            ("drawing_px", self.drawing_px as f64),
            ("drawing_radius_m", self.drawing_radius_m),
            ("udp_port", self.udp_port.into()),
        ]
    }

    fn within(name: &'static str, value: f64) -> Result<(), ParameterError> {
        let Some((_, range)) = Self::RANGES.iter().find(|(of, _)| *of == name) else {
            return Ok(());
        };
        let (least, most) = match *range {
            Range::Real { least, most } => (least, most),
            Range::Whole { least, most } => (least as f64, most as f64),
        };
        let accepted = "in the range that `ros2 param describe` tells";
        check(name, accepted, value, (least..=most).contains(&value))
    }
}
