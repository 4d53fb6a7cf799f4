//! How far places are from the nearest obstacle, asked over DDS by clients whose responses must fit into a datagram.

use msgs::geometry_msgs::Point;
use msgs::stillmap_msgs::{
    DistanceField, GetDistanceFieldRequest, GetDistanceFieldResponse, GetDistancesRequest,
    GetDistancesResponse,
};
use ros2_client::dds::{Client, Context, ContextOptions, ServiceMapping};
use ros2_client::qos::{History, Reliability, WhenFull};
use ros2_client::{Name, NodeName, NodeOptions, QosProfile, ServiceTypeName};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::*;
use crate::ReconstructionConfig;
use crate::shell::distance_output::KEPT;
use crate::surface_map::tests::scene::{Scene, cycle, rig_at};

#[derive(Clone, Serialize, Deserialize)]
struct Wire<M>(M);
impl<M: Clone + Serialize + DeserializeOwned> ros2_client::Message for Wire<M> {}

fn parameters() -> ReconstructionParameters {
    let mut config = ReconstructionConfig::default();
    config.pipeline.map_edge_m = 0.05;
    ReconstructionParameters { config, ..ReconstructionParameters::default() }
}

fn room() -> SegmentedCloud {
    let mut cycle = cycle(&Scene::room(), 0, &rig_at(0.0, 0.0), None);
    cycle.setup = parameters().config.pipeline.setup();
    convert::message_from_segmented_cycle(&cycle)
}

/// A client of the mapping of Fast DDS.
struct Asker {
    node: ros2_client::Node,
    namespace: String,
    _context: Context,
}

impl Asker {
    fn new(test: &Place, namespace: String) -> Self {
        let domain_id = test.transport.domain_id();
        let context = Context::with_options(ContextOptions::new().domain_id(domain_id)).unwrap();
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let node = context.new_node(NodeName::new("/", "asker").unwrap(), options).unwrap();
        Self { node, namespace, _context: context }
    }

    fn client<Q, A>(&mut self, service: &str, type_name: &str) -> Client<Wire<Q>, Wire<A>>
    where
        Q: Clone + Serialize + DeserializeOwned + 'static,
        A: Clone + Serialize + DeserializeOwned + 'static,
    {
        let qos = QosProfile::default()
            .reliability(Reliability::Reliable { when_full: WhenFull::DEFAULT })
            .history(History::KeepLast { depth: 10 });
        let name = Name::parse(&format!("{}/{service}", self.namespace)).unwrap();
        let type_name = ServiceTypeName::new("stillmap_msgs", type_name);
        let mapping = ServiceMapping::Enhanced;
        self.node.create_client(mapping, &name, &type_name, qos.clone(), qos).unwrap()
    }
}

/// Asks until there is an answer.
async fn ask<Q, A>(client: &Client<Wire<Q>, Wire<A>>, request: &Q) -> A
where
    Q: Clone + Serialize + DeserializeOwned + 'static,
    A: Clone + Serialize + DeserializeOwned + 'static,
{
    let mut wait = AGAIN;
    while wait < PATIENCE {
        let id = client.async_send_request(Wire(request.clone())).await.unwrap();
        let answer = client.async_receive_response(id);
        if let Ok(answer) = tokio::time::timeout(wait, answer).await {
            return answer.unwrap().0;
        }
        wait *= 2;
    }
    panic!("timed out: an answer");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn places_are_answered_and_a_large_field_is_on_the_topic() {
    let test = Place::new("distances");
    let host = test.host();
    let (own, peer) = (test.node(&host, "reconstruction"), test.node(&test.host(), "peer"));
    let mut asker = Asker::new(&test, own.full_name());
    let served = serving(own, parameters());
    {
        let places = asker
            .client::<GetDistancesRequest, GetDistancesResponse>("get_distances", "GetDistances");
        let before_wall = Point { x: 2.0, y: 0.0, z: 0.0 };
        let asked = GetDistancesRequest { frame_id: String::new(), points: vec![before_wall] };
        let answer = ask(&places, &asked).await;
        assert!(!answer.success && answer.message.contains("the map is empty"), "{answer:?}");

        let clouds =
            peer.publisher::<SegmentedCloud>("segmented_cloud", &Qos::reliable(5)).unwrap();
        soon("the node", clouds.wait_for_subscribers(1)).await;
        clouds.publish(room()).unwrap();
        let mut answer = ask(&places, &asked).await;
        while !answer.success {
            answer = ask(&places, &asked).await;
        }
        let (true_m, away) = Scene::room().nearest(&nalgebra::Point3::new(2.0, 0.0, 0.0));
        let [distance_m] = answer.distances.distances[..] else { panic!("{answer:?}") };
        assert!((f64::from(distance_m) - true_m).abs() < 0.03, "{answer:?}");
        let [x, y, z] = answer.distances.gradients[..] else { panic!("{answer:?}") };
        assert!(away.dot(&nalgebra::Vector3::new(x, y, z).cast()) > 0.95, "{answer:?}");

        let fields = asker.client::<GetDistanceFieldRequest, GetDistanceFieldResponse>(
            "get_distance_field",
            "GetDistanceField",
        );
        let most = Point { x: 8.0, y: 8.0, z: 0.0 };
        let slice =
            GetDistanceFieldRequest { frame_id: "map".to_owned(), least: Point::default(), most };
        let answer = ask(&fields, &slice).await;
        // Where datagrams are large it is in the response.
        if !answer.success {
            assert!(answer.message.contains("subscribe to distance_field"), "{}", answer.message);
        }
        let listener =
            peer.subscription::<DistanceField>("distance_field", &Qos::reliable(5)).unwrap();
        let (mut heard, mut answer) = (None, answer);
        for _ in 0..100 {
            answer = ask(&fields, &slice).await;
            let next = tokio::time::timeout(Duration::from_millis(200), listener.next());
            if let Ok(field) = next.await {
                heard = Some(field.message.clone());
                break;
            }
        }
        let heard = heard.expect("the field is on the topic");
        assert!(answer.success, "{}", answer.message);
        assert_eq!((heard.size_x, heard.size_y, heard.size_z), (161, 161, 1));
        assert_eq!(heard.distances.len(), 161 * 161);
        assert!(answer.field.distances.is_empty() || answer.field == *heard);
    }
    host.shutdown_signal().trigger();
    soon("the end", served).await.unwrap().unwrap();
    peer.close().await;
}

#[tokio::test]
async fn what_nobody_has_asked_for_in_a_while_is_forgotten() {
    let test = Place::new("distances_kept");
    let node = test.node(&Host::in_process(), "reconstruction");
    let mut stage = Stage::new(&node, &parameters()).unwrap();
    stage.take(&node_shell::Arrived::Message(std::sync::Arc::new(room())));
    let before = stage.map.memory_bytes();
    stage.map.distances("map", &[nalgebra::Point3::new(2.0, 0.0, 0.0)]).unwrap();
    let now = Instant::now();
    stage.distances.asked(now);
    stage.distances.look(&mut stage.map, now + KEPT / 2);
    assert!(stage.map.memory_bytes() > before);
    stage.distances.look(&mut stage.map, now + KEPT);
    assert_eq!(stage.map.memory_bytes(), before);
}
