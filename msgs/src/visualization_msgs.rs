//! `visualization_msgs`: what viewers draw.

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Duration;
use crate::geometry_msgs::{Point, Pose, Vector3};
use crate::sensor_msgs::CompressedImage;
use crate::std_msgs::{ColorRGBA, Header};

/// A place on a texture, each part within 0 .. 1.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct UVCoordinate {
    /// Across.
    pub u: f32,
    /// Down.
    pub v: f32,
}
ros_message!(UVCoordinate, "visualization_msgs");

/// A mesh sent along with its marker.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct MeshFile {
    /// Its name; the extension gives the format.
    pub filename: String,
    /// The content of the file.
    #[serde(with = "serde_bytes")]
    pub data: Vec<u8>,
}
ros_message!(MeshFile, "visualization_msgs");

/// Something to be drawn, in the layout of ROS 2 since Humble.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Marker {
    /// Moment and frame of the marker.
    pub header: Header,
    /// Together with the id it names the marker.
    pub ns: String,
    /// Unique within the namespace.
    pub id: i32,
    /// One of the shapes, for instance [`Marker::CUBE`].
    pub r#type: i32,
    /// One of the actions, for instance [`Marker::ADD`].
    pub action: i32,
    /// Pose of the shape.
    pub pose: Pose,
    /// Size of the shape in metres.
    pub scale: Vector3,
    /// Colour of the shape.
    pub color: ColorRGBA,
    /// How long it stays; 0 for ever.
    pub lifetime: Duration,
    /// Whether it moves along with its frame.
    pub frame_locked: bool,
    /// Vertices of strips, lists and points in metres.
    pub points: Vec<Point>,
    /// Colours of the vertices: one each, or none.
    pub colors: Vec<ColorRGBA>,
    /// Where a texture is to be had.
    pub texture_resource: String,
    /// A texture sent along.
    pub texture: CompressedImage,
    /// Places of the vertices on the texture.
    pub uv_coordinates: Vec<UVCoordinate>,
    /// The text to be shown.
    pub text: String,
    /// Where a mesh is to be had.
    pub mesh_resource: String,
    /// A mesh sent along.
    pub mesh_file: MeshFile,
    /// Whether the mesh keeps its own colours.
    pub mesh_use_embedded_materials: bool,
}
ros_message!(Marker, "visualization_msgs", {
    /// An arrow along x.
    ARROW: i32 = 0,
    /// A cube.
    CUBE: i32 = 1,
    /// A sphere.
    SPHERE: i32 = 2,
    /// A cylinder along z.
    CYLINDER: i32 = 3,
    /// A line through all points.
    LINE_STRIP: i32 = 4,
    /// A line for each pair of points.
    LINE_LIST: i32 = 5,
    /// A cube at each point.
    CUBE_LIST: i32 = 6,
    /// A sphere at each point.
    SPHERE_LIST: i32 = 7,
    /// A dot at each point.
    POINTS: i32 = 8,
    /// Text that faces the viewer.
    TEXT_VIEW_FACING: i32 = 9,
    /// A mesh.
    MESH_RESOURCE: i32 = 10,
    /// A triangle for each three points.
    TRIANGLE_LIST: i32 = 11,
    /// Arrows through all points.
    ARROW_STRIP: i32 = 12,
    /// Add the marker, or change it.
    ADD: i32 = 0,
    /// The same as [`Marker::ADD`].
    MODIFY: i32 = 0,
    /// Take the marker away.
    DELETE: i32 = 2,
    /// Take all markers away.
    DELETEALL: i32 = 3,
});

/// Markers that are drawn together.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct MarkerArray {
    /// The markers.
    pub markers: Vec<Marker>,
}
ros_message!(MarkerArray, "visualization_msgs");
