//! Stamps, clocks, and what is missing in time.

use msgs::convert;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan};

use super::{DEPTH, INFO, POSE, SCAN};
use crate::doctor::bags::{Base, Fault, fault};
use crate::doctor::plant::Recording;

pub(super) const FAULTS: &[Fault] = &[
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
        &[DEPTH, "s ahead", "first and its last stamp"],
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
];

fn delay(header: &mut msgs::std_msgs::Header, seconds: f64) {
    let stamp = convert::stamp_from_time(header.stamp).plus_seconds(seconds);
    header.stamp = convert::time_from_stamp(stamp);
}

fn later(recording: &mut Recording, topic: &str, seconds: f64) {
    for message in recording.messages.iter_mut().filter(|message| message.topic == topic) {
        message.log_time = message.log_time.plus_seconds(seconds);
    }
    recording.messages.sort_by_key(|message| message.log_time);
}
