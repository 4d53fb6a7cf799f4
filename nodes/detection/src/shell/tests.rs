mod behind;
mod colours;
mod rendering;
mod transforms;

use std::collections::BTreeMap;
use std::sync::Arc;

use free_domain::FreeDomain;
use geometry::{CameraModel, DepthImage, DepthPixels, Distortion, Scan, Stamp, StampedPose};
use msgs::convert;
use msgs::diagnostic_msgs::DiagnosticStatus;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan};
use msgs::stillmap_msgs::{DynamicZones, ReducedCloud, StageReport};
use nalgebra::Isometry3;
use node_shell::{Host, Publisher, Qos, RosArguments, Shutdown, Subscription, Transport};

use super::*;

/// A test that waits longer has failed, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// A node on the domain of this process and in a namespace of the test, which takes so many cycles.
fn node_with(name: &str, test: &str, max_waiting_cycles: usize) -> Node {
    let transport = Transport::on_domain(FreeDomain::of_this_process().number()).unwrap();
    let namespace = format!("__ns:=/detection_test_{test}");
    // The topics of tf are absolute; each test has its own.
    let own_tf = ["-r", "/tf:=tf", "-r", "/tf_static:=tf_static"];
    let line = ["--ros-args", "-r", &namespace].into_iter().chain(own_tf);
    let arguments = RosArguments::parse(line).unwrap();
    let host = Host::on(transport).unwrap().with_max_waiting_cycles(max_waiting_cycles);
    host.node(name, &arguments).unwrap()
}

fn node(name: &str, test: &str) -> Node {
    node_with(name, test, OF_A_RECORDING)
}

/// Cycles that may wait where each one counts, ...
const OF_A_RECORDING: usize = 50;
/// ... and where the newest does.
const LIVE: usize = 2;

/// Takes what has come, and processes the cycles that it completes.
fn process(stage: &mut Stage) {
    stage.take_waiting();
    while stage.may_go_on() {
        stage.process_next();
    }
}

async fn soon<T>(what: &str, wait: impl Future<Output = T>) -> T {
    match tokio::time::timeout(PATIENCE, wait).await {
        Ok(value) => value,
        Err(_) => panic!("timed out: {what}"),
    }
}

fn at(milliseconds: i64) -> Stamp {
    Stamp::from_nanos(milliseconds * 1_000_000)
}

fn scan(stamp: Stamp) -> LaserScan {
    convert::message_from_scan(&Scan {
        stamp,
        frame_id: "laser".to_owned(),
        angle_min_rad: -1.0,
        angle_increment_rad: 0.1,
        range_max_m: 8.0,
        ranges_m: vec![2.0; 21],
        ..Scan::default()
    })
}

fn depth_image(stamp: Stamp) -> DepthImage {
    let pixels = DepthPixels::Millimetres(vec![1500; 12]);
    DepthImage::new(stamp, "camera_optical_frame".to_owned(), (4, 3), pixels).unwrap()
}

fn image(stamp: Stamp) -> Image {
    convert::message_from_depth(&depth_image(stamp))
}

fn compressed_image(stamp: Stamp) -> CompressedImage {
    convert::compressed_message_from_depth(&depth_image(stamp)).unwrap()
}

fn camera_info(width_px: usize) -> CameraInfo {
    let camera = CameraModel {
        width_px,
        height_px: 3,
        fx_px: 4.0,
        fy_px: 4.0,
        cx_px: 1.5,
        cy_px: 1.0,
        distortion: Distortion::None,
    };
    convert::message_from_camera(&camera, at(0), "camera_optical_frame")
}

fn pose(stamp: Stamp, x_m: f64) -> PoseStamped {
    convert::message_from_pose(&StampedPose {
        stamp,
        frame_id: "map".to_owned(),
        map_from_rig: Isometry3::translation(x_m, 0.0, 0.0),
    })
}

/// The node under test, and a peer that publishes the sensors' messages and subscribes to the output.
struct Bench {
    served: tokio::task::JoinHandle<Result<(), NodeFailure>>,
    shutdown: Shutdown,
    scans: Publisher<LaserScan>,
    images: Publisher<Image>,
    compressed_images: Publisher<CompressedImage>,
    camera_infos: Publisher<CameraInfo>,
    poses: Publisher<PoseStamped>,
    cycles: Subscription<ReducedCloud>,
    zones: Subscription<DynamicZones>,
    reports: Subscription<StageReport>,
    /// The name of the node under test.
    name: String,
    peer: Node,
}

impl Bench {
    async fn start(test: &str, max_wait_s: f64) -> Self {
        Self::start_with(test, max_wait_s, CloudInput::Depth).await
    }

    /// The newest cycles count.
    async fn start_live(test: &str, max_wait_s: f64) -> Self {
        let config = DetectionConfig { max_wait_s, ..DetectionConfig::default() };
        let parameters = DetectionParameters { config, ..DetectionParameters::default() };
        Self::start_node(node_with("detection", test, LIVE), test, parameters).await
    }

    async fn start_with(test: &str, max_wait_s: f64, input: CloudInput) -> Self {
        let config = DetectionConfig { max_wait_s, ..DetectionConfig::default() };
        let parameters = DetectionParameters { input, config, ..DetectionParameters::default() };
        Self::start_by(test, parameters).await
    }

    async fn start_by(test: &str, parameters: DetectionParameters) -> Self {
        Self::start_node(node("detection", test), test, parameters).await
    }

    async fn start_node(own: Node, test: &str, parameters: DetectionParameters) -> Self {
        let peer = node("robot", test);
        let input = parameters.input;
        let shutdown = own.shutdown_signal();
        let (name, mut own_reports) = (own.full_name(), own.reports());
        let served = tokio::spawn(async move {
            let result = serve(&own, parameters).await;
            own.close().await;
            result
        });
        let qos = Qos::reliable(20);
        let bench = Self {
            served,
            shutdown,
            scans: peer.publisher("scan", &qos).unwrap(),
            images: peer.publisher("depth/image", &qos).unwrap(),
            compressed_images: peer.publisher("depth/image/compressedDepth", &qos).unwrap(),
            camera_infos: peer.publisher("depth/camera_info", &qos).unwrap(),
            poses: peer.publisher("pose", &qos).unwrap(),
            cycles: peer.subscription("reduced_cloud", &qos).unwrap(),
            zones: peer.subscription("dynamic_zones", &qos).unwrap(),
            reports: peer.subscription("detection/report", &qos).unwrap(),
            name,
            peer,
        };
        soon("the node", async {
            bench.scans.wait_for_subscribers(1).await;
            if input == CloudInput::CompressedDepth {
                bench.compressed_images.wait_for_subscribers(1).await;
            } else {
                bench.images.wait_for_subscribers(1).await;
            }
            bench.camera_infos.wait_for_subscribers(1).await;
            bench.poses.wait_for_subscribers(1).await;
            bench.cycles.wait_for_publishers(1).await;
            bench.zones.wait_for_publishers(1).await;
            bench.reports.wait_for_publishers(1).await;
            // What nobody listens to is not made: the node is to know of its listeners.
            let is_heard = |status: &DiagnosticStatus, name: &str| {
                let of_topic = |key: &str| key.starts_with("subscribers ") && key.ends_with(name);
                status.values.iter().any(|pair| of_topic(&pair.key) && pair.value != "0")
            };
            let outputs = ["reduced_cloud", "dynamic_zones", "detection/report"];
            let knows = |status: &Option<Arc<DiagnosticStatus>>| {
                let status = status.as_ref();
                status.is_some_and(|status| outputs.iter().all(|name| is_heard(status, name)))
            };
            own_reports.wait_for(knows).await.unwrap();
        })
        .await;
        bench
    }

    async fn report(&self) -> Arc<StageReport> {
        soon("a report", self.reports.next()).await.message
    }

    async fn end(self) {
        self.shutdown.trigger();
        soon("the end", self.served).await.unwrap().unwrap();
        let Self { peer, .. } = self;
        peer.close().await;
    }
}

fn counts(report: &StageReport) -> BTreeMap<&str, u64> {
    report.count_names.iter().map(String::as_str).zip(report.counts.iter().copied()).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn scan_image_and_pose_become_a_cycle_even_when_the_calibration_comes_last() {
    let bench = Bench::start("cycle", 0.5).await;
    bench.images.publish(image(at(1_010))).unwrap();
    bench.scans.publish(scan(at(1_000))).unwrap();
    bench.poses.publish(pose(at(1_000), 1.0)).unwrap();
    bench.poses.publish(pose(at(1_020), 3.0)).unwrap();
    bench.camera_infos.publish(camera_info(4)).unwrap();

    let message = soon("the cycle", bench.cycles.next()).await.message;
    let cycle = convert::detected_cycle_from_message(&message).unwrap();
    assert_eq!(
        (cycle.index, cycle.scan_stamp, cycle.reduced_cloud.stamp),
        (0, at(1_000), at(1_010))
    );
    assert_eq!(
        (cycle.map_frame_id.as_str(), cycle.reduced_cloud.frame_id.as_str()),
        ("map", "rig")
    );
    assert!((cycle.map_from_rig.translation.x - 2.0).abs() < 1e-9);
    assert_eq!(cycle.points_before_reduction, 12);
    assert!(cycle.reduced_cloud.points_m.iter().all(|point| (point.x - 1.5).abs() < 1e-5));
    assert_eq!(soon("the zones", bench.zones.next()).await.message.header, message.header);

    let report = bench.report().await;
    assert!(report.processed && report.cycle == 0 && report.header == message.header);
    let counts = counts(&report);
    for (name, count) in [
        ("scans_received", 1),
        ("images_received", 1),
        ("camera_infos_received", 1),
        ("poses_received", 2),
        ("points_before_reduction", 12),
        ("points_reduced", cycle.reduced_cloud.points_m.len() as u64),
        ("zones", 0),
    ] {
        assert_eq!(counts.get(name), Some(&count), "{name}");
    }
    assert_eq!(report.step_names.first().map(String::as_str), Some("convert"));
    assert_eq!(report.step_names.last().map(String::as_str), Some("publish"));
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_compressed_image_gives_the_same_cycle_as_a_raw_one() {
    let bench = Bench::start_with("compressed", 0.5, CloudInput::CompressedDepth).await;
    bench.compressed_images.publish(compressed_image(at(1_010))).unwrap();
    bench.scans.publish(scan(at(1_000))).unwrap();
    bench.poses.publish(pose(at(1_000), 1.0)).unwrap();
    bench.poses.publish(pose(at(1_020), 3.0)).unwrap();
    bench.camera_infos.publish(camera_info(4)).unwrap();
    let message = soon("the cycle", bench.cycles.next()).await.message;
    let cycle = convert::detected_cycle_from_message(&message).unwrap();
    assert_eq!((cycle.reduced_cloud.stamp, cycle.points_before_reduction), (at(1_010), 12));
    assert!(cycle.reduced_cloud.points_m.iter().all(|point| (point.x - 1.5).abs() < 1e-5));
    let report = bench.report().await;
    assert_eq!(counts(&report).get("images_received"), Some(&1));

    // With an image that cannot be read the scan is dropped, with the reason.
    let mut damaged = compressed_image(at(2_000));
    damaged.format = "16UC1; compressedDepth rvl".to_owned();
    bench.compressed_images.publish(damaged).unwrap();
    bench.poses.publish(pose(at(2_000), 3.0)).unwrap();
    bench.scans.publish(scan(at(2_000))).unwrap();
    let report = bench.report().await;
    let topic = bench.compressed_images.topic();
    assert!(!report.processed, "{report:?}");
    assert!(report.drop_reason.starts_with(topic), "{report:?}");
    assert!(report.drop_reason.contains("\"rvl\""), "{report:?}");
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_scan_without_its_pose_is_dropped_with_the_topic_when_the_input_stops() {
    let bench = Bench::start_live("silence", 0.1).await;
    bench.camera_infos.publish(camera_info(4)).unwrap();
    bench.images.publish(image(at(1_010))).unwrap();
    bench.scans.publish(scan(at(1_000))).unwrap();
    let report = bench.report().await;
    assert!(!report.processed);
    assert_eq!(convert::stamp_from_time(report.header.stamp), at(1_000));
    assert!(
        report.drop_reason.starts_with(&format!("missing {};", bench.poses.topic())),
        "{report:?}"
    );
    bench.end().await;
}

/// A player that waited for slow nodes on a busy machine was once taken for one that had ended.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_scan_of_a_recording_waits_for_as_long_as_its_player_is_there() {
    const MAX_WAIT_S: f64 = 0.02;
    let bench = Bench::start("pause", MAX_WAIT_S).await;
    let views = bench.peer.subscription::<StageReport>("detection/views", &Qos::reliable(5));
    let views = views.unwrap();
    soon("the views", views.wait_for_publishers(1)).await;
    bench.camera_infos.publish(camera_info(4)).unwrap();
    bench.images.publish(image(at(1_010))).unwrap();
    bench.scans.publish(scan(at(1_000))).unwrap();
    // Several times what it waits for live.
    tokio::time::sleep(Duration::from_secs_f64(10.0 * SILENCE_IN_WAITS * MAX_WAIT_S)).await;
    bench.poses.publish(pose(at(1_000), 1.0)).unwrap();
    bench.poses.publish(pose(at(1_015), 3.0)).unwrap();
    let report = bench.report().await;
    assert!(report.processed, "{report:?}");
    bench.images.publish(image(at(1_050))).unwrap();
    let taken = soon("an image", views.next()).await.message;
    assert!(convert::stamp_from_time(taken.header.stamp) >= at(1_010));
    drop(views);
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn faults_of_an_input_are_reported() {
    let bench = Bench::start_live("wrong", 0.4).await;
    // A scan without beams is dropped at once.
    bench.scans.publish(LaserScan { ranges: Vec::new(), ..scan(at(500)) }).unwrap();
    let report = bench.report().await;
    assert!(report.drop_reason.contains("LaserScan"), "{report:?}");

    // An image without a calibration: the missing topic is the calibration's.
    bench.images.publish(image(at(1_000))).unwrap();
    bench.poses.publish(pose(at(1_000), 0.0)).unwrap();
    bench.scans.publish(scan(at(1_000))).unwrap();
    let report = bench.report().await;
    let topic = bench.camera_infos.topic();
    assert!(report.drop_reason.starts_with(&format!("missing {topic};")), "{report:?}");

    // The calibration of another camera: both sizes are named.
    bench.camera_infos.publish(camera_info(5)).unwrap();
    bench.images.publish(image(at(2_000))).unwrap();
    bench.poses.publish(pose(at(2_000), 0.0)).unwrap();
    bench.scans.publish(scan(at(2_000))).unwrap();
    let report = loop {
        let report = bench.report().await;
        if convert::stamp_from_time(report.header.stamp) == at(2_000) {
            break report;
        }
    };
    assert!(report.drop_reason.contains("4 x 3") && report.drop_reason.contains("5 x 3"));

    // With the right one it works again, and the dropped scans have no cycle number.
    bench.camera_infos.publish(camera_info(4)).unwrap();
    bench.images.publish(image(at(3_000))).unwrap();
    bench.poses.publish(pose(at(3_000), 0.0)).unwrap();
    bench.scans.publish(scan(at(3_000))).unwrap();
    let report = bench.report().await;
    assert!(report.processed && report.cycle == 0, "{report:?}");
    bench.end().await;
}

/// A wall 3 m away, which is 6 cm farther in the scan.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_scan_beside_the_surfaces_is_a_warning_in_the_diagnostics() {
    use msgs::diagnostic_msgs::DiagnosticArray;
    let bench = Bench::start("extrinsics", 0.5).await;
    let reliable = Qos::reliable(50);
    let diagnostics =
        bench.peer.subscription::<DiagnosticArray>("/diagnostics", &reliable).unwrap();
    let camera = CameraModel {
        width_px: 160,
        height_px: 120,
        fx_px: 144.0,
        fy_px: 144.0,
        cx_px: 79.5,
        cy_px: 59.5,
        distortion: Distortion::None,
    };
    let wall = |stamp| {
        let pixels = DepthPixels::Millimetres(vec![3000; 160 * 120]);
        DepthImage::new(stamp, "camera_optical_frame".to_owned(), (160, 120), pixels).unwrap()
    };
    let turn = |stamp| {
        let step_rad = 1_f32.to_radians();
        let ranges_m = (0..81).map(|beam| 3.06 / ((beam as f32 - 40.0) * step_rad).cos()).collect();
        convert::message_from_scan(&Scan {
            stamp,
            frame_id: "laser".to_owned(),
            angle_min_rad: -40.0 * step_rad,
            angle_increment_rad: step_rad,
            range_max_m: 8.0,
            ranges_m,
            ..Scan::default()
        })
    };
    bench
        .camera_infos
        .publish(convert::message_from_camera(&camera, at(0), "camera_optical_frame"))
        .unwrap();
    for cycle in 0..20 {
        let stamp = at(1_000 + 500 * cycle);
        bench.images.publish(convert::message_from_depth(&wall(stamp))).unwrap();
        bench.poses.publish(pose(stamp, 0.0)).unwrap();
        bench.scans.publish(turn(stamp)).unwrap();
        // A scan is matched when the next image or pose has arrived.
        if cycle > 0 {
            assert!(bench.report().await.processed);
        }
    }
    let warning = soon("a warning", async {
        loop {
            let message = diagnostics.next().await.message;
            let own = message.part(&bench.name);
            if let Some(status) = own
                && status.message.contains("calibrate anew")
            {
                break status.clone();
            }
        }
    })
    .await;
    assert_eq!(warning.level, DiagnosticStatus::WARN);
    assert!(
        warning.message.contains("extrinsics: the scan lies 0.06 m beside the surfaces"),
        "{warning:?}"
    );
    let value = warning.value("extrinsics").unwrap();
    assert!(value.contains("limit 0.03 m"), "{value:?}");
    drop(diagnostics);
    bench.end().await;
}

#[test]
fn the_parameters_of_node_and_method_are_on_one_level() {
    let described = node_shell::parameters::describe::<DetectionParameters>().unwrap();
    let default_of = |name: &str| {
        described.iter().find(|(key, _)| key == name).map(|(_, default)| default.as_str())
    };
    assert_eq!(default_of("input"), Some("\"depth\""));
    assert_eq!(default_of("voxel_edge_m"), Some("0.08"));
    assert_eq!(default_of("method"), Some("\"free_space\""));
}

/// How a path is used is tested in the core; here a valid one reaches it, and an invalid one does not.
#[test]
fn an_invalid_path_is_counted_and_reported() {
    let host = node_shell::Host::in_process();
    let arguments = RosArguments::parse([] as [String; 0]).unwrap();
    let (own, peer) =
        (host.node("detection", &arguments).unwrap(), host.node("slam", &arguments).unwrap());
    let mut stage = Stage::new(&own, &DetectionParameters::default()).unwrap();
    let paths = peer.publisher::<msgs::nav_msgs::Path>("map_path", &Qos::latched()).unwrap();
    assert_eq!(paths.subscriber_count(), 1);
    let vertex = geometry::PathVertex {
        stamp: Stamp::from_nanos(5),
        map_from_rig: Isometry3::translation(1.0, 0.0, 0.0),
    };
    let path = geometry::MapPath::new(Stamp::from_nanos(7), "map", vec![vertex]).unwrap();
    let mut message = convert::message_from_map_path(&path);
    paths.publish(message.clone()).unwrap();
    stage.take_waiting();
    assert!(own.counters().drops().is_empty(), "{:?}", own.counters().drops());
    message.poses.push(message.poses[0].clone());
    paths.publish(message).unwrap();
    stage.take_waiting();
    assert_eq!(own.counters().drops().values().sum::<u64>(), 1, "{:?}", own.counters().drops());
}
