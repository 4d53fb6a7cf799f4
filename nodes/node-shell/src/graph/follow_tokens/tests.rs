use std::sync::Arc;

use super::*;
use crate::graph::exchange::{Exchange, TopicKey};
use crate::graph::siblings::Siblings;
use crate::settings::qos::Qos;
use crate::wire::rmw_zenoh::keys::{End, NodePlace};

const SCAN: &str = "sensor_msgs::msg::dds_::LaserScan_";

fn token(kind: Kind, entity_id: u64, (dds_type, hash): (&str, &str)) -> Token {
    let node = NodePlace {
        domain_id: 0,
        session: "aa".to_owned(),
        node_id: 1,
        namespace: "/".to_owned(),
        name: "driver".to_owned(),
    };
    let (name, dds_type, hash) = ("/scan".to_owned(), dds_type.to_owned(), hash.to_owned());
    let end = Some(End { name, dds_type, hash, qos: Qos::sensor(5) });
    Token { node, entity_id, kind, end }
}

fn graph() -> Graph {
    Graph::new(Arc::new(Exchange::new()), Siblings::default())
}

fn subscribe(graph: &Graph, exchange: &Exchange) -> EndpointId {
    let key = TopicKey { topic: "/scan".to_owned(), dds_type: SCAN.to_owned() };
    let id = exchange.enter_publisher(key, &Qos::reliable(1));
    let guid = GUID::from_bytes([7; 16]);
    let entered =
        graph.enter(id, (Role::Subscription, "/scan", SCAN), || Ok::<_, String>(Some((guid, ()))));
    entered.unwrap();
    graph.enter_hash(id, "RIHS01_a");
    id
}

#[test]
fn a_publisher_is_matched_whether_it_comes_first_or_last_and_goes_with_its_token() {
    for comes_first in [true, false] {
        let graph = graph();
        let exchange = Arc::clone(&graph.exchange);
        let driver = token(Kind::Publisher, 2, (SCAN, "RIHS01_a"));
        if comes_first {
            graph.token_found(driver.clone(), false);
        }
        let id = subscribe(&graph, &exchange);
        if !comes_first {
            graph.token_found(driver.clone(), false);
        }
        // Another end, and one's own process.
        graph.token_found(token(Kind::Subscription, 3, (SCAN, "RIHS01_a")), false);
        graph.token_found(token(Kind::Publisher, 4, (SCAN, "RIHS01_a")), true);
        assert_eq!((graph.peers(id), graph.tokens().len()), (1, 2));
        let guid = GUID::from_bytes(driver.guid_bytes());
        assert_eq!(graph.node_of(guid).as_deref(), Some("/driver"));
        graph.token_gone(&driver);
        assert_eq!((graph.peers(id), graph.tokens().len()), (0, 1));
    }
}

#[test]
fn another_type_or_another_definition_of_it_is_no_peer_and_is_told() {
    let graph = graph();
    let exchange = Arc::clone(&graph.exchange);
    let id = subscribe(&graph, &exchange);
    graph.token_found(token(Kind::Publisher, 2, (SCAN, "RIHS01_b")), false);
    graph.token_found(token(Kind::Publisher, 3, ("a::msg::dds_::B_", "RIHS01_a")), false);
    assert_eq!(graph.peers(id), 0);
    let texts: Vec<String> = graph.troubles().into_iter().map(|one| one.text).collect();
    assert_eq!(texts.len(), 2);
    let is_told = |part: &str| texts.iter().any(|text| text.contains(part));
    assert!(is_told("node /driver, has the type a/msg/B"), "{texts:?}");
    assert!(
        is_told("node /driver, has another definition of sensor_msgs/msg/LaserScan"),
        "{texts:?}"
    );
}

/// Messages of a type without a hash have a key of their own: such a publisher was counted, and nothing came.
#[test]
fn a_publisher_without_a_hash_is_heard_by_those_alone_that_hear_all() {
    let graph = graph();
    let exchange = Arc::clone(&graph.exchange);
    let id = subscribe(&graph, &exchange);
    graph.token_found(token(Kind::Publisher, 2, (SCAN, UNKNOWN_HASH)), false);
    assert_eq!(graph.peers(id), 0);
    let texts: Vec<String> = graph.troubles().into_iter().map(|one| one.text).collect();
    let is_told = |part: &str| texts.iter().any(|text| text.contains(part));
    assert!(is_told("is not heard: it is of ROS 2 Humble"), "{texts:?}");
    // The recorder hears all of a topic.
    let key = TopicKey { topic: "/scan".to_owned(), dds_type: SCAN.to_owned() };
    let any = exchange.enter_publisher(key, &Qos::reliable(1));
    let guid = GUID::from_bytes([8; 16]);
    let place = (Role::Subscription, "/scan", SCAN);
    graph.enter(any, place, || Ok::<_, String>(Some((guid, ())))).unwrap();
    graph.enter_hash(any, UNKNOWN_HASH);
    graph.token_found(token(Kind::Publisher, 3, (SCAN, "RIHS01_a")), false);
    assert_eq!((graph.peers(id), graph.peers(any)), (1, 2));
}

/// As a peer on the network that announces endpoint after endpoint.
#[test]
fn so_many_tokens_of_others_are_known_and_no_more() {
    let graph = graph();
    let exchange = Arc::clone(&graph.exchange);
    let id = subscribe(&graph, &exchange);
    for entity_id in 0..MOST_TOKENS as u64 + 100 {
        graph.token_found(token(Kind::Publisher, entity_id, (SCAN, "RIHS01_a")), false);
    }
    assert_eq!((graph.tokens().len(), graph.peers(id)), (MOST_TOKENS, MOST_TOKENS));
    // One's own are known all the same.
    graph.token_found(token(Kind::Server, 1 << 20, (SCAN, "RIHS01_a")), true);
    graph.token_gone(&token(Kind::Publisher, 7, (SCAN, "RIHS01_a")));
    assert_eq!((graph.tokens().len(), graph.peers(id)), (MOST_TOKENS - 1, MOST_TOKENS - 1));
}
