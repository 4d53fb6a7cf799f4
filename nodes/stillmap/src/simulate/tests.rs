use bag_player::{Bag, Selection};
use clap::Parser;
use msgs::RosMessage;
use msgs::sensor_msgs::{LaserScan, PointCloud2};
use msgs::stillmap_msgs::Tracks;

use super::*;
use crate::sensor_bag::{SCAN, TRUE_EMPTY_SCENE, TRUE_OBJECTS, TRUE_SCAN_LABELS};

#[derive(Parser)]
struct CommandLine {
    #[command(flatten)]
    args: SimulateArgs,
}

fn parse(arguments: &str) -> Result<SimulateArgs, clap::Error> {
    let arguments = ["simulate", "-o", "out.mcap"].into_iter().chain(arguments.split_whitespace());
    CommandLine::try_parse_from(arguments).map(|line| line.args)
}

fn asked_for(arguments: &str) -> Scenario {
    scenario(&parse(arguments).unwrap()).unwrap()
}

#[test]
fn what_is_asked_for_is_simulated() {
    use simulator::{CrossingObject, PathName, Platform, SceneName};
    assert_eq!(asked_for("demo"), Scenario::demo());
    assert_eq!(asked_for("small --seed 7"), Scenario::small().with_seed(7));
    assert_eq!(asked_for("demo --empty"), Scenario::demo().without_objects());
    let crossing = |object, path| Scenario::crossing(SceneName::B, object, path, 3);
    assert_eq!(asked_for("--scene B --seed 3"), crossing(CrossingObject::Person, PathName::A));
    assert_eq!(
        asked_for("b --object robot --path c --seed 3"),
        crossing(CrossingObject::Robot, PathName::C)
    );
    assert_eq!(
        asked_for("--scene F --object three --platform sway"),
        Scenario::three_crossing(SceneName::F, 1).with_platform(Platform::Sway)
    );
    assert_eq!(asked_for("--scene H --pause 10"), Scenario::pausing(SceneName::H, 10.0, 1));
    assert_eq!(asked_for("--scene A --object none"), Scenario::empty(SceneName::A, 1));
    assert_eq!(
        asked_for(
            "--scene A --object none --clock-skew-ms -12 --jitter-ms 2 --pose-noise 0.01 0.005 \
             --extrinsic-error 0.01 0.02 --depth-size 80 60"
        ),
        Scenario::empty(SceneName::A, 1)
            .with_depth_size(80, 60)
            .with_pose_noise(0.01, 0.005)
            .with_mounting_error(0.01, 0.02)
            .with_stamp_errors(-0.012, 0.002)
    );
}

#[test]
fn what_makes_no_sense_is_refused() {
    assert!(parse("").is_err());
    assert!(parse("demo --scene A").is_err());
    assert!(parse("--scene A --pause 3 --object robot").is_err());
    assert!(parse("--file x.yaml --scene A").is_err());
    assert!(parse("--scene Q").is_err());
    let refused = |arguments: &str| scenario(&parse(arguments).unwrap()).unwrap_err().to_string();
    assert!(refused("demo --object robot").contains("--object"));
    assert!(refused("--scene A --object three --path B").contains("ways of their own"));
    assert!(refused("--scene A --pause -1").contains("--pause is -1"));
    assert!(refused("--file /does/not/exist.yaml").contains("/does/not/exist.yaml"));
}

#[test]
fn a_file_that_is_wrong_is_named_with_its_line_and_key() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.yaml");
    std::fs::write(&file, "name: mine\nduratoin_s: 3.0\n").unwrap();
    let args = parse(&format!("--file {}", file.display())).unwrap();
    let error = scenario(&args).unwrap_err().to_string();
    assert!(error.contains("scene.yaml") && error.contains("line 2"), "{error}");
    assert!(error.contains("duratoin_s"), "{error}");
    std::fs::write(&file, "name: mine\nseed: 9\n").unwrap();
    assert_eq!(
        scenario(&args).unwrap(),
        Scenario { name: "mine".into(), seed: 9, ..Scenario::default() }
    );
}

fn messages<M: RosMessage>(bag: &Path, topic: &str) -> Vec<M> {
    let bag = Bag::open(bag).unwrap();
    let selection = Selection { topics: Some(vec![topic.to_owned()]), ..Selection::default() };
    bag.messages(&selection).unwrap().map(|message| message.unwrap().decode().unwrap()).collect()
}

#[test]
fn the_bag_holds_the_truth_of_beams_and_objects_and_is_the_same_each_time() {
    // A bag tells its own name, so that it must be the same.
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let [bag, again] = folders.each_ref().map(|folder| folder.path().join("room.mcap"));
    let scenario = Scenario::small().with_depth_size(64, 48).with_duration_s(7.0);
    write_bag(&scenario, &bag).unwrap();
    write_bag(&scenario, &again).unwrap();
    let [bytes, others] = [&bag, &again].map(|path| std::fs::read(path).unwrap());
    let differing = bytes.iter().zip(&others).position(|(byte, other)| byte != other);
    assert_eq!((differing, bytes.len()), (None, others.len()));

    let scans: Vec<LaserScan> = messages(&bag, SCAN);
    let labelled: Vec<LaserScan> = messages(&bag, TRUE_SCAN_LABELS);
    assert_eq!(scans.len(), labelled.len());
    let mut beams = 0;
    for (scan, labelled) in scans.iter().zip(&labelled) {
        assert!(scan.intensities.is_empty());
        let unlabelled = LaserScan { intensities: Vec::new(), ..labelled.clone() };
        assert_eq!(*scan, unlabelled);
        assert_eq!(labelled.intensities.len(), scan.ranges.len());
        assert!(labelled.intensities.iter().all(|label| [0.0, 2.0].contains(label)));
        beams += labelled.intensities.iter().filter(|label| **label == 2.0).count();
    }
    assert!(beams > 50, "{beams} beams on the person");

    let truths: Vec<Tracks> = messages(&bag, TRUE_OBJECTS);
    assert_eq!(truths.len(), 210);
    let (mut in_view, mut before) = (0, true);
    for (image, truth) in truths.iter().enumerate() {
        assert_eq!((truth.cycle as usize, truth.tracks.len()), (image, 1));
        let track = &truth.tracks[0];
        assert_eq!((track.id, truth.header.frame_id.as_str()), (2, "map"));
        assert!((1.5..1.95).contains(&track.extent.z), "{}", track.extent.z);
        if track.unseen_cycles == 0 {
            (in_view, before) = (in_view + 1, false);
            assert!((track.velocity.y - 1.4).abs() < 0.02 && track.velocity.x.abs() < 0.02);
            assert!((track.position.x - 2.4).abs() < 0.3);
        } else if before {
            assert_eq!((track.unseen_cycles as usize, track.age_s), (image + 1, 0.0));
        }
    }
    assert!(in_view > 55, "{in_view} images");

    let empty: Vec<PointCloud2> = messages(&bag, TRUE_EMPTY_SCENE);
    assert_eq!(empty.len(), 1);
}
