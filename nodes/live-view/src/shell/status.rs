//! The state of the nodes, of their own diagnostics.

use std::collections::BTreeMap;

use msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use serde_json::{Value, json};
use tokio::time::Instant;

use crate::LiveMap;

/// Nodes that are shown, at most: more would be somebody's who floods the topic.
const MOST_NODES: usize = 64;
/// Figures of a node that are shown, at most.
const MOST_FIGURES: usize = 200;
/// Characters of a text that is shown, at most.
const LONGEST_TEXT: usize = 400;

/// What the nodes have last said of themselves.
#[derive(Default)]
pub(super) struct Status {
    nodes: BTreeMap<String, (Instant, DiagnosticStatus)>,
}

impl Status {
    pub(super) fn take(&mut self, message: &DiagnosticArray) {
        for status in &message.status {
            if self.nodes.len() < MOST_NODES || self.nodes.contains_key(&status.name) {
                self.nodes.insert(status.name.clone(), (Instant::now(), status.clone()));
            }
        }
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
            "nodes": nodes, "browsers": browsers, "map_points": map.len(), "refused": map.refused(),
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
            status.take(&DiagnosticArray { status: vec![one], ..DiagnosticArray::default() });
        }
        let map = LiveMap::new(0.1, 10).unwrap();
        let json: Value = serde_json::from_str(&status.json(&map, 1)).unwrap();
        let nodes = json["nodes"].as_array().unwrap();
        assert_eq!(nodes.len(), MOST_NODES);
        assert_eq!(nodes[0]["figures"].as_array().unwrap().len(), MOST_FIGURES);
        assert_eq!(nodes[0]["message"].as_str().unwrap().chars().count(), LONGEST_TEXT);
    }
}
