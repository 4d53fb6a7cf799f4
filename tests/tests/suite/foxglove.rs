//! The topics of the suite for a viewer that speaks Foxglove's websocket protocol.

use std::time::Duration;

use futures::{SinkExt, StreamExt};
use msgs::sensor_msgs::{LaserScan, PointCloud2};
use msgs::{cdr, schema_of};
use node_shell::{Node, Qos, RosArguments};
use serde_json::{Value, json};
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;

use crate::bags::small_room;
use crate::program::Running;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// What stands before a message: the opcode, the subscription, the time.
const HEAD_BYTES: usize = 13;

/// The suite, and the address for viewers that it printed.
struct Suite {
    program: Running,
    url: String,
}

impl Suite {
    fn start(arguments: &[&str]) -> Self {
        let (program, url) = Running::start_and_hear(arguments, "foxglove: ");
        Self { program, url }
    }

    /// Connects with one of the protocols, or with none; else the status of the refusal.
    async fn connect(
        &self,
        origin: &str,
        protocol: Option<&str>,
    ) -> Result<WebSocketStream<TcpStream>, u16> {
        let address = self.url.trim_start_matches("ws://").split('/').next().unwrap();
        let stream = TcpStream::connect(address).await.unwrap();
        let mut request = (&*self.url).into_client_request().unwrap();
        request.headers_mut().insert("Origin", origin.parse().unwrap());
        if let Some(protocol) = protocol {
            request.headers_mut().insert("Sec-WebSocket-Protocol", protocol.parse().unwrap());
        }
        match tokio_tungstenite::client_async(request, stream).await {
            Ok((socket, answer)) => {
                let chosen = answer.headers()["Sec-WebSocket-Protocol"].to_str().unwrap();
                assert_eq!(
                    Some(chosen),
                    protocol.map(|offered| offered.split(", ").last().unwrap())
                );
                Ok(socket)
            }
            Err(tokio_tungstenite::tungstenite::Error::Http(answer)) => {
                Err(answer.status().as_u16())
            }
            Err(error) => panic!("{error}"),
        }
    }
}

/// The next text of the server.
async fn text(socket: &mut WebSocketStream<TcpStream>) -> Value {
    loop {
        let message = timeout(PATIENCE, socket.next()).await.unwrap().unwrap().unwrap();
        if let Message::Text(text) = message {
            return serde_json::from_str(&text).unwrap();
        }
    }
}

/// The next message of a subscription, in CDR.
async fn message(socket: &mut WebSocketStream<TcpStream>, subscription: u32) -> Vec<u8> {
    loop {
        let message = timeout(PATIENCE, socket.next()).await.unwrap().unwrap().unwrap();
        let Message::Binary(bytes) = message else { continue };
        assert_eq!(bytes[0], 1, "the opcode of a message");
        if bytes[1..5] == subscription.to_le_bytes() {
            return bytes[HEAD_BYTES..].to_vec();
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_viewer_gets_the_topics_that_it_subscribes_to() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let namespace = format!("/foxglove_{}", std::process::id());
    let rule = format!("__ns:={namespace}");
    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
    let node = Node::start("outsider", &arguments).unwrap();
    let maps = node.subscription::<PointCloud2>("static_map", &Qos::latched()).unwrap();
    // The name of the suite's own stays for viewers, whatever the driver's is.
    let laser = format!("scan:={namespace}/laser");
    let suite =
        Suite::start(&["up", "--foxglove", "127.0.0.1:0", "--ros-args", "-r", &rule, "-r", &laser]);
    timeout(PATIENCE, maps.wait_for_publishers(1)).await.unwrap();

    assert_eq!(
        suite.connect("http://evil.example", Some("foxglove.sdk.v1")).await.err(),
        Some(403)
    );
    assert_eq!(suite.connect("http://localhost:8080", None).await.err(), Some(400));
    suite.connect("http://localhost:8080", Some("foxglove.websocket.v1")).await.unwrap();
    let offered = "unknown, foxglove.sdk.v1";
    let mut viewer = suite.connect("https://app.foxglove.dev", Some(offered)).await.unwrap();
    assert_eq!(text(&mut viewer).await["op"], "serverInfo");
    let channels = text(&mut viewer).await["channels"].take();
    let channel = |topic: &str| {
        channels.as_array().unwrap().iter().find(|channel| channel["topic"] == topic).unwrap()
    };
    for (topic, type_name) in
        [("/static_map", "sensor_msgs/msg/PointCloud2"), ("/tracks", "stillmap_msgs/msg/Tracks")]
    {
        let told = channel(topic);
        assert_eq!(told["schemaName"], type_name);
        assert_eq!(told["schema"].as_str().map(str::to_owned), schema_of(type_name));
    }
    let layout = include_str!("../../../config/foxglove/stillmap.json");
    let layout: Value = serde_json::from_str(layout).unwrap();
    for topic in layout["configById"]["3D!map"]["topics"].as_object().unwrap().keys() {
        channel(topic);
    }

    let wanted = json!({ "op": "subscribe", "subscriptions": [
        { "id": 7, "channelId": channel("/static_map")["id"] }, { "id": 8, "channelId": channel("/scan")["id"] },
    ]});
    viewer.send(Message::text(wanted.to_string())).await.unwrap();
    viewer
        .send(Message::text(r#"{"op":"subscribe","subscriptions":[{"id":9,"channelId":4000}]}"#))
        .await
        .unwrap();
    assert_eq!(text(&mut viewer).await["message"], "there is no channel 4000");
    // One that takes nothing: it is waited for by nobody.
    let mut stopped = suite.connect("https://app.foxglove.dev", Some(offered)).await.unwrap();
    stopped.send(Message::text(wanted.to_string())).await.unwrap();

    let mut play = vec!["play".to_owned(), bag.display().to_string(), "--rate=4".to_owned()];
    for (from, name) in [
        ("/scan", "laser"),
        ("/pose", "pose"),
        ("/camera/depth/image_raw", "depth/image"),
        ("/camera/depth/camera_info", "depth/camera_info"),
    ] {
        let to = format!("{namespace}/{name}");
        play.push(format!("--topics={from}"));
        play.push(format!("--remap={from}:={to}"));
        play.push(format!("--wait-for={to}"));
    }
    let player = Running::start(play);
    let scan: LaserScan = cdr::decode(&message(&mut viewer, 8).await).unwrap();
    assert!(!scan.ranges.is_empty());
    let whole = timeout(PATIENCE, async {
        loop {
            let map: PointCloud2 = cdr::decode(&message(&mut viewer, 7).await).unwrap();
            if map.width > 1_000 {
                break;
            }
        }
    });
    whole.await.unwrap();
    assert!(player.wait().success());
    // Whoever comes later has the last map at once, and who wants no more has no more.
    let mut later = suite.connect("https://app.foxglove.dev", Some(offered)).await.unwrap();
    later.send(Message::text(wanted.to_string())).await.unwrap();
    let last: PointCloud2 = cdr::decode(&message(&mut later, 7).await).unwrap();
    // Voxels may have gone meanwhile.
    assert!(last.width > 1_000, "{}", last.width);
    later.send(Message::text(r#"{"op":"unsubscribe","subscriptionIds":[7,8,7]}"#)).await.unwrap();
    later.send(Message::text(r#"{"op":"getParameters"}"#)).await.unwrap();
    assert_eq!(text(&mut later).await["message"], "stillmap has no getParameters for viewers");

    drop((viewer, stopped, later, maps));
    node.close().await;
    assert!(suite.program.interrupt());
}
