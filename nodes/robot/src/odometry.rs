//! `stillmap odometry`: the trajectory of a bag's camera, from its images; or of its LiDAR.

mod findings;
mod summary;

use std::collections::BTreeMap;
use std::path::PathBuf;

use bag_player::Selection;
use clap::{Args, ValueEnum};
use msgs::convert::message_from_depth;
use msgs::sensor_msgs::{CameraInfo, Image};
use node_shell::parameters::{self, Assignment};
use node_shell::{Host, NodeFailure, Publisher, Qos, RosArguments};
use pose::shell::PoseParameters;

use self::findings::{findings, no_pose};
use self::summary::{OdometrySummary, print_summary};
use crate::console;
use crate::existing::{check_output_file, refuse_same_file};
use crate::failure::{Failure, Outcome};
use crate::lidar::{self, LidarArgs};
use crate::offer::Offer;
use crate::open_bag::open_bag;
use crate::progress::Progress;
use crate::run::view_topics::{depth_image, raw_name};
use crate::visual::{self, VisualOdometry, VisualTopicArgs, VisualTopics, write_trajectory};

/// The namespace of the node, which keeps its topics apart from those of a bag.
const NAMESPACE: &str = "/stillmap_odometry";

/// Arguments of `stillmap odometry`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap import tum rgbd_dataset_freiburg1_rpy -o fr1_rpy.mcap
  stillmap odometry fr1_rpy.mcap -o fr1_rpy.txt
  stillmap eval trajectory fr1_rpy.txt --ref rgbd_dataset_freiburg1_rpy/groundtruth.txt
  stillmap odometry drive.pcap --of lidar -o drive.txt
  stillmap odometry monday.mcap --slam --save-map flat.map -o monday.txt
  stillmap odometry tuesday.mcap --slam --map flat.map --localise -o tuesday.txt

The file has a line `seconds x y z qx qy qz qw` for each pose; images without a pose have none. The poses are in
the frame of the rig at the first image: x forward, z up.
With --of lidar the input may also be a capture of a Velodyne's packets (pcap, pcapng) or a folder of KITTI's scans.")]
pub struct OdometryArgs {
    /// A bag (MCAP, sqlite3 or ROS 1, recognised by its content) or a rosbag2 folder, with colour and depth images or a LiDAR's scans
    bag: PathBuf,
    /// Where the poses go, in the form of the TUM benchmark
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    topics: VisualTopicArgs,
    /// The depth image topic (16UC1 or 32FC1), or that of compressed ones (.../compressedDepth)
    #[arg(long, value_name = "TOPIC")]
    depth: Option<String>,
    /// The features that are tracked
    #[arg(long, value_enum)]
    features: Option<Features>,
    /// Keep a map and close loops; the poses are those of the final map
    #[arg(long)]
    slam: bool,
    /// With --slam: begin with this map, in which the camera must be localised first
    #[arg(long, value_name = "FILE", requires = "slam")]
    map: Option<PathBuf>,
    /// With --map: only localise the camera in the map, which stays unchanged; images before that have no pose
    #[arg(long, requires = "map")]
    localise: bool,
    /// With --slam: save the final map
    #[arg(long, value_name = "FILE", requires = "slam")]
    save_map: Option<PathBuf>,
    /// Replace the files of these names
    #[arg(long)]
    overwrite: bool,
    /// Whose poses are written
    #[arg(long, value_enum, default_value_t = Whose::Camera)]
    of: Whose,
    #[command(flatten)]
    lidar: LidarArgs,
    /// With a LiDAR: close loops when a place is revisited; the poses are corrected for the drift
    #[arg(long)]
    loop_closing: bool,
    /// A ROS 2 parameter file for the node pose, or lidar_odometry; later ones override earlier ones
    #[arg(long = "params-file", value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

/// The features that are tracked.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum Features {
    /// Corners alone
    Points,
    /// Line segments alone
    Lines,
    /// Both
    Both,
}

/// Whose poses are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum Whose {
    /// The camera's optical frame (z forward), as data sets of cameras have it
    Camera,
    /// The rig (x forward), as ROS has it
    Rig,
    /// The turning LiDAR, by its scans alone
    Lidar,
}

pub(crate) fn run(args: &OdometryArgs) -> Result<Outcome, Failure> {
    check_output_file(&args.output, args.overwrite, "-o")?;
    if let Some(map) = &args.save_map {
        check_output_file(map, args.overwrite, "--save-map")?;
        refuse_same_file((&args.output, "-o"), (map, "--save-map"))?;
    }
    if args.of == Whose::Lidar && args.slam {
        return Err(Failure::unusable("--slam is for a camera").fix("leave it out for a LiDAR"));
    }
    let is_of_images = args.depth.is_some() || args.features.is_some() || !args.topics.is_empty();
    if args.of == Whose::Lidar && is_of_images {
        return Err(Failure::unusable(
            "--depth, --features, --image and --image-info are for a camera",
        )
        .fix("leave them out for a LiDAR"));
    }
    if args.of == Whose::Lidar {
        let how = (&args.lidar, args.loop_closing);
        return lidar::run_odometry(&args.bag, &args.output, how, &args.files, args.json);
    }
    if !args.lidar.is_empty() || args.loop_closing {
        return Err(Failure::unusable("--lidar, --calibration and --loop-closing are for a LiDAR")
            .fix("add --of lidar"));
    }
    let mut parameters: PoseParameters =
        parameters::load(&format!("/{}", visual::NODE), &args.files, &[] as &[Assignment])
            .map_err(|error| Failure::of_parameters(&error))?;
    if let Some(features) = args.features {
        parameters.tracker.frame.use_points = features != Features::Lines;
        parameters.tracker.frame.use_lines = features != Features::Points;
    }
    if args.slam {
        // The SLAM runs between two images, so that the same bag gives the same poses.
        (parameters.slam, parameters.slam_in_background) = (true, false);
    }
    if let Some(map) = &args.map {
        parameters.map_file = map.display().to_string();
        parameters.load_map_on_start = true;
        parameters.localisation_only |= args.localise;
    }
    let bag = open_bag(&args.bag)?;
    let info = bag.info().map_err(|error| Failure::new(error.to_string()))?;
    let offer = Offer::of_bag(&info);
    let depth = visual::depth_topic(args.depth.as_deref(), &offer)?;
    let depth_info = visual::depth_info_topic(&depth);
    let topics = VisualTopics::choose(&args.topics, &depth, &depth_info, &offer)?;

    let failed = |error: NodeFailure| Failure::new(error.to_string());
    let mut tracking = Tracking::new(topics, &depth_info, &parameters).map_err(failed)?;
    let mut names = tracking.bag_topics();
    // Depth images that are registered to the colour images need none of their own.
    names.retain(|name| *name != depth_info || info.topic(name).is_some());
    let count = |name: &String| {
        let known = info.topics.iter().filter(|topic| topic.topic == *name);
        known.map(|topic| topic.message_count).sum::<u64>()
    };
    let progress = Progress::new("tracking", names.iter().map(count).sum());
    let selection = Selection { topics: Some(names), ..Selection::default() };
    let mut messages = bag.messages(&selection).map_err(|error| Failure::new(error.to_string()))?;
    let mut unusable: BTreeMap<String, (u64, String)> = BTreeMap::new();
    for message in &mut messages {
        let message = message.map_err(|error| Failure::new(error.to_string()))?;
        if let Err(error) = tracking.take(&message) {
            let (count, _) =
                unusable.entry(message.topic.to_string()).or_insert((0_u64, error.to_string()));
            *count += 1;
        }
        progress.advance();
    }
    progress.finish();
    for (topic, (count, first)) in &unusable {
        let what = format!("{topic}: {count} messages cannot be used; the first: {first}");
        console::print_failure(&Failure::new(what));
    }
    let rig_from_written = match args.of {
        Whose::Camera => geometry::pose_from_vector(&parameters.rig_from_camera),
        Whose::Rig | Whose::Lidar => nalgebra::Isometry3::identity(),
    };
    let final_poses = tracking.odometry.trajectory();
    let poses = final_poses.as_deref().unwrap_or(tracking.odometry.poses());
    let mut summary = OdometrySummary::of(&tracking.odometry, poses);
    if poses.is_empty() {
        print_summary(&summary, &args.output, args.json)?;
        return Err(no_pose(&tracking.odometry, &parameters));
    }
    write_trajectory(&args.output, poses, &rig_from_written)?;
    let saved = args.save_map.as_deref().map(|path| tracking.odometry.save_map(path)).transpose();
    summary.map = saved.map_err(failed)?;
    print_summary(&summary, &args.output, args.json)?;
    let findings = findings(&tracking.odometry, poses.len(), &parameters);
    findings.iter().for_each(console::print_failure);
    if let Some(doubt) = tracking.odometry.registration_doubt() {
        console::note(doubt);
    }
    let is_complete = messages.losses().is_empty() && unusable.is_empty() && findings.is_empty();
    Ok(if is_complete { Outcome::Complete } else { Outcome::WithLosses })
}

/// The pose node with the depth images' publishers.
struct Tracking {
    odometry: VisualOdometry,
    depth_topic: String,
    depth_info_topic: String,
    other_topics: Vec<String>,
    depths: Publisher<Image>,
    depth_infos: Publisher<CameraInfo>,
    /// Keeps the nodes.
    _host: Host,
}

impl Tracking {
    fn new(
        topics: VisualTopics,
        depth_info: &str,
        parameters: &PoseParameters,
    ) -> Result<Self, NodeFailure> {
        let host = Host::in_process();
        let mut arguments = vec!["--ros-args".to_owned()];
        arguments.extend(["-r".to_owned(), format!("__ns:={NAMESPACE}")]);
        // What the node says of its topics has the names of the bag.
        let depth = [("depth/image", topics.depth.as_str()), ("depth/camera_info", depth_info)];
        for (name, topic) in topics.by_node_name().into_iter().chain(depth) {
            arguments.extend(["-r".to_owned(), format!("{name}:={topic}")]);
        }
        let arguments = RosArguments::parse(arguments)?;
        let (node, beside) = (host.node(visual::NODE, &arguments)?, host.node("feed", &arguments)?);
        let other_topics =
            topics.by_node_name().into_iter().map(|(_, topic)| topic.to_owned()).collect();
        Ok(Self {
            other_topics,
            depth_topic: topics.depth.clone(),
            depth_info_topic: depth_info.to_owned(),
            depths: beside.publisher("depth/image", &Qos::sensor(1))?,
            depth_infos: beside.publisher("depth/camera_info", &Qos::sensor(1))?,
            odometry: VisualOdometry::new(&node, &beside, topics, parameters)?,
            _host: host,
        })
    }

    fn bag_topics(&self) -> Vec<String> {
        let mut topics = self.other_topics.clone();
        topics.extend([self.depth_topic.clone(), self.depth_info_topic.clone()]);
        topics.sort();
        topics.dedup();
        topics
    }

    fn take(&mut self, message: &bag_player::BagMessage) -> Result<(), visual::FeedError> {
        self.odometry.feed(message)?;
        if *message.topic == self.depth_topic && !self.odometry.has_ended() {
            let image = match raw_name(&message.topic) {
                Some(_) => message_from_depth(&depth_image(message)?),
                None => message.decode::<Image>()?,
            };
            self.depths.publish(image)?;
        }
        // Where both cameras have one topic, it was published as that of the colour camera.
        let is_of_depth = *message.topic == self.depth_info_topic;
        if is_of_depth && !self.other_topics.contains(&self.depth_info_topic) {
            self.depth_infos.publish(message.decode::<CameraInfo>()?)?;
        }
        self.odometry.flow();
        Ok(())
    }
}

#[cfg(test)]
mod tests;
