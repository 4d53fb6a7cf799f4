use geometry::Distortion;

use super::*;
use crate::Waypoint;

fn error(change: impl FnOnce(&mut Scenario)) -> ScenarioError {
    let mut scenario = Scenario::demo();
    change(&mut scenario);
    let error = scenario.validate().unwrap_err();
    // As texts: NaN does not equal itself.
    let text = error.to_string();
    assert_eq!(scenario.samples().unwrap_err().to_string(), text);
    assert_eq!(scenario.static_scene_cloud().unwrap_err().to_string(), text);
    error
}

#[test]
fn the_scenarios_of_the_suite_are_valid() {
    assert_eq!(Scenario::demo().validate(), Ok(()));
    assert_eq!(Scenario::small().validate(), Ok(()));
    assert_eq!(Scenario::demo().without_objects().validate(), Ok(()));
}

#[test]
fn what_is_wrong_is_named_with_its_number() {
    let text = error(|s| s.duration_s = f64::NAN).to_string();
    assert_eq!(text, "duration_s is NaN, but must be 0 to 86400");
    let text = error(|s| s.rig.lidar.turn_rate_hz = 0.0).to_string();
    assert_eq!(text, "lidar.turn_rate_hz is 0, but must be above 0, at most 1000");
    let text = error(|s| s.scene.bodies[0].pose[3] = f64::INFINITY).to_string();
    assert!(text.contains("the pose of floor of the scene is inf"), "{text}");
    let text = error(|s| s.scene.bodies[0].shape = Shape::Sphere { radius_m: -1.0 }).to_string();
    assert!(text.contains("a size of floor of the scene is -1"), "{text}");
    let text = error(|s| s.rig.depth_camera.depth_max_m = 0.1).to_string();
    assert!(text.contains("above depth_min_m"), "{text}");
    let text = error(|s| s.scene.bodies[0].material.reflectivity = 2.0).to_string();
    assert!(text.contains("reflectivity of floor of the scene is 2"), "{text}");
}

#[test]
fn sizes_that_cannot_be_allocated_are_refused() {
    let size = |width_px, height_px| {
        error(|s| {
            s.rig.depth_camera.camera.width_px = width_px;
            s.rig.depth_camera.camera.height_px = height_px;
        })
    };
    let refused = |width_px, height_px| ScenarioError::ImageSize { width_px, height_px };
    assert_eq!(size(0, 480), refused(0, 480));
    assert_eq!(size(1 << 20, 1 << 20), refused(1 << 20, 1 << 20));
    assert_eq!(size(usize::MAX, 2), refused(usize::MAX, 2));
    assert_eq!(error(|s| s.rig.lidar.beams = 0), ScenarioError::Beams { beams: 0 });
    assert_eq!(
        error(|s| s.rig.lidar.beams = usize::MAX),
        ScenarioError::Beams { beams: usize::MAX }
    );
}

#[test]
fn ids_and_paths_must_make_sense() {
    let id = |first, second| {
        error(|s| {
            s.scene.objects[0].id = first;
            s.scene.objects[1].id = second;
        })
    };
    assert_eq!(id(0, 1), ScenarioError::StaticId { name: "robot".to_owned() });
    assert_eq!(id(4, 4), ScenarioError::DuplicateId { id: 4 });
    assert_eq!(
        error(|s| s.rig.path.waypoints.clear()),
        ScenarioError::EmptyPath { of: "the rig".to_owned() }
    );
    let backwards = Waypoint { time_s: -1.0, pose: [0.0; 6] };
    assert_eq!(
        error(|s| s.rig.path.waypoints.push(backwards)),
        ScenarioError::WaypointOrder { of: "the rig".to_owned(), index: 1, time_s: -1.0 }
    );
    let distorted = |s: &mut Scenario| {
        s.rig.depth_camera.camera.distortion = Distortion::PlumbBob([0.1, 0.0, 0.0, 0.0, 0.0]);
    };
    assert_eq!(error(distorted), ScenarioError::Distorted);
}
