//! The values that flow between the cores: scans, clouds, depth images, poses, zones, and the cycle that ties
//! one of each together. No ROS, no clock, no files.
//!
//! # Frames
//!
//! | name | origin and axes |
//! |---|---|
//! | `map` | whatever frame the poses lead to; the thesis takes the rig frame of the first cycle (MF_0) |
//! | `rig` | origin at the camera's optical centre, x forward, y left, z up (REP-103); the thesis' O_k |
//! | `camera` | the optical frame: same origin, x right, y down, z forward |
//! | `lidar` | the scan's own frame; 5 cm below the rig on the thesis' platform |
//!
//! A transform is named target first: `map_from_rig * point_in_rig` is a point in `map`.
//!
//! ```
//! use geometry::{VoxelGrid, pose_from_vector};
//! use nalgebra::Point3;
//!
//! // Two points of one voxel of 8 cm become their mean.
//! let grid = VoxelGrid::new(0.08)?;
//! let reduced = grid.reduce(&[Point3::new(1.01, 0.01, 0.01), Point3::new(1.03, 0.01, 0.01)]);
//! assert_eq!(reduced.len(), 1);
//!
//! // The rig is at x = 2 m and looks along y: [x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad].
//! let map_from_rig = pose_from_vector(&[2.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0]);
//! let point_in_map = map_from_rig * Point3::from(reduced[0].cast::<f64>());
//! assert!((point_in_map - Point3::new(1.99, 1.02, 0.01)).norm() < 1e-6);
//! # Ok::<(), geometry::VoxelEdgeError>(())
//! ```

mod camera;
mod cloud;
mod colour;
mod cycle;
mod depth;
mod depth_frame;
mod depth_projection;
mod distance;
mod label;
mod last_sight;
mod lidar_cloud;
mod map_path;
mod map_view;
mod method;
mod moving_beam;
mod occupancy_grid;
mod organised_cloud;
pub mod parameter;
pub mod pcd;
mod pipeline;
pub mod ply;
mod point_block;
mod point_file;
mod pose;
mod revolution;
mod rig;
mod rigid;
mod robot_box;
mod scan;
mod scan_from_depth;
mod scan_ray;
mod stamp;
mod track;
mod triangle_mesh;
mod voxel;
mod zone;

pub use camera::{CameraModel, CameraModelError, Distortion, DistortionError, RayTable};
pub use cloud::{Cloud, ColouredCloud, is_finite};
pub use colour::{
    ColourFill, ColourImage, ColourRegistration, ColourRegistrationError, ColourSizeError, DARKEST,
    NO_COLOUR, seen_colour,
};
pub use cycle::{DetectedCycle, SegmentationCounts, SegmentedCycle};
pub use depth::{DepthImage, DepthPixels, DepthSizeError};
pub use depth_frame::{
    CloudCamera, DepthFrame, DepthFrameError, MaskSizeError, MaskedDepth, PinholeFitError,
};
pub use depth_projection::{
    DepthCameraError, DepthLimits, DepthProjector, PixelArea, PixelVoxels, ProjectableDepth,
    ReducedDepth,
};
pub use distance::{DistanceAt, DistanceLattice, Distances, NearestObstacle, PlaceState};
pub use label::{LabelImage, LabelSizeError};
pub use last_sight::LastSight;
pub use lidar_cloud::{LidarCloud, span_without_strays};
pub use map_path::{
    ContinuousFrame, LateCorrections, MapPath, MapPathError, PathCorrection, PathKnot, PathVertex,
};
pub use map_view::{MapView, MapViews, NoView};
pub use method::Method;
pub use moving_beam::{BeamFill, MovingBeam};
pub use occupancy_grid::{FREE_THRESHOLD, GridCell, GridPart, OCCUPIED_THRESHOLD, OccupancyGrid};
pub use organised_cloud::OrganisedCloud;
pub use parameter::ParameterError;
pub use pipeline::{CycleSetup, PipelineConfig, PipelineDifference, PipelineMismatch};
pub use point_file::{OrientedPoints, PointFileError};
pub use pose::{
    FARTHEST_POSE_M, PoseBuffer, PoseLookupError, PosePushError, StampedPose, UnusablePose,
    check_pose, homogeneous_from_pose_vector, pose_from_vector, pose_vector,
};
pub use revolution::{LidarReturn, Revolution, RevolutionSizeError};
pub use rig::{ExtrinsicsSource, RigConfig, RigMounts, is_same_mount};
pub use robot_box::{RobotBox, RobotPixels};
pub use scan::{BeamOrder, Scan, ScanError, rays_in_turn, rays_without_overlap};
pub use scan_from_depth::{ScanBand, ScanCutter, ScanFromDepth, ScanFromDepthError};
pub use scan_ray::ScanRay;
pub use stamp::Stamp;
pub use track::{CycleTracks, Track};
pub use triangle_mesh::{MeshEdges, MeshPiece, MeshUpdate, TriangleMesh};
pub use voxel::{
    BuildVoxelHasher, VoxelAccumulator, VoxelBox, VoxelEdgeError, VoxelGrid, VoxelHasher, VoxelKey,
};
pub use zone::{DynamicZone, ReturnSpan, ZoneSource, azimuth_rad};
