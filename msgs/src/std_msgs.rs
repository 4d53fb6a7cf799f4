//! `std_msgs`: the header and plain values.

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Time;

/// When and in which frame the data was measured.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Header {
    /// The moment of the measurement.
    pub stamp: Time,
    /// The frame that the data is expressed in.
    pub frame_id: std::string::String,
}
ros_message!(Header, "std_msgs");

/// A text.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct String {
    /// The text.
    pub data: std::string::String,
}
ros_message!(String, "std_msgs");

/// Yes or no.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Bool {
    /// The value.
    pub data: bool,
}
ros_message!(Bool, "std_msgs");

/// Nothing but the fact that it was sent.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Empty {
    /// ROS 2 puts one byte on the wire for a message without fields.
    pub structure_needs_at_least_one_member: u8,
}
ros_message!(Empty, "std_msgs");

/// A colour; every part within 0 .. 1.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ColorRGBA {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
    /// Opacity: 1 is opaque.
    pub a: f32,
}
ros_message!(ColorRGBA, "std_msgs");
