//! What the live graph has for the suite, as the arguments that `stillmap up` needs for it.

#[cfg(test)]
mod tests;

use detection::shell::{DetectionParameters, PoseInput};
use geometry::ExtrinsicsSource;
use msgs::RosMessage;
use msgs::sensor_msgs::{Image, PointCloud2};
use msgs::tf2_msgs::TFMessage;
use node_shell::names::NameError;
use node_shell::{DiscoveredEndpoint, Role, RosArguments};
use serde::Serialize;

use super::{GraphView, ReceivedTopic, SuiteTopics, results};
use crate::failure::Failure;
use crate::offer::{LEAST_POSES_HZ, Offer};
use crate::ros_words::{gives, ros_words};
use crate::run::inputs::{Inputs, TF, TF_STATIC, TopicArgs, ViewTopics};
use crate::run::pose_topics::{BY_TF, PoseSource, PoseTopicKind};
use crate::run::tf_frames::{self, TfFrames};
use crate::up::PoseNode;
use crate::visual::VisualTopics;

/// Nodes of the suite: beside one that runs no other is started.
const SUITE: [&str; 3] = ["detection", "segmentation", "reconstruction"];

/// The arguments for a graph.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Proposal {
    /// The node that computes the pose, where nothing publishes one.
    pub(crate) pose: Option<PoseNode>,
    /// The inputs, by the names that the nodes know them by.
    pub(crate) inputs: Vec<ProposedInput>,
    /// What stands behind `--ros-args`.
    pub(crate) ros_arguments: Vec<String>,
    /// What a reader should know of them.
    pub(crate) notes: Vec<String>,
}

/// An input of the suite.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct ProposedInput {
    /// The name that the node knows it by.
    pub(crate) name: &'static str,
    /// The topic.
    pub(crate) topic: String,
    /// How often its messages came, by their stamps; `None` where fewer than two came, or nobody listened.
    pub(crate) rate_hz: Option<f64>,
}

impl Proposal {
    /// The arguments for what was observed of a graph, or of the namespace that the suite is to have. Inputs that are published under the suite's own names are taken; others are
    /// found by their types, their usual names, and whether images are depth images.
    ///
    /// # Errors
    /// When the suite runs in the graph already, an input is missing, or several topics could be one.
    pub(crate) fn of(view: &GraphView) -> Result<Self, Failure> {
        let Some(running) = running_suite(&view.suite, view) else { return Self::of_topics(view) };
        let beside = Self::of_topics(view).ok().and_then(|proposal| proposal.beside(view));
        let second = beside.map(|command| format!(", or start another suite beside it: {command}"));
        Err(Failure::new(format!("{running} runs in this graph already"))
            .fix(format!("stop it{}", second.unwrap_or_default())))
    }

    /// The same, whether a suite runs or not: its results are no inputs.
    fn of_topics(view: &GraphView) -> Result<Self, Failure> {
        let results = results::of_suite(&view.endpoints);
        let published: Vec<(&str, &str)> = view
            .endpoints
            .iter()
            .filter(|one| one.role == Role::Publisher && is_alive(view, one))
            .filter(|one| is_tf(&one.topic) || view.suite.is_beside(&one.topic))
            .filter(|one| !results.contains(one.topic.as_str()))
            .filter(|one| one.topic != TF || may_place_the_robot(view))
            .map(|one| (one.topic.as_str(), one.type_name.as_str()))
            .collect();
        let offer = Offer::of_graph(published);
        let mut topics = named(view, &offer);
        let mut inputs = Inputs::choose_from(&topics, &offer, PoseInput::Pose);
        topics.pose = Some(BY_TF.to_owned());
        let sensors = Inputs::choose_from(&topics, &offer, PoseInput::Tf);
        let placed = sensors.as_ref().ok().and_then(|sensors| placed(view, sensors));
        if !has_pose(&offer)
            && let Ok(sensors) = &sensors
            && let Some(odometry) = odometry(view, &offer, sensors)
        {
            return Ok(Self::of_odometry(view, &offer, (sensors, placed.as_ref()), odometry));
        }
        // A robot with a description and a localisation: it has one frame for all, and corrections of the map.
        if placed.is_some() {
            inputs = sensors;
        }
        let inputs = inputs?;
        let mut proposal = Self::default();
        proposal.take_topics(view, inputs.by_node_name());
        proposal.take_view(&inputs.view);
        proposal.take_pose(&inputs, placed.as_ref());
        proposal.take_colours(view, &offer, &inputs.view);
        Ok(proposal)
    }

    /// The same with a node that computes the pose.
    fn of_odometry(
        view: &GraphView,
        offer: &Offer<'_>,
        (sensors, placed): (&Inputs, Option<&TfFrames>),
        odometry: Odometry<'_>,
    ) -> Self {
        let mut proposal = Self::default();
        proposal.take_topics(view, sensors.by_node_name());
        proposal.take_view(&sensors.view);
        let topics = match odometry {
            Odometry::Lidar(cloud) => {
                proposal.pose = Some(PoseNode::Lidar);
                proposal.notes.push(
                    "nothing publishes a pose: the LiDAR's odometry computes it (--pose lidar); where the LiDAR is on the \
                     robot is its parameter base_from_lidar"
                        .to_owned(),
                );
                vec![("points", cloud)]
            }
            Odometry::Visual => {
                proposal.pose = Some(PoseNode::Visual);
                proposal.notes.push(
                    "nothing publishes a pose: the visual odometry computes it from colour and depth images (--pose visual)"
                        .to_owned(),
                );
                Vec::new()
            }
        };
        proposal.take_topics(view, topics);
        proposal.take_mounts(placed);
        proposal.take_colours(view, offer, &sensors.view);
        proposal
    }

    /// The command for another suite with the same inputs, in a namespace of its own, where their names are other ones.
    fn beside(self, view: &GraphView) -> Option<String> {
        let (said, suite) = (2..).find_map(|number| free_namespace(view, number))?;
        let is_parameter = |pair: &&[String]| pair.first().is_some_and(|option| option == "-p");
        let parameters: Vec<String> =
            self.ros_arguments.chunks(2).filter(is_parameter).flatten().cloned().collect();
        let mut second = Self { inputs: Vec::new(), ros_arguments: Vec::new(), ..self.clone() };
        let second_view = GraphView { suite, ..view.clone() };
        let topics = self.inputs.iter().map(|input| (input.name, input.topic.as_str()));
        second.take_topics(&second_view, topics);
        second.ros_arguments.extend(parameters);
        second.command(&[], &said).ok()
    }

    /// Whether tf says where scanner and camera are on the robot.
    pub(crate) fn knows_mounts(&self) -> bool {
        self.ros_arguments.iter().any(|word| word.starts_with("extrinsics:="))
    }

    /// The command, for a shell, with these arguments for the program itself. What the user has said of the nodes stands where it holds.
    ///
    /// # Errors
    /// When the user's namespace is none.
    pub(crate) fn command(&self, own: &[String], said: &RosArguments) -> Result<String, NameError> {
        let mut ros = ros_words(said)?;
        // Of a remapping the first holds, of parameters the last.
        let is_of_parameters = |word: &String| word == "-p" || word == "--params-file";
        let own_parameters =
            ros.split_off(ros.iter().position(is_of_parameters).unwrap_or(ros.len()));
        // An option and what it takes.
        for pair in self.ros_arguments.chunks(2) {
            let parameter = pair.last().and_then(|value| value.split(":=").next());
            let is_said = pair.first().is_some_and(|option| option == "-p")
                && parameter.is_some_and(|parameter| gives(said, parameter));
            ros.extend(pair.iter().filter(|_| !is_said).cloned());
        }
        ros.extend(own_parameters);
        let mut words = ["stillmap", "up"].map(str::to_owned).to_vec();
        words.extend(own.iter().cloned());
        let pose = self.pose.into_iter().flat_map(|pose| ["--pose", pose.word()]);
        words.extend(pose.map(str::to_owned));
        if !ros.is_empty() {
            words.push("--ros-args".to_owned());
            words.extend(ros);
        }
        Ok(words.join(" "))
    }

    fn take_topics<'a>(
        &mut self,
        view: &GraphView,
        topics: impl IntoIterator<Item = (&'static str, &'a str)>,
    ) {
        for (name, topic) in topics {
            let rate_hz = view.received.get(topic).and_then(|received| received.rate_hz());
            self.inputs.push(ProposedInput { name, topic: topic.to_owned(), rate_hz });
            if view.suite.resolved(name).as_deref() != Some(topic) {
                self.ros_arguments.extend(["-r".to_owned(), format!("{name}:={topic}")]);
            }
        }
    }

    fn set(&mut self, parameter: &str, value: impl Serialize) {
        let value = serde_json::to_value(value).unwrap_or_default();
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        self.ros_arguments.extend(["-p".to_owned(), format!("{parameter}:={value}")]);
    }

    fn take_view(&mut self, view: &ViewTopics) {
        if view.input() != DetectionParameters::default().input {
            self.set("input", view.kind());
        }
    }

    fn take_pose(&mut self, inputs: &Inputs, placed: Option<&TfFrames>) {
        let defaults = DetectionParameters::default();
        if inputs.pose.input() != defaults.pose_source {
            self.set("pose_source", inputs.pose.input());
        }
        if let Some(TfFrames { map, .. }) = placed
            && inputs.pose == PoseSource::Tf
            && *map != defaults.map_frame_id
        {
            self.set("map_frame_id", map);
        }
        self.take_mounts(placed);
    }

    fn take_mounts(&mut self, placed: Option<&TfFrames>) {
        let defaults = DetectionParameters::default();
        let Some(TfFrames { robot, .. }) = placed else {
            self.notes.push(
                "tf does not say where scanner and camera are on the robot: give their mounting by --rig (a preset, or a file \
                 that `stillmap calibrate` writes from a recording)"
                    .to_owned(),
            );
            return;
        };
        if *robot != defaults.config.pipeline.rig.rig_frame_id {
            self.set("rig_frame_id", robot);
        }
        self.set("extrinsics", ExtrinsicsSource::TfFromRig);
    }

    /// The colour camera beside the depth images, where there is one.
    fn take_colours(&mut self, view: &GraphView, offer: &Offer<'_>, chosen: &ViewTopics) {
        let ViewTopics::Depth { image, camera_info } = chosen else { return };
        let Ok(colours) = VisualTopics::choose(&Default::default(), image, camera_info, offer)
        else {
            return;
        };
        if !colours.has_usual_name() {
            return;
        }
        self.set("colour", if colours.is_compressed { "compressed" } else { "raw" });
        let topics = colours.by_node_name();
        self.take_topics(view, topics.into_iter().filter(|(name, _)| name.starts_with("rgb/")));
    }
}

fn is_tf(topic: &str) -> bool {
    [TF, TF_STATIC].contains(&topic)
}

/// What can compute the pose.
enum Odometry<'a> {
    /// `lidar_odometry`, by the clouds of this topic.
    Lidar(&'a str),
    /// `pose`, by the colour camera beside the depth images.
    Visual,
}

/// Whether a topic could place the robot in a map.
fn has_pose(offer: &Offer<'_>) -> bool {
    let is_there = |kind: PoseTopicKind| offer.of_type(kind.type_name()).next().is_some();
    PoseTopicKind::ALL.into_iter().any(is_there) || offer.has(TF, TFMessage::TYPE_NAME)
}

/// The odometry that these sensors have what it needs for: the LiDAR's before the camera's, which needs texture and light.
fn odometry<'a>(view: &GraphView, offer: &Offer<'a>, sensors: &Inputs) -> Option<Odometry<'a>> {
    let ViewTopics::Depth { image, camera_info } = &sensors.view else { return None };
    // The clouds of a depth camera are in one of its frames, and stand beside its images.
    let frame = |topic: &str| view.received.get(topic).and_then(|received| received.frame());
    let camera = frame(image).or_else(|| frame(camera_info));
    let first_part = |topic: &str| topic.split('/').nth(1).map(str::to_owned);
    let is_lidar = |topic: &&str| {
        frame(topic).is_some_and(|one| Some(one) != camera)
            && first_part(topic) != first_part(image)
    };
    let mut clouds = offer.of_type(PointCloud2::TYPE_NAME).filter(is_lidar);
    if let (Some(cloud), None) = (clouds.next(), clouds.next()) {
        return Some(Odometry::Lidar(cloud));
    }
    if sensors.view.is_compressed() {
        return None;
    }
    let colours = VisualTopics::choose(&Default::default(), image, camera_info, offer).ok()?;
    colours.has_usual_name().then_some(Odometry::Visual)
}

/// Whether tf could have the robot's pose: what a description of the robot publishes there of its wheels is none. What nobody heard
/// counts.
fn may_place_the_robot(view: &GraphView) -> bool {
    let tree = view.transforms.tree();
    tree.is_empty() || tf_frames::in_tree(tree, &DetectionParameters::default()).is_ok()
}

/// Whether a publisher could be a sensor's, or a localisation's: poses that do not come, or once in a while, are goals or first
/// guesses. What nobody listened to counts.
fn is_alive(view: &GraphView, one: &DiscoveredEndpoint) -> bool {
    let is_pose = PoseTopicKind::ALL.iter().any(|kind| kind.type_name() == one.type_name);
    let received = view.received.get(&one.topic);
    let is_slow =
        received.is_some_and(|received| received.rate_hz().is_none_or(|hz| hz < LEAST_POSES_HZ));
    !(is_pose && is_slow)
}

/// The frames by which tf places the robot in the map, and scanner and camera on the robot; `None` where it does not.
fn placed(view: &GraphView, inputs: &Inputs) -> Option<TfFrames> {
    let tree = view.transforms.tree();
    let found = tf_frames::in_tree(tree, &DetectionParameters::default()).ok()?;
    let frame = |topic: &String| view.received.get(topic).and_then(|received| received.frame());
    let camera = match &inputs.view {
        ViewTopics::Depth { image, camera_info } => frame(image).or_else(|| frame(camera_info)),
        ViewTopics::Points(points) => frame(points),
    };
    let sensors = [frame(&inputs.scan)?, camera?].map(str::to_owned);
    tf_frames::not_on_robot(tree, &found.robot, &sensors).is_empty().then_some(found)
}

/// A node of the suite that is there under its name of these.
fn running_suite(suite: &SuiteTopics, view: &GraphView) -> Option<String> {
    let is_suite =
        |node: &&str| SUITE.iter().any(|one| suite.resolved(one).as_deref() == Some(*node));
    let mut nodes = view.endpoints.iter().filter_map(|one| one.node.as_deref());
    nodes.find(is_suite).map(|node| format!("node {node}"))
}

/// A namespace in which no suite runs, as arguments and with the names that the suite has there; `None` where one does.
fn free_namespace(view: &GraphView, number: usize) -> Option<(RosArguments, SuiteTopics)> {
    let rule = format!("__ns:=/suite_{number}");
    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).ok()?;
    let suite = SuiteTopics::resolve(&arguments).ok()?;
    running_suite(&suite, view).is_none().then_some((arguments, suite))
}

/// What need not be chosen: the topics that have the suite's names, and the only topic with depth images.
fn named(view: &GraphView, offer: &Offer<'_>) -> TopicArgs {
    let own = |name: &str| {
        let (topic, type_name) = view.suite.input(name)?;
        offer.has(topic, type_name).then(|| topic.to_owned())
    };
    let is_depth = |topic: &&str| {
        let received = view.received.get(*topic);
        received.is_some_and(ReceivedTopic::has_depths)
    };
    let mut depths = offer.of_type(Image::TYPE_NAME).filter(is_depth);
    let only_depth = depths.next().filter(|_| depths.next().is_none()).map(str::to_owned);
    let depth = own("depth/image").or(only_depth);
    let camera_info = own("depth/camera_info").filter(|_| depth.is_some());
    let mut named = TopicArgs::default();
    (named.scan, named.pose) = (own("scan"), own("pose"));
    (named.depth, named.camera_info) = (depth, camera_info);
    named
}
