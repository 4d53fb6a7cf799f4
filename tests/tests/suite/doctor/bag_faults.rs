//! The faults that are planted in bags.

use msgs::geometry_msgs::PoseStamped;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, Image, Imu, LaserScan, PointCloud2};
use msgs::tf2_msgs::TFMessage;
use msgs::{RosMessage, convert};

use super::bags::{Base, Fault, fault};
use super::plant::{CAMERA, Recording, transform};

const SCAN: &str = "/scan";
const DEPTH: &str = "/camera/depth/image_raw";
const INFO: &str = "/camera/depth/camera_info";
const POSE: &str = "/pose";
const IMU: &str = "/imu/data_raw";
const CLOUD: &str = "/velodyne_points";

pub(super) const FAULTS: &[Fault] = &[
    fault(
        "no pose",
        Base::Room,
        |bag| {
            bag.keep(POSE, |_| false);
        },
        ["error", "inputs"],
        &["PoseStamped", "--pose"],
    ),
    fault(
        "poses of another type",
        Base::Room,
        |bag| {
            bag.retype(POSE, |pose: PoseStamped| {
                let mut odometry = Odometry { header: pose.header, ..Odometry::default() };
                odometry.pose.pose = pose.pose;
                odometry
            });
        },
        ["error", "inputs"],
        &["geometry_msgs/msg/PoseStamped"],
    ),
    fault(
        "colour for depth",
        Base::Room,
        |bag| {
            bag.edit(DEPTH, |_, image: &mut Image| {
                image.encoding = "rgb8".to_owned();
                image.step = image.width * 3;
                image.data = vec![9; (image.step * image.height) as usize];
            });
        },
        ["error", "messages"],
        &[DEPTH, "rgb8", "16UC1"],
    ),
    fault(
        "messages cut short",
        Base::Room,
        |bag| {
            bag.edit(SCAN, |index, scan: &mut LaserScan| {
                if index % 4 == 1 {
                    scan.ranges.clear()
                }
            });
        },
        ["warn", "messages"],
        &[SCAN, "of 14 messages"],
    ),
    fault(
        "stamps out of order",
        Base::Room,
        |bag| {
            bag.edit(SCAN, |index, scan: &mut LaserScan| {
                let seconds = match index {
                    5 => 0.15,
                    6 => -0.15,
                    _ => 0.0,
                };
                delay(&mut scan.header, seconds);
            });
        },
        ["warn", "stamps"],
        &[SCAN, "1 of", "before the one before", "chronyc"],
    ),
    fault(
        "stamps of zero",
        Base::Room,
        |bag| {
            bag.edit(DEPTH, |_, image: &mut Image| image.header.stamp = Default::default());
        },
        ["error", "stamps"],
        &[DEPTH, "stamp 0"],
    )
    .also(&["offsets", "poses", "clocks"]),
    fault(
        "one stamp for all",
        Base::Room,
        |bag| {
            let stamp = convert::time_from_stamp(bag.start());
            bag.edit(SCAN, |_, scan: &mut LaserScan| scan.header.stamp = stamp);
        },
        ["error", "stamps"],
        &[SCAN, "all", "messages have the stamp"],
    )
    .also(&["clocks"]),
    fault(
        "a gap",
        Base::Room,
        |bag| {
            bag.keep(SCAN, |index| !(4..9).contains(&index));
        },
        ["warn", "gaps"],
        &[SCAN, "1 gaps", "--max-cache-size"],
    ),
    fault(
        "a camera's clock ahead",
        Base::Room,
        |bag| {
            bag.edit(DEPTH, |_, image: &mut Image| delay(&mut image.header, 0.4));
            bag.edit(INFO, |_, info: &mut CameraInfo| delay(&mut info.header, 0.4));
        },
        ["warn", "clocks"],
        &[DEPTH, "0.400 s ahead", "chrony"],
    )
    .also(&["offsets", "poses"]),
    fault(
        "a clock that was recorded with its own times",
        Base::Room,
        |bag| {
            bag.edit(DEPTH, |_, image: &mut Image| delay(&mut image.header, 0.4));
            later(bag, DEPTH, 0.4);
        },
        ["warn", "clocks"],
        &[DEPTH, "s ahead", "begins and ends"],
    )
    .also(&["offsets", "poses"]),
    fault(
        "clocks an hour apart",
        Base::Room,
        |bag| {
            bag.edit(SCAN, |_, scan: &mut LaserScan| delay(&mut scan.header, 3600.0));
        },
        ["error", "clocks"],
        &[SCAN, "3600.000 s ahead"],
    )
    .also(&["offsets"]),
    fault(
        "an odometry that ends early",
        Base::Room,
        |bag| {
            bag.keep(POSE, |index| index < 30);
        },
        ["warn", "poses"],
        &["of 60 images", "start the odometry before"],
    ),
    fault(
        "no frame_id",
        Base::Room,
        |bag| {
            bag.edit(SCAN, |_, scan: &mut LaserScan| scan.header.frame_id.clear());
        },
        ["error", "frames"],
        &[SCAN, "empty in"],
    ),
    fault(
        "a slash before the frame",
        Base::Room,
        |bag| {
            bag.edit(SCAN, |_, scan: &mut LaserScan| scan.header.frame_id = "/laser".to_owned());
        },
        ["warn", "frames"],
        &[SCAN, "leading slash"],
    ),
    fault(
        "a frame that tf does not know",
        Base::RoomWithTf,
        |bag| {
            bag.edit(SCAN, |_, scan: &mut LaserScan| scan.header.frame_id = "rplidar".to_owned());
        },
        ["warn", "frames"],
        &[SCAN, "rplidar", "static_transform_publisher"],
    ),
    fault(
        "tf in two parts",
        Base::RoomWithTf,
        |bag| {
            bag.edit("/tf_static", |_, tf: &mut TFMessage| {
                tf.transforms[1].header.frame_id = "camera_link".to_owned();
            });
        },
        ["warn", "transforms"],
        &["2 parts", "laser", CAMERA, "camera_link"],
    ),
    fault(
        "tf in a loop",
        Base::RoomWithTf,
        |bag| {
            let start = bag.start();
            let odom = transform(start, "laser", "odom", [0.0; 6]);
            bag.add("/tf", [(start, TFMessage { transforms: vec![odom] })]);
        },
        ["error", "transforms"],
        &["base_link -> odom -> laser -> base_link is a loop"],
    ),
    fault(
        "a frame with two parents",
        Base::RoomWithTf,
        |bag| {
            let start = bag.start();
            let moments = (0..20).map(|tenth| start.plus_seconds(f64::from(tenth) / 10.0));
            let tf = |stamp| TFMessage {
                transforms: vec![transform(stamp, "map", "base_link", [0.0; 6])],
            };
            bag.add("/tf", moments.map(|stamp| (stamp, tf(stamp))));
        },
        ["error", "transforms"],
        &["base_link has 2 parents", "map (20 messages)", "REP-105"],
    ),
    fault(
        "a rotation that is none",
        Base::RoomWithTf,
        |bag| {
            bag.edit("/tf", |_, tf: &mut TFMessage| {
                tf.transforms[0].transform.rotation = Default::default();
                tf.transforms[0].transform.rotation.w = 0.0;
            });
        },
        ["error", "transforms"],
        &["40 transforms are none", "quaternion"],
    ),
    fault(
        "fixed transforms that are not latched",
        Base::RoomWithTf,
        |bag| {
            bag.unlatch();
        },
        ["warn", "qos"],
        &["/tf_static", "volatile", "transient local"],
    ),
    fault(
        "ranges in millimetres",
        Base::Room,
        |bag| {
            bag.edit(SCAN, |_, scan: &mut LaserScan| {
                for range in &mut scan.ranges {
                    *range *= 1e3
                }
                scan.range_max *= 1e3;
            });
        },
        ["error", "units"],
        &[SCAN, "median range", "millimetres", "divide by 1000"],
    ),
    fault(
        "angles in degrees",
        Base::Room,
        |bag| {
            bag.edit(SCAN, |_, scan: &mut LaserScan| {
                for angle in [&mut scan.angle_min, &mut scan.angle_max, &mut scan.angle_increment] {
                    *angle = angle.to_degrees();
                }
            });
        },
        ["error", "units"],
        &[SCAN, "more than a turn", "radians"],
    )
    .also(&["messages"]),
    fault(
        "metres that are millimetres",
        Base::Room,
        |bag| {
            bag.edit(DEPTH, |_, image: &mut Image| depths_as_floats(image, 1.0));
        },
        ["error", "units"],
        &[DEPTH, "32FC1", "REP-118"],
    ),
    fault(
        "millimetres that are metres",
        Base::Room,
        |bag| {
            bag.edit(DEPTH, |_, image: &mut Image| {
                let (pixels, _) = image.data.as_chunks_mut::<2>();
                for pixel in pixels {
                    *pixel = (u16::from_le_bytes(*pixel) / 1000).to_le_bytes();
                }
            });
        },
        ["error", "units"],
        &[DEPTH, "16UC1", "multiply by 1000"],
    ),
    fault(
        "positions in millimetres",
        Base::Sway,
        |bag| {
            bag.edit(POSE, |_, pose: &mut PoseStamped| {
                let position = &mut pose.pose.position;
                for one in [&mut position.x, &mut position.y, &mut position.z] {
                    *one *= 1e3
                }
            });
        },
        ["error", "units"],
        &[POSE, "median speed", "millimetres"],
    ),
    fault(
        "a pose that jumps",
        Base::Sway,
        |bag| {
            bag.edit(POSE, |index, pose: &mut PoseStamped| {
                if index >= 40 {
                    pose.pose.position.x += 5.0
                }
            });
        },
        ["warn", "motion"],
        &[POSE, "1 jumps", "5."],
    ),
    fault(
        "accelerations in g",
        Base::Inertial,
        |bag| {
            bag.edit(IMU, |_, imu: &mut Imu| {
                let one = &mut imu.linear_acceleration;
                for axis in [&mut one.x, &mut one.y, &mut one.z] {
                    *axis /= 9.80665
                }
            });
        },
        ["warn", "units"],
        &[IMU, "linear_acceleration", "9.80665"],
    ),
    fault(
        "points in millimetres",
        Base::Velodyne,
        |bag| {
            bag.edit(CLOUD, |_, cloud: &mut PointCloud2| {
                for axis in ["x", "y", "z"] {
                    edit_field(cloud, axis, |one| one * 1e3)
                }
            });
        },
        ["warn", "units"],
        &[CLOUD, "median distance", "millimetres"],
    ),
    fault(
        "no time for each point",
        Base::Velodyne,
        |bag| {
            bag.edit(CLOUD, |_, cloud: &mut PointCloud2| {
                cloud.fields.retain(|field| field.name != "time");
            });
        },
        ["warn", "point_times"],
        &[CLOUD, "no time for each point", "XYZIRT"],
    ),
    fault(
        "times of points in microseconds",
        Base::Velodyne,
        |bag| {
            bag.edit(CLOUD, |_, cloud: &mut PointCloud2| {
                edit_field(cloud, "time", |one| one * 1e6)
            });
        },
        ["warn", "units"],
        &[CLOUD, "field time", "seconds"],
    ),
    fault(
        "a scanner that is covered",
        Base::Room,
        |bag| {
            bag.edit(SCAN, |_, scan: &mut LaserScan| scan.ranges.fill(f32::INFINITY));
        },
        ["error", "returns"],
        &[SCAN, "0 of", "uncover"],
    ),
    fault(
        "a camera that is covered",
        Base::Room,
        |bag| {
            bag.edit(DEPTH, |_, image: &mut Image| image.data.fill(0));
        },
        ["error", "returns"],
        &[DEPTH, "0.0 %", "uncover"],
    ),
    fault(
        "no calibration",
        Base::Room,
        |bag| {
            bag.edit(INFO, |_, info: &mut CameraInfo| info.k = [0.0; 9]);
        },
        ["error", "calibration"],
        &[INFO, "K is all zero", "cameracalibrator"],
    )
    .also(&["messages"]),
    fault(
        "the calibration of another mode",
        Base::Room,
        |bag| {
            bag.edit(INFO, |_, info: &mut CameraInfo| {
                (info.width, info.height) = (2 * info.width, 2 * info.height);
                for one in &mut info.k[..6] {
                    *one *= 2.0
                }
            });
        },
        ["error", "calibration"],
        &[DEPTH, INFO, "is for"],
    ),
    fault(
        "a scanner that was knocked",
        Base::Room,
        |bag| {
            bag.edit(SCAN, |_, scan: &mut LaserScan| {
                scan.angle_min += 0.1;
                scan.angle_max += 0.1;
            });
        },
        ["error", "extrinsics"],
        &["rig_from_lidar", "beside the surfaces", "stillmap calibrate"],
    ),
    fault(
        "a definition of another release",
        Base::Room,
        |bag| {
            bag.define(LaserScan::TYPE_NAME, |text| {
                text.replace("string frame_id", "uint32 seq\nstring frame_id")
            });
        },
        ["error", "versions"],
        &[SCAN, "'uint32 seq' there"],
    ),
];

fn delay(header: &mut msgs::std_msgs::Header, seconds: f64) {
    let stamp = convert::stamp_from_time(header.stamp).plus_seconds(seconds);
    header.stamp = convert::time_from_stamp(stamp);
}

/// Changes each float of a 32-bit field of the points of a cloud.
fn edit_field(cloud: &mut PointCloud2, name: &str, edit: impl Fn(f32) -> f32) {
    let offset = cloud.fields.iter().find(|field| field.name == name).unwrap().offset as usize;
    for point in cloud.data.chunks_exact_mut(cloud.point_step as usize) {
        let bytes = &mut point[offset..offset + 4];
        let value = f32::from_le_bytes((&*bytes).try_into().unwrap());
        bytes.copy_from_slice(&edit(value).to_le_bytes());
    }
}

fn depths_as_floats(image: &mut Image, factor: f32) {
    let (pixels, _) = image.data.as_chunks::<2>();
    let metres = pixels.iter().map(|pixel| f32::from(u16::from_le_bytes(*pixel)) * factor);
    image.data = metres.flat_map(f32::to_le_bytes).collect();
    image.encoding = "32FC1".to_owned();
    image.step *= 2;
}

fn later(recording: &mut Recording, topic: &str, seconds: f64) {
    for message in recording.messages.iter_mut().filter(|message| message.topic == topic) {
        message.log_time = message.log_time.plus_seconds(seconds);
    }
    recording.messages.sort_by_key(|message| message.log_time);
}
