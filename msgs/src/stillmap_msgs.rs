//! `stillmap_msgs`: the suite's own messages. Their `.msg` files in `msgs/msg/stillmap_msgs` say the
//! same in the language of ROS, for nodes of others.

mod distances;

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Time;
use crate::fixed_array;
use crate::geometry_msgs::{Point, Pose, Vector3};
use crate::sensor_msgs::{CameraInfo, CompressedImage, Image, PointCloud2};
use crate::std_msgs::Header;
pub use distances::{
    DistanceField, Distances, GetDistanceField, GetDistanceFieldRequest, GetDistanceFieldResponse,
    GetDistances, GetDistancesRequest, GetDistancesResponse,
};

/// A wedge of directions around the rig's z axis in which something moves (Rec-HV 3.2.2).
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct DynamicZone {
    /// The right-hand bound, within -pi .. pi; measured about z, from x (forward) towards y (left).
    pub azimuth_min_rad: f64,
    /// The left-hand bound, at least `azimuth_min_rad`; above pi where the wedge crosses the rear.
    pub azimuth_max_rad: f64,
    /// The largest deviation of a range within the zone when it was last measured.
    pub peak_std_dev_m: f32,
    /// Cycles since it was last measured: 0 when this cycle measured it.
    pub held_cycles: u32,
    /// Whether the two distances are known.
    pub has_returns: bool,
    /// The distance of the nearest return that moved, from the z axis.
    pub nearest_return_m: f32,
    /// That of the farthest one.
    pub farthest_return_m: f32,
}
ros_message!(DynamicZone, "stillmap_msgs");

/// The dynamic zones of one cycle.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct DynamicZones {
    /// Stamp of the cycle's cloud; the rig frame.
    pub header: Header,
    /// The number of the cycle, counted from 0.
    pub cycle: u32,
    /// The zones; empty when nothing moves.
    pub zones: Vec<DynamicZone>,
}
ros_message!(DynamicZones, "stillmap_msgs");

/// With what a cycle was made: what the nodes of a pipeline must agree on, and where the sensors were mounted.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct CycleSetup {
    /// The method: `rec_hv` or `free_space`.
    pub method: String,
    /// Edge of the voxels that the cycle's points are means of, in metres.
    pub voxel_edge: f64,
    /// Edge of the voxels of a map of depth images, in metres; 0 where the map is of the cycle's points.
    pub map_edge: f64,
    /// After how long what moved and stays in its place is static, in seconds; 0 where the method does not ask.
    pub max_stop: f64,
    /// Pose of the camera's optical frame in the rig.
    pub rig_from_camera: Pose,
    /// Pose of the scanner in the rig.
    pub rig_from_lidar: Pose,
    /// Pose of the depth camera in the colour camera.
    pub colour_from_depth: Pose,
    /// The box around the robot itself in the rig, in metres: its least corner, then its greatest; zeros where there is none.
    pub robot_box: [f64; 6],
}
ros_message!(CycleSetup, "stillmap_msgs");

/// A depth image with its camera. Segmentation's evidence of free space and the map of the depth images are computed from it.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct DepthFrame {
    /// The depths in whole millimetres, 0 where nothing was measured: RVL, without loss.
    pub image: CompressedImage,
    /// The camera that took it.
    pub camera: CameraInfo,
    /// The colour that each of its pixels shows: `rgb8` of the same size, 0 0 0 where none was seen. One image, or none.
    pub colour: Vec<Image>,
}
ros_message!(DepthFrame, "stillmap_msgs");

/// The output of detection to segmentation: the cloud, the pose and the zones of one cycle.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ReducedCloud {
    /// Stamp of the cycle's cloud; the rig frame, in which the cloud and the zones are expressed.
    pub header: Header,
    /// The number of the cycle, counted from 0.
    pub cycle: u32,
    /// With what the cycle was made.
    pub setup: CycleSetup,
    /// Stamp of the laser scan of the cycle.
    pub scan_stamp: Time,
    /// Points of the cloud before the reduction.
    pub points_before_reduction: u64,
    /// The frame that `map_from_rig` leads to.
    pub map_frame_id: String,
    /// Pose of the rig in the map at the stamp of the cloud.
    pub map_from_rig: Pose,
    /// Pose, in the map, of the frame that does not jump when the map is corrected; empty while that is the map itself.
    pub map_from_continuous: Vec<Pose>,
    /// Zones with moving objects; empty when there are none.
    pub zones: Vec<DynamicZone>,
    /// The beams of the scan that hit something that moves: their indices, rising.
    pub moving_beams: Vec<u32>,
    /// For each of them the range in metres of the static surface behind the object; NaN where it is not known.
    pub background_ranges: Vec<f32>,
    /// The reduced cloud; its header is the message's own.
    pub cloud: PointCloud2,
    /// How many points each of the cloud's is the mean of, in their order.
    pub voxel_points: Vec<u32>,
    /// The depth image of the cloud, or one that was made of the cloud, with the method free_space; otherwise none.
    pub depth: Vec<DepthFrame>,
    /// The rays of the scan that ended at something, in the rig frame at the stamp of the cloud, with the method `free_space`: six
    /// numbers each, where it starts and where it ends, in metres.
    pub scan_rays: Vec<f32>,
    /// Of each ray: 1 if it ends at something that moves, or may; 2 if the next ray is that of the next beam.
    #[serde(with = "serde_bytes")]
    pub scan_ray_flags: Vec<u8>,
}
ros_message!(ReducedCloud, "stillmap_msgs");

/// The output of segmentation to reconstruction: both parts of one cycle's cloud, and from where they were seen.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct SegmentedCloud {
    /// Stamp of the cycle's cloud; the map frame.
    pub header: Header,
    /// The number of the cycle, counted from 0.
    pub cycle: u32,
    /// With what the cycle was made.
    pub setup: CycleSetup,
    /// Pose of the rig in the map at the stamp of the cloud.
    pub map_from_rig: Pose,
    /// The static part, in the map frame; its header is the message's own.
    pub static_cloud: PointCloud2,
    /// The moving objects, in the rig frame.
    pub dynamic_cloud: PointCloud2,
    /// The depth image of the clouds, as [`ReducedCloud`] had it; otherwise none.
    pub depth: Vec<DepthFrame>,
    /// Which of its pixels show something that moves, or may: a bit for each, row by row, the lowest bit of a byte first.
    #[serde(with = "serde_bytes")]
    pub moving_pixels: Vec<u8>,
    /// The rays of the scan that ended at something, in the rig frame at the stamp of the cloud, with the method `free_space`: six
    /// numbers each, where it starts and where it ends, in metres.
    pub scan_rays: Vec<f32>,
    /// Of each ray: 1 if it ends at something that moves, or may; 2 if the next ray is that of the next beam.
    #[serde(with = "serde_bytes")]
    pub scan_ray_flags: Vec<u8>,
    /// Points of earlier clouds, in the map frame, that were static then and are known by now to be of an object that has gone from
    /// there: x, y and z of each, in metres. The map is to forget what it has within a voxel of them.
    pub retracted: Vec<f32>,
}
ros_message!(SegmentedCloud, "stillmap_msgs");

/// What one stage of the pipeline did in one cycle.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct StageReport {
    /// Stamp of the cycle's cloud, or of the scan where the cycle was dropped.
    pub header: Header,
    /// The stage: `detection`, `segmentation`, `reconstruction`, `pose` or `lidar_odometry`.
    pub stage: String,
    /// The number of the cycle; of a dropped one, the number that the next one will take.
    pub cycle: u32,
    /// Whether the cycle was processed; false when it was dropped.
    pub processed: bool,
    /// Why the cycle was dropped, with the topics that were missing; empty when it was processed.
    pub drop_reason: String,
    /// The names of the counts.
    pub count_names: Vec<String>,
    /// The counts, in the order of `count_names`.
    pub counts: Vec<u64>,
    /// The steps that were timed.
    pub step_names: Vec<String>,
    /// How long each step took, in the order of `step_names`.
    pub step_durations_s: Vec<f64>,
}
ros_message!(StageReport, "stillmap_msgs");

/// A moving object followed over cycles.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Track {
    /// The object's number; never used for another object of the same run.
    pub id: u32,
    /// Centre of the object in the header's frame, in metres.
    pub position: Point,
    /// Its velocity in the header's frame, in m/s.
    pub velocity: Vector3,
    /// Its edge lengths along the axes of the header's frame, in metres.
    pub extent: Vector3,
    /// Covariance of position and velocity: 6 x 6 by rows in the order x, y, z, vx, vy, vz.
    #[serde(with = "fixed_array")]
    pub covariance: [f64; 36],
    /// Time since it was first seen.
    pub age_s: f64,
    /// Cycles since it was last seen; 0 when this cycle saw it.
    pub unseen_cycles: u32,
}
ros_message!(Track, "stillmap_msgs");

impl Default for Track {
    fn default() -> Self {
        Self {
            id: 0,
            position: Point::default(),
            velocity: Vector3::default(),
            extent: Vector3::default(),
            covariance: [0.0; 36],
            age_s: 0.0,
            unseen_cycles: 0,
        }
    }
}

/// The moving objects of one cycle.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Tracks {
    /// Stamp of the cycle's cloud; the frame of the tracks.
    pub header: Header,
    /// The number of the cycle, counted from 0.
    pub cycle: u32,
    /// The tracks, by rising id.
    pub tracks: Vec<Track>,
}
ros_message!(Tracks, "stillmap_msgs");
