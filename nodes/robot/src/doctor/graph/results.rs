//! The results that nodes of the suite publish as topics of sensors: what stands still, and what moves, of each sensor's messages.

use std::collections::BTreeSet;

use msgs::RosMessage;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan, PointCloud2};
use msgs::stillmap_msgs::StageReport;
use node_shell::{DiscoveredEndpoint, Role};

/// The types of these topics.
const TYPES: [&str; 5] = [
    LaserScan::TYPE_NAME,
    Image::TYPE_NAME,
    CompressedImage::TYPE_NAME,
    PointCloud2::TYPE_NAME,
    CameraInfo::TYPE_NAME,
];

/// The topics of sensors that nodes of the suite alone publish: they are no input, are empty where nothing moves, and who subscribes to
/// them lets the nodes compute them. A node is of the suite if it reports its cycles under its own name; a player of recorded reports is
/// not.
pub(super) fn of_suite(endpoints: &[DiscoveredEndpoint]) -> BTreeSet<&str> {
    let published = || endpoints.iter().filter(|one| one.role == Role::Publisher);
    let nodes: BTreeSet<&str> = published()
        .filter(|one| one.type_name == StageReport::TYPE_NAME)
        .filter_map(|one| {
            let node = one.node.as_deref()?;
            (one.topic.strip_suffix("/report") == Some(node)).then_some(node)
        })
        .collect();
    let is_of_suite =
        |one: &DiscoveredEndpoint| one.node.as_deref().is_some_and(|node| nodes.contains(node));
    let sensors = || published().filter(|one| TYPES.contains(&one.type_name.as_str()));
    let by_others: BTreeSet<&str> =
        sensors().filter(|one| !is_of_suite(one)).map(|one| one.topic.as_str()).collect();
    let by_suite = sensors().filter(|one| is_of_suite(one)).map(|one| one.topic.as_str());
    by_suite.filter(|topic| !by_others.contains(topic)).collect()
}
