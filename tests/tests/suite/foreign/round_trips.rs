//! Every type there and back: the peer decodes each message into its own struct, and encodes it again
//! from that. What comes back is the same to the byte, not-a-number and minus zero included.

use std::time::Duration;

use msgs::RosMessage;
use node_shell::{Node, Publisher, Qos, Subscription};

use super::build::Make;
use super::cases::{Case, cases};
use super::definitions::Definitions;
use super::fill::Floats;
use super::message_types::for_each_message_type;
use super::peer::Peer;
use super::place::{GREETINGS, LONGEST_GREETING, Place, have_matched, publish, receive};

/// How long one message may take there and back, on however busy a machine: what takes longer is lost.
const LONGEST_TRIP: Duration = Duration::from_secs(30);
/// How long the ends of one topic may take to find each other.
const LONGEST_MATCH: Duration = Duration::from_secs(60);
/// The exchange with one peer.
struct Exchange {
    definitions: Definitions,
    peer: Peer,
    node: Node,
    qos: Qos,
    trips: usize,
    lost_greetings: usize,
    failures: Vec<String>,
}

impl Exchange {
    async fn round_trips<M: RosMessage>(&mut self) {
        let topic = |way| format!("{way}/{}", M::TYPE_NAME);
        let publisher = self.node.publisher::<M>(&topic("there"), &self.qos).unwrap();
        let subscription = self.node.subscription::<M>(&topic("back"), &self.qos).unwrap();
        if !have_matched(&publisher, &subscription, LONGEST_MATCH).await
            || !self.peer.has_matched(M::TYPE_NAME, LONGEST_MATCH).await
        {
            self.failures.push(format!("{}: not matched", M::TYPE_NAME));
            return;
        }
        let cases = cases::<M>(&self.definitions, Floats::Any);
        let Some(late_greetings) = self.greet(&publisher, &subscription, &cases[0]).await else {
            return;
        };
        for case in &cases {
            publish(&publisher, &case.message);
            self.trips += 1;
            let mut back = next_encoded(&subscription).await;
            for _ in 0..late_greetings {
                if back.as_ref() == Some(&cases[0].encoded) && case.encoded != cases[0].encoded {
                    back = next_encoded(&subscription).await;
                }
            }
            match back {
                None => self.failures.push(format!("{}: not back", case.name())),
                Some(back) if back == case.encoded => {}
                Some(_) => self.failures.push(format!("{}: back as another", case.name())),
            }
        }
    }

    /// Sends a message until it is back; returns how many of those sent before may still be on the
    /// way, or nothing where none comes back.
    async fn greet<M: RosMessage>(
        &mut self,
        publisher: &Publisher<M>,
        subscription: &Subscription<M>,
        greeting: &Case<M>,
    ) -> Option<usize> {
        for lost in 0..GREETINGS {
            publish(publisher, &greeting.message);
            if receive(subscription, LONGEST_GREETING).await.is_some() {
                self.lost_greetings += lost;
                return Some(lost);
            }
        }
        self.failures.push(format!("{}: no answer to {GREETINGS} greetings", M::TYPE_NAME));
        None
    }
}

/// The next message in CDR, if it comes in time.
async fn next_encoded<M: RosMessage>(subscription: &Subscription<M>) -> Option<Vec<u8>> {
    receive(subscription, LONGEST_TRIP).await.map(|back| msgs::cdr::encode(&back).unwrap())
}

/// Exchanges every case of every type, and reports all that fail.
async fn every_type(make: Make, reliability: &str) {
    let place = Place::new().await;
    let arguments = [place.namespace(), reliability, "volatile"];
    let Some(peer) = Peer::start(make, "echo", &place, &arguments).await else { return };
    let qos = if reliability == "reliable" { Qos::reliable(10) } else { Qos::sensor(10) };
    let mut exchange = Exchange {
        definitions: Definitions::read(),
        peer,
        node: place.node("ours"),
        qos,
        trips: 0,
        lost_greetings: 0,
        failures: Vec::new(),
    };
    macro_rules! round_trips {
        (($exchange:expr) $($message:ty,)*) => { $($exchange.round_trips::<$message>().await;)* };
    }
    for_each_message_type!(round_trips, exchange);
    let Exchange { node, trips, lost_greetings, failures, .. } = exchange;
    node.close().await;
    let failed = failures.len();
    assert!(failures.is_empty(), "{failed} of {trips}:\n{}", failures.join("\n"));
    println!(
        "{make:?}, {reliability}: {trips} messages there and back; first ones lost: {lost_greetings}"
    );
}

macro_rules! tests {
    ($($name:ident: $make:ident, $reliability:literal;)*) => {$(
        #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
        async fn $name() {
            every_type(Make::$make, $reliability).await;
        }
    )*};
}

tests! {
    cyclone_echoes_every_type_best_effort: Cyclone, "best_effort";
    cyclone_echoes_every_type_reliably: Cyclone, "reliable";
    cyclone_python_echoes_every_type_best_effort: CyclonePython, "best_effort";
    cyclone_python_echoes_every_type_reliably: CyclonePython, "reliable";
    fast_dds_echoes_every_type_best_effort: FastDds, "best_effort";
    fast_dds_echoes_every_type_reliably: FastDds, "reliable";
}
