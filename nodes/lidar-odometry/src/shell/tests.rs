//! The node in this process, in a street.

mod behind;
mod loops;

use std::net::UdpSocket;
use std::time::{Duration, Instant};

use geometry::{LidarReturn, Revolution, Stamp};
use msgs::convert;
use msgs::nav_msgs::{Odometry, Path};
use msgs::sensor_msgs::{Image, PointCloud2};
use msgs::stillmap_msgs::StageReport;
use msgs::velodyne_msgs::{VelodynePacket, VelodyneScan};
use nalgebra::{Isometry3, Point3, Vector3};
use node_shell::{Host, Publisher, Qos, RosArguments, Subscription};

use super::*;
use crate::packets::encoder::{Echoes, Encoder};
use crate::packets::{Model, ReturnMode};
use crate::testing::{Random, Rectangle, seen, street};

const PERIOD_S: f64 = 0.1;
const POINTS: usize = 8_000;

/// The node, and stand-ins of its driver and its listeners.
struct Scene {
    stage: Stage,
    street: Vec<Rectangle>,
    clouds: Publisher<PointCloud2>,
    wheels: Publisher<Odometry>,
    packets: Publisher<VelodyneScan>,
    odometry: Subscription<Odometry>,
    reports: Subscription<StageReport>,
    peer: node_shell::Node,
    _host: Host,
}

/// What the node makes of a scan.
#[derive(Debug)]
struct Outcome {
    odometry: Vec<Odometry>,
    reports: Vec<StageReport>,
}

impl Outcome {
    /// Where the vehicle is, ahead.
    fn x_m(&self) -> f64 {
        assert_eq!(self.odometry.len(), 1, "{self:?}");
        self.odometry[0].pose.pose.position.x
    }

    fn reason(&self) -> &str {
        assert_eq!((self.odometry.len(), self.reports.len()), (0, 1), "{self:?}");
        &self.reports[0].drop_reason
    }
}

fn stamp(index: u32) -> Stamp {
    Stamp::from_nanos(5_000_000_000).plus_seconds(f64::from(index) * PERIOD_S)
}

/// Ahead by 6 m/s.
fn x_m(index: u32) -> f64 {
    0.6 * f64::from(index)
}

impl Scene {
    fn new(parameters: &LidarOdometryParameters) -> Self {
        let host = Host::in_process();
        let arguments = RosArguments::parse([] as [String; 0]).unwrap();
        let node = |name: &str| host.node(name, &arguments).unwrap();
        let (own, peer) = (node("lidar_odometry"), node("driver"));
        Self {
            stage: Stage::new(&own, parameters).unwrap(),
            street: street(&mut Random::new(1)),
            clouds: peer.publisher("points", &Qos::sensor(1)).unwrap(),
            wheels: peer.publisher("wheels", &Qos::sensor(10)).unwrap(),
            packets: peer.publisher("velodyne_packets", &Qos::sensor(1)).unwrap(),
            odometry: peer.subscription("odom", &Qos::reliable(10)).unwrap(),
            reports: peer.subscription("lidar_odometry/report", &Qos::reliable(10)).unwrap(),
            peer,
            _host: host,
        }
    }

    /// A cloud of the street with rings, all measured at once.
    fn cloud(&self, index: u32) -> PointCloud2 {
        self.cloud_at(index, x_m(index))
    }

    /// The same from elsewhere along the street.
    fn cloud_at(&self, index: u32, x_m: f64) -> PointCloud2 {
        let mut random = Random::new(100 + u64::from(index));
        let at = Isometry3::translation(-25.0 + x_m, 0.0, 0.0);
        let points_m = seen(&self.street, &at, POINTS, 0.01, &mut random);
        let found = |point: Point3<f32>| {
            Some(LidarReturn { position_m: point, intensity: 40.0, time_s: 0.0 })
        };
        let columns = points_m.len() / 4;
        let returns = points_m.into_iter().take(4 * columns).map(found).collect();
        let revolution = Revolution::new(
            stamp(index),
            "velodyne".to_owned(),
            vec![0.1, 0.0, -0.1, -0.2],
            vec![0.0; columns],
            returns,
        );
        convert::message_from_revolution(&revolution.unwrap())
    }

    fn take(&mut self, cloud: PointCloud2) -> Outcome {
        self.clouds.publish(cloud).unwrap();
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

    fn is_right(&mut self, index: u32, first: u32) -> Outcome {
        let cloud = self.cloud(index);
        let outcome = self.take(cloud);
        let travelled_m = x_m(index) - x_m(first);
        assert!(
            (outcome.x_m() - travelled_m).abs() < 0.1,
            "{index}: {} {travelled_m}",
            outcome.x_m()
        );
        outcome
    }
}

#[test]
fn a_drive_has_poses_with_honest_numbers_and_what_a_viewer_wants() {
    let mut scene = Scene::new(&LidarOdometryParameters::default());
    for index in 0..4 {
        scene.is_right(index, 0);
    }
    let images = |topic: &str| scene.peer.subscription::<Image>(topic, &Qos::sensor(10)).unwrap();
    let pictures =
        ["intensity_panorama", "range_panorama", "drive_from_above", "whole_drive"].map(images);
    let clouds = |topic: &str, qos| scene.peer.subscription::<PointCloud2>(topic, &qos).unwrap();
    let map = clouds("local_map", Qos::reliable(1));
    let scans = clouds("lidar_scan", Qos::sensor(10));
    let paths = scene.peer.subscription::<Path>("path", &Qos::reliable(1)).unwrap();
    let odometry = scene.is_right(4, 0).odometry.remove(0);
    assert_eq!(
        (odometry.header.frame_id.as_str(), odometry.child_frame_id.as_str()),
        ("odom", "base_link")
    );
    assert_eq!(odometry.header.stamp, convert::time_from_stamp(stamp(4)));
    let speed_std_dev = odometry.twist.covariance[0].sqrt();
    let speed = odometry.twist.twist.linear.x;
    assert!(
        (speed - 6.0).abs() < 0.5 && (1e-4..1.0).contains(&speed_std_dev),
        "{speed} {speed_std_dev}"
    );
    assert!((1e-5..0.05).contains(&odometry.pose.covariance[0].sqrt()));
    for (picture, (width, height)) in
        pictures.iter().zip([(1800, 24), (1800, 24), (800, 800), (800, 800)])
    {
        let image = picture.try_next().unwrap().message;
        assert_eq!((image.width, image.height, image.encoding.as_str()), (width, height, "rgb8"));
        let (first, all) = (&image.data[..3], image.data.as_chunks::<3>().0);
        assert!(all.iter().any(|pixel| pixel != first));
    }
    let map = convert::cloud_from_message(&map.try_next().unwrap().message).unwrap();
    assert!(map.frame_id == "odom" && map.points_m.len() > 500, "{}", map.points_m.len());
    let scan = convert::cloud_from_message(&scans.try_next().unwrap().message).unwrap();
    assert_eq!((scan.frame_id.as_str(), scan.points_m.len()), ("base_link", POINTS));
    assert_eq!(paths.try_next().unwrap().message.poses.len(), 5);
}

#[test]
fn a_recording_that_begins_anew_begins_at_the_origin() {
    let mut scene = Scene::new(&LidarOdometryParameters::default());
    for index in 20..26 {
        scene.is_right(index, 20);
    }
    // The same scan once more, and one that is a little late, are no other time.
    let late = [scene.cloud(25), scene.cloud(23)];
    for cloud in late {
        assert!(scene.take(cloud).reason().contains("scans must come one after another"));
    }
    scene.is_right(26, 20);
    let cloud = scene.cloud(0);
    assert!(scene.take(cloud).reason().contains("no other scan's agrees"));
    for index in 1..4 {
        scene.is_right(index, 1);
    }
}

/// Regression: one wrong stamp dropped the pose, the local map and the loops.
#[test]
fn a_scan_with_a_wrong_stamp_is_left_out_and_the_pose_goes_on() {
    let mut scene = Scene::new(&LidarOdometryParameters::default());
    for index in 0..4 {
        scene.is_right(index, 0);
    }
    for (index, wrong_s, side) in [(4, 3600.0, "after"), (6, -4.0, "before")] {
        let mut cloud = scene.cloud(index);
        let wrong = stamp(index).plus_seconds(wrong_s);
        cloud.header.stamp = convert::time_from_stamp(wrong);
        let outcome = scene.take(cloud);
        assert!(outcome.reason().contains(side), "{outcome:?}");
        scene.is_right(index + 1, 0);
    }
}

/// A client cleans the node up and activates it again.
#[test]
fn a_node_that_is_cleaned_up_begins_at_the_origin() {
    let mut scene = Scene::new(&LidarOdometryParameters::default());
    for index in 0..4 {
        scene.is_right(index, 0);
    }
    scene.stage.reset();
    for index in 4..8 {
        scene.is_right(index, 4);
    }
}

#[test]
fn bad_clouds_are_named_and_survived() {
    let mut scene = Scene::new(&LidarOdometryParameters::default());
    let good = scene.cloud(3);
    let no_points = PointCloud2 { width: 0, row_step: 0, data: Vec::new(), ..good.clone() };
    let mut all_nan = good.clone();
    for point in all_nan.data.chunks_exact_mut(22) {
        point[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    }
    for index in 0..3 {
        scene.is_right(index, 0);
    }
    assert!(scene.take(no_points).reason().contains("no usable point: of 0"));
    assert!(scene.take(all_nan).reason().contains("no usable point: of 0"));
    let short = PointCloud2 { data: good.data[..100].to_vec(), ..good.clone() };
    assert!(scene.take(short).odometry.is_empty());
    let mut renamed = good.clone();
    renamed.fields[0].name = "X".to_owned();
    assert!(scene.take(renamed).odometry.is_empty());
    // One wall, and nothing else: the motion along it is the prediction.
    scene.is_right(3, 0);
    let street = std::mem::replace(
        &mut scene.street,
        vec![Rectangle::new([-60.0, 8.0, -30.0], [120.0, 0.0, 0.0], [0.0, 0.0, 60.0])],
    );
    let wall = scene.cloud(4);
    let outcome = scene.take(wall);
    assert_eq!(outcome.odometry.len(), 1);
    scene.street = street;
    // It finds itself again.
    for index in 5..8 {
        let cloud = scene.cloud(index);
        assert_eq!(scene.take(cloud).odometry.len(), 1);
    }
    scene.is_right(8, 0);
}

#[test]
fn wheels_are_asked_only_when_they_are_to_be() {
    let parameters = LidarOdometryParameters { use_wheels: true, ..Default::default() };
    let mut scene = Scene::new(&parameters);
    let wheels = |index: u32| {
        let mut message = Odometry::default();
        message.header.stamp = convert::time_from_stamp(stamp(index));
        message.header.frame_id = "wheels".to_owned();
        message.pose.pose.position.x = x_m(index);
        message.pose.pose.orientation.w = 1.0;
        message
    };
    for index in 0..5 {
        scene.wheels.publish(wheels(index)).unwrap();
        scene.is_right(index, 0);
    }
    // Nothing is visible; the wheels report a higher velocity.
    scene.wheels.publish(Odometry { pose: wheels(7).pose, ..wheels(5) }).unwrap();
    scene.street = street(&mut Random::new(1));
    let mut cloud = scene.cloud(5);
    for point in cloud.data.chunks_exact_mut(22) {
        let z_m = f32::from_le_bytes(point[8..12].try_into().unwrap()) + 40.0;
        point[8..12].copy_from_slice(&z_m.to_le_bytes());
    }
    let held = scene.take(cloud);
    assert!((held.x_m() - x_m(7)).abs() < 0.1, "{}", held.x_m());
}

/// A scanner that stands in a room of 10 x 14 x 6 m.
fn room(model: Model) -> impl FnMut(usize, usize) -> Echoes {
    let encoder = Encoder::new(model, ReturnMode::Strongest);
    let turn_deg = 360.0 * encoder.turn_rate_hz * model.firing_period_s();
    let elevations = crate::packets::Calibration::of_data_sheet(model);
    move |firing, laser| {
        let azimuth_rad = (encoder.start_azimuth_deg + turn_deg * firing as f64).to_radians();
        let elevation_rad = elevations.lasers[laser].elevation_deg.to_radians();
        let (cos, sin) = (elevation_rad.cos(), elevation_rad.sin());
        let ray = Vector3::new(cos * azimuth_rad.cos(), -cos * azimuth_rad.sin(), sin);
        let walls = [(ray.x, 5.0), (ray.y, 7.0), (ray.z, 3.0)];
        let range_m = walls.map(|(along, wall_m)| wall_m / along.abs().max(1e-9));
        [Some((range_m.into_iter().fold(f64::INFINITY, f64::min), 30)), None]
    }
}

#[test]
fn packets_of_a_driver_become_scans() {
    let parameters =
        LidarOdometryParameters { input: LidarInput::VelodynePackets, ..Default::default() };
    let mut scene = Scene::new(&parameters);
    let encoder = Encoder::new(Model::Vlp16, ReturnMode::Strongest);
    let period_s = Model::Vlp16.packet_period_s(ReturnMode::Strongest);
    // A little more than three turns.
    let packets = encoder.packets(240, room(Model::Vlp16));
    let mut outcomes = Outcome { odometry: Vec::new(), reports: Vec::new() };
    for (number, of_message) in packets.chunks(80).enumerate() {
        let packet = |(index, bytes): (usize, &Vec<u8>)| VelodynePacket {
            stamp: convert::time_from_stamp(
                stamp(0).plus_seconds((number * 80 + index) as f64 * period_s),
            ),
            data: bytes.as_slice().try_into().unwrap(),
        };
        let mut of_message: Vec<VelodynePacket> =
            of_message.iter().enumerate().map(packet).collect();
        // One of an unknown scanner.
        of_message.push(VelodynePacket::default());
        let scan = VelodyneScan { packets: of_message, ..VelodyneScan::default() };
        scene.packets.publish(scan).unwrap();
        let heard = scene.hear();
        outcomes.odometry.extend(heard.odometry);
        outcomes.reports.extend(heard.reports);
    }
    scene.stage.end_of_input();
    let heard = scene.hear();
    outcomes.odometry.extend(heard.odometry);
    assert!((2..=3).contains(&outcomes.odometry.len()), "{}", outcomes.odometry.len());
    for odometry in &outcomes.odometry {
        let place = &odometry.pose.pose.position;
        assert!(place.x.hypot(place.y).hypot(place.z) < 0.02, "{place:?}");
    }
}

#[test]
fn packets_of_the_network_become_scans_and_none_is_lost() {
    let parameters = LidarOdometryParameters {
        input: LidarInput::Udp,
        udp_address: "127.0.0.1".to_owned(),
        udp_port: 0,
        udp_position_port: 0,
        ..Default::default()
    };
    let mut scene = Scene::new(&parameters);
    let address = scene.stage.inputs().network().unwrap().address();
    let encoder = Encoder::new(Model::Vlp16, ReturnMode::Strongest);
    let socket = UdpSocket::bind(("127.0.0.1", 0)).unwrap();
    let (mut poses, start) = (0, Instant::now());
    for packet in encoder.packets(240, room(Model::Vlp16)) {
        socket.send_to(&packet, address).unwrap();
        // At the scanner's own pace, so that the smallest buffer of a kernel is enough.
        std::thread::sleep(Duration::from_micros(300));
        poses += scene.hear().odometry.len();
    }
    while poses < 2 && start.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(10));
        poses += scene.hear().odometry.len();
    }
    assert!(poses >= 2, "{poses}");
}

#[test]
fn parameters_that_mean_nothing_are_named() {
    use node_shell::parameters::NodeParameters;
    type Spoil = fn(&mut LidarOdometryParameters);
    let cases: [(&str, Spoil); 9] = [
        ("base_from_lidar", |p| p.base_from_lidar[3] = f64::NAN),
        ("udp_address", |p| p.udp_address = "here".to_owned()),
        ("udp_scanner", |p| p.udp_scanner = "there".to_owned()),
        ("min_range_m", |p| p.min_range_m = 200.0),
        ("neighbours", |p| p.neighbours = 3),
        ("threads", |p| p.threads = 0),
        ("panorama_width_px", |p| p.panorama_width_px = 0),
        ("drawing_px", |p| p.drawing_px = 1_000_000),
        ("road_radius_m", |p| p.road_radius_m = 0.0),
    ];
    assert!(LidarOdometryParameters::default().validate_node().is_ok());
    for (name, spoil) in cases {
        let mut parameters = LidarOdometryParameters::default();
        spoil(&mut parameters);
        let error = parameters.validate_node().unwrap_err().to_string();
        assert!(error.contains(name), "{name}: {error}");
    }
}
