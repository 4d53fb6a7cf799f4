//! The state of the nodes, of their own diagnostics.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use serde_json::{Value, json};
use tokio::time::Instant;

use crate::LiveMap;

/// Names that are shown, at most: more would be somebody's who floods the topic.
const MOST_NODES: usize = 64;
/// A name that was not heard for longer gives its place to another one: nodes report once a second. The page shows them as silent.
const GONE: Duration = Duration::from_secs(5);
/// The node whose state the page's button needs.
const DETECTION: &str = "detection";
/// Figures of a node that are shown, at most.
const MOST_FIGURES: usize = 200;
/// Characters of a text that is shown, at most.
const LONGEST_TEXT: usize = 400;

/// What the nodes have last said of themselves.
#[derive(Default)]
pub(super) struct Status {
    /// The namespace of the view, without a slash at its end.
    namespace: String,
    /// The names of the nodes that the view is of: they have a place whoever else is on the topic.
    own: BTreeSet<String>,
    nodes: BTreeMap<String, (Instant, DiagnosticStatus)>,
}

impl Status {
    /// Of the nodes with these names, relative to the namespace of the view.
    pub(super) fn of<'a>(view: &str, shown: impl Iterator<Item = &'a str>) -> Self {
        let namespace = view.rsplit_once('/').map_or("", |(namespace, _)| namespace).to_owned();
        let own = shown.map(|name| format!("{namespace}/{name}")).collect();
        Self { namespace, own, nodes: BTreeMap::new() }
    }

    /// Takes what was heard `now`.
    pub(super) fn take(&mut self, message: &DiagnosticArray, now: Instant) {
        for status in &message.status {
            if self.has_place(&status.name, now) {
                self.nodes.insert(status.name.clone(), (now, status.clone()));
            }
        }
    }

    /// Whether a name is to be shown; may take the place of the one that was silent for longest.
    fn has_place(&mut self, name: &str, now: Instant) -> bool {
        if self.nodes.len() < MOST_NODES || self.nodes.contains_key(name) {
            return true;
        }
        let others = self.nodes.iter().filter(|(other, _)| !self.own.contains(*other));
        let silent = others.min_by_key(|(_, (heard, _))| *heard);
        let replaced = silent
            .filter(|(_, (heard, _))| self.own.contains(name) || now.duration_since(*heard) > GONE)
            .map(|(other, _)| other.clone());
        replaced.is_some_and(|other| self.nodes.remove(&other).is_some())
    }

    /// The state as JSON.
    pub(super) fn json(&self, map: &LiveMap, browsers: usize) -> String {
        let nodes: Vec<Value> = self
            .nodes
            .values()
            .map(|(heard, status)| {
                let figures = status.values.iter().take(MOST_FIGURES);
                let figures: Vec<[&str; 2]> =
                    figures.map(|pair| [cut(&pair.key), cut(&pair.value)]).collect();
                json!({
                    "name": cut(&status.name), "level": status.level, "message": cut(&status.message),
                    "age_s": heard.elapsed().as_secs(), "figures": figures,
                })
            })
            .collect();
        json!({
            "nodes": nodes, "detection": format!("{}/{DETECTION}", self.namespace), "browsers": browsers, "map_points": map.len(), "refused": map.refused(),
        })
        .to_string()
    }
}

pub(super) fn cut(text: &str) -> &str {
    text.char_indices().nth(LONGEST_TEXT).map_or(text, |(end, _)| &text[..end])
}

#[cfg(test)]
mod tests {
    use msgs::diagnostic_msgs::KeyValue;

    use super::*;

    /// A message with one status of each of these names.
    fn heard(names: impl IntoIterator<Item = String>) -> DiagnosticArray {
        let status = names.into_iter();
        let status = status.map(|name| DiagnosticStatus { name, ..DiagnosticStatus::default() });
        DiagnosticArray { status: status.collect(), ..DiagnosticArray::default() }
    }

    fn motors() -> impl Iterator<Item = String> {
        (0..MOST_NODES + 16).map(|index| format!("/arm/motor_{index:02}"))
    }

    /// Regression: beside 64 names that were heard earlier the suite's own nodes were not shown, and the button to pause did not know
    /// the state.
    #[test]
    fn the_nodes_of_the_view_are_shown_beside_any_number_of_other_names() {
        let mut status = Status::of("/robot/live_view", ["detection", "pose"].into_iter());
        let now = Instant::now();
        status.take(&heard(motors()), now);
        for name in ["/robot/pose", "/other/detection", "/robot/detection"] {
            status.take(&heard([name.to_owned()]), now);
            status.take(&heard(motors()), now);
        }
        let is_shown = |name: &str| status.nodes.contains_key(name);
        assert!(is_shown("/robot/detection") && is_shown("/robot/pose"));
        assert!(!is_shown("/other/detection"));
        assert_eq!(status.nodes.len(), MOST_NODES);
        let map = LiveMap::new(0.1, 10).unwrap();
        let json: Value = serde_json::from_str(&status.json(&map, 1)).unwrap();
        assert_eq!(json["detection"], "/robot/detection");
    }

    /// Regression: a node that had gone kept its place, so that another robot's nodes were never shown.
    #[test]
    fn a_name_that_has_gone_gives_its_place_to_another_one() {
        let mut status = Status::of("/live_view", ["detection"].into_iter());
        let begin = Instant::now();
        status.take(&heard(["/detection".to_owned()]), begin);
        status.take(&heard(motors()), begin);
        let later = begin + GONE + Duration::from_secs(1);
        status.take(&heard(motors().take(20)), later);
        status.take(&heard(["/new".to_owned()]), later);
        assert!(status.nodes.contains_key("/new") && status.nodes.contains_key("/detection"));
        assert!(motors().take(20).all(|name| status.nodes.contains_key(&name)));
        assert_eq!(status.nodes.len(), MOST_NODES);
    }

    #[test]
    fn what_a_flood_of_nodes_says_is_bounded() {
        let mut status = Status::default();
        let long = "ä".repeat(LONGEST_TEXT + 1);
        let values = vec![KeyValue { key: long.clone(), value: long.clone() }; MOST_FIGURES + 1];
        for node in 0..MOST_NODES + 9 {
            let name = format!("/{node}");
            let one = DiagnosticStatus {
                name,
                message: long.clone(),
                values: values.clone(),
                ..DiagnosticStatus::default()
            };
            let message = DiagnosticArray { status: vec![one], ..DiagnosticArray::default() };
            status.take(&message, Instant::now());
        }
        let map = LiveMap::new(0.1, 10).unwrap();
        let json: Value = serde_json::from_str(&status.json(&map, 1)).unwrap();
        let nodes = json["nodes"].as_array().unwrap();
        assert_eq!(nodes.len(), MOST_NODES);
        assert_eq!(nodes[0]["figures"].as_array().unwrap().len(), MOST_FIGURES);
        assert_eq!(nodes[0]["message"].as_str().unwrap().chars().count(), LONGEST_TEXT);
    }
}
