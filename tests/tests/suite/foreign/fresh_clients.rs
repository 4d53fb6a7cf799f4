//! Services of the suite's nodes, called the moment a fresh process sees them, as `ros2 lifecycle get` does. Once 5 of 20 such
//! calls were never answered: the response went out before the client's reader of responses was found.

use std::path::PathBuf;
use std::process::Stdio;
use std::time::{Duration, Instant};

use msgs::lifecycle_msgs::{GetState, GetStateRequest};
use msgs::rcl_interfaces::{
    DescribeParameters, DescribeParametersRequest, ListParameters, ListParametersRequest,
};
use msgs::{RosService, cdr};
use tokio::io::AsyncWriteExt;
use tokio::process::Command;
use tokio::time::timeout;

use super::build::{Make, program};
use super::definitions;
use super::place::{PATIENCE, Place};
use super::services::fast_dds_client;
use crate::program::Running;

/// How many processes of each make call, one after the other; `STILLMAP_FRESH_CLIENTS` names another number.
pub(super) fn fresh_processes() -> usize {
    std::env::var("STILLMAP_FRESH_CLIENTS").map_or(10, |text| text.parse().unwrap())
}

/// A program that makes one call.
enum FreshClient {
    Cyclone(PathBuf),
    FastDds(PathBuf),
}

impl FreshClient {
    /// Those that can be had.
    async fn all() -> Vec<Self> {
        let cyclone = program(Make::CyclonePython).map(|python| Self::Cyclone(python.path));
        let fast_dds = match program(Make::FastDds) {
            Some(_) => Some(Self::FastDds(fast_dds_client("once").await)),
            None => None,
        };
        cyclone.into_iter().chain(fast_dds).collect()
    }

    /// The response of a service to a fresh process.
    async fn call<S: RosService>(
        &self,
        place: &Place,
        service: &str,
        request: &S::Request,
    ) -> S::Response {
        let service = format!("{}/{service}", place.namespace());
        let (mut client, input) = match self {
            Self::Cyclone(python) => {
                let mut client = Command::new(python);
                let once = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/cyclone_python/once.py");
                client.args(["-B", once]).env("STILLMAP_MSG_FOLDER", definitions::folder());
                (client, serde_json::to_string(request).unwrap())
            }
            Self::FastDds(once) => {
                (Command::new(once), hexadecimal(&cdr::encode(request).unwrap()))
            }
        };
        client.args([&place.domain_id().to_string(), &service, S::TYPE_NAME]);
        client.stdin(Stdio::piped()).stdout(Stdio::piped()).kill_on_drop(true);
        let mut client = client.spawn().unwrap();
        let mut stdin = client.stdin.take().unwrap();
        stdin.write_all(format!("{input}\n").as_bytes()).await.unwrap();
        drop(stdin);
        let output = timeout(PATIENCE, client.wait_with_output()).await;
        let output = output.unwrap_or_else(|_| panic!("{service} does not answer")).unwrap();
        assert!(output.status.success(), "{service}: {}", output.status);
        match self {
            Self::Cyclone(_) => serde_json::from_slice(&output.stdout).unwrap(),
            Self::FastDds(_) => cdr::decode(&bytes(&output.stdout)).unwrap(),
        }
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn bytes(digits: &[u8]) -> Vec<u8> {
    let digits = std::str::from_utf8(digits).unwrap().trim_end();
    let byte = |at| u8::from_str_radix(&digits[at..at + 2], 16).unwrap();
    (0..digits.len()).step_by(2).map(byte).collect()
}

/// Lets fresh processes of each make ask these nodes in turn: for the state, for the names of the parameters, and what two of them are.
async fn are_answered(place: &Place, nodes: &[&str]) {
    let count = fresh_processes();
    for client in FreshClient::all().await {
        let mut slowest = Duration::ZERO;
        for (nth, node) in (0..count).zip(nodes.iter().cycle()) {
            let started = Instant::now();
            // Each kind at each node.
            match (nth + nth / nodes.len()) % 3 {
                0 => {
                    let (service, request) =
                        (format!("{node}/get_state"), GetStateRequest::default());
                    let response = client.call::<GetState>(place, &service, &request).await;
                    assert_eq!(response.current_state.label, "active", "{node}");
                }
                1 => {
                    // A part of the name: all names of pose do not fit into a datagram, nor do they reach clients of Fast DDS.
                    let request = ListParametersRequest { prefixes: Vec::new(), depth: 1 };
                    let service = format!("{node}/list_parameters");
                    let response = client.call::<ListParameters>(place, &service, &request).await;
                    let names = response.result.names;
                    assert!(names.contains(&"use_sim_time".to_owned()), "{node}: {names:?}");
                }
                _ => {
                    let names = ["autostart", "use_sim_time"].map(str::to_owned).to_vec();
                    let request = DescribeParametersRequest { names: names.clone() };
                    let service = format!("{node}/describe_parameters");
                    let response =
                        client.call::<DescribeParameters>(place, &service, &request).await;
                    let described: Vec<String> =
                        response.descriptors.into_iter().map(|one| one.name).collect();
                    assert_eq!(described, names, "{node}");
                }
            }
            slowest = slowest.max(started.elapsed());
        }
        let make = match client {
            FreshClient::Cyclone(_) => "Cyclone DDS",
            FreshClient::FastDds(_) => "Fast DDS",
        };
        println!("{nodes:?}: {count} of {count} of {make} answered, the slowest took {slowest:?}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_fresh_client_of_a_composed_suite_is_answered() {
    let place = Place::new().await;
    let rule = format!("__ns:={}", place.namespace());
    let up =
        Running::start_on(place.domain_id(), ["up", "--pose", "visual", "--ros-args", "-r", &rule]);
    are_answered(&place, &["detection", "segmentation", "reconstruction", "pose"]).await;
    assert!(up.interrupt());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_fresh_client_of_a_node_of_its_own_process_is_answered() {
    let place = Place::new().await;
    let rule = format!("__ns:={}", place.namespace());
    let nodes =
        ["detection", "segmentation", "reconstruction", "pose", "compression", "lidar_odometry"];
    let running = nodes.map(|node| {
        let program = node.replace('_', "-");
        Running::start_on(place.domain_id(), ["node", &program, "--ros-args", "-r", &rule])
    });
    are_answered(&place, &nodes).await;
    assert!(running.into_iter().all(Running::interrupt));
}

/// All parameters of `pose` take several datagrams.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_fresh_client_of_cyclone_dds_gets_a_response_of_many_datagrams() {
    let Some(python) = program(Make::CyclonePython) else { return };
    let client = FreshClient::Cyclone(python.path);
    let place = Place::new().await;
    let rule = format!("__ns:={}", place.namespace());
    let pose = Running::start_on(place.domain_id(), ["node", "pose", "--ros-args", "-r", &rule]);
    let request = ListParametersRequest::default();
    let listed = client.call::<ListParameters>(&place, "pose/list_parameters", &request).await;
    let names = listed.result.names;
    let request = DescribeParametersRequest { names: names.clone() };
    let service = "pose/describe_parameters";
    let described = client.call::<DescribeParameters>(&place, service, &request).await;
    let bytes = cdr::encoded_len(&described).unwrap();
    // Ten datagrams of Ethernet.
    assert!(bytes > 15_000, "{bytes} bytes");
    assert!(described.descriptors.iter().map(|one| &one.name).eq(&names));
    assert!(pose.interrupt());
}
