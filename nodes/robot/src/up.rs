//! `stillmap up`: the whole suite live, in one process. Messages between the nodes are not
//! serialised; other processes receive them over DDS.

mod detect;
mod parameters;
mod status;

use std::net::SocketAddr;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use detection::shell::DetectionParameters;
use lidar_odometry::shell::LidarOdometryParameters;
use live_view::shell::{FoxgloveServer, GraphOf, LiveView};
use node_shell::arguments::ParameterSource;
use node_shell::{Host, Node, NodeFailure, RosArguments, ShellError, Shutdown, Transport, log};
use pose::shell::PoseParameters;
use reconstruction::shell::ReconstructionParameters;
use segmentation::shell::SegmentationParameters;
use tokio::task::JoinSet;
use tracing::Instrument;

use crate::console;
use crate::failure::{Failure, Outcome};
use crate::run::Stage;
use crate::up::parameters::{OdometryParameters, SuiteParameters};
use crate::up::status::Status;
use crate::view::FoxgloveArgs;
use crate::{lidar, view, visual};

/// Arguments of `stillmap up`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap up --rig rplidar_a1_kinect_v1 --ros-args -r scan:=/laser/scan -p reconstruction:map_file:=map.ply

ROS arguments go to all nodes; a parameter to those that have it, or to the one named before it. Parameters that the nodes
share (-p method:=rec_hv, -p voxel_edge_m:=0.05) are given without a node.
The nodes end together, on Ctrl-C or SIGTERM.")]
pub struct UpArgs {
    /// A preset of the rig, or the path of a parameter file
    #[arg(long, default_value = PRESETS[0].name)]
    rig: String,
    /// A further node that publishes the pose for the others; without it the pose comes from another process
    #[arg(long, value_enum, value_name = "BY")]
    pose: Option<PoseNode>,
    /// Edge of the map's voxels, in metres; of the method free_space (default: map_edge_m of the parameters, or 0.02)
    #[arg(long, value_name = "METRES")]
    map_edge: Option<f64>,
    /// Serve the live view, a page for the browser: at this address, or for this machine alone; port 0 is a free one
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        num_args = 0..=1,
        default_missing_value = live_view::shell::DEFAULT_ADDRESS
    )]
    view: Option<SocketAddr>,
    #[command(flatten)]
    foxglove: FoxgloveArgs,
    /// Find topics, pose and mounts in the live graph, and print the command for them
    #[arg(long, conflicts_with = "pose")]
    detect: bool,
    /// With --detect: start the suite with what was found
    #[arg(long, requires = "detect")]
    yes: bool,
}

/// Threads of the runtime, at least: one for each of the four nodes, and one to receive.
const THREADS: usize = 5;

impl UpArgs {
    /// The arguments that go with those of a proposal.
    fn for_command(&self) -> Vec<String> {
        let rig = (self.rig != PRESETS[0].name).then(|| ["--rig".to_owned(), self.rig.clone()]);
        let edge = self.map_edge.map(|edge_m| ["--map-edge".to_owned(), edge_m.to_string()]);
        let view = self.view.map(|address| ["--view".to_owned(), address.to_string()]);
        let foxglove = self.foxglove.foxglove;
        let foxglove = foxglove.map(|address| ["--foxglove".to_owned(), address.to_string()]);
        rig.into_iter().chain(edge).chain(view).chain(foxglove).flatten().collect()
    }
}

/// The nodes that publish the pose.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum PoseNode {
    /// pose: from the images of a colour and depth camera
    Visual,
    /// lidar_odometry: from the scans of a 3D LiDAR
    Lidar,
}

/// A rig whose parameters are part of this program.
struct Preset {
    name: &'static str,
    parameters: &'static str,
}

const PRESETS: [Preset; 3] = [
    Preset {
        name: "rplidar_a1_kinect_v1",
        parameters: include_str!("../../../config/rig/rplidar_a1_kinect_v1.yaml"),
    },
    Preset {
        name: "rplidar_s2_realsense_d435",
        parameters: include_str!("../../../config/rig/rplidar_s2_realsense_d435.yaml"),
    },
    Preset { name: "hdl32e_car", parameters: include_str!("../../../config/rig/hdl32e_car.yaml") },
];

pub(crate) fn run(args: &UpArgs, ros: &RosArguments) -> Result<Outcome, Failure> {
    log::start("stillmap", &ros.log, &ros.outputs);
    ros.warn_of_options_without_effect();
    let edge = args.map_edge.map(|edge_m| ParameterSource::Assignment {
        node: None,
        name: "map_edge_m".to_owned(),
        value: format!("{edge_m:?}"),
    });
    let (rig, mut pose) = (rig(&args.rig)?, args.pose);
    let with_options = |mut arguments: RosArguments| {
        arguments.parameters.insert(0, rig.clone());
        arguments.parameters.extend(edge.clone());
        arguments
    };
    let mut arguments = with_options(ros.clone());
    let mut parameters = SuiteParameters::of(&arguments, pose, args.map_edge)?;
    if args.detect {
        let Some(proposal) = detect::detect(ros, &args.for_command())? else {
            console::note("interrupted: nothing was started");
            return Ok(Outcome::Interrupted);
        };
        if !args.yes {
            return Ok(Outcome::Complete);
        }
        arguments = with_options(detect::with_proposal(ros, &proposal)?);
        pose = proposal.pose;
        parameters = SuiteParameters::of(&arguments, pose, args.map_edge)?;
    }
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let runtime = tokio::runtime::Builder::new_multi_thread()
        // A node that computes keeps its thread: the others, and what receives for them, need theirs.
        .worker_threads(cores.max(THREADS))
        .enable_all()
        .build()
        .map_err(|error| Failure::new(format!("cannot start threads: {error}")))?;
    runtime.block_on(async {
        let viewers = (
            args.view.map(|address| view::listen(address, "--view")).transpose()?,
            args.foxglove.listen()?,
        );
        let nodes = Nodes::start(&arguments, parameters, viewers)
            .map_err(|error| Failure::of_node(&error))?;
        nodes.serve().await
    })
}

/// The parameters of a rig.
fn rig(name: &str) -> Result<ParameterSource, Failure> {
    if let Some(preset) = PRESETS.iter().find(|preset| preset.name == name) {
        let (name, yaml) = (preset.name.to_owned(), preset.parameters.to_owned());
        return Ok(ParameterSource::Text { name, yaml });
    }
    if Path::new(name).is_file() {
        return Ok(ParameterSource::File(PathBuf::from(name)));
    }
    let presets: Vec<&str> = PRESETS.iter().map(|preset| preset.name).collect();
    let failure = Failure::new(format!("--rig {name} is no preset and no file"))
        .fix(format!("presets are: {}", presets.join(", ")));
    // A file may be there at another start.
    let is_path = Path::new(name).components().count() > 1;
    Err(if is_path { failure } else { failure.for_good() })
}

/// All nodes of the suite, with their parameters.
struct Nodes {
    shutdown: Shutdown,
    detection: (Node, DetectionParameters),
    segmentation: (Node, SegmentationParameters),
    reconstruction: (Node, ReconstructionParameters),
    odometry: Option<Odometry>,
    view: Option<(Node, LiveView)>,
    foxglove: Option<(Node, FoxgloveServer)>,
}

/// The node that publishes the pose.
enum Odometry {
    Visual(Node, Box<PoseParameters>),
    Lidar(Node, Box<LidarOdometryParameters>),
}

impl Odometry {
    fn node(&self) -> PoseNode {
        match self {
            Self::Visual(..) => PoseNode::Visual,
            Self::Lidar(..) => PoseNode::Lidar,
        }
    }
}

impl Nodes {
    fn start(
        arguments: &RosArguments,
        parameters: SuiteParameters,
        (view, foxglove): (Option<LiveView>, Option<FoxgloveServer>),
    ) -> Result<Self, ShellError> {
        let host = Host::on(Transport::from_environment()?)?.started_again();
        let node = |stage: Stage| host.node(stage.name(), arguments);
        let [detection, segmentation, reconstruction] =
            [node(Stage::Detection)?, node(Stage::Segmentation)?, node(Stage::Reconstruction)?];
        let odometry = |parameters: OdometryParameters| -> Result<Odometry, ShellError> {
            let node = host.node(parameters.node().name(), arguments)?;
            Ok(match parameters {
                OdometryParameters::Visual(parameters) => Odometry::Visual(node, parameters),
                OdometryParameters::Lidar(parameters) => Odometry::Lidar(node, parameters),
            })
        };
        let view = view
            .map(|view| Ok::<_, ShellError>((host.node(live_view::shell::NODE, arguments)?, view)));
        let foxglove = foxglove.map(|server| {
            Ok::<_, ShellError>((host.node(live_view::shell::FOXGLOVE_NODE, arguments)?, server))
        });
        Ok(Self {
            view: view.transpose()?,
            foxglove: foxglove.transpose()?,
            odometry: parameters.odometry.map(odometry).transpose()?,
            shutdown: host.shutdown_signal(),
            detection: (detection, parameters.detection),
            segmentation: (segmentation, parameters.segmentation),
            reconstruction: (reconstruction, parameters.reconstruction),
        })
    }

    /// Serves until the process is to end, or until a node ends by itself: then the others end, too, since they need it.
    async fn serve(self) -> Result<Outcome, Failure> {
        let mut tasks = JoinSet::new();
        let status = Status::of([
            (Stage::Detection.name(), &self.detection.0),
            (Stage::Segmentation.name(), &self.segmentation.0),
            (Stage::Reconstruction.name(), &self.reconstruction.0),
        ]);
        let status = status.map_err(|error| Failure::new(error.to_string()))?;
        let status = tokio::spawn(status.show(self.shutdown.clone()));
        let (node, parameters) = self.detection;
        let span = node.span();
        let serve = async move {
            let result = detection::shell::serve(&node, parameters).await;
            node.close().await;
            (Stage::Detection.name(), result)
        };
        tasks.spawn(serve.instrument(span));
        let (node, parameters) = self.segmentation;
        let span = node.span();
        let serve = async move {
            let result = segmentation::shell::serve(&node, parameters).await;
            node.close().await;
            (Stage::Segmentation.name(), result)
        };
        tasks.spawn(serve.instrument(span));
        let (node, parameters) = self.reconstruction;
        let span = node.span();
        let serve = async move {
            let result = reconstruction::shell::serve(&node, parameters).await;
            node.close().await;
            (Stage::Reconstruction.name(), result)
        };
        tasks.spawn(serve.instrument(span));

        let pose: Vec<PoseNode> = self.odometry.iter().map(Odometry::node).collect();
        let shown = view::shown_nodes(&pose, false)?;
        // The nodes go on without it.
        let view = self.view.map(|(node, view)| {
            view::announce(&view);
            tokio::spawn(async {
                if let Err(reason) = view::serve(view, node, GraphOf::ThisProcess, shown).await {
                    tracing::error!("the live view has ended: {reason}");
                }
            })
        });

        let foxglove = self.foxglove.map(|(node, server)| {
            tokio::spawn(async {
                let served = view::serve_foxglove(server, node, GraphOf::ThisProcess);
                if let Err(reason) = served.await {
                    tracing::error!("the server for Foxglove has ended: {reason}");
                }
            })
        });

        match self.odometry {
            Some(Odometry::Visual(node, parameters)) => {
                let span = node.span();
                let serve = async move {
                    let result = pose::shell::serve(&node, *parameters).await;
                    node.close().await;
                    (PoseNode::Visual.name(), result)
                };
                tasks.spawn(serve.instrument(span));
            }
            Some(Odometry::Lidar(node, parameters)) => {
                let span = node.span();
                let serve = async move {
                    let result = lidar_odometry::shell::serve(&node, *parameters).await;
                    node.close().await;
                    (PoseNode::Lidar.name(), result)
                };
                tasks.spawn(serve.instrument(span));
            }
            None => {}
        }

        let mut failure = None;
        while let Some(ended) = tasks.join_next().await {
            self.shutdown.trigger();
            if let Err(error) = outcome(ended) {
                failure.get_or_insert(error);
            }
        }
        let _ended = status.await;
        for viewer in [view, foxglove].into_iter().flatten() {
            let _ended = viewer.await;
        }
        let failure = failure.or_else(|| self.shutdown.failure().map(Failure::new));
        failure.map_or(Ok(Outcome::Complete), Err)
    }
}

type Ended = Result<(&'static str, Result<(), NodeFailure>), tokio::task::JoinError>;

fn outcome(ended: Ended) -> Result<(), Failure> {
    match ended {
        Ok((_, Ok(()))) => Ok(()),
        Ok((name, Err(error))) => Err(Failure::of_body(&error).within(name)),
        Err(error) => Err(Failure::new(format!("a node failed: {error}"))),
    }
}

impl PoseNode {
    /// What stands behind `--pose`.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Visual => visual::VISUAL,
            Self::Lidar => lidar::LIDAR,
        }
    }

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Visual => visual::NODE,
            Self::Lidar => lidar::NODE,
        }
    }
}
