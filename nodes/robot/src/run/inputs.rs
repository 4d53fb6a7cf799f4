//! Which topics of a bag the pipeline reads.

use bag_player::BagInfo;
use clap::Args;
use detection::shell::{DetectionParameters, PoseInput};
use msgs::RosMessage;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan, PointCloud2};
use msgs::tf2_msgs::TFMessage;

use super::colour_topics::ColourTopics;
use super::pose_topics::{BY_TF, PoseSource, PoseTopicKind};
pub use super::view_topics::ViewTopics;
use super::view_topics::{COMPRESSED_DEPTH, raw_name};
use crate::failure::Failure;
use crate::lidar::{LIDAR, LidarArgs};
use crate::offer::Offer;
use crate::sensor_bag;
use crate::visual::{VISUAL, VisualTopicArgs, VisualTopics};

/// Topics that the user names; the rest is found by type.
#[derive(Args, Debug, Default)]
pub struct TopicArgs {
    /// The LaserScan topic, where the bag has several
    #[arg(long, value_name = "TOPIC")]
    pub scan: Option<String>,
    /// The depth image topic (16UC1 or 32FC1), or that of compressed ones (.../compressedDepth)
    #[arg(long, value_name = "TOPIC")]
    pub depth: Option<String>,
    /// The CameraInfo topic of the depth image
    #[arg(long, value_name = "TOPIC")]
    pub camera_info: Option<String>,
    /// A PointCloud2 topic, to be read in place of a depth image
    #[arg(long, value_name = "TOPIC", conflicts_with_all = ["depth", "camera_info"])]
    pub points: Option<String>,
    /// The topic of the rig's poses (PoseStamped, Odometry or PoseWithCovarianceStamped); or `tf`: the robot in the map by /tf; or
    /// `visual`: visual odometry from the colour and depth images; or `lidar`: odometry from the scans of a 3D LiDAR
    #[arg(long, value_name = "TOPIC")]
    pub pose: Option<String>,
    #[command(flatten)]
    visual: VisualTopicArgs,
    #[command(flatten)]
    lidar: LidarArgs,
}

impl TopicArgs {
    /// Whether no topic is named.
    pub(crate) fn is_empty(&self) -> bool {
        let Self { scan, depth, camera_info, points, pose, visual, lidar } = self;
        [scan, depth, camera_info, points, pose].into_iter().all(Option::is_none)
            && visual.is_empty()
            && lidar.is_empty()
    }

    /// The options that name topics of other sensors than a LiDAR.
    pub(super) fn of_other_sensors(&self) -> Vec<&'static str> {
        let Self { scan, depth, camera_info, points, pose: _, visual, lidar: _ } = self;
        let named = [
            (scan.is_some(), "--scan"),
            (depth.is_some(), "--depth"),
            (camera_info.is_some(), "--camera-info"),
            (points.is_some(), "--points"),
            (!visual.is_empty(), "--image"),
        ];
        named.into_iter().filter_map(|(is_given, name)| is_given.then_some(name)).collect()
    }

    /// What the user names of the colour camera.
    pub(super) fn visual(&self) -> &VisualTopicArgs {
        &self.visual
    }

    /// Whether the pose is to be a LiDAR's.
    pub(crate) fn wants_lidar(&self) -> bool {
        self.pose.as_deref() == Some(LIDAR)
    }

    /// Whether nothing is said of the pose.
    pub(crate) fn has_no_pose(&self) -> bool {
        self.pose.is_none()
    }

    /// What the user names of the LiDAR.
    pub(crate) fn lidar(&self) -> &LidarArgs {
        &self.lidar
    }
}

/// The topics that a run reads.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Inputs {
    pub(crate) scan: String,
    /// The depth images or the clouds.
    pub view: ViewTopics,
    pub(crate) pose: PoseSource,
    /// The colour camera of the map, where it has one.
    pub(crate) colour: Option<ColourTopics>,
    /// The topic of true labels, where the bag has it.
    pub labels: Option<String>,
    /// The topics of tf that the bag has, static transforms first; empty if no node uses tf.
    pub(crate) transforms: Vec<&'static str>,
}

/// The topics of tf, the same in every bag.
pub(crate) const TF_STATIC: &str = "/tf_static";
pub(crate) const TF: &str = "/tf";

/// The scans of scanners that report several returns of a beam, which are not read.
pub(crate) const MULTI_ECHO: &str = "sensor_msgs/msg/MultiEchoLaserScan";

impl Inputs {
    /// Chooses the topics of a bag: those that the user named, else the only one of its type, else the
    /// one with the usual name. Poses are of the kind that `detection` asks for, if the bag has it, or else of another.
    pub(crate) fn choose(
        args: &TopicArgs,
        info: &BagInfo,
        detection: &DetectionParameters,
    ) -> Result<Self, Failure> {
        let offer = Offer::of_bag(info);
        let is_it = |topic: &str, type_name| {
            topic == sensor_bag::TRUE_LABELS && type_name == Image::TYPE_NAME
        };
        let labels = info.topics.iter().find(|topic| is_it(&topic.topic, &topic.type_name));
        let labels = labels.map(|topic| topic.topic.clone());
        Ok(Self { labels, ..Self::choose_from(args, &offer, detection.pose_source)? })
    }

    /// The same among topics of a bag or of the live graph, poses of the preferred kind before others.
    pub(crate) fn choose_from(
        args: &TopicArgs,
        offer: &Offer<'_>,
        preferred: PoseInput,
    ) -> Result<Self, Failure> {
        let choose = Chooser { offer };
        let scan = choose.scan(args)?;
        let view = choose.chosen_view(args)?;
        let pose = choose.pose(args, &view, preferred)?;
        let transforms = [TF_STATIC, TF].into_iter().filter(|name| choose.has_tf(name)).collect();
        Ok(Self { scan, view, pose, colour: None, labels: None, transforms })
    }

    /// The colour camera, where its messages are passed on for the map alone: the visual odometry passes on its own.
    pub(crate) fn colour_of_map(&self) -> Option<&ColourTopics> {
        self.colour.as_ref().filter(|_| !matches!(self.pose, PoseSource::Visual(_)))
    }

    /// Whether the rig's poses come from the bag. Otherwise the run computes them, in a frame whose origin is the first camera.
    #[must_use]
    pub fn has_poses_of_bag(&self) -> bool {
        !matches!(self.pose, PoseSource::Visual(_))
    }

    /// The same without the topics that no node uses with these parameters.
    pub(crate) fn needed_by(self, detection: &DetectionParameters) -> Self {
        if detection.needs_tf() { self } else { Self { transforms: Vec::new(), ..self } }
    }

    /// Whether a node subscribes to a topic of the bag.
    pub(crate) fn is_of(&self, topic: &str) -> bool {
        self.transforms.contains(&topic)
            || self.by_node_name().into_iter().any(|(_, known)| known == topic)
    }

    /// The sensors' topics that the nodes subscribe to, each with the name that the node knows it by.
    pub(crate) fn by_node_name(&self) -> Vec<(&'static str, &str)> {
        let mut topics = vec![("scan", self.scan.as_str())];
        match &self.pose {
            PoseSource::Topic { topic, kind } => topics.push((kind.node_name(), topic)),
            PoseSource::Tf => {}
            PoseSource::Visual(visual) => topics.extend(visual.by_node_name()),
        }
        match &self.view {
            ViewTopics::Depth { image, camera_info } => {
                let is_compressed = self.view.is_compressed();
                topics.push((if is_compressed { COMPRESSED_DEPTH } else { "depth/image" }, image));
                topics.push(("depth/camera_info", camera_info));
            }
            ViewTopics::Points(points) => topics.push(("points", points)),
        }
        for (name, topic) in self.colour.iter().flat_map(ColourTopics::by_node_name) {
            // The visual odometry has the same ones.
            if !topics.iter().any(|(known, _)| *known == name) {
                topics.push((name, topic));
            }
        }
        topics
    }
}

/// Where the points of a bag come from.
pub(crate) fn view_of(info: &BagInfo, topics: &TopicArgs) -> Result<ViewTopics, Failure> {
    Chooser { offer: &Offer::of_bag(info) }.chosen_view(topics)
}

/// Whether images are no depths by the name of their topic: those of a colour or an infrared camera. A name may have both, as
/// `depth_to_rgb/image_raw` of Azure Kinect's driver.
fn is_of_another_camera(topic: &str) -> bool {
    let parts = || topic.split(['/', '_']);
    let others = ["rgb", "color", "colour", "ir", "infra", "infra1", "infra2", "infrared"];
    !topic.contains("depth") && parts().any(|part| others.contains(&part))
}

struct Chooser<'a> {
    offer: &'a Offer<'a>,
}

impl Chooser<'_> {
    fn scan(&self, args: &TopicArgs) -> Result<String, Failure> {
        if args.scan.is_none() && self.of_type(LaserScan::TYPE_NAME).is_empty() {
            if let Some(echoes) = self.of_type(MULTI_ECHO).first() {
                return Err(Failure::new(format!(
                    "{} has no 2D laser scan but that of several echoes, {echoes}, which is not read",
                    self.offer.place()
                ))
                .fix(format!(
                    "laser_proc makes scans of it, as \"first\", \"last\" and \"most_intense\": `ros2 run laser_proc laser_proc_node \
                     --ros-args -r echoes:={echoes}`; some drivers send one echo with publish_multiecho:=false"
                )));
            }
            return Err(Failure::new(format!(
                "{} has no 2D laser scan, no topic of type {}{}",
                self.offer.place(),
                LaserScan::TYPE_NAME,
                self.offer.unread()
            ))
            .fix(if self.offer.is_live() && self.offer.is_of_a_lidar_alone() {
                "start the driver of the scanner; the trajectory of a 3D LiDAR alone: `stillmap node lidar-odometry`"
                    .to_owned()
            } else if self.offer.is_live() {
                "start the driver of the scanner".to_owned()
            } else if self.offer.is_of_a_lidar_alone() {
                "`stillmap run BAG --pose lidar` makes a map of the scans of a 3D LiDAR alone".to_owned()
            } else if self.of_type(Image::TYPE_NAME).is_empty() && self.compressed_depths().is_empty() {
                format!("it has no depth images to cut scans out of, either; {}", self.offer.listed_by())
            } else {
                format!(
                    "without a scanner `stillmap run` cuts scans out of the depth images, and `stillmap import bag BAG --scan-from-depth \
                     -o OUT` adds them to a bag; {}",
                    self.offer.listed_by()
                )
            }));
        }
        self.topic::<LaserScan>(&args.scan, "--scan", &["scan"])
    }

    fn chosen_view(&self, args: &TopicArgs) -> Result<ViewTopics, Failure> {
        match &args.points {
            Some(_) => {
                let points = self.topic::<PointCloud2>(&args.points, "--points", &[])?;
                Ok(ViewTopics::Points(points))
            }
            None => self.view(args),
        }
    }

    fn view(&self, args: &TopicArgs) -> Result<ViewTopics, Failure> {
        let has_none = |name: &str| self.of_type(name).is_empty();
        let is_named = args.depth.is_some() || args.points.is_some();
        let compressed: Vec<&str> = self.compressed_depths();
        let has_no_image = has_none(Image::TYPE_NAME) && compressed.is_empty();
        if !is_named && has_no_image && has_none(PointCloud2::TYPE_NAME) {
            return Err(Failure::new(format!(
                "{} has neither depth images ({}) nor clouds ({}){}",
                self.offer.place(),
                Image::TYPE_NAME,
                PointCloud2::TYPE_NAME,
                self.offer.unread()
            ))
            .fix(format!(
                "--depth or --points names their topic; {}; what moves in scans alone is found by `stillmap eval scans`",
                self.offer.listed_by()
            )));
        }
        if let Some(image) = self.compressed_depth(args, &compressed) {
            let beside = raw_name(&image).unwrap_or_default();
            let camera_info = self.camera_info(args, beside)?;
            return Ok(ViewTopics::Depth { image, camera_info });
        }
        let images = self.of_type(Image::TYPE_NAME);
        let has_depth = images.iter().any(|topic| topic.contains("depth"));
        if !(has_depth || args.depth.is_some() || has_none(PointCloud2::TYPE_NAME)) {
            let points = self.topic::<PointCloud2>(&args.points, "--points", &["points"])?;
            return Ok(ViewTopics::Points(points));
        }
        if args.depth.is_none() && images.iter().all(|topic| is_of_another_camera(topic)) {
            return Err(Failure::new(format!(
                "{} has no depth images: {} is of colour or infrared by its name",
                self.offer.place(),
                images.join(", ")
            ))
            .fix(format!("--depth or --points names their topic; {}", self.offer.listed_by())));
        }
        let image = self.topic::<Image>(&args.depth, "--depth", &["depth/image", "depth"])?;
        let camera_info = self.camera_info(args, &image)?;
        Ok(ViewTopics::Depth { image, camera_info })
    }

    /// The topic of the calibration of the images of a topic. Drivers publish it beside them, under the same parent.
    fn camera_info(&self, args: &TopicArgs, image: &str) -> Result<String, Failure> {
        let parent = image.rsplit_once('/').map_or("", |(parent, _)| parent);
        let beside = format!("{parent}/camera_info");
        let named = args.camera_info.clone().or_else(|| {
            self.of_type(CameraInfo::TYPE_NAME).contains(&beside.as_str()).then_some(beside)
        });
        self.topic::<CameraInfo>(&named, "--camera-info", &["depth"])
    }

    /// The topics of compressed depth images.
    fn compressed_depths(&self) -> Vec<&str> {
        let compressed = self.of_type(CompressedImage::TYPE_NAME).into_iter();
        compressed.filter(|topic| raw_name(topic).is_some()).collect()
    }

    /// The topic of compressed depth images that is to be read: the one that is named, or the only one where there are no raw ones and
    /// no clouds.
    fn compressed_depth(&self, args: &TopicArgs, compressed: &[&str]) -> Option<String> {
        if let Some(named) = &args.depth {
            let (topic, type_name) = self.offer.find(named)?;
            let is_it = type_name == CompressedImage::TYPE_NAME && raw_name(topic).is_some();
            return is_it.then(|| topic.to_owned());
        }
        let raw = self.of_type(Image::TYPE_NAME).into_iter();
        let has_raw_depth = raw.into_iter().any(|topic| topic.contains("depth"));
        let has_clouds = !self.of_type(PointCloud2::TYPE_NAME).is_empty();
        match compressed {
            [only] if !has_raw_depth && !has_clouds => Some((*only).to_owned()),
            _ => None,
        }
    }

    fn pose(
        &self,
        args: &TopicArgs,
        view: &ViewTopics,
        preferred: PoseInput,
    ) -> Result<PoseSource, Failure> {
        match args.pose.as_deref() {
            Some(VISUAL) => self.visual_odometry(args, view),
            Some(BY_TF) => Ok(PoseSource::Tf),
            Some(LIDAR) => Err(Failure::new(
                "--pose lidar is of `stillmap run` and `up`, without a 2D scanner",
            )
            .fix("give a --pose topic, or leave it out")),
            Some(named) => self.named_pose(named),
            None => self.pose_of_kind(preferred),
        }
    }

    /// The topic that the user names, whatever its kind.
    fn named_pose(&self, named: &str) -> Result<PoseSource, Failure> {
        let type_name = self.offer.find(named).map_or("", |(_, type_name)| type_name);
        let is_it = |kind: &PoseTopicKind| kind.type_name() == type_name;
        let kind = PoseTopicKind::ALL.into_iter().find(is_it).unwrap_or(PoseTopicKind::Pose);
        let named = Some(named.to_owned());
        let topic = self.topic_of_type(kind.type_name(), &named, "--pose", &[])?;
        Ok(PoseSource::Topic { topic, kind })
    }

    /// The poses that the bag has: of the preferred kind, or else of the first kind that there is.
    fn pose_of_kind(&self, preferred: PoseInput) -> Result<PoseSource, Failure> {
        let has_tf = [TF_STATIC, TF].into_iter().any(|name| self.has_tf(name));
        if preferred == PoseInput::Tf && has_tf {
            return Ok(PoseSource::Tf);
        }
        let is_there = |kind: &PoseTopicKind| !self.of_type(kind.type_name()).is_empty();
        let preferred = PoseTopicKind::ALL.into_iter().find(|kind| kind.input() == preferred);
        match preferred.into_iter().chain(PoseTopicKind::ALL).find(is_there) {
            Some(kind) => {
                let usual = [kind.node_name()];
                let topic = self.topic_of_type(kind.type_name(), &None, "--pose", &usual)?;
                Ok(PoseSource::Topic { topic, kind })
            }
            None if has_tf => Ok(PoseSource::Tf),
            None => Err(Failure::new(format!(
                "{} has no pose: neither a topic of type {} nor /tf{}",
                self.offer.place(),
                PoseTopicKind::ALL.map(PoseTopicKind::type_name).join(", "),
                self.offer.unread()
            ))
            .fix(format!(
                "`--pose visual` computes it from colour and depth images; {}",
                self.offer.listed_by()
            ))),
        }
    }

    fn visual_odometry(&self, args: &TopicArgs, view: &ViewTopics) -> Result<PoseSource, Failure> {
        let ViewTopics::Depth { image, camera_info } = view else {
            return Err(Failure::new(format!(
                "--pose visual needs depth images, and {} has only clouds",
                self.offer.place()
            ))
            .fix("record the depth images, or give a --pose topic"));
        };
        if view.is_compressed() {
            return Err(Failure::new(format!(
                "--pose visual needs raw depth images, and {} has only compressed ones",
                self.offer.place()
            ))
            .fix("record the raw depth images, or give a --pose topic"));
        }
        let topics = VisualTopics::choose(&args.visual, image, camera_info, self.offer)?;
        Ok(PoseSource::Visual(topics))
    }

    fn has_tf(&self, name: &str) -> bool {
        self.offer.has(name, TFMessage::TYPE_NAME)
    }

    /// The topic for messages of type `M`.
    fn topic<M: RosMessage>(
        &self,
        named: &Option<String>,
        option: &str,
        usual_names: &[&str],
    ) -> Result<String, Failure> {
        self.topic_of_type(M::TYPE_NAME, named, option, usual_names)
    }

    fn topic_of_type(
        &self,
        wanted: &str,
        named: &Option<String>,
        option: &str,
        usual_names: &[&str],
    ) -> Result<String, Failure> {
        if let Some(named) = named {
            let problem = match (self.offer.find(named), self.offer.unread_encoding(named)) {
                (_, Some(encoding)) => {
                    format!("topic {named} is encoded as {encoding}, and only cdr (ROS 2) is read")
                }
                (Some((topic, type_name)), None) if type_name == wanted => {
                    return Ok(topic.to_owned());
                }
                (Some((_, type_name)), None) => {
                    format!("topic {named} carries {type_name}, not {wanted}")
                }
                (None, None) => format!("{} has no topic {named}", self.offer.place()),
            };
            return Err(Failure::new(problem).fix(self.candidates(wanted, option)));
        }
        let candidates = self.of_type(wanted);
        let usual = |name: &&&str| usual_names.iter().any(|usual| name.contains(usual));
        match candidates.as_slice() {
            [] => Err(Failure::new(format!(
                "{} has no topic of type {wanted}{}",
                self.offer.place(),
                self.offer.unread()
            ))
            .fix(format!("{option} needs one; {}", self.offer.listed_by()))),
            [only] => Ok((*only).to_owned()),
            several => {
                let usual: Vec<&&str> = several.iter().filter(usual).collect();
                match usual.as_slice() {
                    [only] => Ok((**only).to_owned()),
                    _ => Err(Failure::new(format!(
                        "{} has {} topics of type {wanted}",
                        self.offer.place(),
                        several.len()
                    ))
                    .fix(self.candidates(wanted, option))),
                }
            }
        }
    }

    fn candidates(&self, type_name: &str, option: &str) -> String {
        let names = self.of_type(type_name);
        if names.is_empty() {
            format!("none is of type {type_name}; {}", self.offer.listed_by())
        } else {
            format!("choose with {option}: {}", names.join(", "))
        }
    }

    fn of_type(&self, type_name: &str) -> Vec<&str> {
        self.offer.of_type(type_name).collect()
    }
}

#[cfg(test)]
mod tests;
