//! The whole suite live in one process: pointers within, DDS to the sensors and to whom it concerns.

use std::cell::Cell;
use std::process::Command;
use std::time::Duration;

use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::PointCloud2;
use msgs::stillmap_msgs::{ReducedCloud, StageReport};
use node_shell::{Node, Qos, RosArguments};
use tokio::time::timeout;

use crate::bags::small_room;
use crate::playing::{IMAGES, Pacer, TO_DETECTION, play};
use crate::program::{Running, stillmap, succeed, summary};
use crate::recorded_camera::{error_m, recording};

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// Cycles that may be on their way through the nodes: half of those that wait before one of them.
const MOST_AHEAD: u64 = 25;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_suite_in_one_process_builds_the_local_runs_map_and_shows_it_outside() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    // First, so that it is known how many cycles there are.
    let out = folder.path().join("local");
    let rig = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/rig/rplidar_a1_kinect_v1.yaml");
    let (bag_name, out_name) = (bag.to_str().unwrap(), out.to_str().unwrap());
    succeed(["run", bag_name, "--params-file", rig, "--out", out_name]);
    let all = summary(&out)["cycles"]["total"].as_u64().unwrap();
    assert!(all > 10, "{all} cycles");

    let map = folder.path().join("map.ply");
    let namespace = format!("/up_{}", std::process::id());
    let rule = format!("__ns:={namespace}");
    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
    let node = Node::start("outsider", &arguments).unwrap();
    let reliable = Qos::reliable(200);
    let reduced = node.subscription::<ReducedCloud>("reduced_cloud", &reliable).unwrap();
    let still = node.subscription::<PointCloud2>("static_cloud", &reliable).unwrap();
    let mapped = node.subscription::<StageReport>("reconstruction/report", &reliable).unwrap();
    let pacer = Pacer::on(&node);
    let up = Running::start_for_every_cycle([
        "up",
        "--ros-args",
        "-r",
        &rule,
        "-p",
        &format!("reconstruction:map_file:={}", map.display()),
    ]);
    let ready = async {
        reduced.wait_for_publishers(1).await;
        still.wait_for_publishers(1).await;
        mapped.wait_for_publishers(1).await;
    };
    timeout(PATIENCE, ready).await.unwrap();
    let mut arguments = play(&bag, &namespace, &TO_DETECTION);
    arguments.push(pacer.argument());
    let player = Running::start(arguments);
    let heard = [const { Cell::new(0) }; 3];
    let counts = || heard.each_ref().map(Cell::get);
    let hear = async {
        while counts() != [all; 3] {
            let next = async {
                tokio::select! {
                    _ = reduced.next() => 0,
                    _ = still.next() => 1,
                    _ = mapped.next() => 2,
                }
            };
            let Ok(one) = timeout(PATIENCE, next).await else { break };
            heard[one].update(|count| count + 1);
        }
    };
    let have_caught_up = || {
        let [cycles, _, mapped] = counts();
        cycles <= mapped + MOST_AHEAD
    };
    tokio::select! {
        () = pacer.pace(have_caught_up) => {}
        () = hear => {}
    }
    assert_eq!(counts(), [all; 3], "what passes within a process also shows outside");
    drop((player, pacer));
    // The map is to be whole all the same.
    assert!(up.interrupt_twice());
    drop((reduced, still, mapped));
    node.close().await;

    // The node saves the normals, too.
    let points = |path| geometry::ply::decode(&std::fs::read(path).unwrap()).unwrap();
    let (live, local) = (points(map), points(out.join("map.ply")));
    assert!(live.len() > 1000 && live == local, "{} and {} points", live.len(), local.len());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_pose_node_beside_the_others_follows_a_camera_of_another_process_and_detection_takes_its_pose()
 {
    let folder = tempfile::tempdir().unwrap();
    let Some((bag, truth)) = recording(folder.path()) else { return };
    let namespace = format!("/up_pose_{}", std::process::id());
    let rule = format!("__ns:={namespace}");
    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
    let node = Node::start("outsider", &arguments).unwrap();
    let poses = node.subscription::<PoseStamped>("pose", &Qos::reliable(200)).unwrap();
    let reduced = node.subscription::<ReducedCloud>("reduced_cloud", &Qos::reliable(200)).unwrap();
    // The recording's depth is registered to the colour camera, and told by the same CameraInfo.
    let up = Running::start([
        "up",
        "--pose",
        "visual",
        "--ros-args",
        "-r",
        &rule,
        "-r",
        "rgb/camera_info:=depth/camera_info",
        "-p",
        "pose:input:=compressed",
    ]);
    let ready = async {
        poses.wait_for_publishers(1).await;
        reduced.wait_for_publishers(1).await;
    };
    timeout(PATIENCE, ready).await.unwrap();
    let topics = [
        ("/scan", "scan"),
        ("/camera/rgb/image_raw/compressed", "rgb/image/compressed"),
        (IMAGES, "depth/image"),
        ("/camera/depth/camera_info", "depth/camera_info"),
    ];
    let mut arguments = play(&bag, &namespace, &topics);
    // A program that is not optimised, beside others, has not the time for every image at the bag's pace.
    arguments.push(format!("--pace={IMAGES}={namespace}/pose/report"));
    let player = Running::start(arguments);
    let (mut followed, mut count, mut cycles) = (String::new(), 0, 0);
    // Of a hundred images.
    while count < 60 || cycles < 5 {
        let next = async {
            tokio::select! {
                pose = poses.next() => Some(pose),
                _ = reduced.next() => None,
            }
        };
        let heard = timeout(PATIENCE, next).await;
        match heard.unwrap_or_else(|_| panic!("{count} poses and {cycles} cycles, and no more")) {
            Some(pose) => {
                followed.push_str(&line_of(&pose.message));
                count += 1;
            }
            None => cycles += 1,
        }
    }
    drop(player);
    assert!(up.interrupt());
    let file = folder.path().join("poses.txt");
    std::fs::write(&file, followed).unwrap();
    let error_m = error_m(&file, &truth);
    // Twice what all images make of it: some may be missing.
    assert!(error_m <= 0.05, "{error_m} m");
    drop((poses, reduced));
    node.close().await;
}

/// As TUM writes it.
fn line_of(message: &PoseStamped) -> String {
    let (stamp, pose) = (&message.header.stamp, &message.pose);
    let (at, to) = (&pose.position, &pose.orientation);
    let seconds = format!("{}.{:09}", stamp.sec, stamp.nanosec);
    format!("{seconds} {} {} {} {} {} {} {}\n", at.x, at.y, at.z, to.x, to.y, to.z, to.w)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_topics_of_a_live_graph_are_found_and_the_suite_starts_with_them() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let namespace = format!("/up_detect_{}", std::process::id());
    let rule = format!("__ns:={namespace}");
    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
    let node = Node::start("outsider", &arguments).unwrap();
    let reduced = node.subscription::<ReducedCloud>("reduced_cloud", &Qos::reliable(5)).unwrap();
    let mut player = vec!["play".to_owned(), bag.display().to_string(), "--loop".to_owned()];
    for (from, name) in [
        ("/scan", "laser/scan"),
        ("/pose", "amcl/pose"),
        ("/camera/depth/image_raw", "front/depth/image_raw"),
        ("/camera/depth/camera_info", "front/depth/camera_info"),
    ] {
        player.push(format!("--topics={from}"));
        player.push(format!("--remap={from}:={namespace}/{name}"));
    }
    let player = Running::start(player);
    let detect = |rule: String| move || stillmap(["up", "--detect", "--ros-args", "-r", &rule]);
    let mut said = String::new();
    // The player may not have begun, or a busy machine may not have got to it.
    for _ in 0..10 {
        let output = tokio::task::spawn_blocking(detect(rule.clone())).await.unwrap();
        if output.status.success() {
            said = String::from_utf8(output.stdout).unwrap();
            break;
        }
    }
    let command = format!(
        "stillmap up --ros-args -r {rule} -r scan:={namespace}/laser/scan -r pose:={namespace}/amcl/pose \
         -r depth/image:={namespace}/front/depth/image_raw \
         -r depth/camera_info:={namespace}/front/depth/camera_info"
    );
    assert_eq!(said.lines().last(), Some(command.as_str()), "{said}");
    let up = Running::start(["up", "--detect", "--yes", "--ros-args", "-r", &rule]);
    let cycle = timeout(PATIENCE, reduced.next()).await;
    assert!(cycle.is_ok(), "the suite has no cycle");

    // Beside it another one runs by the command that is printed then.
    let output = tokio::task::spawn_blocking(detect(rule.clone())).await.unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    let (_, command) = said.split_once("beside it: stillmap ").unwrap_or_else(|| panic!("{said}"));
    let words: Vec<&str> = command.split_whitespace().collect();
    let own = words.iter().find_map(|word| word.strip_prefix("__ns:=")).unwrap();
    let topic = format!("{own}/reduced_cloud");
    let others = node.subscription::<ReducedCloud>(&topic, &Qos::reliable(5)).unwrap();
    let beside = Running::start(&words);
    let cycle = timeout(PATIENCE, others.next()).await;
    assert!(cycle.is_ok(), "`{command}` has no cycle");
    assert!(beside.interrupt());
    assert!(up.interrupt());
    drop((player, reduced, others));
    node.close().await;
}

/// Regression: the service started a program with a wrong parameter again every 2 s, without end.
#[test]
fn what_another_start_cannot_mend_has_an_exit_code_of_its_own() {
    let unit = include_str!("../../../config/systemd/stillmap.service");
    assert!(unit.lines().any(|line| line == "RestartPreventExitStatus=2"));
    let domain = ("ROS_DOMAIN_ID", "300");
    let interface = ("STILLMAP_INTERFACES", "nowhere0");
    let none = ("ROS_DOMAIN_ID", "0");
    let file = ["--ros-args", "--params-file", "/nowhere/robot.yaml"];
    for (command, variable, arguments, code) in [
        (vec!["up"], none, ["--ros-args", "-p", "bogus:=1"].as_slice(), 2),
        (vec!["node", "detection"], none, &["--ros-args", "-p", "bogus:=1"], 2),
        (vec!["up"], none, &["--ros-args", "-x"], 2),
        (vec!["node", "detection"], none, &["--ros-args", "-x"], 2),
        (vec!["up"], domain, &[], 2),
        (vec!["node", "detection"], domain, &[], 2),
        // These may be there by then.
        (vec!["up"], interface, &[], 1),
        (vec!["node", "detection"], interface, &[], 1),
        (vec!["up"], none, &file, 1),
        (vec!["node", "detection"], none, &file, 1),
    ] {
        let program = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
            .args(&command)
            .args(arguments)
            .env(variable.0, variable.1)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&program.stderr);
        assert_eq!(
            program.status.code(),
            Some(code),
            "{command:?} {arguments:?} {variable:?}: {said}"
        );
    }
}

/// Regression: in the journal the reason why a service had ended was a line like any other, and `journalctl -p warning` left it out.
#[test]
fn why_a_service_ended_is_an_error_in_the_journal() {
    use std::os::unix::fs::MetadataExt;
    let folder = tempfile::tempdir().unwrap();
    for command in [["up"].as_slice(), &["node", "detection"]] {
        let path = folder.path().join("stderr");
        let stderr = std::fs::File::create(&path).unwrap();
        let about = stderr.metadata().unwrap();
        let status = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
            .args(command)
            .args(["--ros-args", "-p", "bogus:=1"])
            .env("JOURNAL_STREAM", format!("{}:{}", about.dev(), about.ino()))
            .stderr(stderr)
            .status()
            .unwrap();
        let said = std::fs::read_to_string(&path).unwrap();
        assert_eq!(status.code(), Some(2), "{said}");
        assert!(said.lines().all(|line| line.starts_with('<')), "{said}");
        assert!(
            said.lines().any(|line| line.starts_with("<3>") && line.contains("bogus")),
            "{said}"
        );
    }
}

#[test]
fn mistakes_are_named_before_a_node_starts() {
    for (arguments, named) in [
        (
            vec!["up", "--pose", "lidar", "--ros-args", "-p", "lidar_odometry:every_ray:=0"],
            "every_ray",
        ),
        (vec!["up", "--rig", "no_such_rig"], "presets are: rplidar_a1_kinect_v1"),
        (vec!["up", "--ros-args", "-p", "detection:aperture:=1.0"], "aperture_rad"),
        (vec!["up", "--ros-args", "-p", "voxel_edge_m:=-1.0"], "voxel_edge_m"),
        (
            vec!["up", "--ros-args", "-p", "segmentation:voxel_edge_m:=0.05"],
            "voxel_edge_m is 0.08 of detection and 0.05 of segmentation",
        ),
        (
            vec!["up", "--map-edge", "0.03", "--ros-args", "-p", "method:=rec_hv"],
            "--map-edge is of the method free_space",
        ),
        (vec!["up", "--map-edge", "-1"], "map_edge_m must be 0.001 to 1, not -1"),
        (
            vec!["up", "--detect", "--yes", "--map-edge", "0"],
            "map_edge_m must be 0.001 to 1, not 0",
        ),
        (
            vec!["up", "--ros-args", "-p", "reconstruction:map_file:=/nowhere/map.ply"],
            "the folder of /nowhere/map.ply does not exist",
        ),
        (vec!["up", "--ros-args", "-p", "use_sim_time:=maybe"], "use_sim_time"),
        (
            vec!["node", "reconstruction", "--ros-args", "-p", "at_max_voxels:=spill"],
            "spill_folder is empty",
        ),
        (
            vec!["up", "--ros-args", "-p", "method:=rec_hv", "-p", "grid:=scan"],
            "grid must be none or height_band",
        ),
        (
            vec!["up", "--ros-args", "-p", "method:=rec_hv", "-p", "at_max_voxels:=drop_oldest"],
            "at_max_voxels must be refuse",
        ),
        (vec!["node", "detection", "--ros-args", "-p", "aperture_rad:=99.0"], "at most 2 pi"),
    ] {
        let output = stillmap(&arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(named), "{arguments:?}: {stderr}");
        // A node that joins the network says so.
        assert!(!stderr.contains("on domain"), "{arguments:?}: {stderr}");
    }
}
