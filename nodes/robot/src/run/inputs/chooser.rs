//! Which topic of a bag or of the live graph each input is: the one that the user names, or else the one that can be meant.

use detection::shell::PoseInput;
use msgs::RosMessage;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan, PointCloud2};
use msgs::tf2_msgs::TFMessage;

use super::{MULTI_ECHO, TF, TF_STATIC, TopicArgs, ViewTopics};
use crate::failure::Failure;
use crate::lidar::LIDAR;
use crate::offer::Offer;
use crate::run::pose_topics::{BY_TF, PoseSource, PoseTopicKind};
use crate::run::view_topics::raw_name;
use crate::visual::{VISUAL, VisualTopics};

/// Chooses among the topics of a bag or of the live graph.
pub(super) struct Chooser<'a> {
    pub(super) offer: &'a Offer<'a>,
}

impl Chooser<'_> {
    pub(super) fn scan(&self, args: &TopicArgs) -> Result<String, Failure> {
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

    pub(super) fn chosen_view(&self, args: &TopicArgs) -> Result<ViewTopics, Failure> {
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

    pub(super) fn pose(
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

    pub(super) fn has_tf(&self, name: &str) -> bool {
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

/// Whether images are no depths by the name of their topic: those of a colour or an infrared camera. A name may have both, as
/// `depth_to_rgb/image_raw` of Azure Kinect's driver.
fn is_of_another_camera(topic: &str) -> bool {
    let parts = || topic.split(['/', '_']);
    let others = ["rgb", "color", "colour", "ir", "infra", "infra1", "infra2", "infrared"];
    !topic.contains("depth") && parts().any(|part| others.contains(&part))
}
