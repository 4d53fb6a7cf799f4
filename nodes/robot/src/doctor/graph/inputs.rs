//! The topics that the suite reads: whether they are published, or a topic of their type under another name.

use msgs::RosMessage;
use msgs::convert::COMPRESSED_DEPTH_TOPIC;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan, PointCloud2};
use node_shell::{Role, RosArguments, names::NameError};

use super::{Check, Finding, GraphView, owners, results};

const CHECK: Check = Check::Inputs;
/// The node that resolves the names.
const READER: &str = "detection";

/// One input of the suite.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct SuiteTopic {
    /// The name in the node's code, before remapping.
    name: String,
    /// Its absolute name, after remapping.
    topic: String,
    type_name: &'static str,
}

/// The inputs of the suite, under the names that they have here.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct SuiteTopics {
    arguments: RosArguments,
    scan: SuiteTopic,
    pose: SuiteTopic,
    depth: SuiteTopic,
    compressed_depth: SuiteTopic,
    camera_info: SuiteTopic,
    points: SuiteTopic,
}

impl SuiteTopics {
    /// The names in the namespace and with the remappings of a command line.
    pub(super) fn resolve(arguments: &RosArguments) -> Result<Self, NameError> {
        let identity = arguments.identity(READER)?;
        let resolve = |name: &str, type_name| {
            let topic = identity.resolve(&arguments.remappings, name)?;
            Ok::<_, NameError>(SuiteTopic { name: name.to_owned(), topic, type_name })
        };
        Ok(Self {
            arguments: arguments.clone(),
            scan: resolve("scan", LaserScan::TYPE_NAME)?,
            pose: resolve("pose", PoseStamped::TYPE_NAME)?,
            depth: resolve("depth/image", Image::TYPE_NAME)?,
            compressed_depth: resolve(
                &format!("depth/image/{COMPRESSED_DEPTH_TOPIC}"),
                CompressedImage::TYPE_NAME,
            )?,
            camera_info: resolve("depth/camera_info", CameraInfo::TYPE_NAME)?,
            points: resolve("points", PointCloud2::TYPE_NAME)?,
        })
    }
}

impl SuiteTopics {
    /// The names and types of all of them.
    pub(super) fn all(&self) -> [(&str, &'static str); 6] {
        let Self { arguments: _, scan, pose, depth, compressed_depth, camera_info, points } = self;
        [scan, pose, depth, compressed_depth, camera_info, points]
            .map(|input| (input.topic.as_str(), input.type_name))
    }

    /// The absolute name here of what the node knows by this name; `None` where it cannot have it.
    pub(super) fn resolved(&self, name: &str) -> Option<String> {
        let identity = self.arguments.identity(READER).ok()?;
        identity.resolve(&self.arguments.remappings, name).ok()
    }

    /// Whether a topic is in the namespace that the nodes have here.
    pub(super) fn is_beside(&self, topic: &str) -> bool {
        // Of any name: what is before it is the namespace.
        let own = self.resolved("probe").unwrap_or_default();
        own.strip_suffix("probe").is_some_and(|namespace| topic.starts_with(namespace))
    }

    /// The absolute name and the type of one of the inputs.
    pub(super) fn input(&self, name: &str) -> Option<(&str, &'static str)> {
        let Self { arguments: _, scan, pose, depth, compressed_depth, camera_info, points } = self;
        let mut all = [scan, pose, depth, compressed_depth, camera_info, points].into_iter();
        let input = all.find(|input| input.name == name)?;
        Some((&input.topic, input.type_name))
    }

    /// Whether one of the inputs has this name.
    pub(super) fn contains(&self, topic: &str) -> bool {
        self.all().into_iter().any(|(input, _)| input == topic)
    }

    /// Whether it is the topic of a sensor, whose frame must be in tf.
    pub(super) fn is_placed(&self, topic: &str) -> bool {
        self.contains(topic) && topic != self.pose.topic
    }
}

impl GraphView {
    fn is_published(&self, input: &SuiteTopic) -> bool {
        self.at(Role::Publisher, &input.topic).any(|one| one.type_name == input.type_name)
    }

    fn is_awaited(&self, input: &SuiteTopic) -> bool {
        self.at(Role::Subscription, &input.topic).next().is_some()
    }
}

/// The inputs that nobody publishes; an error if a node waits for one already.
pub(super) fn missing(view: &GraphView) -> Vec<Finding> {
    let suite = &view.suite;
    let mut missing: Vec<&SuiteTopic> = vec![&suite.scan];
    let images = [&suite.depth, &suite.compressed_depth];
    if !view.is_published(&suite.points) {
        if images.iter().any(|image| view.is_published(image)) {
            missing.push(&suite.camera_info);
        } else if view.is_awaited(&suite.points) {
            missing.push(&suite.points);
        } else if view.is_awaited(&suite.compressed_depth) {
            missing.extend([&suite.compressed_depth, &suite.camera_info]);
        } else {
            missing.extend([&suite.depth, &suite.camera_info]);
        }
    }
    missing.push(&suite.pose);
    missing.retain(|input| !view.is_published(input));
    if missing.is_empty() {
        return vec![Finding::ok(CHECK, "all topics that the suite reads are published")];
    }
    missing.into_iter().map(|input| nobody_publishes(view, input)).collect()
}

fn nobody_publishes(view: &GraphView, input: &SuiteTopic) -> Finding {
    let SuiteTopic { name, topic, type_name } = input;
    let waiting = owners(view.at(Role::Subscription, topic));
    let mut what = format!("nobody publishes {topic} ({type_name}), which the suite reads");
    if !waiting.is_empty() {
        what += &format!("; {waiting} waits for it");
    }
    let mut elsewhere = view.published(type_name);
    let results = results::of_suite(&view.endpoints);
    elsewhere.retain(|other| !view.suite.contains(other) && !results.contains(other));
    let fix = match elsewhere.as_slice() {
        [] => format!("start the driver of {name}; nobody here publishes a {type_name}"),
        [only] => {
            format!("{only} has that type: start the suite with --ros-args -r {name}:={only}")
        }
        several => format!(
            "choose one of {}: start the suite with --ros-args -r {name}:={}",
            several.join(", "),
            several[0]
        ),
    };
    Finding::grave_if(!waiting.is_empty(), CHECK, what, fix)
}

/// Whether the suite works without a topic: only a SLAM publishes its trajectory.
fn is_optional(topic: &str) -> bool {
    topic.rsplit('/').next() == Some("map_path")
}

/// Subscriptions without a publisher, of any node, if a topic of their type is published that nobody reads: a name that was
/// not remapped.
pub(super) fn unmatched_names(view: &GraphView) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut last = "";
    let subscriptions = view.endpoints.iter().filter(|one| one.role == Role::Subscription);
    for subscription in subscriptions {
        let topic = subscription.topic.as_str();
        let is_known = std::mem::replace(&mut last, topic) == topic;
        if is_known
            || is_optional(topic)
            || view.suite.contains(topic)
            || view.at(Role::Publisher, topic).next().is_some()
        {
            continue;
        }
        let unread: Vec<_> = view
            .published(&subscription.type_name)
            .into_iter()
            .filter(|other| view.at(Role::Subscription, other).next().is_none())
            .collect();
        if let [only] = unread.as_slice() {
            let reader = owners(view.at(Role::Subscription, topic));
            findings.push(Finding::warn(
                Check::Names,
                format!(
                    "{reader} waits for {topic} ({}), which nobody publishes, and nobody reads {only} of \
                     the same type from {}",
                    subscription.type_name,
                    owners(view.at(Role::Publisher, only))
                ),
                format!("if they belong together, start {reader} with --ros-args -r {topic}:={only}"),
            ));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::*;
    use super::*;
    use crate::doctor::finding::Severity;

    fn without(topic: &str, role: Option<Role>) -> GraphView {
        let mut endpoints = healthy();
        endpoints.retain(|one| one.topic != topic || role.is_some_and(|role| one.role != role));
        view(endpoints)
    }

    #[test]
    fn a_graph_with_all_inputs_is_ok() {
        let findings = missing(&view(healthy()));
        assert_eq!(findings.len(), 1);
        assert_finding(&findings[0], Severity::Ok, &["all topics"]);
        assert!(unmatched_names(&view(healthy())).is_empty());
    }

    #[test]
    fn a_missing_input_that_a_node_waits_for_is_an_error() {
        let findings = missing(&without("/scan", Some(Role::Publisher)));
        assert_eq!(findings.len(), 1);
        let parts = ["nobody publishes /scan", "node /detection waits", "start the driver of scan"];
        assert_finding(&findings[0], Severity::Error, &parts);
    }

    #[test]
    fn a_missing_input_that_nobody_waits_for_is_a_warning_with_the_remapping() {
        let mut graph = without("/scan", None);
        graph.endpoints.push(publisher("/laser/scan", SCAN, "/driver"));
        let findings = missing(&graph);
        assert_finding(&findings[0], Severity::Warn, &["--ros-args -r scan:=/laser/scan"]);
        graph.endpoints.push(publisher("/rear/scan", SCAN, "/driver"));
        assert_finding(
            &missing(&graph)[0],
            Severity::Warn,
            &["choose one of /laser/scan, /rear/scan"],
        );
    }

    #[test]
    fn a_cloud_replaces_a_depth_image() {
        let mut graph = without("/depth/image", None);
        graph.endpoints.retain(|one| one.topic != "/depth/camera_info");
        let findings = missing(&graph);
        assert_eq!(findings.len(), 2);
        assert_finding(&findings[0], Severity::Warn, &["/depth/image"]);
        assert_finding(&findings[1], Severity::Warn, &["/depth/camera_info"]);
        graph.endpoints.push(publisher("/points", POINTS, "/camera"));
        assert_finding(&missing(&graph)[0], Severity::Ok, &[]);
    }

    #[test]
    fn an_image_without_its_calibration_is_an_error() {
        let findings = missing(&without("/depth/camera_info", Some(Role::Publisher)));
        assert_eq!(findings.len(), 1);
        assert_finding(&findings[0], Severity::Error, &["/depth/camera_info"]);
    }

    #[test]
    fn a_publisher_of_another_type_does_not_count() {
        let mut graph = without("/scan", Some(Role::Publisher));
        graph.endpoints.push(publisher("/scan", IMAGE, "/camera"));
        assert_finding(&missing(&graph)[0], Severity::Error, &["nobody publishes /scan"]);
        graph.endpoints.retain(|one| one.topic != "/depth/image");
        let image = &missing(&graph)[1];
        assert_finding(
            image,
            Severity::Warn,
            &["nobody publishes /depth/image", "start the driver"],
        );
    }

    #[test]
    fn names_are_resolved_with_namespace_and_remappings() {
        let arguments = ["--ros-args", "-r", "__ns:=/robot", "-r", "scan:=/laser/scan"];
        let suite = SuiteTopics::resolve(&RosArguments::parse(arguments).unwrap()).unwrap();
        assert_eq!(suite.scan.topic, "/laser/scan");
        assert_eq!(suite.depth.topic, "/robot/depth/image");
        assert_eq!(suite.compressed_depth.topic, "/robot/depth/image/compressedDepth");
    }

    #[test]
    fn a_node_that_waits_beside_a_topic_of_its_type_gets_the_remapping() {
        let mut graph = view(healthy());
        graph.endpoints.push(subscription("/cloud", POINTS, "/viewer"));
        assert!(unmatched_names(&graph).is_empty());
        graph.endpoints.push(publisher("/camera/points", POINTS, "/camera"));
        let findings = unmatched_names(&graph);
        assert_eq!(findings.len(), 1);
        let parts = ["node /viewer waits for /cloud", "-r /cloud:=/camera/points", "node /camera"];
        assert_finding(&findings[0], Severity::Warn, &parts);
    }
}
