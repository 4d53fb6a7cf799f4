//! Every type by the names of its fields: the Python peer makes its classes from the `.msg` files, and
//! hears and says messages as JSON.

use std::time::Duration;

use msgs::RosMessage;
use node_shell::{Node, Publisher, Qos};
use serde_json::Value;

use super::build::Make;
use super::cases::{Case, cases};
use super::definitions::Definitions;
use super::fill::Floats;
use super::message_types::for_each_message_type;
use super::peer::Peer;
use super::place::{GREETINGS, LONGEST_GREETING, Place, have_matched, publish, receive};

/// How long one message may take, on however busy a machine: what takes longer is lost.
const LONGEST_WAY: Duration = Duration::from_secs(30);
/// How long the ends of one topic may take to find each other.
const LONGEST_MATCH: Duration = Duration::from_secs(60);

struct Exchange {
    definitions: Definitions,
    peer: Peer,
    node: Node,
    heard: usize,
    said: usize,
    failures: Vec<String>,
}

impl Exchange {
    async fn both_ways<M: RosMessage>(&mut self) {
        let topic = |way| format!("{way}/{}", M::TYPE_NAME);
        let qos = Qos::reliable(10);
        let publisher = self.node.publisher::<M>(&topic("there"), &qos).unwrap();
        let subscription = self.node.subscription::<M>(&topic("back"), &qos).unwrap();
        if !have_matched(&publisher, &subscription, LONGEST_MATCH).await
            || !self.peer.has_matched(M::TYPE_NAME, LONGEST_MATCH).await
        {
            self.failures.push(format!("{}: not matched", M::TYPE_NAME));
            return;
        }
        let cases = cases::<M>(&self.definitions, Floats::SaidInJson);
        let greeting = serde_json::to_value((M::TYPE_NAME, &cases[0].message)).unwrap();
        if !self.greet(&publisher, &cases[0]).await {
            return;
        }
        for case in &cases {
            let said = serde_json::to_value((M::TYPE_NAME, &case.message)).unwrap();
            publish(&publisher, &case.message);
            self.heard += 1;
            let mut heard = self.heard().await;
            while said != greeting && heard.as_ref() == Some(&greeting) {
                heard = self.heard().await;
            }
            self.compare("the peer", case, &said, heard);

            self.peer.tell(&said.to_string());
            self.said += 1;
            let back = receive(&subscription, LONGEST_WAY).await;
            let back = back.map(|back| serde_json::to_value((M::TYPE_NAME, back)).unwrap());
            self.compare("the suite", case, &said, back);
        }
    }

    /// Sends a message until the peer hears it, and says whether it did.
    async fn greet<M: RosMessage>(&mut self, publisher: &Publisher<M>, greeting: &Case<M>) -> bool {
        for _ in 0..GREETINGS {
            publish(publisher, &greeting.message);
            if self.peer.heard(LONGEST_GREETING).await.is_some() {
                return true;
            }
        }
        self.failures.push(format!("{}: {GREETINGS} greetings were not heard", M::TYPE_NAME));
        false
    }

    async fn heard(&mut self) -> Option<Value> {
        let heard = self.peer.heard(LONGEST_WAY).await?;
        Some(heard.parse().expect("the peer tells in JSON"))
    }

    fn compare<M: RosMessage>(
        &mut self,
        who: &str,
        case: &Case<M>,
        said: &Value,
        heard: Option<Value>,
    ) {
        let difference = match heard {
            None => "nothing".to_owned(),
            Some(heard) if heard == *said => return,
            Some(heard) => difference("", said, &heard),
        };
        self.failures.push(format!("{}: {who} heard {difference}", case.name()));
    }
}

/// Where two values first differ, by the path of names that leads there.
fn difference(path: &str, said: &Value, heard: &Value) -> String {
    let inner = match (said, heard) {
        (Value::Object(said), Value::Object(heard)) if said.keys().eq(heard.keys()) => {
            said.iter().zip(heard.values()).find_map(|((name, said), heard)| {
                (said != heard).then(|| difference(&format!("{path}.{name}"), said, heard))
            })
        }
        (Value::Array(said), Value::Array(heard)) if said.len() == heard.len() => {
            said.iter().zip(heard).enumerate().find_map(|(index, (said, heard))| {
                (said != heard).then(|| difference(&format!("{path}[{index}]"), said, heard))
            })
        }
        _ => None,
    };
    let short = |value: &Value| value.to_string().chars().take(80).collect::<String>();
    inner.unwrap_or_else(|| format!("{path}: {} in place of {}", short(heard), short(said)))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn cyclone_python_agrees_on_every_field_by_name() {
    let place = Place::new().await;
    let arguments = [place.namespace(), "reliable", "volatile"];
    let Some(peer) = Peer::start(Make::CyclonePython, "name", &place, &arguments).await else {
        return;
    };
    let mut exchange = Exchange {
        definitions: Definitions::read(),
        peer,
        node: place.node("ours"),
        heard: 0,
        said: 0,
        failures: Vec::new(),
    };
    macro_rules! both_ways {
        (($exchange:expr) $($message:ty,)*) => { $($exchange.both_ways::<$message>().await;)* };
    }
    for_each_message_type!(both_ways, exchange);
    let Exchange { node, heard, said, failures, .. } = exchange;
    node.close().await;
    let failed = failures.len();
    assert!(failures.is_empty(), "{failed} of {}:\n{}", heard + said, failures.join("\n"));
    println!("by name: {heard} messages heard, {said} said");
}

#[test]
fn a_difference_is_named_by_its_path() {
    let said = serde_json::json!({"a": [{"b": 1}, {"b": 2}], "c": 1.5});
    let mut heard = said.clone();
    heard["a"][1]["b"] = 3.into();
    assert_eq!(difference("", &said, &heard), ".a[1].b: 3 in place of 2");
    heard = said.clone();
    heard["c"] = 2.5.into();
    assert_eq!(difference("", &said, &heard), ".c: 2.5 in place of 1.5");
}
