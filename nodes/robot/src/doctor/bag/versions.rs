//! Whether the bag's definition of a type is the same as this release's.

use bag_player::TopicInfo;
use msgs::schema_of;

use crate::doctor::checks::Check;
use crate::doctor::finding::Finding;

/// The fields of a message that is not within another, as the schemas name the first part.
const WHOLE: &str = "";

/// A type whose definition in the bag differs from that of this program.
pub(super) fn finding(topic: &TopicInfo) -> Option<Finding> {
    let ours = schema_of(&topic.type_name)?;
    let theirs = topic.definition.as_deref().filter(|text| !text.trim().is_empty())?;
    let difference = difference(theirs, &ours)?;
    Some(Finding::grave_if(
        topic.message_count > 0,
        Check::Versions,
        format!(
            "{}: the definition of {} in the bag differs: {difference}",
            topic.topic, topic.type_name
        ),
        "record with the packages of a current ROS 2, or convert the bag; where it was converted, see that the \
         definitions are of the messages in it",
    ))
}

/// The first field that differs, in words.
fn difference(theirs: &str, ours: &str) -> Option<String> {
    let theirs = parts(theirs);
    parts(ours).into_iter().find_map(|(name, our_fields)| {
        let (_, their_fields) = theirs.iter().find(|(their_name, _)| *their_name == name)?;
        let most = our_fields.len().max(their_fields.len());
        let place = (0..most).find(|place| our_fields.get(*place) != their_fields.get(*place))?;
        let description = |fields: &[String]| {
            fields.get(place).map_or_else(|| "nothing".to_owned(), |field| format!("'{field}'"))
        };
        let of = if name == WHOLE { String::new() } else { format!(" of {name}") };
        Some(format!(
            "field {}{of} is {} there and {} here",
            place + 1,
            description(their_fields),
            description(&our_fields)
        ))
    })
}

/// The messages of a schema, each with its fields; what is within others by its name alone.
fn parts(schema: &str) -> Vec<(String, Vec<String>)> {
    let mut parts = vec![(WHOLE.to_owned(), Vec::new())];
    for line in schema.lines() {
        if let Some(name) = line.strip_prefix("MSG:") {
            parts.push((base(name.trim()).to_owned(), Vec::new()));
        } else if let (Some(field), Some((_, fields))) = (field(line), parts.last_mut()) {
            fields.push(field);
        }
    }
    parts
}

/// Type and name of the field in a line; none for comments, constants and separators.
fn field(line: &str) -> Option<String> {
    let code = line.split('#').next()?;
    let mut words = code.split_whitespace();
    let (of_type, name) = (words.next()?, words.next()?);
    // A constant has an equals sign before its value; a default follows the name without one.
    let is_constant = name.contains('=') || words.next().is_some_and(|word| word.starts_with('='));
    if is_constant || of_type.starts_with('=') {
        return None;
    }
    let (element, array) = of_type.find('[').map_or((of_type, ""), |at| of_type.split_at(at));
    let element = match base(element) {
        // Of ROS 1, and of definitions made from IDL.
        "time" => "Time",
        "duration" => "Duration",
        "octet" | "byte" => "uint8",
        "float" => "float32",
        "double" => "float64",
        other => other,
    };
    Some(format!("{element}{array} {}", name.to_lowercase()))
}

/// The name without its package.
fn base(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSE: &str = "geometry_msgs/msg/PoseStamped";

    #[test]
    fn formatting_of_a_definition_makes_no_difference() {
        let ours = schema_of(POSE).unwrap();
        assert_eq!(difference(&ours, &ours), None);
        let written = ours
            .replace("builtin_interfaces/Time", "builtin_interfaces/msg/Time")
            .replace("std_msgs/Header header", "Header   header # of the pose")
            .replace("float64 w 1", "float64 w");
        assert_eq!(difference(&written, &ours), None);
    }

    #[test]
    fn another_field_is_named_with_its_place() {
        let ours = schema_of(POSE).unwrap();
        let ros1 = ours.replace("\nstring frame_id", "\nuint32 seq\nstring frame_id");
        let text = difference(&ros1, &ours).unwrap();
        assert!(
            text.contains("of Header is 'uint32 seq' there and 'string frame_id' here"),
            "{text}"
        );
        let short = difference("std_msgs/Header header\n", &ours).unwrap();
        assert!(short.contains("field 2 is nothing there"), "{short}");
    }
}
