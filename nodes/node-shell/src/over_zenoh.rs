//! Tests over real Zenoh: each node has a session of its own, and a router in this process connects them.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Sender, TryRecvError, channel};
use std::time::{Duration, Instant};

use ::zenoh::Wait;
use ::zenoh::config::Config;
use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::rcl_interfaces::{GetParameters, GetParametersRequest};
use msgs::sensor_msgs::{Image, LaserScan};
use msgs::std_srvs::{SetBool, SetBoolRequest, SetBoolResponse};
use msgs::{RosMessage, RosService};

use crate::parameters::NodeParameters;
use crate::two_nodes::{PATIENCE, arguments, matched, scan, soon};
use crate::wire::rmw_zenoh::settings::ZenohSettings;
use crate::{AskError, Host, Node, Qos, RawType, Role, Transport};

/// In which nothing comes.
const SHORT: Duration = Duration::from_millis(100);

/// A router and the nodes that find each other by it.
struct Place {
    port: u16,
    router: Option<::zenoh::Session>,
}

impl Place {
    fn new() -> Self {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let mut place = Self { port, router: None };
        place.start_router();
        place
    }

    fn start_router(&mut self) {
        let config = format!(
            r#"{{ mode: "router", listen: {{ endpoints: ["tcp/127.0.0.1:{}"] }}, scouting: {{ multicast: {{ enabled: false }} }} }}"#,
            self.port
        );
        let begun = Instant::now();
        // Somebody else may have been given the port for a moment.
        self.router = loop {
            match ::zenoh::open(Config::from_json5(&config).unwrap()).wait() {
                Ok(router) => break Some(router),
                Err(error) => assert!(begun.elapsed() < PATIENCE, "{error}"),
            }
            std::thread::sleep(SHORT);
        };
    }

    fn stop_router(&mut self) {
        self.router.take().unwrap().close().wait().unwrap();
    }

    /// `mode` as Zenoh has it: peers connect with each other too, clients with the router alone.
    fn transport(&self, mode: &str) -> Transport {
        self.transport_that_looks(mode, 3)
    }

    /// The same, looking for a router that often.
    fn transport_that_looks(&self, mode: &str, router_checks: u64) -> Transport {
        let pair = |key: &str, value: String| (key.to_owned(), value);
        let overrides = vec![
            pair("mode", format!("\"{mode}\"")),
            pair("connect/endpoints", format!("[\"tcp/127.0.0.1:{}\"]", self.port)),
            pair("connect/retry", "{ period_init_ms: 100, period_max_ms: 200 }".to_owned()),
        ];
        let settings = ZenohSettings { config_file: None, overrides, router_checks };
        Transport::on_domain(7).unwrap().over_zenoh(settings)
    }

    fn node(&self, name: &str) -> Node {
        Node::start_on(self.transport("client"), name, &arguments("/robot", &[])).unwrap()
    }
}

geometry::parameters! {
    /// A node's own.
    #[derive(Clone, Debug)]
    pub(crate) struct OwnParameters {
        /// Of a scan.
        beams: u32 = 7;
    }
}

impl NodeParameters for OwnParameters {}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn messages_reach_a_node_of_another_process_in_order_and_once() {
    let place = Place::new();
    let (talker, listener) = (place.node("talker"), place.node("listener"));
    {
        // On Zenoh quality of service keeps nobody apart.
        let publisher = talker.publisher::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
        let subscription = listener.subscription::<LaserScan>("scan", &Qos::reliable(20)).unwrap();
        let raw =
            listener.raw_subscription("scan", LaserScan::TYPE_NAME, &Qos::sensor(20)).unwrap();
        let image = listener.subscription::<Image>("scan", &Qos::sensor(5)).unwrap();
        matched(&publisher, &subscription).await;
        soon("both subscriptions", publisher.wait_for_subscribers(2)).await;
        for beams in 1..=10 {
            publisher.publish(scan(beams)).unwrap();
            let received = soon("a message", subscription.next()).await;
            assert_eq!(received.message.ranges.len(), beams);
            assert!(received.sent.is_some_and(|sent| sent.as_nanos() > 0));
            let bytes = soon("its bytes", raw.next()).await.encoded;
            assert_eq!(bytes[..4], [0, 1, 0, 0]);
        }
        assert_eq!((publisher.subscriber_count(), subscription.lost_count()), (2, 0));
        assert!(subscription.try_next().is_none() && image.try_next().is_none());
        drop((subscription, raw));
        soon("their end", async {
            while publisher.subscriber_count() > 0 {
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        })
        .await;
        publisher.publish_if_awaited(|| panic!("it is made for nobody"));
    }
    talker.close().await;
    listener.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_comes_late_gets_what_a_latched_topic_keeps() {
    let place = Place::new();
    let (mapper, viewer) = (place.node("mapper"), place.node("viewer"));
    {
        let publisher = mapper.publisher::<LaserScan>("map", &Qos::latched()).unwrap();
        publisher.publish(scan(1)).unwrap();
        publisher.publish(scan(2)).unwrap();
        let late = viewer.subscription::<LaserScan>("map", &Qos::latched()).unwrap();
        assert_eq!(soon("the last map", late.next()).await.message.ranges.len(), 2);
        publisher.publish(scan(3)).unwrap();
        assert_eq!(soon("a new map", late.next()).await.message.ranges.len(), 3);
        let unasked = viewer.subscription::<LaserScan>("map", &Qos::reliable(5)).unwrap();
        soon("the match", unasked.wait_for_publishers(1)).await;
        tokio::time::sleep(SHORT).await;
        assert!(unasked.try_next().is_none() && late.try_next().is_none());
    }
    mapper.close().await;
    viewer.close().await;
}

/// Each latched topic sent a heartbeat every half second for ever, whether there was a message or not.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_latched_topic_is_silent_while_nothing_is_published() {
    let place = Place::new();
    let mapper = place.node("mapper");
    let router = place.router.as_ref().unwrap();
    let heartbeats = router.declare_subscriber("7/robot/map/*/*/@adv/pub/**").await.unwrap();
    {
        let publisher = mapper.publisher::<LaserScan>("map", &Qos::latched()).unwrap();
        soon("a heartbeat", async {
            loop {
                publisher.publish(scan(1)).unwrap();
                let next = tokio::time::timeout(SHORT, heartbeats.recv_async()).await;
                if next.is_ok() {
                    break;
                }
            }
        })
        .await;
        // Time for three. The last message has one.
        tokio::time::sleep(Duration::from_millis(1700)).await;
        let more = std::iter::from_fn(|| heartbeats.try_recv().ok().flatten()).count();
        assert!(more <= 1, "{more}");
    }
    mapper.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn services_answer_other_processes_and_siblings() {
    let place = Place::new();
    let host = Host::on(place.transport("client")).unwrap();
    let server = host.node("server", &arguments("/robot", &[])).unwrap();
    let sibling = host.node("sibling", &arguments("/robot", &[])).unwrap();
    let other = place.node("other");
    {
        let missing = other.service_client::<SetBool>("nobody/switch").unwrap();
        let missing = missing.ask(&SetBoolRequest::default(), SHORT).await.unwrap_err();
        assert!(matches!(missing, AskError::NoServer { .. }), "{missing}");
        let service = server.service::<SetBool>("~/switch").unwrap();
        let serve = async {
            loop {
                let request = service.next().await;
                // Larger than a datagram: on Zenoh all clients get it.
                let message =
                    if request.message.data { "x".repeat(100_000) } else { String::new() };
                let response = SetBoolResponse { success: true, message };
                request.respond_or(&response, |_| SetBoolResponse::default()).unwrap();
            }
        };
        let ask = async {
            for asker in [&other, &sibling] {
                let client = asker.service_client::<SetBool>("server/switch").unwrap();
                for (data, length) in [(true, 100_000), (false, 0)] {
                    let answer = client.ask(&SetBoolRequest { data }, PATIENCE).await.unwrap();
                    assert_eq!((answer.success, answer.message.len()), (true, length));
                }
            }
        };
        tokio::select! {
            () = serve => {}
            () = soon("the answers", ask) => {}
        }
    }
    for node in [server, sibling, other] {
        node.close().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nodes_of_one_process_hand_over_and_are_heard_outside_once() {
    let place = Place::new();
    let host = Host::on(place.transport("client")).unwrap();
    let talker = host.node("talker", &arguments("/robot", &[])).unwrap();
    let listener = host.node("listener", &arguments("/robot", &[])).unwrap();
    let outsider = place.node("outsider");
    {
        for (topic, qos) in [("scan", Qos::reliable(5)), ("map", Qos::latched())] {
            let publisher = talker.publisher::<LaserScan>(topic, &qos).unwrap();
            let inside = listener.subscription::<LaserScan>(topic, &qos).unwrap();
            let outside = outsider.subscription::<LaserScan>(topic, &qos).unwrap();
            matched(&publisher, &outside).await;
            soon("both", publisher.wait_for_subscribers(2)).await;
            for beams in 1..=3 {
                publisher.publish(scan(beams)).unwrap();
                let (here, there) = (inside.next(), outside.next());
                let (here, there) = soon("a message", async { tokio::join!(here, there) }).await;
                assert_eq!(here.message.ranges.len(), beams);
                assert_eq!(there.message.ranges.len(), beams);
            }
            tokio::time::sleep(SHORT).await;
            assert!(inside.try_next().is_none() && outside.try_next().is_none());
            assert_eq!(publisher.subscriber_count(), 2);
        }
    }
    for node in [talker, listener, outsider] {
        node.close().await;
    }
}

/// What was recorded of a type that nobody here defines was played to nobody.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn messages_of_a_type_that_is_known_by_its_hash_alone_are_heard() {
    let place = Place::new();
    let (player, recorder) = (place.node("player"), place.node("recorder"));
    {
        let hash = format!("RIHS01_{}", "ab".repeat(32));
        let kind = RawType { name: "other_msgs/msg/Thing", definition: None, hash: Some(&hash) };
        let publisher = player.raw_publisher_of("thing", kind, &Qos::reliable(5)).unwrap();
        let key = format!("7/robot/thing/other_msgs::msg::dds_::Thing_/{hash}");
        let router = place.router.as_ref().unwrap();
        let foreign = router.declare_subscriber(key).await.unwrap();
        let ours = recorder.raw_subscription("thing", kind.name, &Qos::reliable(5)).unwrap();
        soon("the match", publisher.wait_for_subscribers(1)).await;
        soon("the message", async {
            loop {
                publisher.publish(&[0, 1, 0, 0, 7, 0, 0, 0]).unwrap();
                if tokio::time::timeout(SHORT, foreign.recv_async()).await.is_ok() {
                    break;
                }
            }
        })
        .await;
        assert_eq!(soon("the message", ours.next()).await.encoded[4], 7);
        let survey = recorder.survey();
        let thing = survey.iter().find(|one| one.topic == "/robot/thing").unwrap();
        assert_eq!(thing.type_hash.as_deref(), Some(&*hash));
    }
    player.close().await;
    recorder.close().await;
}

/// As another implementation sees them.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_graph_names_nodes_ends_and_the_hashes_of_their_types() {
    let place = Place::new();
    let (talker, doctor) = (place.node("talker"), place.node("doctor"));
    {
        let _scans = talker.publisher::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
        let _map = talker.subscription::<LaserScan>("map", &Qos::latched()).unwrap();
        let _service = talker.service::<GetParameters>("~/get_parameters").unwrap();
        let survey = soon("the survey", async {
            loop {
                let survey = doctor.survey();
                let is_there = |topic: &str| survey.iter().any(|one| one.topic == topic);
                if is_there("/robot/scan") && is_there("/robot/map") && is_there("/diagnostics") {
                    return survey;
                }
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        })
        .await;
        let scan = survey.iter().find(|one| one.topic == "/robot/scan").unwrap();
        assert_eq!((scan.role, &*scan.type_name), (Role::Publisher, LaserScan::TYPE_NAME));
        assert_eq!(
            (scan.owner(), scan.participant.vendor()),
            ("node /robot/talker".to_owned(), "Zenoh")
        );
        assert_eq!(scan.qos.to_string(), "best effort, volatile");
        let map = survey.iter().find(|one| one.topic == "/robot/map").unwrap();
        assert!(map.qos.is_transient_local() && map.role == Role::Subscription);
        assert!(survey.iter().all(|one| one.owner() != "node /robot/doctor"));

        let hash = LaserScan::type_hash().unwrap();
        let service = GetParameters::type_hash().unwrap();
        let ends = [
            "/NN/%/%robot/talker".to_owned(),
            format!(
                "/MP/%/%robot/talker/%robot%scan/sensor_msgs::msg::dds_::LaserScan_/{hash}/2::,5:,:,:,,"
            ),
            format!(
                "/MS/%/%robot/talker/%robot%map/sensor_msgs::msg::dds_::LaserScan_/{hash}/:1:,1:,:,:,,"
            ),
            format!(
                "/SS/%/%robot/talker/%robot%talker%get_parameters/rcl_interfaces::srv::dds_::GetParameters_/{service}/::,10:,:,:,,"
            ),
        ];
        let router = place.router.as_ref().unwrap();
        soon("all tokens", async {
            loop {
                let tokens = router.liveliness().get("@ros2_lv/7/**").await.unwrap();
                let mut keys = Vec::new();
                while let Ok(reply) = tokens.recv_async().await {
                    keys.push(reply.result().unwrap().key_expr().to_string());
                }
                let is_told = |end: &&String| keys.iter().any(|key| key.ends_with(*end));
                let missing: Vec<_> = ends.iter().filter(|end| !is_told(end)).collect();
                if missing.is_empty() {
                    break;
                }
                println!("{missing:#?} are not among {keys:#?}");
                tokio::time::sleep(SHORT).await;
            }
        })
        .await;
    }
    talker.close().await;
    doctor.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_router_that_ends_and_comes_back_brings_nodes_together_again() {
    let mut place = Place::new();
    let (talker, listener) = (place.node("talker"), place.node("listener"));
    {
        let publisher = talker.publisher::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
        let subscription = listener.subscription::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
        let map = talker.publisher::<LaserScan>("map", &Qos::latched()).unwrap();
        let map_heard = listener.subscription::<LaserScan>("map", &Qos::latched()).unwrap();
        matched(&publisher, &subscription).await;
        map.publish(scan(1)).unwrap();
        soon("the map", map_heard.next()).await;
        place.stop_router();
        soon("the end of the match", async {
            while publisher.subscriber_count() > 0 {
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        })
        .await;
        // Into the void: it does not block.
        publisher.publish(scan(1)).unwrap();
        map.publish(scan(2)).unwrap();
        place.start_router();
        matched(&publisher, &subscription).await;
        publisher.publish(scan(9)).unwrap();
        assert_eq!(soon("a message", subscription.next()).await.message.ranges.len(), 9);
        assert_eq!(soon("the map of the meantime", map_heard.next()).await.message.ranges.len(), 2);
    }
    talker.close().await;
    listener.close().await;
}

/// Lets the first client through to `port`, until it is told to take nothing more from it.
fn gate_to(port: u16) -> (u16, Sender<()>) {
    let gate = TcpListener::bind("127.0.0.1:0").unwrap();
    let own_port = gate.local_addr().unwrap().port();
    let (shut, is_shut) = channel();
    std::thread::spawn(move || {
        let mut client = gate.accept().unwrap().0;
        let mut router = TcpStream::connect(("127.0.0.1", port)).unwrap();
        let mut back = (router.try_clone().unwrap(), client.try_clone().unwrap());
        std::thread::spawn(move || std::io::copy(&mut back.0, &mut back.1));
        let mut bytes = vec![0; 1 << 16];
        while is_shut.try_recv() == Err(TryRecvError::Empty) {
            let read = client.read(&mut bytes).unwrap();
            router.write_all(&bytes[..read]).unwrap();
        }
        // The connection lives on until the test ends.
        let _ended = is_shut.recv();
    });
    (own_port, shut)
}

/// A process that sent images to a machine which had gone took 10 s to end.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_link_that_takes_nothing_more_does_not_hold_up_the_end() {
    let place = Place::new();
    let (port, shut) = gate_to(place.port);
    let transport = Place { port, router: None }.transport("client");
    let talker = Node::start_on(transport, "talker", &arguments("/robot", &[])).unwrap();
    let listener = place.node("listener");
    {
        let publisher = talker.publisher::<Image>("image", &Qos::sensor(5)).unwrap();
        let subscription = listener.subscription::<Image>("image", &Qos::sensor(5)).unwrap();
        matched(&publisher, &subscription).await;
        shut.send(()).unwrap();
        for _ in 0..10 {
            publisher.publish(Image { data: vec![7; 4_900_000], ..Image::default() }).unwrap();
        }
    }
    let begun = Instant::now();
    talker.close().await;
    let took = begun.elapsed();
    assert!(took < Duration::from_secs(8), "{took:?}");
    listener.close().await;
}

/// A node that was told to wait for its router as long as it takes was deaf to SIGTERM.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_waits_for_a_router_without_end_ends_when_asked() {
    let mut place = Place::new();
    place.stop_router();
    let host = Host::on(place.transport_that_looks("peer", u64::MAX)).unwrap();
    let shutdown = host.shutdown_signal();
    let start = move || host.node("patient", &arguments("/robot", &[]));
    let mut started = tokio::task::spawn_blocking(start);
    assert!(tokio::time::timeout(SHORT, &mut started).await.is_err());
    shutdown.trigger();
    soon("the end of the wait", started).await.unwrap().unwrap().close().await;
}

/// Without a router nodes start, say so, and are on their own.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_starts_before_its_router_and_offers_its_services() {
    let mut place = Place::new();
    place.stop_router();
    let start = |name: &str| {
        let transport = place.transport("peer");
        Node::start_on(transport, name, &arguments("/robot", &[])).unwrap()
    };
    let (talker, listener) = (start("talker"), start("listener"));
    place.start_router();
    {
        let _live = talker.serve_parameters(&OwnParameters::default()).unwrap();
        let client = listener.service_client::<GetParameters>("talker/get_parameters").unwrap();
        let request = GetParametersRequest { names: vec!["beams".to_owned()] };
        let response = client.ask(&request, PATIENCE).await.unwrap();
        assert_eq!(response.values[0].integer_value, 7);
        let reports =
            listener.subscription::<DiagnosticArray>("/diagnostics", &Qos::reliable(9)).unwrap();
        let report = soon("a report", reports.next()).await;
        assert!(!report.message.status.is_empty());
    }
    talker.close().await;
    listener.close().await;
}
