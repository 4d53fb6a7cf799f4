//! The player of a run: its arguments, what it reports to have sent, and what of that was lost.

use std::collections::BTreeMap;
use std::process::Stdio;

use super::discovery::LONGEST_DISCOVERY;
use super::feed::{Compressed, FedTopic};
use super::{Playback, Run, pacing};
use crate::failure::Failure;
use crate::processes::Process;
use crate::run::findings::LostMessages;
use crate::run::view_topics::COMPRESSED_DEPTH;
use crate::visual;

impl Run {
    pub(super) fn start_player(&self, playback: &Playback<'_>) -> Result<Process, Failure> {
        let mut arguments = vec!["play".to_owned(), playback.bag.display().to_string()];
        arguments.extend(["--json".to_owned(), "--rate".to_owned(), playback.rate.to_string()]);
        let wait_timeout_s = LONGEST_DISCOVERY.as_secs().to_string();
        arguments.extend(["--wait-timeout".to_owned(), wait_timeout_s]);
        // Its output is read after its end only: the summary is shorter than what a pipe holds.
        for topic in &self.feed.topics {
            let bag_topic = &topic.bag_topic;
            let to = format!("{}/{}", self.namespace, topic.played_name);
            arguments.extend(["--topics".to_owned(), bag_topic.clone()]);
            arguments.extend(["--remap".to_owned(), format!("{bag_topic}:={to}")]);
            match topic.compressed {
                Some(Compressed::Depth) => {
                    arguments.extend(["--compress-depth".to_owned(), bag_topic.clone()]);
                }
                Some(Compressed::Colour) => {
                    arguments.extend(["--compress-color".to_owned(), format!("{bag_topic}=png")]);
                }
                None => {}
            }
            let awaited = format!("{}/{}", self.namespace, topic.received_name());
            arguments.extend(["--wait-for".to_owned(), awaited]);
        }
        let views = ["depth/image", COMPRESSED_DEPTH, "points"];
        let is_view = |topic: &&FedTopic| topic.names.iter().any(|name| views.contains(name));
        if let Some(views) = self.feed.topics.iter().find(is_view) {
            let pace = format!("{}={}/{}", views.bag_topic, self.namespace, pacing::TOPIC);
            arguments.extend(["--pace".to_owned(), pace]);
        }
        // The pose node is the slowest; the player waits for it so that no images are lost.
        let images = self.feed.topics.iter().find(|topic| topic.names.contains(&"depth/image"));
        if let Some(images) = images.filter(|_| self.poses.is_some()) {
            let reports = format!("{}/{}/report", self.namespace, visual::NODE);
            arguments.extend(["--pace".to_owned(), format!("{}={reports}", images.bag_topic)]);
        }
        arguments.extend(self.ros_arguments());
        Process::start("player", &arguments, Stdio::piped())
    }

    /// What the player sent and its node has not received, by topic and node. Diagnostics are published once a second, so
    /// messages may be missing here for up to a second.
    pub(super) fn losses(&self, sent: &Sent) -> Vec<LostMessages> {
        let lost = |topic: &FedTopic| {
            let received = self.diagnostic(topic.node, "received", &topic.received_name());
            let bag_topic = topic.bag_topic.clone();
            let messages = sent.messages_on(&bag_topic).saturating_sub(received);
            LostMessages { topic: bag_topic, node: topic.node, messages }
        };
        self.feed.topics.iter().map(lost).filter(|lost| lost.messages > 0).collect()
    }
}

/// What the player sent, by the bag's own topic names.
pub(super) struct Sent {
    messages: BTreeMap<String, u64>,
}

impl Sent {
    /// What a player that has ended reports to have sent.
    pub(super) fn by(player: &mut Process) -> Result<Self, Failure> {
        let output = player.output()?;
        let summary: PlayedTopics = serde_json::from_str(&output).map_err(|_| {
            Failure::new("the player ended without playing the bag").fix("its own message is above")
        })?;
        let messages =
            summary.topics.into_iter().map(|topic| (topic.topic, topic.published)).collect();
        Ok(Self { messages })
    }

    pub(super) fn messages_on(&self, topic: &str) -> u64 {
        self.messages.get(topic).copied().unwrap_or(0)
    }
}

/// The part of the player's summary that is used here.
#[derive(serde::Deserialize)]
struct PlayedTopics {
    topics: Vec<PlayedTopic>,
}

#[derive(serde::Deserialize)]
struct PlayedTopic {
    topic: String,
    published: u64,
}
