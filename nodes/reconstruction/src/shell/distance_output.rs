//! How far places are from the nearest obstacle of the map: two services, and the topic `distance_field` for what is too large for
//! a response.

use std::time::Duration;

use msgs::stillmap_msgs::{
    DistanceField, GetDistanceField, GetDistanceFieldResponse, GetDistances, GetDistancesResponse,
};
use msgs::{convert, geometry_msgs};
use nalgebra::Point3;
use node_shell::{Node, NodeFailure, Publisher, Qos, Request, Throttle};
use tokio::time::Instant;

use super::Stage;
use crate::{DistanceError, Map, MapBox};

/// The topic of boxes that were asked for.
const TOPIC: &str = "distance_field";
/// Fields that may wait for a subscriber.
const FIELDS_KEPT: usize = 2;
/// When nobody has asked for so long, changes of the map are no longer followed, and the memory is given back: planners ask several
/// times a second.
pub(super) const KEPT: Duration = Duration::from_secs(60);

/// What the services need besides the map.
pub(super) struct DistanceOutput {
    /// Absent where the map has no distances.
    fields: Option<Publisher<DistanceField>>,
    asked_last: Option<Instant>,
    unanswered: Throttle,
}

impl DistanceOutput {
    pub(super) fn new(node: &Node, has_distances: bool) -> Result<Self, NodeFailure> {
        let publisher = || node.publisher(TOPIC, &Qos::reliable(FIELDS_KEPT));
        Ok(Self {
            fields: has_distances.then(publisher).transpose()?,
            asked_last: None,
            unanswered: Throttle::for_warnings(),
        })
    }

    /// Somebody asks.
    pub(super) fn asked(&mut self, now: Instant) {
        self.asked_last = Some(now);
    }

    /// Forgets what nobody has asked for in a while.
    pub(super) fn look(&mut self, map: &mut Map, now: Instant) {
        if self.asked_last.is_some_and(|last| now.saturating_duration_since(last) >= KEPT) {
            self.asked_last = None;
            map.forget_distances();
        }
    }

    /// Publishes a field if somebody subscribes. Returns whether it was.
    fn publish(&self, field: &DistanceField) -> bool {
        self.fields.as_ref().is_some_and(|fields| {
            fields.subscriber_count() > 0 && fields.publish_or_warn(field.clone())
        })
    }

    fn note(&self, answered: Result<(), impl std::fmt::Display>) {
        if let Err(error) = answered
            && let Some(held_back) = self.unanswered.pass()
        {
            tracing::warn!("{error} ({held_back} more since the last warning)");
        }
    }
}

fn place_m(point: &geometry_msgs::Point) -> Point3<f64> {
    Point3::new(point.x, point.y, point.z)
}

impl Stage {
    /// Answers how far places are.
    pub(super) fn answer_distances(&mut self, request: Request<'_, GetDistances>) {
        self.distances.asked(Instant::now());
        let places_m: Vec<Point3<f64>> = request.message.points.iter().map(place_m).collect();
        let distances = self.map.distances(&request.message.frame_id, &places_m);
        let response = match distances {
            Ok(distances) => GetDistancesResponse {
                success: true,
                message: String::new(),
                distances: convert::message_from_distances(&distances),
            },
            Err(error) => GetDistancesResponse { message: error.to_string(), ..Default::default() },
        };
        let answered = request.respond_or(&response, |error| GetDistancesResponse {
            message: error.to_string(),
            ..Default::default()
        });
        self.distances.note(answered);
    }

    /// Answers how far the places of a box are, and publishes it where somebody subscribes.
    pub(super) fn answer_distance_field(&mut self, request: Request<'_, GetDistanceField>) {
        self.distances.asked(Instant::now());
        let asked = &request.message;
        let within = MapBox { least_m: place_m(&asked.least), most_m: place_m(&asked.most) };
        let made = self.map.distance_lattice(&asked.frame_id, &within);
        let response = match made {
            Ok(lattice) => GetDistanceFieldResponse {
                success: true,
                message: String::new(),
                field: convert::field_from_distances(&lattice),
            },
            Err(error) => failed(&error),
        };
        let is_published = response.success && self.distances.publish(&response.field);
        let answered = request.respond_or(&response, |error| GetDistanceFieldResponse {
            success: is_published,
            message: if is_published {
                format!("the field is on the topic {TOPIC}: it is too large for this client's middleware as a response")
            } else {
                format!("{error}, or subscribe to {TOPIC}, where the field is published then")
            },
            ..Default::default()
        });
        self.distances.note(answered);
    }
}

fn failed(error: &DistanceError) -> GetDistanceFieldResponse {
    GetDistanceFieldResponse { message: error.to_string(), ..Default::default() }
}
