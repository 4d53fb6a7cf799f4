//! How the nodes end.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::stillmap_msgs::StageReport;
use node_shell::{Node, Qos, RosArguments, ending_signals};
use rustix::process::Signal;
use tokio::time::timeout;

use crate::bags::{bag_of, pose, ten_stamps};
use crate::overload::send_cycles;
use crate::program::Running;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// In this time a node has ended, on however busy a machine; what waits for a lease takes longer. It takes 10 ms, and with a
/// map that is synced to an idle disk 100 ms; `ros2 launch` waits for 5 s before it sends the next, harder signal.
pub(crate) const LONGEST_END: Duration = Duration::from_secs(25);

/// Each program, and the nodes that it is.
const PROGRAMS: [(&[&str], &[&str]); 11] = [
    (&["node", "detection"], &["detection"]),
    (&["node", "segmentation"], &["segmentation"]),
    (&["node", "reconstruction"], &["reconstruction"]),
    (&["node", "pose"], &["pose"]),
    (&["node", "lidar-odometry"], &["lidar_odometry"]),
    (&["node", "compression"], &["compression"]),
    (&["up"], &["detection", "segmentation", "reconstruction"]),
    (&["up", "--pose", "visual"], &["detection", "segmentation", "reconstruction", "pose"]),
    (&["up", "--pose", "lidar"], &["detection", "reconstruction", "lidar_odometry"]),
    (&["play", BAG, "--loop"], &["bag_player"]),
    (&["record", "--overwrite", "-o", RECORDED], &["bag_recorder"]),
];
/// Stands for the path of the bag that is played, ...
const BAG: &str = "BAG";
/// ... and for that of the one that is recorded.
const RECORDED: &str = "RECORDED";

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_node_ends_in_order_on_each_signal_and_on_two() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "poses.mcap", |topics| {
        topics.messages("/pose", ten_stamps().map(|stamp| (stamp, pose(stamp))));
    });
    let namespace = format!("/ending_{}", std::process::id());
    let rule = format!("__ns:={namespace}");
    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
    let ear = Node::start("ear", &arguments).unwrap();
    let reports = ear.subscription::<DiagnosticArray>("/diagnostics", &Qos::reliable(100)).unwrap();
    let recorded = folder.path().join("recorded.mcap");
    for (count, (program, nodes)) in PROGRAMS.iter().enumerate() {
        // Somebody ends it, or the connection that it was started from is closed; what `nohup` has started, as maybe this, takes no notice of
        // that.
        let hangs_up = count % 2 == 1 && ending_signals().contains(&Signal::HUP.as_raw());
        let other = if hangs_up { ("hangup", Signal::HUP) } else { ("term", Signal::TERM) };
        for (name, signal) in [("twice int", None), (other.0, Some(other.1))] {
            let name = name.replace(' ', "_");
            let place = format!("{namespace}/{name}_{count}");
            let path = |word: &&str| match *word {
                BAG => bag.display().to_string(),
                RECORDED => recorded.display().to_string(),
                word => word.to_owned(),
            };
            let mut line: Vec<String> = program.iter().map(path).collect();
            line.extend(["--ros-args", "-r", &format!("__ns:={place}")].map(str::to_owned));
            let map = folder.path().join(format!("{name}_{count}.ply"));
            if nodes.contains(&"reconstruction") {
                let value = format!("reconstruction:map_file:={}", map.display());
                line.extend(["-p".to_owned(), value]);
            }
            let running = Running::start(&line);
            let mut awaited: Vec<String> =
                nodes.iter().map(|node| format!("{place}/{node}")).collect();
            let ready = async {
                while !awaited.is_empty() {
                    let report = reports.next().await.message;
                    awaited.retain(|node| report.part(node).is_none());
                }
            };
            timeout(PATIENCE, ready).await.unwrap_or_else(|_| panic!("{line:?} does not report"));
            let asked = Instant::now();
            let is_well = match signal {
                None => running.interrupt_twice(),
                Some(signal) => running.end(signal).success(),
            };
            assert!(is_well, "{line:?} on {name}");
            println!("{} on {name}: {:?}", program.join(" "), asked.elapsed());
            assert!(asked.elapsed() < LONGEST_END, "{line:?} on {name}: {:?}", asked.elapsed());
            assert_eq!(recorded.is_file(), program.contains(&RECORDED), "{line:?} on {name}");
            assert!(!map.exists(), "nothing was mapped: {line:?} on {name}");
        }
    }
    drop(reports);
    ear.close().await;
}

/// How often a suite with a map is ended by two signals, and the variable that names another number.
const ROUNDS: (&str, usize) = ("STILLMAP_ENDING_ROUNDS", 3);

/// The second signal of `ros2 launch` comes while the map is written: the file is whole all the same.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_map_is_saved_whole_when_a_second_signal_comes_meanwhile() {
    let folder = tempfile::tempdir().unwrap();
    let rounds = std::env::var(ROUNDS.0).map_or(ROUNDS.1, |text| text.parse().unwrap());
    for round in 0..rounds {
        let rule = format!("__ns:=/ending_with_a_map_{}_{round}", std::process::id());
        let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
        let robot = Node::start("robot", &arguments).unwrap();
        let mapped =
            robot.subscription::<StageReport>("reconstruction/report", &Qos::reliable(50)).unwrap();
        let map = folder.path().join(format!("map_{round}.ply"));
        let map_file = format!("reconstruction:map_file:={}", map.display());
        let up = Running::start(["up", "--ros-args", "-r", &rule, "-p", &map_file]);
        let has_mapped = async {
            tokio::select! {
                () = send_cycles(&robot) => {}
                () = async { while !mapped.next().await.message.processed {} } => {}
            }
        };
        timeout(PATIENCE, has_mapped).await.expect("the suite maps");
        let is_well = tokio::task::spawn_blocking(move || up.interrupt_twice());
        assert!(is_well.await.unwrap(), "round {round}");
        let points = geometry::ply::decode(&std::fs::read(&map).unwrap()).unwrap().len();
        assert!(points > 100, "round {round}: {points} points");
        drop(mapped);
        robot.close().await;
    }
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, rounds, "nothing but the maps is left");
}

/// A process that grows beyond its ceiling ends with a failure, so that whoever started it starts it again.
#[test]
#[cfg(target_os = "linux")]
fn a_process_beyond_its_memory_says_so_and_ends_with_a_failure() {
    // `EX_SOFTWARE` of sysexits.h; a mebibyte is less than any process has.
    const EX_SOFTWARE: i32 = 70;
    let output = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
        .args(["node", "segmentation"])
        .env("STILLMAP_MEMORY_LIMIT_MIB", "1")
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(EX_SOFTWARE), "{stderr}");
    let line = stderr.lines().find(|line| line.contains("beyond its ceiling of 1 MB"));
    assert!(line.is_some_and(|line| line.contains("ERROR")), "{stderr}");
}
