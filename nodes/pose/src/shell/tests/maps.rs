//! Maps of keyframes that are saved, loaded and let go.

use std::path::Path;
use std::sync::OnceLock;

use geometry::pose_from_vector;
use msgs::nav_msgs;
use nalgebra::Isometry3;

use super::*;

/// Within this many images the camera is found: a third of a second.
const SOON: u32 = 10;
/// Where the rig was set off on the second day, in its odometry's frame.
const SET_OFF: [f64; 6] = [4.0, -3.0, 0.0, 1.0, 0.0, 0.0];

fn with_map() -> PoseParameters {
    PoseParameters { slam: true, slam_in_background: false, ..PoseParameters::default() }
}

/// A folder, and in it the map of a camera that has gone 6 cm to the right.
fn saved_map() -> (tempfile::TempDir, String) {
    static MAP: OnceLock<Vec<u8>> = OnceLock::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map").to_str().unwrap().to_owned();
    let bytes = MAP.get_or_init(|| {
        let parameters = PoseParameters { map_file: path.clone(), ..with_map() };
        let mut scene = Scene::with(parameters);
        for index in 0..30 {
            scene.is_right(index);
        }
        let (file, saved) = scene.stage.to_be_saved().unwrap();
        let message = file.save(&saved).unwrap();
        assert!(message.contains("keyframes") && message.contains(&path), "{message}");
        std::fs::read(&path).unwrap()
    });
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

/// A camera that was found in the map.
struct Found {
    /// After this many images.
    after: u32,
    /// How far off the last pose in the map was.
    off_m: f64,
    /// The last pose of the odometry.
    odom: Isometry3<f64>,
}

/// Shows these images; the last result with a pose in the map, if any.
fn found(scene: &mut Scene, images: std::ops::Range<u32>) -> Option<Found> {
    let poses = scene.peer.subscription::<PoseStamped>("pose", &Qos::reliable(100)).unwrap();
    let first = images.start;
    let mut found: Option<Found> = None;
    for index in images {
        let outcome = scene.see(index);
        let Some(odom) = outcome.odometry.first() else { continue };
        let odom = convert::isometry_from_pose(&odom.pose.pose).unwrap();
        while let Some(pose) = poses.try_next() {
            assert_eq!(pose.message.header.frame_id, "map");
            let in_map = convert::isometry_from_pose(&pose.message.pose).unwrap();
            let off_m = (in_map.translation.y + right_m(index)).abs();
            let after = found.as_ref().map_or(index - first, |found| found.after);
            found = Some(Found { after, off_m, odom });
        }
    }
    found
}

#[test]
fn a_camera_is_found_in_a_map_of_another_day_within_a_third_of_a_second() {
    let (_folder, path) = saved_map();
    let parameters = PoseParameters {
        map_file: path.clone(),
        localisation_only: true,
        initial_pose: SET_OFF,
        ..with_map()
    };
    let mut scene = Scene::with(parameters);
    let map = |scene: &Scene| scene.stage.to_be_saved().unwrap().1.encode().unwrap();
    let before = map(&scene);
    assert_eq!(before, std::fs::read(&path).unwrap());
    let Found { after, off_m, odom } = found(&mut scene, 20..20 + SOON).unwrap();
    assert!(after < SOON && off_m < 0.01, "{after} {off_m}");
    // Odometry begins at its start, and continues from there.
    let went = pose_from_vector(&SET_OFF).inverse() * odom;
    let went_m = right_m(SOON - 1);
    assert!((went.translation.y + went_m).abs() < 0.01, "{went}");
    // The map is unchanged.
    assert_eq!(map(&scene), before);
    // After a restart it is searched for again, in the same map.
    let message = scene.stage.begin_anew().unwrap();
    assert!(message.contains("in the map of"), "{message}");
    scene.calibrate();
    let Found { after, off_m, .. } = found(&mut scene, 40..40 + SOON).unwrap();
    assert!(after < SOON && off_m < 0.01, "{after} {off_m}");
    assert_eq!(map(&scene), before);
}

/// Regression: before it was found its poses were in `odom`, and `reconstruction` threw the map away that it had loaded.
#[test]
fn a_camera_that_is_not_found_in_a_loaded_map_has_odometry_and_no_pose() {
    let (_folder, path) = saved_map();
    let parameters = PoseParameters {
        map_file: path,
        load_map_on_start: true,
        initial_pose: SET_OFF,
        ..with_map()
    };
    let mut scene = Scene::with(parameters);
    let known =
        std::mem::replace(&mut scene.picture, dead_leaves(PICTURE_PX, 6_000, &mut Random::new(4)));
    let poses = scene.peer.subscription::<PoseStamped>("pose", &Qos::reliable(100)).unwrap();
    for index in 0..5 {
        assert_eq!(scene.see(index).odometry.len(), 1);
    }
    assert!(poses.try_next().is_none());
    // Odometry begins anew before the wall that it knows.
    scene.picture = known;
    let Found { off_m, .. } = found(&mut scene, 20..20 + SOON).unwrap();
    assert!(off_m < 0.01, "{off_m}");
}

#[test]
fn the_trajectory_is_published_in_the_frame_of_the_map_with_the_first_pose() {
    let mut scene = Scene::with(PoseParameters { initial_pose: SET_OFF, ..with_map() });
    let poses = scene.peer.subscription::<PoseStamped>("pose", &Qos::reliable(100)).unwrap();
    let paths = scene.peer.subscription::<nav_msgs::Path>("map_path", &Qos::reliable(9)).unwrap();
    for index in 0..3 {
        scene.see(index);
    }
    let pose = convert::pose_from_message(&poses.try_next().unwrap().message).unwrap();
    let path = convert::map_path_from_message(&paths.try_next().unwrap().message).unwrap();
    assert_eq!((path.frame_id(), pose.frame_id.as_str()), ("map", "map"));
    let first = path.vertices()[0];
    assert!(first.stamp.seconds_since(pose.stamp) < 0.1);
    let off = first.map_from_rig.inverse() * pose.map_from_rig;
    assert!(off.translation.vector.norm() < 0.02 && off.rotation.angle() < 0.02, "{off}");
    // Without a map there is no such topic.
    let without = Scene::with(PoseParameters::default());
    let paths = without.peer.subscription::<nav_msgs::Path>("map_path", &Qos::reliable(9)).unwrap();
    assert_eq!(paths.publisher_count(), 0);
}

#[test]
fn a_map_that_was_loaded_grows_when_the_camera_was_found_in_it() {
    let (_folder, path) = saved_map();
    let parameters = PoseParameters { map_file: path, load_map_on_start: true, ..with_map() };
    let mut scene = Scene::with(parameters);
    let keyframes = |scene: &Scene| scene.stage.to_be_saved().unwrap().1.map.keyframes_so_far();
    let before = keyframes(&scene);
    let Found { after, off_m, .. } = found(&mut scene, 25..70).unwrap();
    assert!(after < SOON && off_m < 0.01, "{after} {off_m}");
    assert!(keyframes(&scene) > before, "{} after {before}", keyframes(&scene));
    let message = scene.stage.begin_anew().unwrap();
    assert!(message.contains("with nothing"), "{message}");
    let error = scene.stage.to_be_saved().unwrap_err().to_string();
    assert!(error.contains("there is no map yet"), "{error}");
}

#[test]
fn a_map_is_loaded_while_the_camera_goes_on_and_odometry_does_not_jump() {
    let (_folder, path) = saved_map();
    let parameters = PoseParameters { map_file: path, initial_pose: SET_OFF, ..with_map() };
    let mut scene = Scene::with(parameters);
    let odom_before = found(&mut scene, 10..16).unwrap().odom;
    let message = scene.stage.load_map().unwrap();
    assert!(message.contains("loaded a map of"), "{message}");
    let Found { after, off_m, odom } = found(&mut scene, 16..16 + SOON).unwrap();
    assert!(after < SOON && off_m < 0.01, "{after} {off_m}");
    let went = odom_before.inverse() * odom;
    assert!((went.translation.y + right_m(SOON)).abs() < 0.01, "{went}");
}

#[test]
fn a_failure_to_load_or_save_is_reported_and_changes_nothing() {
    let (folder, path) = saved_map();
    let parameters =
        PoseParameters { map_file: path.clone(), load_map_on_start: true, ..with_map() };
    let mut scene = Scene::with(parameters);
    let before = scene.stage.to_be_saved().unwrap().1.encode().unwrap();
    let mut spoilt = std::fs::read(&path).unwrap();
    spoilt[1000] ^= 1;
    std::fs::write(&path, spoilt).unwrap();
    let error = scene.stage.load_map().unwrap_err().to_string();
    assert!(error.contains(&path) && error.contains("checksum"), "{error}");
    std::fs::remove_file(&path).unwrap();
    let error = scene.stage.load_map().unwrap_err().to_string();
    assert!(error.contains(&path) && error.contains("could not be loaded"), "{error}");
    assert_eq!(scene.stage.to_be_saved().unwrap().1.encode().unwrap(), before);
    assert_eq!(scene.see(20).odometry.len(), 1);
    let error = scene.stage.save_map_to(folder.path()).unwrap_err().to_string();
    assert!(error.contains("could not be saved"), "{error}");
    let mut odometry = Scene::new();
    let error = odometry.stage.load_map().unwrap_err().to_string();
    assert!(error.contains("the parameter slam is false"), "{error}");
    let path = Path::new(&path);
    assert!(odometry.stage.save_map_to(path).is_err() && !path.exists());
    let mut without_file = Scene::with(with_map());
    let error = without_file.stage.load_map().unwrap_err().to_string();
    assert!(error.contains("map_file is empty"), "{error}");
}

/// Why a node does not start.
fn refused(parameters: PoseParameters) -> String {
    let host = Host::in_process();
    let arguments = RosArguments::parse([] as [String; 0]).unwrap();
    let node = host.node("pose", &arguments).unwrap();
    Stage::new(&node, &parameters).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn to_localise_alone_without_a_map_is_refused_by_what_is_missing() {
    let localise = |parameters| PoseParameters { localisation_only: true, ..parameters };
    let named = |map_file: &str| PoseParameters { map_file: map_file.to_owned(), ..with_map() };
    let error = refused(localise(PoseParameters::default()));
    assert!(error.contains("localisation_only needs slam"), "{error}");
    let error = refused(localise(with_map()));
    assert!(error.contains("localisation_only needs map_file"), "{error}");
    let error = refused(localise(named("/nowhere/at/all")));
    assert!(error.contains("map_file") && error.contains("does not exist"), "{error}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map");
    let error = refused(localise(named(path.to_str().unwrap())));
    assert!(error.contains("could not be loaded from"), "{error}");
    std::fs::write(&path, "ply\nformat ascii 1.0\n").unwrap();
    let error = refused(localise(named(path.to_str().unwrap())));
    assert!(error.contains("no map of keyframes"), "{error}");
    let without_file = PoseParameters { load_map_on_start: true, ..with_map() };
    assert!(refused(without_file).contains("load_map_on_start needs map_file"));
    let exit = PoseParameters { save_map_on_exit: "map".to_owned(), ..PoseParameters::default() };
    assert!(refused(exit).contains("save_map_on_exit needs slam"));
    let mut lines_alone = with_map();
    lines_alone.tracker.frame.use_points = false;
    assert!(refused(lines_alone).contains("slam needs frame.use_points"));
}

#[test]
fn a_map_of_fewer_keyframes_keeps_the_file_as_a_version() {
    let (folder, path) = saved_map();
    let before = std::fs::read(&path).unwrap();
    let mut scene = Scene::with(with_map());
    scene.see(0);
    let done = scene.stage.save_map_to(Path::new(&path)).unwrap();
    assert!(done.contains("1 keyframes") && done.contains("is kept as"), "{done}");
    let files = || std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(files(), 2);
    let version = done.rsplit("kept as ").next().unwrap();
    assert!(std::fs::read(version).unwrap() == before);
    // The same map again, or a larger one, replaces it.
    let done = scene.stage.save_map_to(Path::new(&path)).unwrap();
    assert!(!done.contains("is kept as") && files() == 2, "{done}");
}
