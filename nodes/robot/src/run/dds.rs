//! The pipeline over DDS: three nodes, the pose node if it is used, and a player, each a process of its own, in a namespace
//! that no other run has. This process only subscribes.

mod discovery;
mod feed;
mod pacing;
mod player;

use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use detection::shell::DetectionParameters;
use geometry::{ColouredCloud, OrientedPoints};
use msgs::geometry_msgs::PoseStamped;
use node_shell::{EVERY_CYCLE, Node, Qos, RosArguments, ShellError, Subscription};
use reconstruction::BoundReached;
use report::{RunRecord, Transport};

use self::feed::Feed;
use self::pacing::Pacing;
use self::player::Sent;
use super::collector::{CollectedState, Collector};
use super::findings::{DoubtfulInput, LostMessages};
use super::inputs::{Inputs, TF, TF_STATIC};
use super::parameters::PipelineParameters;
use super::pose_topics::PoseSource;
use super::recorder::{Recorder, RunName, Stage};
use crate::console;
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use crate::map_file::MapFile;
use crate::processes::Process;
use crate::progress::Progress;
use crate::visual;

/// When the player has ended and nothing was received for this long, what is missing is lost. Only a run that has lost
/// something waits for it: it is longer than a machine that is out of CPU time lets the nodes stand still.
const LONGEST_SILENCE: Duration = Duration::from_secs(20);
/// After an interrupt the nodes have this long to finish what they have received.
const LONGEST_END: Duration = Duration::from_secs(5);
/// A period that no run lasts for, within the range of the parameter: the node saves its files when it ends.
const NEVER_S: f64 = 1e9;
/// A node that saves the map may take so long to end: 10 million points with their triangles on a slow disk.
const LONGEST_SAVE: Duration = Duration::from_secs(60);
/// How often the processes are checked while nothing is received.
const POLL_PERIOD: Duration = Duration::from_millis(50);

/// What a run over DDS yields.
pub(crate) struct DdsRun {
    pub(crate) record: RunRecord,
    pub(crate) doubtful: DoubtfulInput,
    /// The bounds that have kept something out of the map.
    pub(crate) bounds_reached: Vec<BoundReached>,
    /// Messages that the player sent and that their node did not receive.
    pub(crate) lost: Vec<LostMessages>,
    /// The rig's poses, if the pose node was used.
    pub(crate) poses: Option<Vec<PoseStamped>>,
    /// Why the run ended before the end of the bag, if it did.
    pub(crate) failure: Option<Failure>,
    /// Whether a signal has ended it before the end of the bag.
    pub(crate) is_interrupted: bool,
}

/// How to play.
pub(crate) struct Playback<'a> {
    pub(crate) bag: &'a Path,
    pub(crate) bag_name: &'a str,
    pub(crate) rate: f64,
    /// The parameters of the nodes.
    pub(crate) parameters: &'a Path,
    /// Where the node of the map saves that when it ends: a `.ply` file that does not exist yet.
    pub(crate) map_file: &'a Path,
    /// Where the node of the map saves the occupancy grid, if there is to be one.
    pub(crate) grid_file: Option<&'a Path>,
    /// Where it saves the triangles, if there are to be some.
    pub(crate) mesh_file: Option<&'a Path>,
}

/// Runs a bag through the nodes.
pub(crate) fn run(
    playback: &Playback<'_>,
    inputs: &Inputs,
    parameters: &PipelineParameters,
    (progress, interrupt): (&Progress, &Interrupt),
) -> Result<DdsRun, Failure> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| Failure::new(format!("cannot start threads: {error}")))?;
    runtime.block_on(async {
        let namespace = format!("/stillmap_run_{}", std::process::id());
        let visual = match &inputs.pose {
            PoseSource::Visual(topics) => Some(topics),
            PoseSource::Topic { .. } | PoseSource::Tf => None,
        };
        let detection = DetectionParameters {
            input: inputs.view.input(),
            ..parameters.detection_node().clone()
        };
        let Subscribed { collector, poses, pacing } = subscribe_in(&namespace, inputs, &detection)
            .map_err(|error| Failure::new(format!("cannot join the network: {error}")))?;
        let recorder = Recorder::new(parameters.reconstruction())
            .map_err(|error| Failure::new(error.to_string()))?;
        let granted = collector.granted_buffer();
        let feed = Feed::choose(playback.bag, inputs, parameters, granted);
        if let Some(compression) = &feed.compression {
            console::note(compression);
        }
        if let Some(too_large) = &feed.too_large {
            console::note(too_large.uncompressed_note());
        }
        let mut run = Run {
            namespace,
            remappings: feed::remappings(inputs),
            feed,
            collector,
            pacing,
            poses,
            received_poses: Vec::new(),
            recorder,
            nodes: Vec::new(),
            lost: Vec::new(),
            interrupt: interrupt.clone(),
        };
        for stage in Stage::ALL {
            let colour = run.feed.colour.map(|colour| ("colour", colour.to_owned()));
            let overrides: Vec<(&str, String)> = match stage {
                Stage::Detection => {
                    [("input", run.feed.input.to_owned())].into_iter().chain(colour).collect()
                }
                Stage::Segmentation => Vec::new(),
                Stage::Reconstruction => {
                    let files = [
                        ("map_file", Some(playback.map_file)),
                        ("grid_file", playback.grid_file),
                        ("mesh_file", playback.mesh_file),
                    ];
                    let named = |(name, file): (_, Option<&Path>)| {
                        file.map(|file| (name, file.display().to_string()))
                    };
                    let at_the_end = ("map_save_period_s", format!("{NEVER_S:?}"));
                    files.into_iter().filter_map(named).chain([at_the_end]).collect()
                }
            };
            run.start_node(stage.name(), &overrides, playback.parameters)?;
        }
        if let Some(topics) = visual {
            let input = if topics.is_compressed { "compressed" } else { "raw" };
            run.start_node(visual::NODE, &[("input", input.to_owned())], playback.parameters)?;
        }
        run.wait_for_discovery().await?;
        if run.interrupt.has_come() {
            return run.finish(playback, None).await;
        }
        let mut player = run.start_player(playback)?;
        let failure = run.listen(&mut player, inputs, progress).await.err();
        run.finish(playback, failure).await
    })
}

/// Poses that may wait for this process.
const WAITING_POSES: usize = 1000;

/// Joins the network in a namespace and subscribes there; to poses as well, if the run computes them.
fn subscribe_in(
    namespace: &str,
    inputs: &Inputs,
    detection: &DetectionParameters,
) -> Result<Subscribed, ShellError> {
    let own = [format!("__ns:={namespace}"), format!("/diagnostics:={namespace}/diagnostics")];
    let rules = own.into_iter().chain(feed::remappings(inputs));
    let rules = rules.flat_map(|rule| ["-r".to_owned(), rule]);
    let arguments = RosArguments::parse(std::iter::once("--ros-args".to_owned()).chain(rules))?;
    let node = Node::start("collector", &arguments)?;
    let to_poses = || node.subscription("pose", &Qos::reliable(WAITING_POSES));
    let poses = (!inputs.has_poses_of_bag()).then(to_poses).transpose()?;
    let pacing = Pacing::listen(&node)?;
    Ok(Subscribed { poses, pacing, collector: Collector::on(node, detection)? })
}

/// The subscriptions of this process.
struct Subscribed {
    collector: Collector,
    poses: Option<Subscription<PoseStamped>>,
    pacing: Pacing,
}

struct Run {
    namespace: String,
    /// By which the nodes find what the player plays.
    remappings: Vec<String>,
    feed: Feed,
    collector: Collector,
    pacing: Pacing,
    poses: Option<Subscription<PoseStamped>>,
    received_poses: Vec<PoseStamped>,
    recorder: Recorder,
    nodes: Vec<Process>,
    lost: Vec<LostMessages>,
    /// The interrupt of the whole program: the collector's node handles signals only once it has started.
    interrupt: Interrupt,
}

impl Run {
    /// `overrides` are parameters of the node, in place of those in the file.
    fn start_node(
        &mut self,
        name: &'static str,
        overrides: &[(&str, String)],
        parameters: &Path,
    ) -> Result<(), Failure> {
        let mut arguments = vec!["node".to_owned(), name.to_owned()];
        arguments.extend(self.ros_arguments());
        for rule in &self.remappings {
            arguments.extend(["-r".to_owned(), rule.clone()]);
        }
        arguments.extend(["--params-file".to_owned(), parameters.display().to_string()]);
        for (name, value) in overrides {
            arguments.extend(["-p".to_owned(), format!("{name}:={value}")]);
        }
        let mut node = Process::this_program(name)?;
        let (variable, value) = EVERY_CYCLE;
        node.args(&arguments).env(variable, value).stdout(Stdio::null());
        self.nodes.push(Process::spawn(name, node)?);
        Ok(())
    }

    /// The arguments that separate the processes of this run from others: its namespace, also for the topics with absolute
    /// names. Their logs are limited to warnings.
    fn ros_arguments(&self) -> Vec<String> {
        let namespace = &self.namespace;
        let mut arguments = vec!["--ros-args".to_owned()];
        arguments.extend(["-r".to_owned(), format!("__ns:={namespace}")]);
        for topic in ["/diagnostics", TF_STATIC, TF] {
            arguments.extend(["-r".to_owned(), format!("{topic}:={namespace}{topic}")]);
        }
        arguments.extend(["--log-level".to_owned(), "warn".to_owned()]);
        arguments
    }

    /// A number that a node's diagnostics report about one of its topics.
    fn diagnostic(&self, node: &str, what: &str, topic: &str) -> u64 {
        let namespace = &self.namespace;
        let node = format!("{namespace}/{node}");
        self.collector.seen().diagnostic(&node, &format!("{what} {namespace}/{topic}"))
    }

    /// Receives until the nodes have processed all that was sent.
    async fn listen(
        &mut self,
        player: &mut Process,
        inputs: &Inputs,
        progress: &Progress,
    ) -> Result<(), Failure> {
        let mut last_received = Instant::now();
        let mut sent = None;
        loop {
            if self.receive_for(POLL_PERIOD).await {
                last_received = Instant::now();
                progress.set(self.collector.seen().scans_decided);
            }
            if self.interrupt.has_come() {
                player.stop()?;
                self.receive_last_map().await;
                return Ok(());
            }
            self.check()?;
            if !self.pacing.has_started() && self.hear_the_player() {
                let started = self.pacing.start(self.collector.node());
                started.map_err(|error| Failure::new(error.to_string()))?;
            }
            if sent.is_none() && player.ended()?.is_some() {
                sent = Some(Sent::by(player)?);
                last_received = Instant::now();
            }
            let Some(sent) = &sent else { continue };
            if self.has_all(sent, inputs) || last_received.elapsed() >= LONGEST_SILENCE {
                self.lost = self.losses(sent);
                for LostMessages { topic, node, messages } in &self.lost {
                    let reason = format!("lost between player and {node}");
                    self.recorder.dropped(topic, &reason, *messages);
                }
                return Ok(());
            }
        }
    }

    /// After the player has stopped: receives the remaining messages, and the map that follows when no more clouds arrive.
    async fn receive_last_map(&mut self) {
        let deadline = Instant::now() + LONGEST_END;
        while Instant::now() < deadline && !self.has_last_map() {
            self.receive_for(POLL_PERIOD).await;
        }
    }

    /// Whether every stage has reported every cycle, and the map includes the last one.
    fn has_last_map(&self) -> bool {
        let seen = self.collector.seen();
        self.recorder.incomplete_cycles() == 0
            && seen.map.as_ref().map(|(stamp, _)| *stamp) == seen.last_cloud
    }

    /// Receives one message, or none within a time; returns whether one about a cycle was received.
    async fn receive_for(&mut self, longest: Duration) -> bool {
        let received = tokio::select! {
            received = self.collector.receive(&mut self.recorder) => received,
            report = self.pacing.next() => {
                self.pacing.take(report);
                false
            }
            () = tokio::time::sleep(longest) => false,
        };
        self.pacing.pass_on(self.recorder.cycles_ahead());
        while let Some(pose) = self.poses.as_ref().and_then(Subscription::try_next) {
            self.received_poses.push((*pose.message).clone());
        }
        received
    }

    /// An error if a node has ended.
    fn check(&mut self) -> Result<(), Failure> {
        for node in &mut self.nodes {
            if let Some(status) = node.ended()? {
                return Err(Failure::new(format!("the node {} ended: {status}", node.name()))
                    .fix("its own message, if there is one, is above; what was mapped until then is written"));
            }
        }
        Ok(())
    }

    /// Whether the nodes have received all that was sent, every scan was processed or dropped, every stage has reported
    /// every cycle, and the map includes the last one.
    fn has_all(&self, sent: &Sent, inputs: &Inputs) -> bool {
        let seen = self.collector.seen();
        self.losses(sent).is_empty()
            && seen.scans_decided >= sent.messages_on(&inputs.scan)
            && self.has_last_map()
    }

    async fn finish(
        mut self,
        playback: &Playback<'_>,
        failure: Option<Failure>,
    ) -> Result<DdsRun, Failure> {
        let is_interrupted = self.interrupt.has_come();
        if failure.is_some() || is_interrupted {
            self.recorder.dropped("bag", "the run ended before the bag did", 1);
        }
        for node in [Stage::Detection.name(), visual::NODE] {
            let node = format!("{}/{node}", self.namespace);
            for (cause, count) in self.collector.seen().drops_of(&node) {
                self.recorder.unusable(cause, count);
            }
        }
        let Self { collector, recorder, nodes, lost, poses, pacing, received_poses, .. } = self;
        let poses = poses.map(|_| received_poses);
        drop(pacing);
        let mut failure = failure;
        for mut node in nodes {
            let status = node.stop_within(LONGEST_SAVE)?;
            if !status.success() && failure.is_none() {
                failure = Some(Failure::new(format!("the node {} failed: {status}", node.name())));
            }
        }
        let CollectedState { map, last_cloud, .. } = collector.close().await;
        let name = RunName {
            bag_name: playback.bag_name.to_owned(),
            transport: Transport::Dds,
            map_frame_id: recorder.map_frame_id(),
        };
        let has_last_map = map.as_ref().map(|(stamp, _)| *stamp) == last_cloud;
        let map = match MapFile::read(playback.map_file) {
            // Unlike the cloud that its node publishes it has normals and views, and it arrives whatever its size.
            Ok(saved) => saved,
            // The node has ended before it saved: what it has published last is left.
            Err(unread) => {
                if failure.is_none() && !is_interrupted && !has_last_map {
                    failure = Some(Failure::new(format!(
                        "the map that is written is not the last one: reconstruction has not saved it ({unread})"
                    )));
                }
                let ColouredCloud { cloud, colours } = map.map(|(_, map)| map).unwrap_or_default();
                let points_m = cloud.points_m;
                let points = OrientedPoints { points_m, colours, ..OrientedPoints::default() };
                MapFile { points, ..MapFile::default() }
            }
        };
        let (doubtful, bounds_reached) = (recorder.doubtful(), recorder.bounds_reached());
        let record = recorder.finish(map, name);
        Ok(DdsRun { record, doubtful, bounds_reached, lost, poses, failure, is_interrupted })
    }
}
