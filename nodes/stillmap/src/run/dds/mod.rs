//! The pipeline over DDS: three nodes and a player, each a process of its own, in a namespace that no
//! other run shares. This process only listens.

mod feed;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use evaluation::{RunRecord, Transport};
use node_shell::{Node, RAISE_RECEIVE_BUFFER, RosArguments, ShellError};

use self::feed::{FedTopic, Feed};
use super::collector::{Collector, Seen};
use super::inputs::{Inputs, TF, TF_STATIC};
use super::parameters::PipelineParameters;
use super::recorder::{Recorder, RunName, Stage};
use crate::console;
use crate::failure::Failure;
use crate::processes::Process;
use crate::progress::Progress;

/// The nodes must have found each other after this time; on one host it takes a fraction of a second.
const LONGEST_DISCOVERY: Duration = Duration::from_secs(30);
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
    /// Messages that the player sent and detection never received.
    pub(crate) lost_messages: u64,
    /// Why the run ended before its end, if it did.
    pub(crate) trouble: Option<Failure>,
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
    progress: &Progress,
) -> Result<DdsRun, Failure> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| Failure::new(format!("cannot start threads: {error}")))?;
    runtime.block_on(async {
        let namespace = format!("/stillmap_run_{}", std::process::id());
        let collector = listen_in(&namespace)
            .map_err(|error| Failure::new(format!("cannot join the network: {error}")))?;
        let recorder = Recorder::new(parameters.reconstruction(), parameters.method_name())
            .map_err(|error| Failure::new(error.to_string()))?;
        let feed = Feed::choose(playback.bag, inputs, collector.granted_buffer());
        if let Some(compression) = &feed.compression {
            console::note(compression);
        }
        let mut run =
            Run { namespace, feed, collector, recorder, nodes: Vec::new(), lost_messages: 0 };
        for stage in Stage::ALL {
            run.start_node(stage, playback.parameters)?;
        }
        run.wait_for_discovery().await?;
        let mut player = run.start_player(playback)?;
        let trouble = run.listen(&mut player, inputs, progress).await.err();
        run.finish(playback, trouble).await
    })
}

/// Joins the network in a namespace, to listen there.
fn listen_in(namespace: &str) -> Result<Collector, ShellError> {
    let arguments = RosArguments::parse([
        "--ros-args".to_owned(),
        "-r".to_owned(),
        format!("__ns:={namespace}"),
        "-r".to_owned(),
        format!("/diagnostics:={namespace}/diagnostics"),
    ])?;
    Collector::on(Node::start("collector", &arguments)?)
}

struct Run {
    namespace: String,
    feed: Feed,
    collector: Collector,
    recorder: Recorder,
    nodes: Vec<Process>,
    lost_messages: u64,
}

impl Run {
    fn start_node(&mut self, stage: Stage, parameters: &Path) -> Result<(), Failure> {
        let mut arguments = vec!["node".to_owned(), stage.name().to_owned()];
        arguments.extend(self.ros_arguments());
        arguments.extend(["--params-file".to_owned(), parameters.display().to_string()]);
        if stage == Stage::Detection {
            arguments.extend(["-p".to_owned(), format!("input:={}", self.feed.input)]);
        }
        self.nodes.push(Process::start(stage.name(), &arguments, Stdio::null())?);
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

    /// Waits until every node has found those that it sends to and receives from, this process included.
    async fn wait_for_discovery(&mut self) -> Result<(), Failure> {
        let deadline = Instant::now() + LONGEST_DISCOVERY;
        loop {
            let missing = self.undiscovered();
            if missing.is_empty() {
                return Ok(());
            }
            self.check()?;
            if Instant::now() >= deadline {
                return Err(Failure::new(format!(
                    "the nodes have not found each other within {} s; missing: {}",
                    LONGEST_DISCOVERY.as_secs(),
                    missing.join(", ")
                ))
                .mend("multicast on the loopback interface may be off or filtered; `--transport local` needs none"));
            }
            self.hear_for(LOOK_AGAIN).await;
        }
    }

    /// Connections of the pipeline that no node reports yet, as `node topic`.
    fn undiscovered(&self) -> Vec<String> {
        // Node, its own diagnostic, and the peers that it must have: the next node and this process.
        let connections = [
            (Stage::Detection, "subscribers", "reduced_cloud", 2),
            (Stage::Detection, "subscribers", "detection/report", 1),
            (Stage::Segmentation, "publishers", "reduced_cloud", 1),
            (Stage::Segmentation, "subscribers", "segmented_cloud", 1),
            (Stage::Segmentation, "subscribers", "dynamic_cloud", 1),
            (Stage::Segmentation, "subscribers", "segmentation/report", 1),
            (Stage::Reconstruction, "publishers", "segmented_cloud", 1),
            (Stage::Reconstruction, "subscribers", "static_map", 1),
            (Stage::Reconstruction, "subscribers", "reconstruction/report", 1),
        ];
        connections
            .into_iter()
            .filter(|(stage, peers, topic, least)| self.says(*stage, peers, topic) < *least)
            .map(|(stage, peers, topic, _)| format!("{peers} of {topic} at {}", stage.name()))
            .collect()
    }

    /// What a node's diagnostics say of one of its topics.
    fn says(&self, stage: Stage, what: &str, topic: &str) -> u64 {
        let namespace = &self.namespace;
        let node = format!("{namespace}/{}", stage.name());
        self.collector.seen().diagnostic(&node, &format!("{what} {namespace}/{topic}"))
    }

    fn start_player(&self, playback: &Playback<'_>) -> Result<Process, Failure> {
        let mut arguments = vec!["play".to_owned(), playback.bag.display().to_string()];
        arguments.extend(["--json".to_owned(), "--rate".to_owned(), playback.rate.to_string()]);
        // Its output is read after its end only: the summary is shorter than what a pipe holds.
        for topic in &self.feed.topics {
            let bag_topic = &topic.bag_topic;
            let to = format!("{}/{}", self.namespace, topic.played_name);
            arguments.extend(["--topics".to_owned(), bag_topic.clone()]);
            arguments.extend(["--remap".to_owned(), format!("{bag_topic}:={to}")]);
            if topic.is_compressed {
                arguments.extend(["--compress-depth".to_owned(), bag_topic.clone()]);
            }
            let awaited = format!("{}/{}", self.namespace, topic.node_name());
            arguments.extend(["--wait-for".to_owned(), awaited]);
        }
        arguments.extend(self.ros_arguments());
        Process::start("player", &arguments, Stdio::piped())
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
            self.check()?;
            if sent.is_none() && player.ended()?.is_some() {
                sent = Some(Sent::by(player)?);
                last_heard = Instant::now();
            }
            let Some(sent) = &sent else { continue };
            if self.has_all(sent, inputs) || last_heard.elapsed() >= LONGEST_SILENCE {
                for (topic, lost) in self.losses(sent) {
                    self.recorder.dropped(&topic, "lost between player and detection", lost);
                    self.lost_messages += lost;
                }
                return Ok(());
            }
        }
    }

    /// Hears one message, or none within a time. Diagnostics do not count as heard.
    async fn hear_for(&mut self, longest: Duration) -> bool {
        let heard = tokio::time::timeout(longest, self.collector.hear(&mut self.recorder)).await;
        heard.unwrap_or(false)
    }

    /// Whether the run can go on: nobody has interrupted it, and every node lives.
    fn check(&mut self) -> Result<(), Failure> {
        // On a terminal the nodes have had the same signal, and their ends are no news.
        if self.collector.is_interrupted() {
            return Err(Failure::new("interrupted; what was mapped until then is written"));
        }
        for node in &mut self.nodes {
            if let Some(status) = node.ended()? {
                return Err(Failure::new(format!("the node {} ended: {status}", node.name()))
                    .mend("its own message, if it could leave one, stands above; what was mapped until then is written"));
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
            && self.recorder.incomplete_cycles() == 0
            && seen.map.as_ref().map(|(stamp, _)| *stamp) == seen.last_cloud
    }

    /// What the player sent and detection has not received, by topic. Diagnostics come once a second, so
    /// that messages may be missing here for a moment only.
    fn losses(&self, sent: &Sent) -> Vec<(String, u64)> {
        let lost = |topic: &FedTopic| {
            let received = self.says(Stage::Detection, "received", &topic.node_name());
            let bag_topic = topic.bag_topic.clone();
            let sent = sent.messages_on(&bag_topic);
            (bag_topic, sent.saturating_sub(received))
        };
        self.feed.topics.iter().map(lost).filter(|(_, lost)| *lost > 0).collect()
    }

    async fn finish(
        mut self,
        playback: &Playback<'_>,
        trouble: Option<Failure>,
    ) -> Result<DdsRun, Failure> {
        if trouble.is_some() {
            self.recorder.dropped("bag", "the run ended before the bag did", 1);
        }
        let detection = format!("{}/{}", self.namespace, Stage::Detection.name());
        for (cause, count) in self.collector.seen().drops_of(&detection) {
            self.recorder.unusable(cause, count);
        }
        let Self { collector, recorder, nodes, lost_messages, .. } = self;
        let mut trouble = trouble;
        for mut node in nodes {
            let status = node.stop()?;
            if !status.success() && trouble.is_none() {
                trouble =
                    Some(Failure::new(format!("the node {} ended badly: {status}", node.name())));
            }
        }
        let Seen { map, last_cloud, .. } = collector.close().await;
        if map.as_ref().map(|(stamp, _)| *stamp) != last_cloud && trouble.is_none() {
            trouble = Some(
                Failure::new("the last map did not arrive: the one that is written is older")
                    .mend(format!("a large map needs room on its way: `{RAISE_RECEIVE_BUFFER}`")),
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
        Ok(DdsRun { record, blind_scans, lost_messages, trouble })
    }
}

/// What the player sent, by the bag's own topic names.
struct Sent {
    messages: BTreeMap<String, u64>,
}

impl Sent {
    /// What a player that has ended says that it sent.
    fn by(player: &mut Process) -> Result<Self, Failure> {
        let output = player.output()?;
        let summary: PlayedTopics = serde_json::from_str(&output).map_err(|_| {
            Failure::new("the player ended without playing the bag")
                .mend("its own message stands above")
        })?;
        let messages =
            summary.topics.into_iter().map(|topic| (topic.topic, topic.published)).collect();
        Ok(Self { messages })
    }

    fn messages_on(&self, topic: &str) -> u64 {
        self.messages.get(topic).copied().unwrap_or(0)
    }
}

/// The part of the player's summary that is of interest here.
#[derive(serde::Deserialize)]
struct PlayedTopics {
    topics: Vec<PlayedTopic>,
}

#[derive(serde::Deserialize)]
struct PlayedTopic {
    topic: String,
    published: u64,
}
