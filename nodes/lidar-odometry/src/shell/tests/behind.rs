//! A node that is slower than the scanner.

use super::*;

/// Scans that the node is given at once.
const SCANS: u32 = 5;

/// Regression: of scans that the node itself had left out it said that none had come for so long.
#[test]
fn scans_that_the_node_leaves_out_are_its_own_delay_and_no_gap_of_the_scanner() {
    let mut scene = Scene::new(&LidarOdometryParameters::default());
    let first = scene.cloud_at(0, 0.0);
    scene.take(first);
    // The queue has five places: scans 1 to 15 give way.
    for index in 1..=20 {
        scene.clouds.publish(scene.cloud_at(index, 0.0)).unwrap();
    }
    assert_eq!(scene.hear().reports.len(), 5);
    let trouble = scene.stage.last_trouble().unwrap();
    let said = "15 scans were left out, since the node is too slow for its input: 1.6 s";
    assert!(trouble.starts_with(said), "{trouble}");
    let warnings = scene.stage.warnings().join("; ");
    for part in ["pace: too slow for its input: 15 cycles", "the step `", "scan_voxel_edge_m"] {
        assert!(warnings.contains(part), "{warnings}");
    }
    // A gap of the scanner is one.
    let late = scene.cloud_at(50, 0.0);
    scene.take(late);
    let trouble = scene.stage.last_trouble().unwrap();
    assert!(trouble.starts_with("3.0 s without a scan"), "{trouble}");
}

/// Regression: in `up` the detection read nothing while this node had scans that waited.
#[tokio::test]
async fn other_tasks_run_after_each_scan_of_a_node_that_is_slower_than_its_input() {
    let parameters = LidarOdometryParameters::default();
    let scene = Scene::new(&parameters);
    let arguments = RosArguments::parse([] as [String; 0]).unwrap();
    let own = scene._host.node("slow", &arguments).unwrap();
    let served = serve(&own, parameters);
    let other = async {
        for index in 0..SCANS {
            scene.clouds.publish(scene.cloud(index)).unwrap();
        }
        let mut at_once = Vec::new();
        while at_once.iter().sum::<usize>() < SCANS as usize {
            at_once.push(std::iter::from_fn(|| scene.odometry.try_next()).count());
            tokio::task::yield_now().await;
        }
        at_once
    };
    tokio::select! {
        biased;
        ended = served => panic!("{ended:?}"),
        at_once = other => assert_eq!(at_once.iter().max(), Some(&1), "{at_once:?}"),
    }
}
