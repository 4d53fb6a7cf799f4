//! The `frame_id` of messages.

use std::collections::BTreeSet;

use super::{Check, Finding, Subject};

/// Names that are kept at most.
const MOST_NAMES: usize = 4;

/// The frames of a topic's messages.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Frames {
    messages: u64,
    empty: u64,
    names: BTreeSet<String>,
}

impl Frames {
    pub(super) fn take(&mut self, frame_id: &str) {
        self.messages += 1;
        if frame_id.is_empty() {
            self.empty += 1;
        } else if self.names.len() < MOST_NAMES && !self.names.contains(frame_id) {
            self.names.insert(frame_id.to_owned());
        }
    }

    /// The one name of all messages.
    pub(super) fn only(&self) -> Option<&str> {
        match (self.empty, self.names.len()) {
            (0, 1) => self.names.first().map(String::as_str),
            _ => None,
        }
    }

    pub(super) fn findings(&self, subject: &Subject<'_>) -> Vec<Finding> {
        let Self { messages, empty, names } = self;
        let topic = subject.topic;
        let mut findings = Vec::new();
        if *empty > 0 {
            findings.push(subject.grave(
                Check::Frames,
                format!("{topic}: frame_id is empty in {empty} of {messages} messages"),
                "set the frame in the driver's parameters (frame_id), and publish its mount on /tf_static",
            ));
        }
        let slashed: Vec<&str> =
            names.iter().filter(|name| name.starts_with('/')).map(String::as_str).collect();
        if !slashed.is_empty() {
            findings.push(Finding::warn(
                Check::Frames,
                format!(
                    "{topic}: the frame {} has a leading slash, which tf2 refuses",
                    slashed.join(", ")
                ),
                "set the frame without the slash in the driver's parameters (frame_id)",
            ));
        }
        if names.len() > 1 {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            findings.push(Finding::warn(
                Check::Frames,
                format!("{topic}: the frame changes among {}", names.join(", ")),
                "see that one driver alone publishes the topic; give each sensor a topic of its own",
            ));
        }
        findings
    }
}
