use geometry::Stamp;
use msgs::convert::time_from_stamp;
use msgs::geometry_msgs::TransformStamped;
use msgs::sensor_msgs::LaserScan;

use super::super::SuiteTopics;
use super::super::synthetic::*;
use super::*;

const ODOMETRY: &str = "nav_msgs/msg/Odometry";

fn robot() -> GraphView {
    view(vec![
        publisher("/laser/scan", SCAN, "/sllidar"),
        publisher("/camera/depth/image_raw", IMAGE, "/camera"),
        publisher("/camera/depth/camera_info", CAMERA_INFO, "/camera"),
        publisher("/camera/color/image_raw", IMAGE, "/camera"),
        publisher("/camera/color/camera_info", CAMERA_INFO, "/camera"),
        publisher("/odom", ODOMETRY, "/base"),
    ])
}

fn command(view: &GraphView) -> String {
    of_proposal(&Proposal::of(view).unwrap())
}

fn of_proposal(proposal: &Proposal) -> String {
    proposal.command(&[], &said(&[])).unwrap()
}

fn said(words: &[&str]) -> RosArguments {
    RosArguments::parse(words.iter().copied()).unwrap()
}

fn refused(view: &GraphView) -> String {
    Proposal::of(view).unwrap_err().to_string()
}

#[test]
fn a_graph_with_the_names_of_the_suite_needs_no_argument() {
    let mut graph = view(healthy());
    graph.endpoints.retain(|one| one.role == Role::Publisher);
    assert_eq!(command(&graph), "stillmap up");
}

#[test]
fn the_drivers_of_a_robot_are_found_by_type_and_name() {
    let proposal = Proposal::of(&robot()).unwrap();
    assert_eq!(
        of_proposal(&proposal),
        "stillmap up --ros-args -r scan:=/laser/scan -r depth/image:=/camera/depth/image_raw \
         -r depth/camera_info:=/camera/depth/camera_info -p pose_source:=odometry -p colour:=raw \
         -r rgb/image:=/camera/color/image_raw -r rgb/camera_info:=/camera/color/camera_info"
    );
    assert!(proposal.notes[0].contains("--rig"), "{:?}", proposal.notes);
}

/// Messages of these frames, at 10 Hz, on a topic.
fn hears(graph: &mut GraphView, topic: &str, type_name: &'static str, frame: &str, count: i64) {
    let mut received = ReceivedTopic::of_type(type_name);
    for index in 0..count {
        let stamp = Stamp::from_nanos(1_000_000_000 + index * 100_000_000);
        let mut scan = LaserScan::default();
        scan.header.frame_id = frame.to_owned();
        scan.header.stamp = time_from_stamp(stamp);
        received.take(&scan, 0, stamp);
    }
    graph.received.insert(topic.to_owned(), received);
}

fn is_placed(graph: &mut GraphView, parent: &str, child: &str) {
    let mut transform = TransformStamped::default();
    transform.header.frame_id = parent.to_owned();
    transform.child_frame_id = child.to_owned();
    transform.transform.rotation.w = 1.0;
    graph.transforms.take(&TFMessage { transforms: vec![transform] }, true);
}

#[test]
fn pose_and_mounts_come_from_tf_where_it_has_both() {
    let mut graph = robot();
    graph.endpoints.push(publisher("/tf", "tf2_msgs/msg/TFMessage", "/amcl"));
    hears(&mut graph, "/laser/scan", SCAN, "laser", 2);
    hears(&mut graph, "/camera/depth/camera_info", CAMERA_INFO, "optical", 2);
    for (parent, child) in [("odom", "base_link"), ("base_link", "laser")] {
        is_placed(&mut graph, parent, child);
    }
    assert!(command(&graph).contains("pose_source:=odometry"), "{}", command(&graph));
    is_placed(&mut graph, "base_link", "optical");
    let proposal = Proposal::of(&graph).unwrap();
    let wanted = "-p pose_source:=tf -p map_frame_id:=odom -p rig_frame_id:=base_link -p extrinsics:=tf_from_rig";
    assert!(of_proposal(&proposal).contains(wanted), "{}", of_proposal(&proposal));
    assert_eq!(proposal.inputs[0].rate_hz.map(f64::round), Some(10.0));
    assert!(proposal.notes.is_empty(), "{:?}", proposal.notes);
}

#[test]
fn with_a_namespace_the_topics_of_other_robots_are_none() {
    let mut graph = robot();
    for one in &mut graph.endpoints {
        one.topic = format!("/first{}", one.topic);
    }
    let endpoints = graph.endpoints.clone();
    graph.endpoints.extend(endpoints.into_iter().map(|mut one| {
        one.topic = one.topic.replace("/first", "/second");
        one
    }));
    assert!(refused(&graph).contains("the graph has 2 topics"), "{}", refused(&graph));
    let arguments = RosArguments::parse(["--ros-args", "-r", "__ns:=/second"]).unwrap();
    graph.suite = SuiteTopics::resolve(&arguments).unwrap();
    assert!(command(&graph).contains("-r scan:=/second/laser/scan"), "{}", command(&graph));
    assert!(!command(&graph).contains("/first"), "{}", command(&graph));
}

#[test]
fn what_the_user_has_said_stands_in_the_command_and_holds() {
    let said = said(&[
        "--ros-args",
        "-r",
        "__ns:=/robot",
        "--params-file",
        "mine.yaml",
        "-p",
        "map_file:=map.ply",
        "-p",
        "colour:=none",
    ]);
    let command = Proposal::of(&robot()).unwrap().command(&[], &said).unwrap();
    let begins = "stillmap up --ros-args -r __ns:=/robot -r scan:=/laser/scan ";
    assert!(command.starts_with(begins), "{command}");
    // Regression: of a parameter the last value holds, and those of a user's file stood before what is proposed.
    assert!(
        command.ends_with(" --params-file mine.yaml -p map_file:=map.ply -p colour:=none"),
        "{command}"
    );
    assert!(
        command.contains("pose_source:=odometry") && !command.contains("colour:=raw"),
        "{command}"
    );
}

#[test]
fn compressed_depth_images_are_taken_where_there_are_no_raw_ones() {
    const COMPRESSED: &str = "sensor_msgs/msg/CompressedImage";
    let mut graph = robot();
    let compressed = "/camera/depth/image_raw/compressedDepth";
    graph.endpoints.push(publisher(compressed, COMPRESSED, "/camera"));
    assert!(!command(&graph).contains("compressedDepth"), "{}", command(&graph));
    graph.endpoints.retain(|one| one.topic != "/camera/depth/image_raw");
    let wanted = "-r depth/image/compressedDepth:=/camera/depth/image_raw/compressedDepth \
                  -r depth/camera_info:=/camera/depth/camera_info -p input:=compressed_depth";
    assert!(command(&graph).contains(wanted), "{}", command(&graph));
}

#[test]
fn where_nothing_publishes_a_pose_an_odometry_computes_it() {
    let mut graph = robot();
    graph.endpoints.retain(|one| one.topic != "/odom");
    let visual = command(&graph);
    assert!(visual.starts_with("stillmap up --pose visual --ros-args "), "{visual}");
    assert!(visual.contains("-r rgb/image:=/camera/color/image_raw"), "{visual}");

    // The camera's own clouds are no LiDAR's, and a description of the robot is no pose.
    graph.endpoints.push(publisher("/tf_static", "tf2_msgs/msg/TFMessage", "/description"));
    for (topic, frame) in [("/velodyne_points", "velodyne"), ("/camera/depth/points", "optical")] {
        graph.endpoints.push(publisher(topic, POINTS, "/driver"));
        hears(&mut graph, topic, POINTS, frame, 2);
    }
    hears(&mut graph, "/camera/depth/camera_info", CAMERA_INFO, "optical", 2);
    let proposal = Proposal::of(&graph).unwrap();
    let lidar = of_proposal(&proposal);
    assert!(lidar.starts_with("stillmap up --pose lidar --ros-args "), "{lidar}");
    assert!(lidar.contains("-r points:=/velodyne_points"), "{lidar}");
    assert!(!lidar.contains("pose_source") && !lidar.contains("input:="), "{lidar}");
    assert!(proposal.notes[0].contains("nothing publishes a pose"), "{:?}", proposal.notes);

    // Of two, the user has to say which.
    graph.endpoints.push(publisher("/rear_points", POINTS, "/driver"));
    hears(&mut graph, "/rear_points", POINTS, "rear", 2);
    assert!(command(&graph).contains("--pose visual"), "{}", command(&graph));
    graph.endpoints.retain(|one| !one.topic.contains("color"));
    graph.endpoints.retain(|one| !one.topic.contains("tf_static"));
    assert!(refused(&graph).contains("has no pose"), "{}", refused(&graph));
}

/// A description with wheels that turn publishes `/tf`, too.
#[test]
fn wheels_on_tf_are_no_pose_of_the_robot() {
    let mut graph = robot();
    graph.endpoints.retain(|one| one.topic != "/odom");
    graph.endpoints.push(publisher("/tf", "tf2_msgs/msg/TFMessage", "/description"));
    assert!(command(&graph).contains("pose_source:=tf"), "nobody listened");
    is_placed(&mut graph, "base_link", "wheel_left");
    assert!(command(&graph).starts_with("stillmap up --pose visual"), "{}", command(&graph));
    graph.endpoints.retain(|one| !one.topic.contains("color"));
    assert!(refused(&graph).contains("has no pose"), "{}", refused(&graph));
    is_placed(&mut graph, "odom", "base_link");
    assert!(command(&graph).contains("pose_source:=tf"), "{}", command(&graph));
}

/// RViz publishes the goals that its user sets.
#[test]
fn a_goal_is_no_pose_of_the_robot() {
    let mut graph = robot();
    graph.endpoints.push(publisher("/goal_pose", POSE, "/rviz"));
    assert!(command(&graph).contains("pose:=/goal_pose"), "nobody listened");
    hears(&mut graph, "/goal_pose", POSE, "map", 0);
    assert!(command(&graph).contains("pose_source:=odometry"), "{}", command(&graph));
}

#[test]
fn what_is_missing_or_not_clear_is_said() {
    let mut graph = robot();
    graph.endpoints.push(publisher("/rear/scan", SCAN, "/rear"));
    assert!(refused(&graph).contains("the graph has 2 topics"), "{}", refused(&graph));
    graph.endpoints.retain(|one| one.type_name != SCAN);
    assert!(refused(&graph).contains("the graph has no 2D laser scan"), "{}", refused(&graph));
    let mut running = robot();
    running.endpoints.push(publisher("/static_map", POINTS, "/reconstruction"));
    assert!(refused(&running).contains("/reconstruction runs"), "{}", refused(&running));
}

/// Regression: the advice was a namespace alone, in which the graph had no 2D laser scan.
#[test]
fn beside_a_running_suite_the_command_for_another_one_has_the_same_inputs() {
    const REPORT: &str = "stillmap_msgs/msg/StageReport";
    let mut graph = view(healthy());
    for node in ["/detection", "/segmentation", "/suite_2/detection"] {
        graph.endpoints.push(publisher(&format!("{node}/report"), REPORT, node));
    }
    graph.endpoints.push(publisher("/static_scan", SCAN, "/segmentation"));
    let advice = Proposal::of(&graph).unwrap_err();
    let line = format!("{advice:?}");
    let command = "stillmap up --ros-args -r __ns:=/suite_3 -r scan:=/scan -r pose:=/pose \
                   -r depth/image:=/depth/image -r depth/camera_info:=/depth/camera_info";
    assert!(line.contains(command), "{line}");
    // It is what that suite needs.
    let words = command.split_whitespace().skip(2);
    let suite = SuiteTopics::resolve(&RosArguments::parse(words).unwrap()).unwrap();
    for (name, topic) in [("scan", "/scan"), ("depth/image", "/depth/image"), ("pose", "/pose")] {
        assert_eq!(suite.resolved(name).as_deref(), Some(topic));
    }
}
