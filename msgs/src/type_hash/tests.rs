use super::*;
use crate::{
    RosMessage, RosService, diagnostic_msgs, nav_msgs, rcl_interfaces, sensor_msgs, std_msgs,
};

/// As rosidl of ROS 2 Jazzy has it in its `.json` files, and rosbags 0.11.9 computes it.
#[test]
fn messages_have_the_hashes_that_ros_2_gives_them() {
    let hashes = [
        (
            std_msgs::String::type_hash(),
            "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
        ),
        (
            std_msgs::Empty::type_hash(),
            "20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312",
        ),
        (
            sensor_msgs::PointCloud2::type_hash(),
            "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
        ),
        (
            nav_msgs::Odometry::type_hash(),
            "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
        ),
        (
            diagnostic_msgs::DiagnosticArray::type_hash(),
            "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
        ),
        (
            rcl_interfaces::ParameterDescriptor::type_hash(),
            "52175dbfda6c51153101d33d2a9da05743f66f02d5ab2ca9ec4709b46b73d704",
        ),
        (
            rcl_interfaces::Log::type_hash(),
            "e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac",
        ),
    ];
    for (hash, expected) in hashes {
        assert_eq!(hash, Some(format!("{PREFIX}{expected}")));
    }
}

/// As rosidl of ROS 2 Jazzy has it in its `.json` files.
#[test]
fn services_have_the_hashes_that_ros_2_gives_them() {
    let hashes = [
        (
            rcl_interfaces::GetParameters::type_hash(),
            "bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc",
        ),
        (
            rcl_interfaces::SetParametersAtomically::type_hash(),
            "0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd",
        ),
        (
            rcl_interfaces::ListParameters::type_hash(),
            "3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d",
        ),
        (
            rcl_interfaces::DescribeParameters::type_hash(),
            "845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff",
        ),
    ];
    for (hash, expected) in hashes {
        assert_eq!(hash, Some(format!("{PREFIX}{expected}")));
    }
}

#[test]
fn another_definition_has_another_hash_and_comments_constants_and_defaults_count_for_nothing() {
    let hash = |text: &str| type_hash_of("a/msg/B", text);
    let plain = hash("string<=5 name\nfloat64[3] c\n");
    assert!(plain.is_some());
    assert_eq!(plain, hash("# of a\nuint8 K=3\nstring<=5 name \"x\" # why\n\nfloat64[3] c\n"));
    for other in ["string name\nfloat64[3] c\n", "string<=5 name\nfloat64[<=3] c\n", "float64[3] c"]
    {
        assert_ne!(plain, hash(other), "{other}");
    }
}

#[test]
fn what_is_no_whole_schema_has_no_hash() {
    assert_eq!(type_hash_of("a/msg/B", "C inner\n"), None);
    assert_eq!(type_hash_of("a/msg/B", "float64\n"), None);
    assert_eq!(type_hash_of("a/msg/B", "a/b/c/d x\n"), None);
}
