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
    assert!(is_told("sensor_msgs/msg/LaserScan of another definition"), "{texts:?}");
    // One that does not say which.
    graph.token_found(token(Kind::Publisher, 4, (SCAN, UNKNOWN_HASH)), false);
    assert_eq!(graph.peers(id), 1);
}
