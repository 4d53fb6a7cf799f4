//! How far places are from the nearest obstacle of the map: asked for by services.

use serde::{Deserialize, Serialize};

use crate::geometry_msgs::Point;
use crate::std_msgs::Header;

/// How far places are from the nearest obstacle of the map, and what the map has recorded of them.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Distances {
    /// When the map was last seen; the map frame.
    pub header: Header,
    /// The distance of each place in metres; +Inf where no obstacle is within the bound. Never negative.
    pub distances: Vec<f32>,
    /// Of each place the direction in which the distance grows, of length 1: x, y and z in the map frame. 0 0 0 where it grows in
    /// none, or no obstacle is within the bound.
    pub gradients: Vec<f32>,
    /// What is recorded of each place: [`Self::UNKNOWN`], [`Self::FREE`] or [`Self::BEHIND`].
    #[serde(with = "serde_bytes")]
    pub states: Vec<u8>,
}
ros_message!(Distances, "stillmap_msgs", {
    /// Nothing is recorded there: never seen, behind what was seen, or free without a surface near.
    UNKNOWN: u8 = 0,
    /// Seen to be free: before a surface.
    FREE: u8 = 1,
    /// Behind a surface, by no more than the truncation of the map's distances.
    BEHIND: u8 = 2,
});

/// The distances on a lattice: a box, or a slice with one layer.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct DistanceField {
    /// When the map was last seen; the map frame.
    pub header: Header,
    /// The place of the first value, in the map frame.
    pub origin: Point,
    /// How far neighbouring places are apart, in metres.
    pub resolution: f64,
    /// Places along x.
    pub size_x: u32,
    /// Places along y.
    pub size_y: u32,
    /// Places along z.
    pub size_z: u32,
    /// Farther distances are not computed, in metres.
    pub max_distance: f64,
    /// The distance of each place in metres; +Inf where no obstacle is within `max_distance`. x runs fastest, then y, then z.
    pub distances: Vec<f32>,
    /// What is recorded of each place, as in [`Distances`], in the same order.
    #[serde(with = "serde_bytes")]
    pub states: Vec<u8>,
}
ros_message!(DistanceField, "stillmap_msgs");

/// How far places are from the nearest obstacle of the map.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GetDistances;

/// Names the places.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetDistancesRequest {
    /// The frame of the places: that of the map, or empty for it.
    pub frame_id: String,
    /// The places, at most 10,000.
    pub points: Vec<Point>,
}

/// Has the distances.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetDistancesResponse {
    /// Whether there are distances.
    pub success: bool,
    /// Why not.
    pub message: String,
    /// In the order of the places.
    pub distances: Distances,
}
ros_service!(GetDistances, GetDistancesRequest, GetDistancesResponse, "stillmap_msgs");

/// The distances to the nearest obstacle of the map in a box.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GetDistanceField;

/// Names the box.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetDistanceFieldRequest {
    /// The frame of the box: that of the map, or empty for it.
    pub frame_id: String,
    /// The least corner.
    pub least: Point,
    /// The greatest corner. Where both have the same z the field is a slice: the layer of places nearest to it.
    pub most: Point,
}

/// Has the distances.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct GetDistanceFieldResponse {
    /// Whether there are distances.
    pub success: bool,
    /// Why not, or where they are: those that are too many for a response to the client's middleware are on the topic
    /// `distance_field`.
    pub message: String,
    /// The places within the box; along an axis on which none is, those nearest to its middle.
    pub field: DistanceField,
}
ros_service!(GetDistanceField, GetDistanceFieldRequest, GetDistanceFieldResponse, "stillmap_msgs");
