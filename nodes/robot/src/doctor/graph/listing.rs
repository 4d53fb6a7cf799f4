//! Every topic with its publishers and subscriptions.

use node_shell::DiscoveredEndpoint;
use serde::Serialize;

/// One topic.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub(crate) struct TopicListing {
    topic: String,
    /// One type, unless an endpoint has the wrong one.
    types: Vec<String>,
    ends: Vec<End>,
}

/// One publisher or subscription.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
struct End {
    /// `publisher` or `subscription`.
    role: String,
    owner: String,
    vendor: &'static str,
    #[serde(rename = "type")]
    type_name: String,
    qos: String,
}

/// The topics of the endpoints, which are sorted by topic.
pub(super) fn of(endpoints: &[DiscoveredEndpoint]) -> Vec<TopicListing> {
    let mut listings: Vec<TopicListing> = Vec::new();
    for endpoint in endpoints {
        let end = End {
            role: endpoint.role.to_string(),
            owner: endpoint.owner(),
            vendor: endpoint.participant.vendor(),
            type_name: endpoint.type_name.clone(),
            qos: endpoint.qos.to_string(),
        };
        match listings.last_mut() {
            Some(listing) if listing.topic == endpoint.topic => listing.ends.push(end),
            _ => listings.push(TopicListing {
                topic: endpoint.topic.clone(),
                types: Vec::new(),
                ends: vec![end],
            }),
        }
    }
    for listing in &mut listings {
        listing.types = listing.ends.iter().map(|end| end.type_name.clone()).collect();
        listing.types.sort_unstable();
        listing.types.dedup();
    }
    listings
}

impl TopicListing {
    /// The topic in lines: its name and types, then its endpoints.
    pub(crate) fn lines(&self) -> Vec<String> {
        let mut lines = vec![format!("{}  {}", self.topic, self.types.join(" and "))];
        for End { role, owner, vendor, type_name, qos } in &self.ends {
            let odd = if self.types.len() > 1 { format!(", {type_name}") } else { String::new() };
            lines.push(format!("  {role:<12}  {owner} ({vendor}), {qos}{odd}"));
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::*;
    use super::*;

    #[test]
    fn a_topic_is_listed_with_its_ends() {
        let listings = of(&healthy());
        assert_eq!(listings.len(), 4);
        let lines = listings[0].lines();
        assert_eq!(lines[0], "/scan  sensor_msgs/msg/LaserScan");
        assert_eq!(lines[1], "  publisher     node /driver (Cyclone DDS), reliable, volatile");
        assert_eq!(
            lines[2],
            "  subscription  node /detection (Cyclone DDS), best effort, volatile"
        );
    }

    #[test]
    fn two_types_are_listed_with_their_endpoints() {
        let listings =
            of(&[publisher("/scan", SCAN, "/driver"), publisher("/scan", IMAGE, "/camera")]);
        let lines = listings[0].lines();
        assert!(lines[0].ends_with("sensor_msgs/msg/Image and sensor_msgs/msg/LaserScan"));
        assert!(lines[2].ends_with("volatile, sensor_msgs/msg/Image"), "{}", lines[2]);
    }
}
