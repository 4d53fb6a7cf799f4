//! The pipeline over DDS: three nodes, that for the pose where it is asked for, and a player, each a process of its own, in a namespace that no
//! other run shares. This process only listens.

mod discovery;
mod feed;
mod player;

use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use msgs::geometry_msgs::PoseStamped;
use node_shell::{
    EVERY_CYCLE, Node, Qos, RAISE_RECEIVE_BUFFER, RosArguments, ShellError, Subscription,
};
use report::{RunRecord, Transport};

use self::feed::Feed;
use self::player::Sent;
use super::collector::{Collector, Seen};
use super::findings::LostOnTheWay;
use super::inputs::{Inputs, PoseSource, TF, TF_STATIC};
use super::parameters::PipelineParameters;
use super::recorder::{Recorder, RunName, Stage};
use crate::console;
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use crate::processes::Process;
use crate::progress::Progress;
use crate::visual;

/// When the player has ended and nothing has been heard for this long, nothing more will come: longer
/// than detection waits for the rest of a cycle.
const LONGEST_SILENCE: Duration = Duration::from_secs(5);
/// How often the processes are looked at while nothing is heard.
const LOOK_AGAIN: Duration = Duration::from_millis(50);

/// What a run over DDS yields.
pub(crate) struct DdsRun {
    pub(crate) record: RunRecord,
    /// Scans in which nothing could be found for want of returns.
    pub(crate) blind_scans: usize,
    /// Messages that the player sent and that never reached their node.
    pub(crate) lost: Vec<LostOnTheWay>,
    /// The rig's poses by the node for the pose, where it was asked for.
    pub(crate) poses: Option<Vec<PoseStamped>>,
    /// Why the run ended before its end, if it did.
    pub(crate) trouble: Option<Failure>,
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
            PoseSource::Topic(_) => None,
        };
        let (collector, poses) = listen_in(&namespace, visual.is_some())
            .map_err(|error| Failure::new(format!("cannot join the network: {error}")))?;
        let recorder = Recorder::new(parameters.reconstruction())
            .map_err(|error| Failure::new(error.to_string()))?;
        let granted = collector.granted_buffer();
        let feed = Feed::choose(playback.bag, inputs, parameters, granted);
        if let Some(compression) = &feed.compression {
            console::note(compression);
        }
        if let Some(too_large) = &feed.too_large {
            console::note(too_large.undone());
        }
        let mut run = Run {
            namespace,
            feed,
            collector,
            poses,
            heard_poses: Vec::new(),
            recorder,
            nodes: Vec::new(),
            lost: Vec::new(),
            interrupt: interrupt.clone(),
        };
        for stage in Stage::ALL {
            let input = (stage == Stage::Detection).then_some(run.feed.input);
            run.start_node(stage.name(), input, playback.parameters)?;
        }
        if let Some(topics) = visual {
            let input = if topics.is_compressed { "compressed" } else { "raw" };
            run.start_node(visual::NODE, Some(input), playback.parameters)?;
        }
        run.wait_for_discovery().await?;
        if run.interrupt.has_come() {
            return run.finish(playback, None).await;
        }
        let mut player = run.start_player(playback)?;
        let trouble = run.listen(&mut player, inputs, progress).await.err();
        run.finish(playback, trouble).await
    })
}

/// Poses that may wait for this process.
const WAITING_POSES: usize = 1000;

/// Joins the network in a namespace, to listen there; to poses, too, where nobody but the nodes has them.
fn listen_in(
    namespace: &str,
    with_poses: bool,
) -> Result<(Collector, Option<Subscription<PoseStamped>>), ShellError> {
    let arguments = RosArguments::parse([
        "--ros-args".to_owned(),
        "-r".to_owned(),
        format!("__ns:={namespace}"),
        "-r".to_owned(),
        format!("/diagnostics:={namespace}/diagnostics"),
    ])?;
    let node = Node::start("collector", &arguments)?;
    let to_poses = || node.subscription("pose", &Qos::reliable(WAITING_POSES));
    let poses = with_poses.then(to_poses).transpose()?;
    Ok((Collector::on(node)?, poses))
}

struct Run {
    namespace: String,
    feed: Feed,
    collector: Collector,
    poses: Option<Subscription<PoseStamped>>,
    heard_poses: Vec<PoseStamped>,
    recorder: Recorder,
    nodes: Vec<Process>,
    lost: Vec<LostOnTheWay>,
    /// Of the whole program: the node that listens takes signals only once it has started.
    interrupt: Interrupt,
}

impl Run {
    /// `input` says what the node's images or points come as, whatever its parameters say.
    fn start_node(
        &mut self,
        name: &'static str,
        input: Option<&str>,
        parameters: &Path,
    ) -> Result<(), Failure> {
        let mut arguments = vec!["node".to_owned(), name.to_owned()];
        arguments.extend(self.ros_arguments());
        for (name, played) in &self.feed.aliases {
            arguments.extend(["-r".to_owned(), format!("{name}:={played}")]);
        }
        arguments.extend(["--params-file".to_owned(), parameters.display().to_string()]);
        if let Some(input) = input {
            arguments.extend(["-p".to_owned(), format!("input:={input}")]);
        }
        let mut node = Process::this_program(name)?;
        let (variable, value) = EVERY_CYCLE;
        node.args(&arguments).env(variable, value).stdout(Stdio::null());
        self.nodes.push(Process::spawn(name, node)?);
        Ok(())
    }

    /// What keeps a process of this run to this run: its namespace, also for the topics that have one place for all
    /// namespaces. Of its log only trouble is of interest here.
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

    /// What a node's diagnostics say of one of its topics.
    fn says(&self, node: &str, what: &str, topic: &str) -> u64 {
        let namespace = &self.namespace;
        let node = format!("{namespace}/{node}");
        self.collector.seen().diagnostic(&node, &format!("{what} {namespace}/{topic}"))
    }

    /// Listens until the nodes have said all that there is to say.
    async fn listen(
        &mut self,
        player: &mut Process,
        inputs: &Inputs,
        progress: &Progress,
    ) -> Result<(), Failure> {
        let mut last_heard = Instant::now();
        let mut sent = None;
        loop {
            if self.hear_for(LOOK_AGAIN).await {
                last_heard = Instant::now();
                progress.set(self.collector.seen().scans_decided);
            }
            if self.interrupt.has_come() {
                player.stop()?;
                self.settle().await;
                return Ok(());
            }
            self.check()?;
            if sent.is_none() && player.ended()?.is_some() {
                sent = Some(Sent::by(player)?);
                last_heard = Instant::now();
            }
            let Some(sent) = &sent else { continue };
            if self.has_all(sent, inputs) || last_heard.elapsed() >= LONGEST_SILENCE {
                self.lost = self.losses(sent);
                for LostOnTheWay { topic, node, messages } in &self.lost {
                    let reason = format!("lost between player and {node}");
                    self.recorder.dropped(topic, &reason, *messages);
                }
                return Ok(());
            }
        }
    }

    /// Nothing is played any more: hears what is on its way, and the map that follows when the clouds pause.
    async fn settle(&mut self) {
        let deadline = Instant::now() + LONGEST_SILENCE;
        while Instant::now() < deadline && !self.has_last_map() {
            self.hear_for(LOOK_AGAIN).await;
        }
    }

    /// Whether every cycle has gone through, and the map holds the last one.
    fn has_last_map(&self) -> bool {
        let seen = self.collector.seen();
        self.recorder.incomplete_cycles() == 0
            && seen.map.as_ref().map(|(stamp, _)| *stamp) == seen.last_cloud
    }

    /// Hears one message, or none within a time. Diagnostics do not count as heard.
    async fn hear_for(&mut self, longest: Duration) -> bool {
        let heard = tokio::time::timeout(longest, self.collector.hear(&mut self.recorder)).await;
        while let Some(pose) = self.poses.as_ref().and_then(Subscription::try_next) {
            self.heard_poses.push((*pose.message).clone());
        }
        heard.unwrap_or(false)
    }

    /// Whether the run can go on: every node lives.
    fn check(&mut self) -> Result<(), Failure> {
        for node in &mut self.nodes {
            if let Some(status) = node.ended()? {
                return Err(Failure::new(format!("the node {} ended: {status}", node.name()))
                    .fix("its own message, if it could leave one, stands above; what was mapped until then is written"));
            }
        }
        Ok(())
    }

    /// Whether detection has all that was sent, every scan has been decided, every cycle has gone
    /// through, and the map holds the last one.
    fn has_all(&self, sent: &Sent, inputs: &Inputs) -> bool {
        let seen = self.collector.seen();
        self.losses(sent).is_empty()
            && seen.scans_decided >= sent.messages_on(&inputs.scan)
            && self.has_last_map()
    }

    async fn finish(
        mut self,
        playback: &Playback<'_>,
        trouble: Option<Failure>,
    ) -> Result<DdsRun, Failure> {
        let is_interrupted = self.interrupt.has_come();
        if trouble.is_some() || is_interrupted {
            self.recorder.dropped("bag", "the run ended before the bag did", 1);
        }
        for node in [Stage::Detection.name(), visual::NODE] {
            let node = format!("{}/{node}", self.namespace);
            for (cause, count) in self.collector.seen().drops_of(&node) {
                self.recorder.unusable(cause, count);
            }
        }
        let Self { collector, recorder, nodes, lost, poses, heard_poses, .. } = self;
        let poses = poses.map(|_| heard_poses);
        let mut trouble = trouble;
        for mut node in nodes {
            let status = node.stop()?;
            if !status.success() && trouble.is_none() {
                trouble =
                    Some(Failure::new(format!("the node {} ended badly: {status}", node.name())));
            }
        }
        let Seen { map, last_cloud, .. } = collector.close().await;
        if map.as_ref().map(|(stamp, _)| *stamp) != last_cloud
            && trouble.is_none()
            && !is_interrupted
        {
            trouble = Some(
                Failure::new("the last map did not arrive: the one that is written is older")
                    .fix(format!("a large map needs room on its way: `{RAISE_RECEIVE_BUFFER}`")),
            );
        }
        let name = RunName {
            bag_name: playback.bag_name.to_owned(),
            transport: Transport::Dds,
            map_frame_id: recorder.map_frame_id(),
        };
        let static_map = map.map(|(_, points_m)| points_m).unwrap_or_default();
        let blind_scans = recorder.blind_scans();
        let record = recorder.finish(static_map, name);
        Ok(DdsRun { record, blind_scans, lost, poses, trouble, is_interrupted })
    }
}
