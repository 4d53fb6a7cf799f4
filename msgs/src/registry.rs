//! Every message of the crate, named once.

use crate::RosMessage;

/// Hands the list of all messages to the macro `$action`.
#[macro_export]
macro_rules! for_each_message {
    ($action:ident) => {
        $action! {
            $crate::builtin_interfaces::Duration,
            $crate::builtin_interfaces::Time,
            $crate::diagnostic_msgs::DiagnosticArray,
            $crate::diagnostic_msgs::DiagnosticStatus,
            $crate::diagnostic_msgs::KeyValue,
            $crate::geometry_msgs::Point,
            $crate::geometry_msgs::Pose,
            $crate::geometry_msgs::PoseArray,
            $crate::geometry_msgs::PoseStamped,
            $crate::geometry_msgs::PoseWithCovariance,
            $crate::geometry_msgs::PoseWithCovarianceStamped,
            $crate::geometry_msgs::Quaternion,
            $crate::geometry_msgs::Transform,
            $crate::geometry_msgs::TransformStamped,
            $crate::geometry_msgs::Twist,
            $crate::geometry_msgs::TwistWithCovariance,
            $crate::geometry_msgs::Vector3,
            $crate::lifecycle_msgs::ChangeStateRequest,
            $crate::lifecycle_msgs::ChangeStateResponse,
            $crate::lifecycle_msgs::GetAvailableStatesRequest,
            $crate::lifecycle_msgs::GetAvailableStatesResponse,
            $crate::lifecycle_msgs::GetAvailableTransitionsRequest,
            $crate::lifecycle_msgs::GetAvailableTransitionsResponse,
            $crate::lifecycle_msgs::GetStateRequest,
            $crate::lifecycle_msgs::GetStateResponse,
            $crate::lifecycle_msgs::State,
            $crate::lifecycle_msgs::Transition,
            $crate::lifecycle_msgs::TransitionDescription,
            $crate::lifecycle_msgs::TransitionEvent,
            $crate::map_msgs::OccupancyGridUpdate,
            $crate::nav_msgs::MapMetaData,
            $crate::nav_msgs::OccupancyGrid,
            $crate::nav_msgs::Odometry,
            $crate::nav_msgs::Path,
            $crate::rcl_interfaces::DescribeParametersRequest,
            $crate::rcl_interfaces::DescribeParametersResponse,
            $crate::rcl_interfaces::FloatingPointRange,
            $crate::rcl_interfaces::GetParameterTypesRequest,
            $crate::rcl_interfaces::GetParameterTypesResponse,
            $crate::rcl_interfaces::GetParametersRequest,
            $crate::rcl_interfaces::GetParametersResponse,
            $crate::rcl_interfaces::IntegerRange,
            $crate::rcl_interfaces::ListParametersRequest,
            $crate::rcl_interfaces::ListParametersResponse,
            $crate::rcl_interfaces::ListParametersResult,
            $crate::rcl_interfaces::Log,
            $crate::rcl_interfaces::Parameter,
            $crate::rcl_interfaces::ParameterDescriptor,
            $crate::rcl_interfaces::ParameterEvent,
            $crate::rcl_interfaces::ParameterType,
            $crate::rcl_interfaces::ParameterValue,
            $crate::rcl_interfaces::SetParametersAtomicallyRequest,
            $crate::rcl_interfaces::SetParametersAtomicallyResponse,
            $crate::rcl_interfaces::SetParametersRequest,
            $crate::rcl_interfaces::SetParametersResponse,
            $crate::rcl_interfaces::SetParametersResult,
            $crate::rosgraph_msgs::Clock,
            $crate::sensor_msgs::CameraInfo,
            $crate::sensor_msgs::CompressedImage,
            $crate::sensor_msgs::Image,
            $crate::sensor_msgs::Imu,
            $crate::sensor_msgs::LaserScan,
            $crate::sensor_msgs::PointCloud2,
            $crate::sensor_msgs::PointField,
            $crate::sensor_msgs::RegionOfInterest,
            $crate::std_msgs::Bool,
            $crate::std_msgs::ColorRGBA,
            $crate::std_msgs::Empty,
            $crate::std_msgs::Header,
            $crate::std_msgs::String,
            $crate::std_srvs::EmptyRequest,
            $crate::std_srvs::EmptyResponse,
            $crate::std_srvs::SetBoolRequest,
            $crate::std_srvs::SetBoolResponse,
            $crate::std_srvs::TriggerRequest,
            $crate::std_srvs::TriggerResponse,
            $crate::stillmap_msgs::CycleSetup,
            $crate::stillmap_msgs::DepthFrame,
            $crate::stillmap_msgs::DistanceField,
            $crate::stillmap_msgs::Distances,
            $crate::stillmap_msgs::DynamicZone,
            $crate::stillmap_msgs::DynamicZones,
            $crate::stillmap_msgs::GetDistanceFieldRequest,
            $crate::stillmap_msgs::GetDistanceFieldResponse,
            $crate::stillmap_msgs::GetDistancesRequest,
            $crate::stillmap_msgs::GetDistancesResponse,
            $crate::stillmap_msgs::ReducedCloud,
            $crate::stillmap_msgs::SegmentedCloud,
            $crate::stillmap_msgs::StageReport,
            $crate::stillmap_msgs::Track,
            $crate::stillmap_msgs::Tracks,
            $crate::tf2_msgs::TFMessage,
            $crate::velodyne_msgs::VelodynePacket,
            $crate::velodyne_msgs::VelodyneScan,
            $crate::visualization_msgs::Marker,
            $crate::visualization_msgs::MarkerArray,
            $crate::visualization_msgs::MeshFile,
            $crate::visualization_msgs::UVCoordinate,
        }
    };
}

macro_rules! names_and_definitions {
    ($($message:ty,)*) => {
        &[$((<$message as RosMessage>::TYPE_NAME, <$message as RosMessage>::DEFINITION)),*]
    };
}

/// Full name and definition of every message.
const DEFINITIONS: &[(&str, &str)] = for_each_message!(names_and_definitions);

/// The definition of the message called `package/Name`.
pub(crate) fn definition_of(package: &str, name: &str) -> Option<&'static str> {
    DEFINITIONS.iter().find_map(|(type_name, definition)| {
        let matches = type_name
            .strip_prefix(package)
            .and_then(|rest| rest.strip_prefix("/msg/"))
            .is_some_and(|rest| rest == name);
        matches.then_some(*definition)
    })
}

#[cfg(test)]
pub(crate) use for_each_message;
