//! What others start and show the suite with: launch files, packages, views, the service. They name only nodes,
//! parameters, topics and options that exist.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use detection::shell::DetectionParameters;
use free_domain::FreeDomain;
use lidar_odometry::shell::LidarOdometryParameters;
use node_shell::parameters::{self, Assignment};
use node_shell::{EXIT_UNUSABLE, Node, RosArguments, Transport};
use pose::shell::PoseParameters;
use reconstruction::shell::ReconstructionParameters;
use segmentation::shell::SegmentationParameters;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::program::{stillmap, succeed};

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The names in the topic table of `nodes/README.md`, without a slash before them.
fn topic_table() -> BTreeSet<String> {
    let text = read("nodes/README.md");
    let table = text.split("\n## Topics\n").nth(1).unwrap().split("\n## ").next().unwrap();
    let cells = table
        .lines()
        .filter(|line| line.starts_with("| `"))
        .map(|line| line.trim_start_matches("| ").split(" | ").next().unwrap());
    let names = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2));
    names.map(|name| name.trim_start_matches('/').to_owned()).collect()
}

#[track_caller]
fn is_topic(name: &str, of: &str) {
    let table = topic_table();
    let bare = name.trim_start_matches('/');
    assert!(table.contains(bare), "{of}: {name} is not among {table:?}");
}

/// What a launch file starts; `None`, and a line that says so, without Python.
fn described(file: &str, arguments: &[&str]) -> Option<Value> {
    let script = root("tests/peers/launch/describe.py");
    let output = Command::new("python3")
        .arg("-B")
        .args([script, root("launch-scripts").join(file)])
        .args(arguments)
        .output();
    let Ok(output) = output else {
        assert_ne!(std::env::var("CI").as_deref(), Ok("true"), "python3 is missing");
        println!("skipped: what {file} starts is not shown, python3 is missing");
        return None;
    };
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{file} {arguments:?}: {stderr}");
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

fn strings(value: &Value) -> Vec<&str> {
    value.as_array().unwrap().iter().map(|one| one.as_str().unwrap()).collect()
}

/// The node takes its parameter files and values.
fn takes<P: geometry::parameter::Parameters + Serialize + DeserializeOwned + Default>(
    name: &str,
    node: &Value,
) {
    let files: Vec<PathBuf> = strings(&node["files"]).into_iter().map(PathBuf::from).collect();
    assert!(files.iter().all(|file| file.is_file()), "{files:?}");
    let assignments: Vec<Assignment> = node["values"]
        .as_object()
        .unwrap()
        .iter()
        .map(|(name, value)| Assignment {
            name: name.clone(),
            value: value.as_str().unwrap().into(),
        })
        .collect();
    parameters::load::<P>(name, &files, &assignments)
        .unwrap_or_else(|error| panic!("{name}: {error}"));
}

/// The nodes of a launch file exist, and take what they are given.
fn nodes_exist(file: &str, arguments: &[&str], expected: &[&str]) {
    let Some(told) = described(file, arguments) else { return };
    let nodes = told["nodes"].as_array().unwrap();
    let names: Vec<&str> = nodes.iter().map(|node| node["name"].as_str().unwrap()).collect();
    assert_eq!(names, expected, "{file} {arguments:?}");
    let names_namespace = arguments.iter().any(|argument| argument.starts_with("namespace:="));
    for node in nodes {
        let name = node["name"].as_str().unwrap();
        // Regression: it was `/`, so that the nodes of two robots, each in a namespace, had the same names.
        let namespace = node["namespace"].as_str().unwrap_or_default();
        assert_eq!(namespace.starts_with('/'), names_namespace, "{file}: {name} in {namespace}");
        if node["package"].as_str().is_some_and(|package| package != "stillmap") {
            // Of another package: what it gets of ours exists.
            for pair in node["remappings"].as_array().unwrap() {
                let filtered = strings(pair)[1];
                assert!(!filtered.starts_with('/'), "{file}: {filtered} leaves the namespace");
                is_topic(filtered, file);
            }
            continue;
        }
        assert_eq!(node["executable"], name.replace('_', "-"), "{file}");
        // A bag is played once: who falls meanwhile has lost a part of it. In XML `respawn` takes no substitution, so that the
        // included file has it for both.
        assert_eq!(node["respawn"], file != "bag.launch.py", "{file}");
        // Regression: a node with a parameter that it refuses was started again without end. XML has nothing against it.
        let is_stopped = node["respawn"] == true && file.ends_with(".py");
        let expected = if is_stopped { json!([EXIT_UNUSABLE]) } else { json!([]) };
        assert_eq!(node["final_codes"], expected, "{file}");
        let full_name = format!("{}/{name}", namespace.trim_end_matches('/'));
        match name {
            "detection" => takes::<DetectionParameters>(&full_name, node),
            "segmentation" => takes::<SegmentationParameters>(&full_name, node),
            "reconstruction" => takes::<ReconstructionParameters>(&full_name, node),
            "pose" => takes::<PoseParameters>(&full_name, node),
            "lidar_odometry" => takes::<LidarOdometryParameters>(&full_name, node),
            other => panic!("{file}: there is no node {other}"),
        }
        for pair in node["remappings"].as_array().unwrap() {
            is_topic(strings(pair)[0], file);
        }
    }
    for process in told["processes"].as_array().unwrap() {
        let words = strings(process);
        assert_eq!(words[0], "stillmap", "{file}");
        let help = succeed([words[1], "--help"]);
        for option in words.iter().filter(|word| word.starts_with("--")) {
            assert!(help.contains(option), "{file}: stillmap {} has no {option}", words[1]);
        }
    }
    let described = told["arguments"].as_object().unwrap();
    assert!(described.values().all(|text| text.as_str().is_some_and(|text| !text.is_empty())));
}

const ALL: [&str; 3] = ["detection", "segmentation", "reconstruction"];

#[test]
fn launch_files_start_nodes_that_exist_with_parameters_that_they_take() {
    let presets = ["rig:=rplidar_s2_realsense_d435.yaml", "namespace:=/robot", "map_file:=1.ply"];
    nodes_exist("robot.launch.py", &[], &ALL);
    nodes_exist("robot.launch.py", &presets, &ALL);
    nodes_exist("robot.launch.py", &["nodes:=pose detection"], &["pose", "detection"]);
    let car = ["nodes:=lidar_odometry", "rig:=hdl32e_car.yaml"];
    nodes_exist("robot.launch.py", &car, &["lidar_odometry"]);
    nodes_exist("bag.launch.py", &["bag:=room.mcap"], &ALL);
    nodes_exist("split.launch.py", &["part:=sensors"], &ALL[..1]);
    nodes_exist("split.launch.py", &["part:=map", "peer:=10.0.0.1"], &ALL[1..]);
    nodes_exist("filter.launch.py", &["fill:=background"], &ALL[..2]);
    for (consumer, node) in [
        ("slam_toolbox", "slam_toolbox"),
        ("amcl", "amcl"),
        ("rtabmap", "rtabmap"),
        ("nvblox", "nvblox_node"),
        ("octomap_server", "octomap_server"),
        ("voxel_layer", "planner_server"),
    ] {
        let arguments = [&format!("consumer:={consumer}"), "namespace:=/robot"];
        nodes_exist("filter.launch.py", &arguments, &[ALL[0], ALL[1], node]);
    }
    nodes_exist("robot.launch.xml", &["namespace:=/robot"], &ALL);
    nodes_exist("bag.launch.xml", &["bag:=room.mcap"], &ALL);
    nodes_exist("split.launch.xml", &["peer:=10.0.0.2"], &ALL[..1]);
}

#[test]
fn each_launch_file_is_described() {
    let files = std::fs::read_dir(root("launch-scripts")).unwrap();
    let names: BTreeSet<String> = files
        .map(|file| file.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.contains(".launch."))
        .collect();
    let known = ["bag", "robot", "split"]
        .map(|name| [format!("{name}.launch.py"), format!("{name}.launch.xml")]);
    let known = known.into_iter().flatten().chain(["filter.launch.py".to_owned()]);
    assert_eq!(names, known.collect());
}

/// The strings at the places that `is_topic_place` knows, in whatever depth.
fn topics_in<'a>(value: &'a Value, found: &mut Vec<&'a str>) {
    match value {
        Value::Object(members) => {
            for (name, member) in members {
                match (name.as_str(), member) {
                    // RViz.
                    ("Topic" | "Update Topic", Value::Object(topic)) => {
                        found.extend(topic["Value"].as_str())
                    }
                    // Foxglove.
                    ("topics", Value::Object(topics)) => {
                        found.extend(topics.keys().map(String::as_str))
                    }
                    (
                        "imageTopic" | "calibrationTopic" | "topicPath" | "topicToRender",
                        Value::String(topic),
                    ) => {
                        found.push(topic);
                    }
                    _ => topics_in(member, found),
                }
            }
        }
        Value::Array(members) => members.iter().for_each(|member| topics_in(member, found)),
        _ => {}
    }
}

#[test]
fn views_show_topics_that_exist() {
    let rviz: Value = serde_saphyr::from_str(&read("config/rviz/stillmap.rviz")).unwrap();
    let foxglove: Value = serde_json::from_str(&read("config/foxglove/stillmap.json")).unwrap();
    for (name, view) in [("rviz", &rviz), ("foxglove", &foxglove)] {
        let mut topics = Vec::new();
        topics_in(view, &mut topics);
        assert!(topics.len() >= 6, "{name}: {topics:?}");
        topics.iter().for_each(|topic| is_topic(topic, name));
    }
    // Each panel of the layout has its settings.
    let layout = foxglove["layout"].to_string();
    for panel in foxglove["configById"].as_object().unwrap().keys() {
        assert!(layout.contains(panel.as_str()), "{panel}");
    }
}

/// Longer than a start takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(90);

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_topic_of_the_running_suite_is_in_the_table() {
    let process = std::process::id();
    let domain = FreeDomain::new();
    let namespace = format!("/packaging_{process}");
    let mut suite = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
        .args(["up", "--ros-args", "-r", &format!("__ns:={namespace}")])
        .env("ROS_DOMAIN_ID", domain.number().to_string())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let arguments = RosArguments::parse(["x"]).unwrap();
    let node = Node::start_on(Transport::on_domain(domain.number()).unwrap(), "reader", &arguments)
        .unwrap();
    let begun = Instant::now();
    let prefix = format!("{namespace}/");
    let (mut topics, mut last) = (BTreeSet::new(), BTreeSet::new());
    // Until all ends have come: the three nodes share 20 or so, and none comes any more.
    while begun.elapsed() < PATIENCE && (topics.len() < 15 || topics != last) {
        last = topics;
        tokio::time::sleep(Duration::from_millis(500)).await;
        let survey = node.survey();
        let ours = survey.iter().filter_map(|end| end.topic.strip_prefix(&prefix));
        topics = ours.map(str::to_owned).collect();
    }
    node.close().await;
    suite.kill().unwrap();
    suite.wait().unwrap();
    assert!(topics.len() >= 15, "{topics:?}");
    let table = topic_table();
    for topic in &topics {
        let private = ALL.iter().find_map(|node| topic.strip_prefix(&format!("{node}/")));
        let name = private.map_or_else(|| topic.clone(), |name| format!("~/{name}"));
        assert!(table.contains(&name), "{name} is not in the table of nodes/README.md");
    }
}

#[test]
fn the_service_starts_what_there_is() {
    let service = read("config/systemd/stillmap.service");
    let command = service.lines().find_map(|line| line.strip_prefix("ExecStart=")).unwrap();
    let words: Vec<&str> = command.split(' ').collect();
    assert_eq!(words[..3], ["/usr/bin/stillmap", "up", "--rig"]);
    assert!(root(&format!("config/rig/{}.yaml", words[3])).is_file());
    let arguments = RosArguments::parse(words[4..].iter().copied()).unwrap();
    assert_eq!((arguments.remappings.len(), arguments.parameters.len()), (2, 1));
    for word in words.iter().filter(|word| word.contains(":=") && !word.contains("map_file")) {
        is_topic(word.split(":=").next().unwrap(), "the service");
    }
    assert!(service.contains("\nKillMode=mixed\n"));
    // Without this call the nodes have no filter on their sockets.
    assert!(service.contains("\nSystemCallFilter=@system-service pidfd_getfd\n"));
}

#[test]
fn the_table_of_the_doctors_checks_is_current() {
    let table = succeed(["doctor", "--checks"]);
    let page = read("nodes/stillmap/README.md");
    assert!(page.contains(table.trim_end()), "put this into nodes/stillmap/README.md:\n{table}");
}

#[test]
fn every_preset_is_known_by_its_name() {
    let output = stillmap(["up", "--rig", "none"]);
    let known = String::from_utf8(output.stderr).unwrap();
    for file in std::fs::read_dir(root("config/rig")).unwrap() {
        let name = file.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned();
        assert!(known.contains(&name), "{name} is not among: {known}");
    }
}
