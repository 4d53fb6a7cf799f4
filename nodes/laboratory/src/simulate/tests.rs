use bag_player::{Bag, Selection};
use clap::Parser;
use msgs::RosMessage;
use msgs::sensor_msgs::{LaserScan, PointCloud2};
use msgs::stillmap_msgs::Tracks;

use super::*;
use robot::sensor_bag::{SCAN, TRUE_EMPTY_SCENE, TRUE_OBJECTS, TRUE_SCAN_LABELS};

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
    assert!(refused("--scene A --object three --path B").contains("fixed paths"));
    assert!(refused("--scene A --pause -1").contains("--pause is -1"));
    assert!(refused("--file /does/not/exist.yaml").contains("/does/not/exist.yaml"));
}

#[test]
fn a_file_is_a_scenario_without_an_option_too() {
    let folder = tempfile::tempdir().unwrap();
    let mine = Scenario { name: "mine".into(), seed: 9, ..Scenario::default() };
    // By its ending, and because it exists.
    for name in ["scene.yaml", "scene.YML", "scene"] {
        let file = folder.path().join(name);
        std::fs::write(&file, "name: mine\nseed: 9\n").unwrap();
        let file = file.display();
        assert_eq!(asked_for(&file.to_string()), mine);
        assert_eq!(asked_for(&format!("{file} --seed 4")), mine.clone().with_seed(4));
        assert_eq!(asked_for(&format!("--file {file}")), mine);
        let refused = |arguments: String| scenario(&parse(&arguments).unwrap()).unwrap_err();
        let object = refused(format!("{file} --object robot")).to_string();
        assert!(object.contains("--object") && object.contains(name), "{object}");
        assert!(parse(&format!("{file} --scene A")).is_err());
        assert!(parse(&format!("{file} --file other.yaml")).is_err());
    }
    let missing = scenario(&parse("not-there.yaml").unwrap()).unwrap_err().to_string();
    assert!(missing.contains("not-there.yaml"), "{missing}");
}

#[test]
fn a_name_that_is_none_gets_the_names_and_how_to_give_a_file() {
    let error = parse("ofice").unwrap_err().to_string();
    for said in ["ofice", "demo", "walking-xyz", "similar", "scene.yaml", "example.yaml"] {
        assert!(error.contains(said), "{said}: {error}");
    }
    assert_eq!(asked_for("DEMO"), Scenario::demo());
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
    // A bag contains its own name, so it must be the same.
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let [bag, again] = folders.each_ref().map(|folder| folder.path().join("room.mcap"));
    let scenario = Scenario::small().with_depth_size(64, 48).with_duration_s(7.0);
    write_bag(&scenario, &bag, &Interrupt::default()).unwrap();
    write_bag(&scenario, &again, &Interrupt::default()).unwrap();
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

#[test]
fn scenarios_for_odometry_and_sensors_are_asked_for_by_name() {
    use simulator::{ColourCamera, Imu, OdometryRun, SceneName, SlamRun, VelodyneModel, Wheels};
    assert_eq!(asked_for("office --seed 2"), Scenario::odometry(OdometryRun::Office, 2));
    assert_eq!(asked_for("low-light"), Scenario::odometry(OdometryRun::LowLight, 1));
    for run in OdometryRun::ALL {
        assert_eq!(asked_for(run.name()), Scenario::odometry(run, 1));
    }
    assert_eq!(asked_for(SlamRun::Flat.name()), Scenario::slam(SlamRun::Flat, 1));
    assert_eq!(asked_for("road --velodyne vlp16"), Scenario::road(VelodyneModel::Vlp16, 1));
    let mut rail = Scenario::crossing(
        SceneName::B,
        simulator::CrossingObject::Robot,
        simulator::PathName::D,
        1,
    );
    rail.rig.colour_camera = Some(ColourCamera::default());
    rail.rig.imu = Some(Imu::default());
    rail.rig.wheels = Some(Wheels::default());
    assert_eq!(asked_for("--scene B --object robot --path D --colour --imu --wheels"), rail);
    let colour = |arguments: &str| asked_for(arguments).rig.colour_camera.unwrap();
    assert_eq!(colour("demo --low-light"), ColourCamera::default().in_low_light());
    assert_eq!(colour("demo --motion-blur-ms 20").exposure_s, 0.02);
    assert_eq!(colour("office --supersampling 1").supersampling, 1);
    // Sensors that were not requested are absent.
    let rig = asked_for("demo").rig;
    assert!(rig.colour_camera.is_none() && rig.imu.is_none() && rig.velodyne.is_none());
    assert!(parse("demo --motion-blur-ms 50").is_err());
    assert!(parse("demo --velodyne hdl-128").is_err());
    let refused = scenario(&parse("office --object robot").unwrap()).unwrap_err().to_string();
    assert!(refused.contains("--object"), "{refused}");
}

#[test]
fn the_bag_holds_what_colour_camera_imu_wheels_and_velodyne_publish() {
    use msgs::geometry_msgs::PoseStamped;
    use msgs::nav_msgs::Odometry;
    use msgs::sensor_msgs::{CameraInfo, Image, Imu};
    use robot::sensor_bag::{
        COLOUR_CAMERA_INFO, DEPTH, IMU, RAW_COLOUR, TRUE_POSE, TRUE_VELODYNE_LABELS, VELODYNE,
        WHEELS,
    };
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("all.mcap");
    let arguments = "small --colour --imu --wheels --velodyne vlp16 --depth-size 64 48";
    write_bag(&asked_for(arguments).with_duration_s(1.0), &bag, &Interrupt::default()).unwrap();

    let (images, depths) = (messages::<Image>(&bag, RAW_COLOUR), messages::<Image>(&bag, DEPTH));
    assert_eq!((images.len(), depths.len()), (30, 30));
    for (image, depth) in images.iter().zip(&depths) {
        assert_eq!(image.header, depth.header);
        assert_eq!((image.encoding.as_str(), image.width, image.height), ("rgb8", 64, 48));
        assert_eq!((image.step, image.data.len()), (192, 64 * 48 * 3));
    }
    let infos: Vec<CameraInfo> = messages(&bag, COLOUR_CAMERA_INFO);
    assert_eq!((infos.len(), infos[0].header.clone()), (30, images[0].header.clone()));

    let imu: Vec<Imu> = messages(&bag, IMU);
    assert_eq!((imu.len(), imu[0].header.frame_id.as_str()), (201, "imu"));
    assert_eq!(imu[0].orientation_covariance[0], -1.0);
    assert!((imu[0].linear_acceleration.z - 9.8).abs() < 0.3);

    let odometry: Vec<Odometry> = messages(&bag, WHEELS);
    assert_eq!(odometry.len(), 51);
    let frames = (odometry[0].header.frame_id.as_str(), odometry[0].child_frame_id.as_str());
    assert_eq!(frames, ("odom", "base_link"));
    assert_eq!(odometry[50].pose.covariance[14], 1e6);

    let clouds: Vec<PointCloud2> = messages(&bag, VELODYNE);
    let labels: Vec<Image> = messages(&bag, TRUE_VELODYNE_LABELS);
    assert_eq!((clouds.len(), labels.len()), (10, 10));
    for (cloud, labels) in clouds.iter().zip(&labels) {
        assert_eq!((cloud.width, cloud.height), (labels.width, labels.height));
        assert_eq!((cloud.width, cloud.height, cloud.point_step), (1808, 16, 22));
        let names: Vec<&str> = cloud.fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(names, ["x", "y", "z", "intensity", "ring", "time"]);
        let points = msgs::convert::cloud_from_message(cloud).unwrap().points_m;
        // A room of 5 x 6 m with nothing nearer than a metre.
        let measured: Vec<_> = points.iter().filter(|p| p.x.is_finite()).collect();
        assert!(measured.len() > 15_000, "{}", measured.len());
        assert!(measured.iter().all(|p| (0.9..9.0).contains(&p.coords.norm())));
    }
    let poses: Vec<PoseStamped> = messages(&bag, TRUE_POSE);
    assert_eq!(poses.len(), 40);
}
