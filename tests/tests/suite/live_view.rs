//! The live view of the suite in one process, as a browser gets it: the map that `static_map` has, for its own page alone.

#[path = "../../../nodes/live-view/src/tests/decoded.rs"]
mod decoded;

use std::collections::BTreeMap;
use std::time::Duration;

use futures::{SinkExt, StreamExt};
use geometry::{Cloud, VoxelGrid, VoxelKey};
use msgs::convert;
use msgs::sensor_msgs::PointCloud2;
use nalgebra::Point3;
use node_shell::{Node, Qos, RosArguments};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{Instant, sleep_until, timeout};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::{self, Message};

use crate::bags::small_room;
use crate::playing::{TO_DETECTION, play};
use crate::program::Running;
use decoded::DecodedPage;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// The map that a page shows is taken for the last one when no other has come for this long: an update comes twice a second.
const SILENCE: Duration = Duration::from_secs(3);

/// A program that serves a page.
struct Served {
    program: Running,
    /// As it was printed, without `http://`.
    address: String,
    /// What follows the address of the page: the token, where there is one.
    query: String,
}

impl Served {
    fn start(arguments: &[&str]) -> Self {
        let (program, url) = Running::start_and_hear(arguments, "live view: http://");
        let (address, query) = url.split_once('/').unwrap();
        // As it is announced on a machine without a network.
        let address = address.replace("0.0.0.0", "127.0.0.1");
        Self { program, address, query: query.to_owned() }
    }

    /// The status line of the answer to a request for the data.
    async fn status(&self, host: &str, origin: Option<&str>, query: &str) -> String {
        let mut stream = TcpStream::connect(&self.address).await.unwrap();
        let origin = origin.map_or(String::new(), |origin| format!("Origin: {origin}\r\n"));
        let request = format!(
            "GET /live{query} HTTP/1.1\r\nHost: {host}\r\n{origin}Connection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        );
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = vec![0; 12];
        timeout(PATIENCE, stream.read_exact(&mut answer)).await.unwrap().unwrap();
        String::from_utf8(answer).unwrap()
    }

    /// A browser that has connected.
    async fn look(&self) -> WebSocketStream<TcpStream> {
        let stream = TcpStream::connect(&self.address).await.unwrap();
        let url = format!("ws://{}/live{}", self.address, self.query);
        let mut request = url.into_client_request().unwrap();
        let origin = format!("http://{}", self.address);
        request.headers_mut().insert("Origin", origin.parse().unwrap());
        tokio_tungstenite::client_async(request, stream).await.unwrap().0
    }
}

/// Shows a message.
async fn show(
    socket: &mut WebSocketStream<TcpStream>,
    page: &mut DecodedPage,
    message: Result<Message, tungstenite::Error>,
) {
    if let Message::Binary(bytes) = message.unwrap() {
        page.take(&bytes);
        socket.send(Message::text("shown")).await.unwrap();
    }
}

/// Whether a page has the points of this map and no others.
fn has(page: &DecodedPage, map: &Cloud) -> bool {
    let grid = VoxelGrid::new(f64::from(page.voxel_edge_m)).unwrap();
    let keyed = |point_m: &Point3<f32>| (grid.key(point_m), *point_m);
    let expected: BTreeMap<VoxelKey, Point3<f32>> = map.points_m.iter().map(keyed).collect();
    assert_eq!(expected.len(), map.points_m.len(), "a point for each voxel");
    let half_m = f64::from(page.step_m) / 2.0 + 1e-5;
    let shown: Vec<Point3<f64>> = page.points().map(|(_, at_m)| at_m).collect();
    // A step may lead over the face of a voxel, and so the points are compared and not the voxels.
    shown.len() == expected.len()
        && shown.iter().all(|at_m| {
            grid.key(at_m).with_neighbours().any(|key| {
                let point = expected.get(&key);
                point.is_some_and(|point| (at_m - point.cast::<f64>()).amax() <= half_m)
            })
        })
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_browser_gets_the_map_that_the_topic_has() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let namespace = format!("/live_view_{}", std::process::id());
    let rule = format!("__ns:={namespace}");
    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
    let node = Node::start("outsider", &arguments).unwrap();
    let maps = node.subscription::<PointCloud2>("static_map", &Qos::latched()).unwrap();
    let served = Served::start(&["up", "--view", "127.0.0.1:0", "--ros-args", "-r", &rule]);
    timeout(PATIENCE, maps.wait_for_publishers(1)).await.unwrap();

    let (mut socket, mut page) = (served.look().await, DecodedPage::default());
    // One that takes nothing: it is waited for by nobody.
    let _stopped = served.look().await;
    let arguments = play(&bag, &namespace, &TO_DETECTION).into_iter();
    let player = Running::start(arguments.chain(["--rate=4".to_owned()]));
    let is_filled = async {
        while page.total <= 1_000 {
            let message = socket.next().await.unwrap();
            show(&mut socket, &mut page, message).await;
        }
    };
    timeout(PATIENCE, is_filled).await.expect("the page has a map");
    assert!(player.wait().success());

    // The nodes may be behind: after each map there may be another, which the page is to have then.
    let (mut last, mut came) = (None, Instant::now());
    let has_the_last = async {
        loop {
            let is_shown = last.as_ref().is_some_and(|map| has(&page, map));
            tokio::select! {
                map = maps.next() => {
                    last = Some(convert::cloud_from_message(&map.message).unwrap());
                    came = Instant::now();
                }
                message = socket.next() => show(&mut socket, &mut page, message.unwrap()).await,
                () = sleep_until(came + SILENCE), if is_shown => break,
            }
        }
    };
    let has_the_last = timeout(PATIENCE, has_the_last).await;
    let points = last.map_or(0, |map| map.points_m.len());
    assert!(has_the_last.is_ok(), "{} points on the page, {points} in the map", page.total);
    assert!(points > 1_000, "{points}");
    drop((socket, maps));
    node.close().await;
    assert!(served.program.interrupt());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_has_no_business_with_the_data_is_refused() {
    const REFUSED: &str = "HTTP/1.1 403";
    const ACCEPTED: &str = "HTTP/1.1 101";
    let here = Served::start(&["view", "127.0.0.1:0"]);
    let own = format!("http://{}", here.address);
    assert_eq!(here.status(&here.address, Some(&own), "").await, ACCEPTED);
    assert_eq!(here.status("evil.example", Some("http://evil.example"), "").await, REFUSED);
    assert_eq!(here.status(&here.address, Some("http://evil.example"), "").await, REFUSED);
    assert_eq!(here.status(&here.address, None, "").await, REFUSED);
    assert!(here.program.interrupt());

    let everywhere = Served::start(&["view", "0.0.0.0:0"]);
    assert!(everywhere.query.starts_with("?token="), "{}", everywhere.query);
    let (address, query) = (everywhere.address.clone(), everywhere.query.clone());
    let own = format!("http://{address}");
    assert_eq!(everywhere.status(&address, Some(&own), &query).await, ACCEPTED);
    for wrong in ["", "?token=", "?token=0123", &query[..query.len() - 1], &format!("{query}0")] {
        assert_eq!(everywhere.status(&address, Some(&own), wrong).await, REFUSED, "{wrong}");
    }
    assert_eq!(everywhere.status(&address, Some("http://evil.example"), &query).await, REFUSED);
    let _looking = everywhere.look().await;
    assert!(everywhere.program.interrupt(), "a browser does not keep it");
}
