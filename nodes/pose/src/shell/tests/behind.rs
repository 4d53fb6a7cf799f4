//! A node that is slower than the cameras.

use super::*;

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
