//! Datagrams made by hand to use up a node's memory: none of them may reach the DDS library.
//!
//! Each goes from the loopback, in the name of a participant that the node has discovered. A watch kills what grows, so that a
//! fault costs the test and not the machine.

mod packets;

use std::net::{Ipv4Addr, UdpSocket};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use free_domain::FreeDomain;
use geometry::Stamp;
use msgs::convert;
use msgs::diagnostic_msgs::DiagnosticArray;
use node_shell::{Node, Qos, RosArguments, Subscription, Transport};
use rustix::process::{Pid, Signal, kill_process};
use tokio::time::timeout;

use super::end::PATIENCE;
use crate::bags::{bag_of, pose, ten_stamps};

/// What no node may grow beyond. The suite has some 60 MB here, and without the filter 300 MB more each second.
const MOST_BYTES: u64 = 500 << 20;
/// How often memory is looked at.
const LOOK: Duration = Duration::from_millis(20);
/// The participants of the domain that are sent to; those of the test are the first.
const PARTICIPANTS: u16 = 8;
/// How often each is sent: a single one must not count for lost.
const TIMES: u32 = 50;

/// A process that is killed when it grows.
struct Watched {
    child: Child,
    pid: Pid,
    most_bytes: Arc<AtomicU64>,
    ended: Arc<AtomicBool>,
}

impl Watched {
    fn start(domain_id: u16, arguments: &[&str]) -> Self {
        let child = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
            .args(arguments)
            .env("ROS_DOMAIN_ID", domain_id.to_string())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let pid = Pid::from_raw(i32::try_from(child.id()).unwrap()).unwrap();
        let (most_bytes, ended) = (Arc::<AtomicU64>::default(), Arc::<AtomicBool>::default());
        let (most, end) = (Arc::clone(&most_bytes), Arc::clone(&ended));
        std::thread::spawn(move || {
            while !end.load(Ordering::Relaxed) {
                let bytes = resident_bytes(pid).unwrap_or(0);
                most.fetch_max(bytes, Ordering::Relaxed);
                if bytes > MOST_BYTES {
                    // It may have ended meanwhile.
                    let _ = kill_process(pid, Signal::KILL);
                    return;
                }
                std::thread::sleep(LOOK);
            }
        });
        Self { child, pid, most_bytes, ended }
    }

    fn is_up(&mut self) -> bool {
        self.child.try_wait().unwrap().is_none()
    }

    fn interrupt(mut self) -> bool {
        kill_process(self.pid, Signal::INT).unwrap();
        self.child.wait().unwrap().success()
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn resident_bytes(pid: Pid) -> Option<u64> {
    let path = format!("/proc/{}/statm", pid.as_raw_nonzero());
    let pages = std::fs::read_to_string(path).ok()?;
    let pages: u64 = pages.split_whitespace().nth(1)?.parse().ok()?;
    Some(pages * rustix::param::page_size() as u64)
}

/// Waits until each of the nodes has reported, from a second after now on, to a subscription that is made now: what grows has
/// grown by then.
async fn all_report(ear: &Node, names: &[String], when: &str) -> Duration {
    let start = Instant::now();
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    let since =
        Stamp::from_nanos(i64::try_from((now + Duration::from_secs(1)).as_nanos()).unwrap());
    let reports: Subscription<DiagnosticArray> =
        ear.subscription("/diagnostics", &Qos::reliable(100)).unwrap();
    let mut awaited = names.to_vec();
    let ready = async {
        while !awaited.is_empty() {
            let report = reports.next().await.message;
            if convert::stamp_from_time(report.header.stamp) > since {
                awaited.retain(|node| report.part(node).is_none());
            }
        }
    };
    let in_time = timeout(PATIENCE, ready).await.is_ok();
    assert!(in_time, "{when}: {awaited:?} do not report");
    start.elapsed()
}

/// Sends each packet to a program and expects it to go on as if nothing had come.
async fn withstands(program: &[&str], nodes: &[&str]) {
    let domain = FreeDomain::new();
    let namespace = format!("/hostile_{}", std::process::id());
    let rule = format!("__ns:={namespace}");
    let node = |name: &str| {
        let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
        Node::start_on(Transport::on_domain(domain.number()).unwrap(), name, &arguments).unwrap()
    };
    let (ear, other) = (node("ear"), node("other"));
    let prefix = async {
        loop {
            let found = other.survey();
            if let Some(found) = found.iter().find(|one| one.topic == "/diagnostics") {
                return found.participant.0;
            }
            tokio::time::sleep(LOOK).await;
        }
    };
    let prefix = timeout(PATIENCE, prefix).await.unwrap();
    let line = [program, &["--ros-args", "-r", &rule]].concat();
    let mut target = Watched::start(domain.number(), &line);
    let names: Vec<_> = nodes.iter().map(|node| format!("{namespace}/{node}")).collect();
    all_report(&ear, &names, "at the start").await;
    let before = resident_bytes(target.pid).unwrap();

    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    // RTPS 2.5, section 9.6.2.3.
    let first_port = 7410 + 250 * domain.number();
    for (name, packet) in packets::that_end_a_node() {
        target.most_bytes.store(0, Ordering::Relaxed);
        for count in 0..TIMES {
            let datagram = packet(prefix, 1_000_000 + count);
            for port in (first_port..).take(usize::from(2 * PARTICIPANTS)) {
                // Nobody need be there.
                let _ = socket.send_to(&datagram, (Ipv4Addr::LOCALHOST, port));
            }
        }
        let took = all_report(&ear, &names, &format!("{program:?} after {name}")).await;
        let most = target.most_bytes.load(Ordering::Relaxed);
        let (most_mb, before_mb) = (most as f64 * 1e-6, before as f64 * 1e-6);
        println!(
            "{program:?}, {name}: {before_mb:.0} MB before, at most {most_mb:.0}; reports {took:?} later"
        );
        assert!(target.is_up(), "{program:?} ended by {name}, at {most_mb:.0} MB");
        assert!(most < MOST_BYTES, "{program:?}, {name}: {most_mb:.0} MB");
    }
    assert!(target.interrupt(), "{program:?}");
    ear.close().await;
    other.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_datagram_ends_a_node_the_suite_or_the_player() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "poses.mcap", |topics| {
        topics.messages("/pose", ten_stamps().map(|stamp| (stamp, pose(stamp))));
    });
    withstands(&["node", "detection"], &["detection"]).await;
    withstands(&["up"], &["detection", "segmentation", "reconstruction"]).await;
    withstands(&["play", bag.to_str().unwrap(), "--loop"], &["bag_player"]).await;
}
