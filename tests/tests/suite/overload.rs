//! A suite whose input comes faster than any machine can process it.

use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use geometry::{CameraModel, DepthImage, DepthPixels, Distortion, Stamp};
use msgs::convert;
use msgs::stillmap_msgs::StageReport;
use node_shell::{Node, Qos, Received, RosArguments, Subscription};
use rustix::process::Signal;
use tokio::time::timeout;

use crate::bags::{pose, scan};
use crate::program::Running;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// A hundred scans a second, each with its image: where a cycle with voxels of a centimetre takes 0.3 s, ten machines as fast are too
/// slow.
const PERIOD: Duration = Duration::from_millis(10);
/// Voxels of a centimetre in all that is seen, and a map of 5 mm: what a cycle costs is bounded by `max_evidence_blocks`.
const TOO_FINE: [&str; 4] = ["-p", "voxel_edge_m:=0.01", "-p", "map_edge_m:=0.005"];
/// The newest cycles that the slow stage gets one after the other when the input ends: two may wait before each of the two stages, and
/// one is in each.
const MOST_IN_A_ROW: usize = 6;
/// Cycles of the slow stage that are looked at.
const CYCLES: usize = 5;

const SIZE_PX: (usize, usize) = (160, 120);
const CAMERA_FRAME: &str = "camera_depth_optical_frame";

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_published_is_new_the_log_says_what_helps_and_the_end_is_not_held_up() {
    let folder = tempfile::tempdir().unwrap();
    let (map, log) = (folder.path().join("map.ply"), folder.path().join("log.txt"));
    let rule = format!("__ns:=/overload_{}", std::process::id());
    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
    let robot = Node::start("robot", &arguments).unwrap();
    let [detected, segmented, mapped] = ["detection", "segmentation", "reconstruction"]
        .map(|stage| robot.subscription(&format!("{stage}/report"), &Qos::reliable(500)).unwrap());
    let map_file = format!("reconstruction:map_file:={}", map.display());
    let line = ["up", "--ros-args", "-r", &rule, "-p", &map_file];
    let up = Running::start_live(&log, line.iter().chain(&TOO_FINE));

    let [mut detected_cycles, mut segmented_cycles, mut mapped_cycles] =
        [const { Vec::<Stamp>::new() }; 3];
    let heard = async {
        // The suite has mapped, too.
        let enough = async {
            while segmented_cycles.len() < CYCLES || mapped_cycles.is_empty() {
                tokio::select! {
                    report = segmented.next() => segmented_cycles.extend(processed(&report)),
                    report = mapped.next() => mapped_cycles.extend(processed(&report)),
                }
            }
        };
        tokio::select! {
            () = send_cycles(&robot) => {}
            () = take(&detected, &mut detected_cycles) => {}
            () = enough => {}
        }
    };
    let heard = timeout(PATIENCE, heard).await;
    assert!(heard.is_ok(), "{} cycles in {PATIENCE:?}", segmented_cycles.len());
    // Nothing is sent any more: the newest cycle of all is processed, too.
    let newest = async {
        while segmented_cycles.last() != detected_cycles.last() {
            tokio::select! {
                report = detected.next() => detected_cycles.extend(processed(&report)),
                report = segmented.next() => segmented_cycles.extend(processed(&report)),
            }
        }
    };
    assert!(timeout(PATIENCE, newest).await.is_ok(), "the newest cycle was not processed");
    let is_taken = |stamp: &&Stamp| segmented_cycles.contains(stamp);
    let in_a_row = detected_cycles.iter().rev().take_while(is_taken).count();
    assert!(in_a_row <= MOST_IN_A_ROW, "{in_a_row} cycles waited when the input ended");
    let passed = detected_cycles.iter().filter(|stamp| !is_taken(stamp));
    assert!(passed.count() > CYCLES, "nothing was dropped: the input is no overload");

    // It is asked to end while it has too much to do: what waits before a stage is worked off, and nothing else.
    let busy = async {
        let wanted = segmented_cycles.len() + CYCLES;
        while segmented_cycles.len() < wanted {
            segmented_cycles.extend(processed(&segmented.next().await));
        }
    };
    let busy = async {
        tokio::select! {
            () = send_cycles(&robot) => {}
            () = busy => {}
        }
    };
    assert!(timeout(PATIENCE, busy).await.is_ok(), "the suite does not go on");
    while segmented.try_next().is_some() {}
    let ended = tokio::task::spawn_blocking(move || up.end(Signal::TERM));
    let mut after_the_signal = Vec::new();
    let ended = async {
        tokio::select! {
            () = send_cycles(&robot) => unreachable!("it has no end"),
            () = take(&segmented, &mut after_the_signal) => unreachable!("it has no end"),
            ended = ended => ended.unwrap(),
        }
    };
    let ended = timeout(PATIENCE, ended).await.expect("the suite does not end");
    assert!(ended.success(), "{ended}");
    let worked_off = after_the_signal.len();
    assert!(worked_off <= MOST_IN_A_ROW, "{worked_off} cycles were processed after the signal");
    assert!(geometry::ply::decode(&std::fs::read(&map).unwrap()).unwrap().len() > 100);
    says_what_helps(&log);
    drop((detected, segmented, mapped));
    robot.close().await;
}

fn says_what_helps(log: &Path) {
    let log = std::fs::read_to_string(log).unwrap();
    let mut lines = log.lines().filter(|line| line.contains(".segmentation]"));
    let line = lines.find(|line| line.contains("too slow for its input"));
    let line = line.unwrap_or_else(|| panic!("{log}"));
    for part in ["dropped for newer ones", "the step `", "voxel_edge_m"] {
        assert!(line.contains(part), "{line}");
    }
}

async fn take(reports: &Subscription<StageReport>, taken: &mut Vec<Stamp>) {
    loop {
        taken.extend(processed(&reports.next().await));
    }
}

/// The cycle of a report, unless it was dropped.
fn processed(report: &Received<StageReport>) -> Option<Stamp> {
    let stamp = convert::stamp_from_time(report.message.header.stamp);
    report.message.processed.then_some(stamp)
}

/// Sends scans, images and poses without an end: a wall at 3 m.
pub(crate) async fn send_cycles(robot: &Node) {
    let qos = Qos::sensor(5);
    let scans = robot.publisher("scan", &qos).unwrap();
    let images = robot.publisher("depth/image", &qos).unwrap();
    let infos = robot.publisher("depth/camera_info", &qos).unwrap();
    let poses = robot.publisher("pose", &qos).unwrap();
    let (width_px, height_px) = SIZE_PX;
    let camera = CameraModel {
        width_px,
        height_px,
        fx_px: 140.0,
        fy_px: 140.0,
        cx_px: 79.5,
        cy_px: 59.5,
        distortion: Distortion::None,
    };
    let mut time = tokio::time::interval(PERIOD);
    loop {
        time.tick().await;
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
        let stamp = Stamp::from_nanos(i64::try_from(since_1970.as_nanos()).unwrap());
        let pixels = DepthPixels::Millimetres(vec![3000; width_px * height_px]);
        let image = DepthImage::new(stamp, CAMERA_FRAME.to_owned(), SIZE_PX, pixels).unwrap();
        infos.publish_or_warn(convert::message_from_camera(&camera, stamp, CAMERA_FRAME));
        images.publish_or_warn(convert::message_from_depth(&image));
        poses.publish_or_warn(pose(stamp));
        scans.publish_or_warn(scan(stamp, 3.0));
    }
}
