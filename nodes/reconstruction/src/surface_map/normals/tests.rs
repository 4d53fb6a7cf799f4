use super::*;

/// A square lattice in a plane with this normal.
fn lattice(normal: &Vector3<f64>, spacing_m: f64, origin_m: Point3<f64>) -> Vec<Point3<f32>> {
    let across = normal.cross(&Vector3::new(0.3, 0.1, 0.9)).normalize();
    let up = normal.cross(&across);
    let steps = -15..15;
    let rows = steps.clone().flat_map(|row| steps.clone().map(move |column| (row, column)));
    rows.map(|(row, column)| {
        let from_origin = spacing_m * (f64::from(row) * up + f64::from(column) * across);
        (origin_m + from_origin).cast()
    })
    .collect()
}

#[test]
fn the_spacing_of_a_lattice_is_found_up_to_a_bound() {
    for (spacing, expected) in
        [(0.05, Some(0.05)), (0.1, Some(0.1)), (0.31, Some(0.31)), (0.4, None)]
    {
        let points = lattice(&Vector3::new(0.2, -0.4, 0.9).normalize(), spacing, Point3::origin());
        let found = spacing_m(&points, 0.02, 0.32);
        assert_eq!(found.is_some(), expected.is_some(), "{found:?} of {spacing}");
        assert!(found.zip(expected).is_none_or(|(a, b)| (a - b).abs() < 1e-4), "{found:?}");
    }
    assert_eq!(spacing_m(&[], 0.02, 0.32), None);
    assert_eq!(spacing_m(&[Point3::origin()], 0.02, 0.32), None);
}

#[test]
fn a_plane_has_its_normal_on_the_side_of_what_is_above_the_middle() {
    for normal in [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.3, -0.8, 0.4]].map(Vector3::from) {
        let normal = normal.normalize();
        let far_m = Point3::new(700.0, -30.0, 12.0);
        let points = lattice(&normal, 0.1, far_m);
        let found = normals(&points, 0.1);
        assert_eq!(found.len(), points.len());
        let side = if normal.z >= 0.0 { 1.0 } else { -1.0 };
        for own in &found {
            let along = own.cast::<f64>().dot(&normal);
            // Of a vertical wall either side is as good.
            assert!((along.abs() - 1.0).abs() < 1e-4, "{own}");
            assert!(normal.z.abs() < 0.1 || along * side > 0.0, "{own}");
        }
    }
}

#[test]
fn a_room_is_seen_from_within() {
    let wall = |x_m: f64| lattice(&Vector3::x(), 0.1, Point3::new(x_m, 0.0, 1.0));
    let points = [wall(-2.0), wall(2.0)].concat();
    for (point, normal) in points.iter().zip(normals(&points, 0.1)) {
        assert!(normal.x * point.x < 0.0, "{point}: {normal}");
    }
}

#[test]
fn a_pole_and_a_single_point_look_at_the_camera() {
    let pole: Vec<Point3<f32>> =
        (0..30_u8).map(|z| Point3::new(1.0, 0.0, 0.1 * f32::from(z))).collect();
    let floor = lattice(&Vector3::z(), 0.1, Point3::origin());
    let found = normals(&[pole.clone(), floor].concat(), 0.1);
    for own in &found[5..pole.len()] {
        assert!(own.z.abs() < 0.05 && own.x < -0.9, "{own}");
    }
    let alone = normals(&[Point3::new(1.0, 2.0, 3.0)], 0.1);
    assert_eq!(alone, [Vector3::z()]);
}

#[test]
fn the_order_of_the_points_changes_no_spacing_and_what_is_no_point_has_no_normal() {
    let points = lattice(&Vector3::new(0.1, 0.2, 1.0).normalize(), 0.07, Point3::origin());
    let again = normals(&points, 0.07);
    assert_eq!(again, normals(&points, 0.07));
    let bad = [[f32::NAN, 0.0, 0.0], [f32::MAX, 0.0, 0.0], [0.0, f32::NEG_INFINITY, 0.0]];
    assert_eq!(normals(&bad.map(Point3::from), 0.07), [Vector3::zeros(); 3]);
}
