//! A simulated room, its moving objects and the sensors, with the ground truth of every reading.
//!
//! A [`Scenario`] defines everything: the scene (furniture, moving objects and their paths), the rig with
//! its sensors, the length, and the seed. [`Scenario::samples`] gives what the drivers would publish, in
//! the order of the stamps, each reading with its labels. The same scenario gives the
//! same samples, bit for bit: noise is a function of seed, sensor, frame and pixel (`noise`), never
//! of the order in which things are computed.
//!
//! # Frames
//!
//! | name | origin and axes |
//! |---|---|
//! | `room` | the frame of scenes and paths; z up, the floor at z = 0 |
//! | object | on the floor under the object, x in its direction of travel, z up |
//! | `map`, `rig`, `camera`, `lidar` | as in the crate `geometry`; `map` is the rig's frame at the start |
//!
//! Poses in a scenario are six numbers `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]`, in the order of
//! Rec-HV eq. 8 ([`geometry::pose_from_vector`]).
//!
//! The crate uses no ROS, no files and no clock.
//!
//! ```
//! use simulator::{Sample, Scenario};
//!
//! let scenario = Scenario::demo().with_seed(1).with_depth_size(64, 48).with_duration_s(1.0);
//! let samples: Vec<Sample> = scenario.samples()?.collect();
//! let scans = samples.iter().filter(|one| matches!(one, Sample::Scan { .. })).count();
//! let images = samples.iter().filter(|one| matches!(one, Sample::Depth { .. })).count();
//! // The scanner runs at 7 Hz, the camera at 30 Hz.
//! assert!((6..=7).contains(&scans) && (30..=31).contains(&images), "{scans} scans, {images} images");
//! # Ok::<(), simulator::ScenarioError>(())
//! ```

mod bvh;
mod colour_camera;
mod colour_image;
mod demo;
mod depth_camera;
mod depth_image;
mod encoding;
mod experiments;
mod floor_plan;
mod home;
mod imu;
mod lidar;
mod lighting;
mod material;
mod mesh;
mod noise;
mod object;
mod objects;
mod odometry;
mod paint;
mod path;
mod platform;
mod projection;
mod ray;
mod rig;
mod road;
mod room;
mod samples;
mod scenario;
mod scene;
mod scenes;
mod shape;
mod slam;
mod solid;
mod stamp_error;
mod still;
mod surface;
mod truth;
mod validation;
mod variation;
mod velodyne;
mod walker;
mod wheels;
mod yaml;

pub use colour_camera::ColourCamera;
pub use colour_image::ColourImage;
pub use demo::{PERSON_ID, ROBOT_ID};
pub use depth_camera::DepthCamera;
pub use encoding::{DepthEncoding, NoReturn};
pub use experiments::{CART_ID, CHAIR_ID, CrossingObject, DOOR_ID, PathName, SECOND_PERSON_ID};
pub use home::{FloorArea, Home, Piece};
pub use imu::{Imu, ImuReading};
pub use lidar::Lidar;
pub use lighting::{Lamp, Lighting};
pub use material::Material;
pub use mesh::{Mesh, MeshError};
pub use object::{Figure, MovingObject};
pub use objects::DoorTurn;
pub use odometry::OdometryRun;
pub use paint::{Paint, Texture};
pub use path::{Handheld, Path, Spline, Waypoint};
pub use platform::Platform;
pub use ray::{Hit, Ray};
pub use rig::{PoseSource, Rig};
pub use samples::{Sample, Samples};
pub use scenario::Scenario;
pub use scene::{Body, Scene};
pub use scenes::SceneName;
pub use shape::Shape;
pub use slam::SlamRun;
pub use stamp_error::StampError;
pub use truth::{ObjectPose, ObjectPoses};
pub use validation::ScenarioError;
pub use velodyne::{Velodyne, VelodyneModel, VelodynePoint, VelodyneTurn};
pub use walker::Walker;
pub use wheels::{WheelReading, Wheels};
pub use yaml::{Triangles, YamlError};
