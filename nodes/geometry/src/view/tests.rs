use super::*;

#[test]
fn slopes_are_to_the_left_and_up_for_each_metre_forward() {
    let camera = Point3::new(1.0, 0.0, 0.5);
    let slopes = slopes_from(&camera, &Point3::new(3.0, 1.0, 0.0));
    assert_eq!(slopes, Some(Vector2::new(0.5, -0.25)));
    for beside in [
        Point3::new(1.0, 1.0, 0.5),
        Point3::new(-3.0, 0.0, 0.0),
        Point3::new(f64::NAN, 0.0, 0.0),
        Point3::new(3.0, f64::INFINITY, 0.0),
    ] {
        assert_eq!(slopes_from(&camera, &beside), None, "{beside}");
    }
}

#[test]
fn a_view_is_as_wide_as_what_was_seen() {
    let mut view = View::default();
    assert!(!view.contains(&Vector2::zeros()), "nothing was seen");
    view.widen(&Vector2::new(-0.5, -0.2));
    view.widen(&Vector2::new(0.5, 0.4));
    assert!(view.contains(&Vector2::new(-0.5, 0.4)), "the corner that nothing showed");
    assert!(!view.contains(&Vector2::new(0.6, 0.0)));
    assert!(!view.contains(&Vector2::new(0.0, -0.3)));
}

#[test]
fn the_nearest_or_the_farthest_in_a_direction_is_kept() {
    let (mut nearest, mut farthest) = (DepthByDirection::default(), DepthByDirection::default());
    let (ahead, reach) = (Vector2::new(0.01, 0.01), Vector2::new(0.03, 0.0));
    assert_eq!(nearest.depth_m(&ahead), None);
    for depth_m in [3.0, 2.0, 2.5] {
        nearest.keep_nearest(&ahead, &reach, depth_m);
        farthest.keep_farthest(&ahead, &reach, depth_m);
    }
    for (kept, expected_m) in [(&nearest, 2.0), (&farthest, 3.0)] {
        assert_eq!(kept.depth_m(&ahead), Some(expected_m));
        assert_eq!(kept.depth_m(&Vector2::new(0.04, 0.01)), Some(expected_m), "within reach");
        assert_eq!(kept.depth_m(&Vector2::new(0.01, 0.04)), None, "above it");
        assert_eq!(kept.depth_m(&Vector2::new(0.07, 0.01)), None, "beside it");
    }
    nearest.clear();
    assert_eq!(nearest.depth_m(&ahead), None);
}

#[test]
fn directions_beyond_all_squares_do_no_harm() {
    let mut kept = DepthByDirection::default();
    for far in [1e9, -1e9, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
        kept.keep_nearest(&Vector2::repeat(far), &Vector2::repeat(0.1), 1.0);
    }
    assert_eq!(kept.depth_m(&Vector2::zeros()), None);
}
