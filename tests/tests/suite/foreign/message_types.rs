//! The Rust type of every `.msg` file.

use std::collections::BTreeSet;

use super::definitions::Definitions;

/// Hands the list of all message types to the macro `$action`, with the arguments before it.
macro_rules! for_each_message_type {
    ($action:ident $(, $argument:expr)* $(,)?) => {
        $action! {
            ($($argument),*)
            msgs::builtin_interfaces::Duration,
            msgs::builtin_interfaces::Time,
            msgs::diagnostic_msgs::DiagnosticArray,
            msgs::diagnostic_msgs::DiagnosticStatus,
            msgs::diagnostic_msgs::KeyValue,
            msgs::geometry_msgs::Point,
            msgs::geometry_msgs::Pose,
            msgs::geometry_msgs::PoseArray,
            msgs::geometry_msgs::PoseStamped,
            msgs::geometry_msgs::PoseWithCovariance,
            msgs::geometry_msgs::PoseWithCovarianceStamped,
            msgs::geometry_msgs::Quaternion,
            msgs::geometry_msgs::Transform,
            msgs::geometry_msgs::TransformStamped,
            msgs::geometry_msgs::Twist,
            msgs::geometry_msgs::TwistWithCovariance,
            msgs::geometry_msgs::Vector3,
            msgs::lifecycle_msgs::State,
            msgs::lifecycle_msgs::Transition,
            msgs::lifecycle_msgs::TransitionDescription,
            msgs::lifecycle_msgs::TransitionEvent,
            msgs::map_msgs::OccupancyGridUpdate,
            msgs::nav_msgs::MapMetaData,
            msgs::nav_msgs::OccupancyGrid,
            msgs::nav_msgs::Odometry,
            msgs::nav_msgs::Path,
            msgs::rcl_interfaces::FloatingPointRange,
            msgs::rcl_interfaces::IntegerRange,
            msgs::rcl_interfaces::ListParametersResult,
            msgs::rcl_interfaces::Log,
            msgs::rcl_interfaces::Parameter,
            msgs::rcl_interfaces::ParameterDescriptor,
            msgs::rcl_interfaces::ParameterEvent,
            msgs::rcl_interfaces::ParameterType,
            msgs::rcl_interfaces::ParameterValue,
            msgs::rcl_interfaces::SetParametersResult,
            msgs::rosgraph_msgs::Clock,
            msgs::sensor_msgs::CameraInfo,
            msgs::sensor_msgs::CompressedImage,
            msgs::sensor_msgs::Image,
            msgs::sensor_msgs::Imu,
            msgs::sensor_msgs::LaserScan,
            msgs::sensor_msgs::PointCloud2,
            msgs::sensor_msgs::PointField,
            msgs::sensor_msgs::RegionOfInterest,
            msgs::std_msgs::Bool,
            msgs::std_msgs::ColorRGBA,
            msgs::std_msgs::Empty,
            msgs::std_msgs::Header,
            msgs::std_msgs::String,
            msgs::stillmap_msgs::DistanceField,
            msgs::stillmap_msgs::Distances,
            msgs::stillmap_msgs::DynamicZone,
            msgs::stillmap_msgs::DynamicZones,
            msgs::stillmap_msgs::CycleSetup,
            msgs::stillmap_msgs::DepthFrame,
            msgs::stillmap_msgs::ReducedCloud,
            msgs::stillmap_msgs::SegmentedCloud,
            msgs::stillmap_msgs::StageReport,
            msgs::stillmap_msgs::Track,
            msgs::stillmap_msgs::Tracks,
            msgs::tf2_msgs::TFMessage,
            msgs::velodyne_msgs::VelodynePacket,
            msgs::velodyne_msgs::VelodyneScan,
            msgs::visualization_msgs::Marker,
            msgs::visualization_msgs::MarkerArray,
            msgs::visualization_msgs::MeshFile,
            msgs::visualization_msgs::UVCoordinate,
        }
    };
}
pub(super) use for_each_message_type;

#[test]
fn every_definition_is_exchanged() {
    macro_rules! names {
        (() $($message:ty,)*) => {
            BTreeSet::from([$(<$message as msgs::RosMessage>::TYPE_NAME),*])
        };
    }
    let names: BTreeSet<&str> = for_each_message_type!(names);
    assert_eq!(names, Definitions::read().names().collect());
}
