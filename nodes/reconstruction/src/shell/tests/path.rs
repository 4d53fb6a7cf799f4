//! Corrections of the map by paths.

use geometry::{MapPath, PathVertex};
use msgs::nav_msgs::Path;
use nalgebra::Vector3;

use super::*;

fn path(stamp_ns: i64, frame_id: &str, x_m: f64) -> Path {
    let map_from_rig = Isometry3::new(Vector3::x() * x_m, Vector3::zeros());
    let vertex = PathVertex { stamp: Stamp::from_nanos(0), map_from_rig };
    let path = MapPath::new(Stamp::from_nanos(stamp_ns), frame_id, vec![vertex]).unwrap();
    convert::message_from_map_path(&path)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_map_is_corrected_before_the_clouds_that_wait_and_is_published_whole() {
    let test = Place::new("path");
    // Without a network, so that published messages arrive at once.
    let host = Host::in_process();
    let (node, peer) = (test.node(&host, "reconstruction"), test.node(&host, "peer"));
    let config = ReconstructionConfig { pipeline: pipeline(), ..ReconstructionConfig::default() };
    let parameters = ReconstructionParameters { config, ..ReconstructionParameters::default() };
    let mut stage = Stage::new(&node, &parameters).unwrap();
    let clouds = peer.publisher::<SegmentedCloud>("segmented_cloud", &Qos::reliable(5)).unwrap();
    let paths = peer.publisher::<Path>("map_path", &Qos::latched()).unwrap();
    let reports =
        peer.subscription::<StageReport>("reconstruction/report", &Qos::reliable(5)).unwrap();
    let maps = peer.subscription::<PointCloud2>("static_map", &Qos::latched()).unwrap();

    paths.publish(path(0, "map", 0.0)).unwrap();
    clouds.publish(cloud(0, "map", &[[0.5, 0.5, 0.5]])).unwrap();
    stage.take_waiting();
    let first = reports.try_next().unwrap().message;
    assert!(!first.count_names.contains(&"map_corrections".to_owned()));
    // A second later the correction is two metres; the pose of one cloud includes it, that of another does not yet.
    const THEN: i64 = 1_000_000_000;
    clouds.publish(cloud(THEN, "map", &[[2.5, 2.5, 0.5]])).unwrap();
    clouds.publish(cloud(THEN - 100_000_000, "map", &[[0.5, 4.5, 0.5]])).unwrap();
    paths.publish(path(THEN, "map", 2.0)).unwrap();
    stage.take_waiting();
    assert_eq!(stage.map().points(), [0.5, 2.5, 4.5].map(|y| Point3::new(2.5, y, 0.5)));
    let last = std::iter::from_fn(|| reports.try_next()).last().unwrap().message;
    let count = |name: &str| {
        let index = last.count_names.iter().position(|known| known == name).unwrap();
        last.counts[index]
    };
    assert_eq!(count("map_corrections"), 1);
    assert_eq!((count("largest_correction_mm"), count("cycles_brought_over")), (2000, 1));
    stage.publish_what_is_due();
    let map = convert::cloud_from_message(&maps.try_next().unwrap().message).unwrap();
    assert_eq!(map.points_m, stage.map().points());

    // An invalid path, or one in another frame, is counted, and the map is unchanged.
    let mut nowhere = path(2 * THEN, "map", 2.0);
    nowhere.poses[0].pose.position.x = f64::NAN;
    paths.publish(nowhere).unwrap();
    stage.take_waiting();
    paths.publish(path(2 * THEN, "odom", 9.0)).unwrap();
    stage.take_waiting();
    assert_eq!(node.counters().drops().values().sum::<u64>(), 2, "{:?}", node.counters().drops());
    assert_eq!(stage.map().points(), map.points_m);
    drop(stage);
    drop((clouds, paths, reports, maps));
    node.close().await;
    peer.close().await;
}
