use std::path::PathBuf;

use bag_player::{BagWriter, OfferedQos};
use msgs::geometry_msgs::{Point, Pose};
use nalgebra::Translation3;

use super::*;

fn at(tenths: i64) -> Stamp {
    Stamp::from_nanos(tenths * 100_000_000)
}

fn labels(stamp: Stamp, x_m: f64) -> PoseArray {
    let mut labels = PoseArray::default();
    labels.header.stamp = convert::time_from_stamp(stamp);
    let position = Point { x: x_m, ..Point::default() };
    labels.poses = vec![Pose { position, ..Pose::default() }];
    labels
}

fn scan(stamp: Stamp) -> LaserScan {
    let mut scan = LaserScan::default();
    scan.header.stamp = convert::time_from_stamp(stamp);
    scan
}

/// A bag of labels and scans, each with its log time.
fn bag(folder: &Path, labels: &[(Stamp, PoseArray)], scans: &[(Stamp, LaserScan)]) -> PathBuf {
    let path = folder.join("labels.mcap");
    let mut writer = BagWriter::create(&path).unwrap();
    let of_labels = writer.channel::<PoseArray>("/legs", OfferedQos::reliable(10)).unwrap();
    let of_scans = writer.channel::<LaserScan>("/front", OfferedQos::reliable(10)).unwrap();
    for (recorded, message) in labels {
        writer.write(of_labels, *recorded, message).unwrap();
    }
    for (recorded, message) in scans {
        writer.write(of_scans, *recorded, message).unwrap();
    }
    writer.finish().unwrap();
    path
}

#[test]
fn labels_of_another_bag_find_their_scans_by_stamps() {
    let folder = tempfile::tempdir().unwrap();
    // The first has no stamp and belongs to the scan at 50; the second has its own.
    let of = [(at(1), labels(Stamp::default(), 1.0)), (at(3), labels(at(70), 2.0))];
    let path = bag(folder.path(), &of, &[(at(2), scan(at(50))), (at(4), scan(at(60)))]);
    let rig_from_lidar =
        Isometry3::from_parts(Translation3::new(0.5, 0.0, 0.0), Default::default());
    // Recordings have the slash, users leave it out.
    let mut labels = Labels::apart(rig_from_lidar, &path, "legs").unwrap();
    assert_eq!(labels.of(at(50)), Some(vec![Point3::new(1.5, 0.0, 0.0)]));
    assert_eq!(labels.of(at(60)), None, "nobody has labelled it");
    assert_eq!(labels.of(at(70)), Some(vec![Point3::new(2.5, 0.0, 0.0)]));
    assert_eq!(labels.of(at(50)), None, "a scan comes once");
    assert_eq!(labels.left(), 0);
    assert!(Labels::apart(rig_from_lidar, &path, "/legs_of_nobody").is_err());
}

#[test]
fn labels_among_the_scans_are_of_the_one_that_follows() {
    let folder = tempfile::tempdir().unwrap();
    let path = bag(folder.path(), &[(at(1), labels(at(70), 1.0))], &[]);
    let selection = Selection::default();
    let bag = Bag::open(&path).unwrap();
    let message = bag.messages(&selection).unwrap().next().unwrap().unwrap();
    let mut labels = Labels::among(Isometry3::identity());
    labels.take(&message).unwrap();
    assert_eq!(labels.of(at(5)), Some(vec![Point3::new(1.0, 0.0, 0.0)]));
    assert_eq!(labels.of(at(6)), None);
    assert_eq!(labels.left(), 0);
}

/// Regression: they were dropped silently, and those at the end of a bag were given to the first scan of another bag.
#[test]
fn labels_that_no_scan_takes_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let of = [
        (at(1), labels(Stamp::default(), 1.0)),
        (at(2), labels(Stamp::default(), 2.0)),
        (at(4), labels(at(80), 3.0)),
        (at(5), labels(Stamp::default(), 4.0)),
    ];
    let path = bag(folder.path(), &of, &[(at(3), scan(at(50)))]);
    let mut labels = Labels::apart(Isometry3::identity(), &path, "/legs").unwrap();
    assert_eq!(labels.of(at(10)), None);
    assert_eq!(labels.of(at(50)), Some(vec![Point3::new(2.0, 0.0, 0.0)]));
    assert_eq!(labels.left(), 3, "that of 1.0 was displaced, 80 is no scan here, none follows 4.0");
}
