use geometry::{PoseLookupError, Stamp, pose_from_vector};
use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use proptest::prelude::*;

use super::*;

fn at_s(seconds: f64) -> Stamp {
    Stamp::default().plus_seconds(seconds)
}

fn along_x(x_m: f64) -> Isometry3<f64> {
    Translation3::new(x_m, 0.0, 0.0).into()
}

#[track_caller]
fn check_near(got: &Isometry3<f64>, expected: &Isometry3<f64>) {
    let offset_m = (got.translation.vector - expected.translation.vector).norm();
    let turn_rad = got.rotation.angle_to(&expected.rotation);
    assert!(offset_m < 1e-9 && turn_rad < 1e-7, "{got} is not {expected}");
}

/// base_link with a laser, and a camera on a mast, each fixed to its parent.
fn robot() -> TransformTree {
    let mut tree = TransformTree::default();
    tree.insert_fixed("base_link", "laser", &along_x(0.1)).unwrap();
    tree.insert_fixed("base_link", "mast", &pose_from_vector(&[0.0, 0.0, 1.0, 0.5, 0.0, 0.0]))
        .unwrap();
    tree.insert_fixed("mast", "camera", &pose_from_vector(&[0.2, 0.0, 0.0, 0.0, 0.3, 0.0]))
        .unwrap();
    tree
}

#[test]
fn transforms_chain_up_and_down_the_tree() {
    let tree = robot();
    let lookup = |target: &str, source: &str| tree.lookup(target, source, at_s(9.0)).unwrap();
    let base_from_camera = pose_from_vector(&[0.0, 0.0, 1.0, 0.5, 0.0, 0.0])
        * pose_from_vector(&[0.2, 0.0, 0.0, 0.0, 0.3, 0.0]);
    check_near(&lookup("base_link", "camera"), &base_from_camera);
    check_near(&lookup("camera", "laser"), &(base_from_camera.inverse() * along_x(0.1)));
    check_near(&lookup("laser", "laser"), &Isometry3::identity());
    check_near(&lookup("/mast", "/camera"), &pose_from_vector(&[0.2, 0.0, 0.0, 0.0, 0.3, 0.0]));
}

#[test]
fn moving_transforms_are_interpolated_and_never_extrapolated() {
    let mut tree = robot();
    for (seconds, x_m) in [(1.0, 2.0), (2.0, 4.0), (1.5, 3.5), (9.0, 9.0)] {
        tree.insert_timed(at_s(seconds), "odom", "base_link", &along_x(x_m)).unwrap();
    }
    // Broadcasters repeat themselves; the first one counts.
    tree.insert_timed(at_s(2.0), "odom", "base_link", &along_x(-1.0)).unwrap();
    for (seconds, x_m) in [(1.0, 2.1), (1.25, 2.85), (2.0, 4.1)] {
        check_near(&tree.lookup("odom", "laser", at_s(seconds)).unwrap(), &along_x(x_m));
    }
    let error = |seconds: f64| tree.lookup("laser", "odom", at_s(seconds)).unwrap_err();
    for (seconds, part) in
        [(0.5, "0.500 s later"), (9.5, "0.500 s earlier"), (5.0, "7.000 s apart")]
    {
        let message = error(seconds).to_string();
        let names = message.contains("\"base_link\" to \"odom\"");
        assert!(names && message.contains(part), "{message}");
    }
    check_near(&tree.lookup_latest("odom", "laser").unwrap(), &along_x(9.1));
    assert!(tree.lookup_latest("odom", "lazer").is_err());
    // What is fixed is known at any moment.
    assert!(tree.lookup("camera", "laser", at_s(-5.0)).is_ok());
    tree.forget_timed();
    assert!(matches!(error_of(&tree, "odom", "laser"), TransformError::UnknownFrame { .. }));
    assert!(tree.lookup("camera", "laser", at_s(5.0)).is_ok());
}

/// Regression: with a localisation that corrects the odometry every 2 s no cycle had a pose, though the robot stood.
#[test]
fn seldom_transforms_are_interpolated_between_while_they_agree() {
    let mut tree = robot();
    for (seconds, x_m) in [(0.0, 1.0), (2.0, 1.02), (4.0, 1.02), (6.0, 1.5), (17.0, 1.5)] {
        tree.insert_timed(at_s(seconds), "map", "odom", &along_x(x_m)).unwrap();
    }
    for seconds in 0..=17 {
        tree.insert_timed(at_s(f64::from(seconds)), "odom", "base_link", &along_x(0.0)).unwrap();
    }
    check_near(&tree.lookup("map", "base_link", at_s(0.5)).unwrap(), &along_x(1.005));
    check_near(&tree.lookup("map", "base_link", at_s(3.5)).unwrap(), &along_x(1.02));
    for (seconds, apart) in [(5.0, "2.000 s apart"), (10.0, "11.000 s apart")] {
        let message = tree.lookup("map", "base_link", at_s(seconds)).unwrap_err().to_string();
        assert!(message.contains(apart), "{message}");
    }
}

fn error_of(tree: &TransformTree, target: &str, source: &str) -> TransformError {
    tree.lookup(target, source, at_s(0.0)).unwrap_err()
}

#[test]
fn what_is_missing_is_named() {
    let empty = TransformTree::default();
    assert!(error_of(&empty, "a", "b").to_string().ends_with("none is known"));
    let mut tree = robot();
    let message = error_of(&tree, "camera", "lazer").to_string();
    assert!(
        message.contains("\"lazer\"") && message.contains("base_link, camera, laser, mast"),
        "{message}"
    );
    tree.insert_fixed("world", "tripod", &along_x(1.0)).unwrap();
    let message = error_of(&tree, "camera", "tripod").to_string();
    assert!(message.contains("\"base_link\"") && message.contains("\"world\""), "{message}");
}

#[test]
fn what_is_no_tree_is_refused() {
    let mut tree = robot();
    for (parent, child) in [("camera", "base_link"), ("laser", "laser"), ("/mast", "mast")] {
        let refused = tree.insert_fixed(parent, child, &along_x(1.0)).unwrap_err();
        assert!(matches!(refused, TransformRefused::Loop { .. }), "{refused}");
    }
    for (parent, child) in [("", "laser"), ("base_link", "/")] {
        let refused = tree.insert_timed(at_s(0.0), parent, child, &along_x(1.0)).unwrap_err();
        assert!(matches!(refused, TransformRefused::NoName { .. }), "{refused}");
    }
    let refused = tree.insert_fixed("base_link", "laser", &along_x(f64::NAN)).unwrap_err();
    assert!(matches!(refused, TransformRefused::Unusable { .. }), "{refused}");
    // The last one decides the parent of a frame.
    tree.insert_fixed("mast", "laser", &along_x(7.0)).unwrap();
    check_near(&tree.lookup("mast", "laser", at_s(0.0)).unwrap(), &along_x(7.0));
    assert_eq!(tree.len(), 3);
}

#[test]
fn frames_and_moments_have_a_bound() {
    let mut tree = TransformTree::default();
    for frame in 0..1000 {
        tree.insert_fixed("root", &frame.to_string(), &along_x(1.0)).unwrap();
    }
    let refused = tree.insert_fixed("root", "more", &along_x(1.0)).unwrap_err();
    assert!(matches!(refused, TransformRefused::TooManyFrames { .. }), "{refused}");
    for step in 0..1500 {
        tree.insert_timed(at_s(f64::from(step)), "root", "0", &along_x(1.0)).unwrap();
    }
    let error = tree.lookup("root", "0", at_s(400.0)).unwrap_err();
    assert!(
        matches!(&error, TransformError::Time { source: PoseLookupError::BeforeOldest { .. }, .. }),
        "{error}"
    );
    let refused = tree.insert_timed(at_s(400.0), "root", "0", &along_x(1.0)).unwrap_err();
    assert!(matches!(refused, TransformRefused::Time { .. }), "{refused}");
}

fn pose() -> impl Strategy<Value = Isometry3<f64>> {
    (prop::array::uniform3(-5.0..5.0_f64), prop::array::uniform3(-3.0..3.0_f64))
        .prop_map(|(place, turn)| Isometry3::new(Vector3::from(place), Vector3::from(turn)))
}

proptest! {
    /// A tree in which the parent of each frame is an earlier one, some of them moving.
    #[test]
    fn transforms_chain_and_invert(
        frames in prop::collection::vec((any::<prop::sample::Index>(), pose(), any::<bool>()), 1..12),
        places in prop::array::uniform3(any::<prop::sample::Index>()),
        x_m in -3.0..3.0_f64,
    ) {
        let mut tree = TransformTree::default();
        let mut root_from = vec![Isometry3::identity()];
        for (index, (parent, parent_from_child, moves)) in frames.iter().enumerate() {
            let (parent, child) = (parent.index(index + 1), index + 1);
            let names = (parent.to_string(), child.to_string());
            if *moves {
                tree.insert_timed(at_s(1.0), &names.0, &names.1, parent_from_child).unwrap();
            } else {
                tree.insert_fixed(&names.0, &names.1, parent_from_child).unwrap();
            }
            root_from.push(root_from[parent] * parent_from_child);
        }
        let [a, b, c] = places.map(|place| place.index(root_from.len()));
        let lookup = |target: usize, source: usize| {
            tree.lookup(&target.to_string(), &source.to_string(), at_s(1.0)).unwrap()
        };
        check_near(&lookup(a, b), &(root_from[a].inverse() * root_from[b]));
        check_near(&lookup(a, c), &(lookup(a, b) * lookup(b, c)));
        check_near(&lookup(a, b).inverse(), &lookup(b, a));
        let point = Point3::new(x_m, 1.0, -2.0);
        let there_and_back = lookup(a, b) * (lookup(b, a) * point);
        prop_assert!((there_and_back - point).norm() < 1e-9);
    }
}
