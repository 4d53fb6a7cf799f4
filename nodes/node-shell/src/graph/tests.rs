use msgs::sensor_msgs::LaserScan;

use super::*;
use crate::Qos;
use crate::graph::exchange::TopicKey;
use crate::graph::inbox::Queue;

fn guid(number: u8) -> GUID {
    GUID::from_bytes([number; 16])
}

fn with_subscription() -> (Graph, EndpointId) {
    let exchange = Arc::new(Exchange::new());
    let key = TopicKey { topic: "/scan".to_owned(), dds_type: "a::msg::dds_::Scan_".to_owned() };
    let inbox = Arc::new(Queue::<LaserScan>::new(1));
    let id = exchange.enter_subscription(key, &Qos::sensor(1), inbox);
    let graph = Graph::new(exchange, Siblings::default());
    graph
        .enter(id, (Role::Subscription, "/scan", "a::msg::dds_::Scan_"), || {
            Ok::<_, std::convert::Infallible>(Some((guid(1), ())))
        })
        .unwrap();
    (graph, id)
}

#[test]
fn peers_come_and_go() {
    let (graph, id) = with_subscription();
    let type_name = Some("a::msg::dds_::Scan_".to_owned());
    graph.matched(guid(1), guid(2), type_name.clone());
    graph.matched(guid(1), guid(2), type_name.clone());
    graph.matched(guid(1), guid(3), None);
    graph.matched(guid(9), guid(3), type_name);
    assert_eq!(graph.peers(id), 2);
    graph.lost(|peer| *peer == guid(2));
    assert_eq!(graph.peers(id), 1);
    graph.leave(id);
    assert_eq!(graph.peers(id), 0);
    assert_eq!(graph.open_endpoints(), 0);
}

#[test]
fn a_sibling_is_no_peer_on_the_network() {
    let (graph, id) = with_subscription();
    graph.matched(guid(1), guid(2), None);
    graph.matched(guid(1), guid(3), None);
    assert_eq!(graph.outside_peers(id), 2);
    graph.siblings.enter(guid(2));
    assert_eq!((graph.outside_peers(id), graph.peers(id)), (1, 1));
}

#[test]
fn a_peer_of_another_type_is_none() {
    let (graph, id) = with_subscription();
    graph.matched(guid(1), guid(2), Some("a::msg::dds_::Other_".to_owned()));
    assert_eq!(graph.peers(id), 0);
    assert!(graph.is_foreign(id, guid(2)));
    assert!(!graph.is_foreign(id, guid(3)));
}

#[test]
fn a_misfit_is_a_trouble_as_long_as_it_is_there() {
    let (graph, id) = with_subscription();
    let (offered, requested) =
        (Qos::sensor(5).writer_policies("a/msg/Scan"), Qos::reliable(5).reader_policies());
    graph.incompatible((guid(1), guid(2)), &offered, &requested);
    graph.incompatible((guid(1), guid(2)), &offered, &requested);
    graph.matched(guid(1), guid(3), Some("a::msg::dds_::Other_".to_owned()));
    let kinds =
        |graph: &Graph| graph.troubles().into_iter().map(|one| one.kind).collect::<Vec<_>>();
    assert_eq!(kinds(&graph), [TroubleKind::OtherType, TroubleKind::Incompatible]);
    assert_eq!(graph.peers(id), 0);
    graph.lost(|peer| *peer == guid(3));
    assert_eq!(kinds(&graph), [TroubleKind::Incompatible]);
    graph.matched(guid(1), guid(2), Some("a::msg::dds_::Scan_".to_owned()));
    assert_eq!(kinds(&graph), []);
    assert_eq!(graph.peers(id), 1);
}

#[tokio::test]
async fn waiting_ends_with_the_match() {
    let (graph, id) = with_subscription();
    let waiting = graph.clone();
    let task = tokio::spawn(async move { waiting.wait_for_peers(id, 2).await });
    graph.matched(guid(1), guid(2), None);
    graph.matched(guid(1), guid(3), None);
    task.await.unwrap();
    graph.wait_for_peers(id, 1).await;
}
