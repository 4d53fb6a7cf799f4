//! What the readings say: units, ranges, calibration, the mount.

use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, Image, Imu, LaserScan, PointCloud2};

use super::{CLOUD, DEPTH, IMU, INFO, POSE, SCAN};
use crate::doctor::bags::{Base, Fault, fault};

pub(super) const FAULTS: &[Fault] = &[
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
        "times of points in no unit that a node knows",
        Base::Velodyne,
        |bag| {
            bag.edit(CLOUD, |_, cloud: &mut PointCloud2| {
                edit_field(cloud, "time", |one| one * 1e-4)
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
        "the calibration of another resolution",
        Base::Room,
        |bag| {
            bag.edit(INFO, |_, info: &mut CameraInfo| {
                for one in &mut info.k[..6] {
                    *one *= 1.9
                }
            });
        },
        ["warn", "calibration"],
        &[INFO, "1.9 times as many columns", "resizes"],
    )
    .also(&["extrinsics"]),
];

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
