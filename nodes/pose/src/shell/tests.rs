//! The node in this process, before a wall with a picture on it.

mod behind;
mod maps;
mod options;

use geometry::{CameraModel, DepthImage, DepthPixels, Distortion, Stamp};
use msgs::convert;
use msgs::geometry_msgs::PoseStamped;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, Image};
use msgs::stillmap_msgs::StageReport;
use msgs::tf2_msgs::TFMessage;
use nalgebra::Matrix3;
use node_shell::{Host, Node, Publisher, Qos, RosArguments, Subscription};

use super::*;
use crate::image::GrayImage;
use crate::testing::{Random, dead_leaves, view};

const WALL_M: f32 = 2.0;
const PICTURE_PX: usize = 700;
const PERIOD_S: f64 = 1.0 / 30.0;

/// The node, and the stand-in of its camera.
struct Scene {
    stage: Stage,
    picture: GrayImage,
    camera: CameraModel,
    colors: Publisher<Image>,
    infos: Publisher<CameraInfo>,
    depths: Publisher<Image>,
    odometry: Subscription<Odometry>,
    pictures: Subscription<Image>,
    reports: Subscription<StageReport>,
    peer: Node,
    _host: Host,
}

fn camera(width_px: usize) -> CameraModel {
    let focal_px = 0.8 * width_px as f64;
    CameraModel {
        width_px,
        height_px: width_px * 3 / 4,
        fx_px: focal_px,
        fy_px: focal_px,
        cx_px: 0.5 * width_px as f64,
        cy_px: 0.375 * width_px as f64,
        distortion: Distortion::None,
    }
}

fn stamp(index: u32) -> Stamp {
    Stamp::from_nanos(5_000_000_000).plus_seconds(f64::from(index) * PERIOD_S)
}

/// What the node makes of a pair of images.
#[derive(Debug)]
struct Outcome {
    odometry: Vec<Odometry>,
    reports: Vec<StageReport>,
}

impl Outcome {
    /// Where the rig is, to the left.
    fn y_m(&self) -> f64 {
        assert_eq!(self.odometry.len(), 1, "{self:?}");
        self.odometry[0].pose.pose.position.y
    }

    fn reason(&self) -> &str {
        assert_eq!((self.odometry.len(), self.reports.len()), (0, 1), "{self:?}");
        &self.reports[0].drop_reason
    }
}

impl Scene {
    fn new() -> Self {
        Self::with(PoseParameters::default())
    }

    fn with(parameters: PoseParameters) -> Self {
        let host = Host::in_process();
        let arguments = RosArguments::parse([] as [String; 0]).unwrap();
        let node = |name: &str| -> Node { host.node(name, &arguments).unwrap() };
        let (own, peer) = (node("pose"), node("camera"));
        let scene = Self {
            stage: Stage::new(&own, &parameters).unwrap(),
            picture: dead_leaves(PICTURE_PX, 6_000, &mut Random::new(3)),
            camera: camera(320),
            colors: peer.publisher("rgb/image", &Qos::sensor(1)).unwrap(),
            infos: peer.publisher("rgb/camera_info", &Qos::sensor(1)).unwrap(),
            depths: peer.publisher("depth/image", &Qos::sensor(1)).unwrap(),
            odometry: peer.subscription("odom", &Qos::reliable(10)).unwrap(),
            pictures: peer.subscription("features", &Qos::sensor(10)).unwrap(),
            reports: peer.subscription("pose/report", &Qos::reliable(10)).unwrap(),
            peer,
            _host: host,
        };
        scene.calibrate();
        scene
    }

    fn calibrate(&self) {
        self.infos
            .publish(convert::message_from_camera(&self.camera, stamp(0), "optical"))
            .unwrap();
    }

    /// The image of a camera that has gone to the right.
    fn color(&self, index: u32, right_m: f64) -> Image {
        let CameraModel { width_px, height_px, fx_px, .. } = self.camera;
        // A pixel of the picture is as large on the wall as one of the first camera's image.
        let scale = 256.0 / fx_px;
        let shift_px = 150.0 + right_m * 256.0 / f64::from(WALL_M);
        let homography = Matrix3::new(scale, 0.0, shift_px, 0.0, scale, 150.0, 0.0, 0.0, 1.0);
        let gray = view(&self.picture, &homography, (width_px, height_px));
        Image {
            header: self.header(index),
            height: height_px as u32,
            width: width_px as u32,
            encoding: "mono8".to_owned(),
            is_bigendian: 0,
            step: width_px as u32,
            data: gray.pixels().to_vec(),
        }
    }

    fn header(&self, index: u32) -> msgs::std_msgs::Header {
        let stamp = convert::time_from_stamp(stamp(index));
        msgs::std_msgs::Header { stamp, frame_id: "optical".to_owned() }
    }

    fn depth(&self, index: u32) -> Image {
        let size_px = (self.camera.width_px, self.camera.height_px);
        let pixels = DepthPixels::Metres(vec![WALL_M; size_px.0 * size_px.1]);
        let depth = DepthImage::new(stamp(index), "optical".to_owned(), size_px, pixels).unwrap();
        convert::message_from_depth(&depth)
    }

    fn take(&mut self, color: Image, depth: Image) -> Outcome {
        self.colors.publish(color).unwrap();
        self.depths.publish(depth).unwrap();
        self.hear()
    }

    fn hear(&mut self) -> Outcome {
        self.stage.take_waiting();
        let mut outcome = Outcome { odometry: Vec::new(), reports: Vec::new() };
        while let Some(received) = self.odometry.try_next() {
            outcome.odometry.push((*received.message).clone());
        }
        while let Some(received) = self.reports.try_next() {
            outcome.reports.push((*received.message).clone());
        }
        outcome
    }

    /// The image and the depth of a camera that goes to the right by 6 cm/s.
    fn see(&mut self, index: u32) -> Outcome {
        let (color, depth) = (self.color(index, right_m(index)), self.depth(index));
        self.take(color, depth)
    }

    /// The pose is where the camera is.
    fn is_right(&mut self, index: u32) {
        let y_m = self.see(index).y_m();
        assert!((y_m + right_m(index)).abs() < 0.01, "{index}: {y_m}");
    }
}

fn right_m(index: u32) -> f64 {
    0.002 * f64::from(index)
}

#[test]
fn a_camera_that_goes_to_the_right_has_poses_with_honest_numbers_and_a_picture() {
    let mut scene = Scene::new();
    for index in 0..12 {
        scene.is_right(index);
    }
    let odometry = &scene.see(12).odometry[0];
    assert_eq!(
        (odometry.header.frame_id.as_str(), odometry.child_frame_id.as_str()),
        ("odom", "base_link")
    );
    let speed = odometry.twist.twist.linear.y;
    let std_dev = odometry.twist.covariance[7].sqrt();
    assert!((speed + 0.06).abs() < 4.0 * std_dev, "{speed} {std_dev}");
    let y_std_dev_m = odometry.pose.covariance[7].sqrt();
    assert!((1e-5..0.02).contains(&y_std_dev_m), "{y_std_dev_m}");
    let mut pictures = 0;
    while let Some(received) = scene.pictures.try_next() {
        assert_eq!((received.message.width, received.message.encoding.as_str()), (320, "rgb8"));
        // Something is drawn: not all is gray.
        assert!(received.message.data.as_chunks::<3>().0.iter().any(|pixel| pixel[0] != pixel[1]));
        pictures += 1;
    }
    assert!(pictures > 0);
}

#[test]
fn a_resolution_that_changes_costs_the_images_that_have_no_calibration() {
    let mut scene = Scene::new();
    for index in 0..10 {
        scene.is_right(index);
    }
    scene.camera = camera(480);
    let (color, depth) = (scene.color(10, right_m(10)), scene.depth(10));
    assert!(scene.take(color, depth).reason().contains("480 x 360"));
    scene.calibrate();
    // Now and then a frame is lost until the landmarks are known at their new size; none is wrong.
    for index in 11..20 {
        for odometry in scene.see(index).odometry {
            let y_m = odometry.pose.pose.position.y;
            assert!((y_m + right_m(index)).abs() < 0.02, "{index}: {y_m}");
        }
    }
    scene.is_right(20);
}

#[test]
fn images_that_are_swapped_black_or_without_depth_are_named_and_survived() {
    let mut scene = Scene::new();
    for index in 0..10 {
        scene.is_right(index);
    }
    let (color, depth) = (scene.color(10, 0.0), scene.depth(10));
    let swapped = scene.take(depth, color);
    assert!(swapped.reason().contains("32FC1"), "{swapped:?}");
    let mut black = scene.color(11, 0.0);
    black.data.fill(0);
    let depth = scene.depth(11);
    assert!(scene.take(black, depth).reason().contains("dark, blurred or bare"));
    scene.is_right(12);
    let (color, mut depth) = (scene.color(13, right_m(13)), scene.depth(13));
    depth.data = f32::NAN.to_le_bytes().repeat(depth.data.len() / 4);
    // Known landmarks hold the pose without depth, too.
    let y_m = scene.take(color, depth).y_m();
    assert!((y_m + right_m(13)).abs() < 0.01, "{y_m}");
    scene.is_right(14);
}

/// Regression: the depth images of a camera beside the colour camera were taken for registered ones, without a word.
#[test]
fn registered_depth_that_has_the_frame_of_another_camera_is_reported() {
    let mut scene = Scene::new();
    let (color, mut depth) = (scene.color(0, 0.0), scene.depth(0));
    scene.take(color.clone(), depth.clone());
    assert_eq!(scene.stage.registration_doubt(), None);
    for frame_id in ["depth_optical", ""] {
        frame_id.clone_into(&mut depth.header.frame_id);
        scene.take(color.clone(), depth.clone());
        let doubt = scene.stage.registration_doubt().unwrap_or_default();
        assert_eq!(doubt.contains(r#"in "depth_optical""#), !frame_id.is_empty(), "{doubt}");
    }
}

#[test]
fn an_image_before_any_calibration_says_what_it_waits_for() {
    let mut scene = Scene::new();
    let blind = Host::in_process();
    let arguments = RosArguments::parse([] as [String; 0]).unwrap();
    let (own, peer) =
        (blind.node("pose", &arguments).unwrap(), blind.node("camera", &arguments).unwrap());
    scene.stage = Stage::new(&own, &PoseParameters::default()).unwrap();
    scene.colors = peer.publisher("rgb/image", &Qos::sensor(1)).unwrap();
    scene.depths = peer.publisher("depth/image", &Qos::sensor(1)).unwrap();
    scene.reports = peer.subscription("pose/report", &Qos::reliable(10)).unwrap();
    let outcome = scene.see(0);
    assert!(outcome.reason().contains("no calibration on /rgb/camera_info"), "{outcome:?}");
}

#[test]
fn after_a_reset_the_next_image_is_the_first_one_again() {
    let mut scene = Scene::new();
    for index in 0..10 {
        scene.is_right(index);
    }
    scene.stage.reset().unwrap();
    let (color, depth) = (scene.color(10, right_m(10)), scene.depth(10));
    assert!(scene.take(color, depth).reason().contains("no calibration"), "it comes again");
    scene.calibrate();
    let (color, depth) = (scene.color(11, right_m(11)), scene.depth(11));
    let y_m = scene.take(color, depth).y_m();
    assert!(right_m(11) > 0.01 && y_m.abs() < 1e-6, "{y_m}");
}

#[test]
fn with_a_map_poses_are_published_in_it_and_the_two_frames_are_tied() {
    let parameters =
        PoseParameters { slam: true, slam_in_background: false, ..PoseParameters::default() };
    let mut scene = Scene::with(parameters);
    let poses = scene.peer.subscription::<PoseStamped>("pose", &Qos::reliable(100)).unwrap();
    let transforms = scene.peer.subscription::<TFMessage>("/tf", &Qos::reliable(100)).unwrap();
    let mut last = None;
    for index in 0..30 {
        last = Some(scene.see(index));
    }
    let odometry = last.unwrap();
    let report = &odometry.reports[0];
    let keyframes = report.count_names.iter().position(|name| name == "keyframes").unwrap();
    assert!(report.counts[keyframes] >= 1);
    let mut published = Vec::new();
    while let Some(pose) = poses.try_next() {
        published.push(pose.message);
    }
    assert_eq!(published.len(), 30);
    assert!(published.iter().all(|pose| pose.header.frame_id == "map"));
    let mut tied = Vec::new();
    while let Some(message) = transforms.try_next() {
        tied.extend(message.message.transforms.clone());
    }
    let map_from_odom = tied.iter().rfind(|tied| tied.header.frame_id == "map").unwrap();
    assert_eq!(map_from_odom.child_frame_id, "odom");
    // What the odometry says, put into the map, is what the pose says.
    let tie = convert::isometry_from_transform(&map_from_odom.transform).unwrap();
    let odom = convert::isometry_from_pose(&odometry.odometry[0].pose.pose).unwrap();
    let in_map = convert::isometry_from_pose(&published[29].pose).unwrap();
    let off = (tie * odom).inverse() * in_map;
    assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-9, "{off}");
    assert!((in_map.translation.y + right_m(29)).abs() < 0.01, "{in_map}");
    assert_eq!(scene.stage.trajectory().unwrap().len(), 30);
}
