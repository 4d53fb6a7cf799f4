//! A node that is slower than the cameras.

use super::*;

/// Pairs that the node is given at once.
const PAIRS: u32 = 5;

/// Regression: of images that the node itself had left out it said that the other camera had taken none.
#[test]
fn images_that_the_node_leaves_out_are_its_own_delay_and_no_fault_of_a_camera() {
    let mut scene = Scene::new();
    // The queues have ten places: the first three colour images give way.
    for index in 0..10 {
        scene.depths.publish(scene.depth(index)).unwrap();
    }
    for index in 0..13 {
        scene.colors.publish(scene.color(index, right_m(index))).unwrap();
    }
    let behind = scene.hear();
    let reasons: Vec<&str> =
        behind.reports.iter().map(|report| report.drop_reason.as_str()).collect();
    assert_eq!(reasons[..4], ["newer cycles wait", "newer cycles wait", "newer cycles wait", ""]);
    let warnings = scene.stage.warnings().join("; ");
    for part in ["pace: too slow for its input: 3 cycles", "the step `", "max_corners"] {
        assert!(warnings.contains(part), "{warnings}");
    }
    // The last three colour images are still without depth images, which no camera has taken.
    let after = scene.see(20);
    let reason = after.reports[0].drop_reason.as_str();
    assert_eq!((after.reports.len(), reason), (4, "no image of /depth/image was taken then"));
}

/// Regression: in `up` the detection read nothing while this node had images that waited.
#[tokio::test]
async fn other_tasks_run_after_each_image_of_a_node_that_is_slower_than_its_input() {
    let scene = Scene::new();
    let arguments = RosArguments::parse([] as [String; 0]).unwrap();
    let own = scene._host.node("slow", &arguments).unwrap();
    let served = serve(&own, PoseParameters::default());
    let other = async {
        scene.calibrate();
        for index in 0..PAIRS {
            scene.depths.publish(scene.depth(index)).unwrap();
            scene.colors.publish(scene.color(index, right_m(index))).unwrap();
        }
        let mut at_once = Vec::new();
        while at_once.iter().sum::<usize>() < PAIRS as usize {
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
