//! The parameters of the node.

mod choice;
mod conversion;

use geometry::{ParameterError, parameter};
use node_shell::NodeFailure;
use node_shell::parameters::NodeParameters;

pub use self::choice::{EchoChoice, FilterChoice, LidarInput, ModelChoice, TimeUnitChoice};
use crate::live::LiveConfig;
use crate::odometry::{Guess, LidarOdometryConfig, OdometryMethod};
use crate::packets::{DATA_PORT, POSITION_PORT};
use crate::panorama::{ColourMap, PanoramaConfig};
use crate::registration::PreparationConfig;
use crate::revolution::RevolutionConfig;
use crate::selection::{RayFilter, RoadIntensityFilter};

/// Lengths and intensities beyond this are mistakes.
const MUCH: f64 = 1e6;
/// Threads beyond this are.
const MOST_THREADS: i64 = 256;
/// Pictures larger than this no viewer opens.
const MOST_PX: i64 = 16_384;

geometry::parameters! {
    /// The parameters of the node. What the core has a default for has that one.
    #[derive(Clone, PartialEq, Debug)]
    pub struct LidarOdometryParameters {
        /// Where the scans come from.
        input: LidarInput = LidarInput::Points;
        /// The unit of the points' times. The log says which is used.
        time_unit: TimeUnitChoice = TimeUnitChoice::Auto, read_with("input", "points");
        /// The scanner that sends the packets.
        model: ModelChoice = ModelChoice::Auto;
        /// The scanner's own calibration: the path of a YAML file of velodyne_pointcloud; "" for that of the data sheet. An
        /// HDL-64E needs one.
        calibration_file: String = String::new();
        /// Which return is used of a beam that has two.
        echo: EchoChoice = EchoChoice::Strongest;
        /// A revolution begins where the scanner's head passes this azimuth, clockwise from forward.
        cut_azimuth_deg: f64 = RevolutionConfig::default().cut_azimuth_deg, from_below(0.0, 360.0);
        /// The local address to listen on; "0.0.0.0" for all.
        udp_address: String = LiveConfig::default().address.to_string(), read_with("input", "udp");
        /// The port of data packets; 0 takes a free one.
        udp_port: u16 = DATA_PORT, read_with("input", "udp");
        /// The port of position packets; 0 for none.
        udp_position_port: u16 = POSITION_PORT, read_with("input", "udp");
        /// Only packets from this address are used; "" for all.
        udp_scanner: String = String::new(), read_with("input", "udp");
        /// The frame of scans that come as packets from the scanner itself.
        lidar_frame_id: String = RevolutionConfig::default().frame_id;

        /// Pose of the scanner on the vehicle: [x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad].
        base_from_lidar: [f64; 6] = [0.0; 6];
        /// Pose of the vehicle at the first scan, in odom_frame_id, in the same form.
        initial_pose: [f64; 6] = [0.0; 6];
        /// The frame in which poses are published.
        // REP 105.
        odom_frame_id: String = "odom".to_owned();
        /// The vehicle's frame.
        base_frame_id: String = "base_link".to_owned();
        /// Whether the pose is published on /tf, too.
        publish_tf: bool = true;
        /// The path has this many poses, the latest.
        // A quarter of an hour at ten turns a second.
        path_poses: usize = 10_000, whole(1, 10_000_000);
        /// Whether loops are closed: map_frame_id to odom_frame_id on /tf, without the drift of the odometry, and map_path.
        /// The odometry itself does not jump.
        // The frame of the map may have another owner: who has none asks for it.
        loop_closing: bool = false;
        /// Whether loops are searched for in a thread of its own; otherwise a scan waits for the search, and the same scans
        /// give the same loops.
        // A search takes a second, a scan must not.
        loop_closing_in_background: bool = true, read_with("loop_closing", "true");
        /// The frame in which loops are closed.
        map_frame_id: String = "map".to_owned();

        /// Whether wheel odometry predicts the vehicle's motion between scans. Only its motion is used, not its pose.
        use_wheels: bool = false;
        /// Whether a gyroscope predicts the vehicle's rotation between scans.
        use_imu: bool = false;
        /// Pose of the inertial unit on the vehicle, in the form of base_from_lidar. Its position is not used.
        base_from_imu: [f64; 6] = [0.0; 6], read_with("use_imu", "true");

        /// What a scan is registered to.
        odometry_method: OdometryMethod = OdometryMethod::default();
        /// Where a registration begins.
        guess: Guess = Guess::default(), read_with("odometry_method", "scan_to_scan");
        /// Which points take part.
        filter: FilterChoice = FilterChoice::None;
        /// This many of the lowest rays are left out.
        lowest_rays_left_out: u16 = RayFilter::default().lowest_left_out, read_with("filter", "rays");
        /// Of the other rays one of this many is used.
        every_ray: u16 = RayFilter::default().every, at_least(1.0), read_with("filter", "rays");
        /// The scanner's height above the road. Read with filter: ground, too.
        sensor_height_m: f64 = RoadIntensityFilter::default().sensor_height_m, positive, read_with("filter", "road_intensity");
        /// The road's intensity is measured up to this distance from the vehicle.
        road_radius_m: f64 = RoadIntensityFilter::default().radius_m, positive, read_with("filter", "road_intensity");
        /// Points within this many standard deviations of the road's intensity are left out.
        road_deviations: f64 = RoadIntensityFilter::default().deviations, not_negative, read_with("filter", "road_intensity");
        /// Nearer points are left out, of a road map up to 1.25 times as far: they may be of the vehicle itself.
        min_range_m: f64 = LidarOdometryConfig::default().min_range_m, between(0.0, MUCH);
        /// Farther points are left out, of a road map those beyond 60 m too, and the local map has this radius. Above
        /// min_range_m.
        max_range_m: f64 = LidarOdometryConfig::default().max_range_m, positive;
        /// A scan is thinned out to one point in cubes of this edge; 0 keeps all points.
        scan_voxel_edge_m: f64 = LidarOdometryConfig::default().preparation.voxel_edge_m, not_negative;
        /// The plane at a point is fitted to this many neighbours.
        neighbours: usize = LidarOdometryConfig::default().preparation.neighbours, whole(4, PreparationConfig::MOST_NEIGHBOURS as i64);
        /// The edge of the local map's voxels.
        map_voxel_edge_m: f64 = LidarOdometryConfig::default().map_voxel_edge_m, positive;
        /// The local map has at most this many voxels, which bounds the memory: 150 bytes each.
        max_map_voxels: usize = LidarOdometryConfig::default().max_map_voxels, whole(1_000, LidarOdometryConfig::MOST_VOXELS as i64);
        /// After this many scans in a row that do not fit the map, the map begins anew at the predicted pose.
        max_held_scans: usize = LidarOdometryConfig::default().max_held_scans, whole(0, 1_000_000);
        /// Threads that work on a scan. Their number changes no pose.
        // A robot's computer has more to do.
        threads: u16 = 2, whole(1, MOST_THREADS);

        /// The colours of the panorama of intensities. The road thesis uses OpenCV's pink.
        intensity_colours: ColourMap = PanoramaConfig::intensities().colour_map;
        /// The colours of the panorama of ranges. The road thesis uses OpenCV's hsv.
        range_colours: ColourMap = PanoramaConfig::default().colour_map;
        /// The width of a panorama.
        panorama_width_px: usize = PanoramaConfig::default().width_px, whole(1, MOST_PX);
        /// The height of a row of a panorama; it has one for each laser.
        panorama_row_px: usize = PanoramaConfig::default().row_height_px, whole(1, 64);
        /// The intensity of the last colour.
        panorama_intensity: f64 = f64::from(PanoramaConfig::intensities().limits[1]), between(1e-3, MUCH);
        /// The range of the last colour.
        panorama_range_m: f64 = f64::from(PanoramaConfig::default().limits[1]), between(3.0, MUCH);
        /// The edge of the drawings of the trajectory.
        // Half of a screen.
        drawing_px: usize = 800, whole(64, 4096);
        /// The radius of the drawing around the vehicle.
        // A few streets.
        drawing_radius_m: f64 = 100.0, between(1.0, MUCH);
    }
    check = Self::check_ranges;
}

impl NodeParameters for LidarOdometryParameters {
    fn validate_node(&self) -> Result<(), NodeFailure> {
        self.validate()?;
        self.live()?;
        Ok(())
    }
}

impl LidarOdometryParameters {
    fn check_ranges(&self) -> Result<(), ParameterError> {
        let (nearest, farthest) = (self.min_range_m, self.max_range_m);
        parameter::check(
            "min_range_m",
            ("below max_range_m", farthest),
            nearest,
            nearest < farthest,
        )
    }
}
