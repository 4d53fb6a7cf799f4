//! The `ros2msg` text that goes into a bag beside the messages.

use std::collections::BTreeSet;

use crate::registry::definition_of;

/// The schema of the message called `type_name`, for instance `sensor_msgs/msg/Image`, in the form of
/// [`RosMessage::schema`](crate::RosMessage::schema), if it is one of this crate's.
#[must_use]
pub fn schema_of(type_name: &str) -> Option<String> {
    let (package, name) = type_name.split_once("/msg/")?;
    definition_of(package, name).map(|definition| with_dependencies(type_name, definition))
}

/// The line above each dependency.
const SEPARATOR: &str =
    "================================================================================";

/// The definition of `type_name` (`package/msg/Name`) and those of all messages within it, each one
/// once, in the order in which rosbag2 visits them: depth first, the fields' types by name.
pub(crate) fn with_dependencies(type_name: &str, definition: &str) -> String {
    let package = type_name.split('/').next().unwrap_or_default();
    let mut text = String::new();
    let mut seen = BTreeSet::new();
    append(&mut text, package, definition, &mut seen);
    text
}

fn append(
    text: &mut String,
    package: &str,
    definition: &str,
    seen: &mut BTreeSet<(String, String)>,
) {
    text.push_str(definition);
    for (package, name) in dependencies(package, definition) {
        // A test holds that every dependency is a message of this crate.
        let Some(definition) = definition_of(&package, &name) else { continue };
        if seen.insert((package.clone(), name.clone())) {
            text.push_str(&format!("\n{SEPARATOR}\nMSG: {package}/{name}\n"));
            append(text, &package, definition, seen);
        }
    }
}

/// Package and name of the messages that a definition names as types of its fields.
pub(crate) fn dependencies(package: &str, definition: &str) -> BTreeSet<(String, String)> {
    definition
        .lines()
        .filter_map(|line| line.split('#').next()?.split_whitespace().next())
        .filter_map(|field_type| field_type.split('[').next())
        .filter_map(|element| match element.split_once('/') {
            Some((package, name)) => Some((package.to_owned(), name.to_owned())),
            // Primitive types are written small, messages of the same package with a capital.
            None if element.starts_with(|first: char| first.is_ascii_uppercase()) => {
                Some((package.to_owned(), element.to_owned()))
            }
            None => None,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::for_each_message;
    use crate::{RosMessage, geometry_msgs, std_msgs, stillmap_msgs};

    #[test]
    fn a_message_without_messages_is_its_definition() {
        assert_eq!(std_msgs::ColorRGBA::schema(), std_msgs::ColorRGBA::DEFINITION);
    }

    #[test]
    fn dependencies_follow_depth_first_by_name() {
        let expected = format!(
            "{}\n{SEPARATOR}\nMSG: geometry_msgs/Pose\n{}\n{SEPARATOR}\nMSG: geometry_msgs/Point\n{}\
             \n{SEPARATOR}\nMSG: geometry_msgs/Quaternion\n{}\n{SEPARATOR}\nMSG: std_msgs/Header\n{}\
             \n{SEPARATOR}\nMSG: builtin_interfaces/Time\n{}",
            geometry_msgs::PoseStamped::DEFINITION,
            geometry_msgs::Pose::DEFINITION,
            geometry_msgs::Point::DEFINITION,
            geometry_msgs::Quaternion::DEFINITION,
            std_msgs::Header::DEFINITION,
            crate::builtin_interfaces::Time::DEFINITION,
        );
        assert_eq!(geometry_msgs::PoseStamped::schema(), expected);
        assert_eq!(SEPARATOR.len(), 80);
    }

    #[test]
    fn a_schema_is_found_by_name() {
        let name = "stillmap_msgs/msg/Tracks";
        assert_eq!(schema_of(name), Some(stillmap_msgs::Tracks::schema()));
        for unknown in ["", "stillmap_msgs/Tracks", "stillmap_msgs/msg/Track2", "a/msg/Tracks"] {
            assert_eq!(schema_of(unknown), None, "{unknown}");
        }
    }

    #[test]
    fn each_dependency_stands_once() {
        let schema = stillmap_msgs::ReducedCloud::schema();
        for name in ["std_msgs/Header", "builtin_interfaces/Time", "sensor_msgs/PointField"] {
            assert_eq!(schema.matches(&format!("MSG: {name}\n")).count(), 1, "{name}");
        }
    }

    fn assert_dependencies_known<M: RosMessage>() {
        let package = M::TYPE_NAME.split('/').next().unwrap();
        for (package, name) in dependencies(package, M::DEFINITION) {
            assert!(definition_of(&package, &name).is_some(), "{}: {package}/{name}", M::TYPE_NAME);
        }
    }

    #[test]
    fn every_dependency_is_a_message_of_this_crate() {
        macro_rules! check {
            ($($message:ty,)*) => { $(assert_dependencies_known::<$message>();)* };
        }
        for_each_message!(check);
    }
}
