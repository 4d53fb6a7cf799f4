//! `stillmap calibrate`: the pose of the scanner on the rig, from surfaces that both sensors of a bag see.

mod choice;
mod gathering;
#[cfg(test)]
pub(crate) mod joint_bag;
pub(crate) mod mounts_of_tf;
mod output;
mod poses;
pub(crate) mod reader;
pub(crate) mod rig_poses;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use bag_player::Bag;
use calibration::{CalibrationConfig, Cycle, DepthOptics, calibrate};
use clap::Args;
use geometry::{CameraModel, ExtrinsicsSource, RayTable, RigConfig, RigMounts, Stamp};

use self::mounts_of_tf::{MountsOfTf, is_one_mount};
use self::reader::{Choosing, Read, ReadCycles, Topics};
use self::rig_poses::RigPoses;
use crate::console;
use crate::existing::check_output_file;
use crate::failure::{Failure, Outcome};
use crate::open_bag::open_bag;
use crate::run::inputs::{Inputs, TopicArgs, ViewTopics};
use crate::run::parameters::{ParameterArgs, PipelineParameters};
use crate::run::{SensorFrames, choose_inputs, tf_frames};

/// Arguments of `stillmap calibrate`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap calibrate room.mcap -o extrinsics.yaml
  stillmap run room.mcap --params-file extrinsics.yaml

Both sensors must see the same surfaces: walls and furniture of several directions, upright and as high as the
scanner, 1 to 5 m away. Stand still for ten seconds, or turn slowly. Coordinates that the bag does not determine stay unchanged,
and are named. The mounting of the camera (rig_from_camera) is taken as given. The mountings to start from, and the poses, are
those that `stillmap run` takes: of tf where the bag's tf has the sensors, unless a --params-file says them.")]
pub struct CalibrateArgs {
    /// A bag (MCAP, sqlite3 or ROS 1, recognised by its content) or a rosbag2 folder
    bag: PathBuf,
    /// The parameter file to write: rig_from_lidar, for detection
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace a file of this name
    #[arg(long, requires = "output")]
    overwrite: bool,
    /// A ROS 2 parameter file with the mounts to start from; later ones override earlier ones
    #[arg(long = "params-file", value_name = "FILE")]
    parameter_files: Vec<PathBuf>,
    /// The depth camera's calibration in place of the bag's: a camera_info file in YAML
    #[arg(long, value_name = "YAML")]
    camera_file: Option<PathBuf>,
    /// Scans to use at most, each with its depth image in memory
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..=1000))]
    cycles: u16,
    /// Print the result as JSON, with the covariance
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    topics: TopicArgs,
}

pub(crate) fn run(args: &CalibrateArgs) -> Result<Outcome, Failure> {
    if let Some(output) = &args.output {
        check_output_file(output, args.overwrite, "-o")?;
    }
    let failed = |error: bag_player::BagError| Failure::new(error.to_string());
    let bag = open_bag(&args.bag)?;
    let info = bag.info().map_err(failed)?;
    let files = args.parameter_files.clone();
    let mut parameters = PipelineParameters::load(&ParameterArgs { files, ..Default::default() })?;
    let (inputs, note) = choose_inputs(&bag, &info, &args.topics, &mut parameters)?;
    if let Some(note) = note {
        console::note(note);
    }
    let node = parameters.detection_node();
    let start = StartingMounts::of(&bag, &inputs, &node.config.pipeline.rig)?;
    let ViewTopics::Depth { image, camera_info } = inputs.view.clone() else {
        return Err(Failure::new("clouds cannot be calibrated by, only depth images")
            .fix("record the depth image and its camera_info too, or name them with --depth and --camera-info"));
    };
    let config = CalibrationConfig::default();
    let choosing = Choosing {
        most_cycles: usize::from(args.cycles),
        most_motion_m: f64::INFINITY,
        max_pose_gap_s: node.config.max_pose_gap_s,
        max_image_offset_s: node.config.max_cloud_offset_s,
        beam_order: node.config.free_space.beam_order,
    };
    let Some(poses) = RigPoses::of(&inputs, node) else {
        return Err(Failure::new("the calibration takes its poses from a topic or tf, not from images")
            .fix("record the odometry, too (nav_msgs/Odometry), and name it with --pose; a platform that stands needs one pose"));
    };
    let topics = Topics { scan: inputs.scan, image, camera_info, poses };
    let Read { cycles, camera, losses } = reader::read(&bag, &info, &topics, &choosing)?;
    start.check_joint((&bag, &inputs.transforms), &node.config.pipeline.rig, &cycles.cycles)?;
    let camera = match &args.camera_file {
        Some(file) => read_camera(file)?,
        None => camera.ok_or_else(|| no_camera(&topics))?,
    };
    let rays = RayTable::new(&camera).map_err(|error| Failure::new(error.to_string()))?;
    check_sizes(&cycles, &camera)?;
    let optics = DepthOptics { camera: &camera, rays: &rays };
    let found = calibrate(&cycles.cycles, optics, &start.mounts, &config).map_err(|error| {
        Failure::new(error.to_string()).fix(
            "is rig_from_camera right, and rig_from_lidar within some 8 cm and 8 degrees (--params-file)? A scanner \
             that looks backwards needs a yaw of pi; furniture as high as the scanner helps",
        )
    })?;

    for finding in cycles.findings.iter().chain(&losses) {
        console::print_failure(finding);
    }
    if let Some(path) = &args.output {
        output::write_parameters(path, &args.bag, &found, &start)?;
    }
    if args.json {
        output::print_json(&args.bag, &found)?;
    } else {
        output::print(&found, &start, args.output.as_deref())?;
    }
    let complete = losses.is_empty() && cycles.findings.is_empty();
    Ok(if complete { Outcome::Complete } else { Outcome::WithLosses })
}

/// The mounts that a calibration starts from.
struct StartingMounts {
    mounts: RigMounts,
    source: ExtrinsicsSource,
    /// The frames of camera and scanner, where a joint may move one of them.
    jointed: Option<[String; 2]>,
}

impl StartingMounts {
    /// Those of the parameters, or of the bag's tf where these say so.
    fn of(bag: &Bag, inputs: &Inputs, rig: &RigConfig) -> Result<Self, Failure> {
        let source = rig.extrinsics;
        if source == ExtrinsicsSource::Parameters {
            return Ok(Self { mounts: rig.mounts(), source, jointed: None });
        }
        let SensorFrames { camera: Some(camera), scanner: Some(scanner) } =
            SensorFrames::of(bag, inputs)?
        else {
            return Err(Failure::new(
                "the first image or scan cannot be read, so that its frame is not known",
            )
            .fix("`stillmap doctor BAG` says what is wrong"));
        };
        let tree = tf_frames::tree_of(bag, &inputs.transforms)?;
        let by_tf = MountsOfTf { rig, camera: &camera, scanner: &scanner };
        let mounts = by_tf.latest(&tree).map_err(|error| {
            Failure::new(format!("the mounts to start from are to be those of tf: {error}")).fix(
                "a --params-file with `extrinsics: parameters`, rig_from_camera and rig_from_lidar",
            )
        })?;
        let is_jointed = by_tf.are_jointed(&tree);
        Ok(Self { mounts, source, jointed: is_jointed.then_some([camera, scanner]) })
    }

    /// What is calibrated is one mount.
    fn check_joint(
        &self,
        (bag, transforms): (&Bag, &[&str]),
        rig: &RigConfig,
        cycles: &[Cycle],
    ) -> Result<(), Failure> {
        let Some([camera, scanner]) = &self.jointed else { return Ok(()) };
        let stamps: Vec<Stamp> = cycles.iter().map(|cycle| cycle.image.stamp).collect();
        let by_tf = MountsOfTf { rig, camera, scanner };
        let of_cycles: Vec<RigMounts> =
            by_tf.at(bag, transforms, &stamps)?.into_iter().flatten().collect();
        if is_one_mount(&of_cycles) {
            return Ok(());
        }
        Err(Failure::new(format!(
            "by tf a joint moves the scanner relative to the camera while the bag is recorded ({scanner} to {camera})"
        ))
        .fix("record while it stands still: a calibration is of one mount"))
    }
}

fn read_camera(path: &Path) -> Result<CameraModel, Failure> {
    let within = |reason: String| Failure::new(format!("{}: {reason}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| within(error.to_string()))?;
    let file = calibration::camera_file::camera_from_yaml(&text)
        .map_err(|error| within(error.to_string()))?;
    Ok(file.camera)
}

fn no_camera(topics: &Topics) -> Failure {
    Failure::new(format!("no calibration of the camera could be read from {}", topics.camera_info))
        .fix("give one with --camera-file")
}

/// All images must be of the camera.
fn check_sizes(cycles: &ReadCycles, camera: &CameraModel) -> Result<(), Failure> {
    let (width_px, height_px) = (camera.width_px, camera.height_px);
    for image in cycles.cycles.iter().map(|cycle| &cycle.image) {
        if (image.width_px(), image.height_px()) != (width_px, height_px) {
            return Err(Failure::new(format!(
                "a depth image of {} x {} pixels does not fit a camera of {width_px} x {height_px}",
                image.width_px(),
                image.height_px()
            ))
            .fix("the calibration must be the one of the depth image"));
        }
    }
    Ok(())
}
