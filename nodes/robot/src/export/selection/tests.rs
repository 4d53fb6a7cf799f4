use super::*;

/// The middles of the cells of a lattice of 1 m, from -2 to 2 m along each axis: normals along x, colours by x.
fn lattice() -> OrientedPoints {
    let along = || (-2_i8..2).map(|cell| f32::from(cell) + 0.5);
    let points_m: Vec<Point3<f32>> = along()
        .flat_map(|z| along().flat_map(move |y| along().map(move |x| Point3::new(x, y, z))))
        .collect();
    let normals = vec![Vector3::x(); points_m.len()];
    let colours = points_m.iter().map(|point| [(point.x * 10.0 + 100.0) as u8, 0, 255]).collect();
    OrientedPoints { points_m, normals, colours }
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    Some(text.split_whitespace().map(|number| number.parse().unwrap()).collect())
}

fn lengths(points: &OrientedPoints) -> [usize; 3] {
    [points.points_m.len(), points.normals.len(), points.colours.len()]
}

#[test]
fn nothing_asked_for_leaves_all_as_it_is() {
    let all = Selection::default().of(lattice()).unwrap();
    assert_eq!((all.points_m, lengths(&lattice())), (lattice().points_m, [64; 3]));
}

#[test]
fn a_box_keeps_what_is_in_it_and_may_be_open() {
    let crop = |text| Selection { crop: numbers(text), ..Selection::default() }.of(lattice());
    let some = crop("-1 -1 -1 1 1 1").unwrap();
    assert_eq!(lengths(&some), [8; 3]);
    assert!(some.points_m.iter().all(|point| point.iter().all(|along| along.abs() < 1.0)));
    assert_eq!(lengths(&crop("-inf -inf 0 inf inf 1").unwrap()), [16; 3]);
    for (wrong, said) in [
        ("1 0 0 0 1 1", "not below"),
        ("0 0 NaN 1 1 1", "not below"),
        ("5 5 5 6 6 6", "none of the map's 64 points"),
    ] {
        let error = crop(wrong).unwrap_err().to_string();
        assert!(error.contains(said), "{wrong}: {error}");
    }
}

#[test]
fn a_polygon_keeps_what_is_in_it_seen_from_above() {
    let polygon =
        |text: &str| Selection { polygon: numbers(text), ..Selection::default() }.of(lattice());
    // The half below the diagonal, which has no point on it.
    assert_eq!(lengths(&polygon("-2 -2.2 2 -2.2 2 1.8").unwrap()), [4 * 6; 3]);
    // An L: of three quarters. It begins anywhere, and goes round either way.
    let corners = [(-2, -2), (2, -2), (2, 0), (0, 0), (0, 2), (-2, 2)];
    let text = |(x, y): &(i32, i32)| format!("{x} {y} ");
    for first in 0..corners.len() {
        let round = || corners.iter().cycle().skip(first).take(corners.len());
        let forth: String = round().map(text).collect();
        let back: String = round().collect::<Vec<_>>().into_iter().rev().map(text).collect();
        assert_eq!(lengths(&polygon(&forth).unwrap()), [4 * 12; 3]);
        assert_eq!(lengths(&polygon(&back).unwrap()), [4 * 12; 3]);
    }
    // Rays through corners: the rows of points are as high as these.
    assert_eq!(lengths(&polygon("-2 0.5 0 -1.5 2 0.5 0 1.7").unwrap()), [4 * 6; 3]);
    for wrong in ["0 0 1 0 1 1 0", "0 0 inf 0 1 1"] {
        assert!(polygon(wrong).unwrap_err().to_string().contains("pairs of finite"), "{wrong}");
    }
}

#[test]
fn a_thinned_map_has_the_means_of_its_voxels() {
    let thin = |edge_m| Selection { thin: Some(edge_m), ..Selection::default() }.of(lattice());
    let some = thin(2.0).unwrap();
    assert_eq!(lengths(&some), [8; 3]);
    assert!(some.points_m.iter().all(|point| point.iter().all(|along| along.abs() == 1.0)));
    assert!(some.normals.iter().all(|normal| *normal == Vector3::x()));
    // 85 and 95, 105 and 115.
    assert!(some.colours.iter().all(|colour| [[90, 0, 255], [110, 0, 255]].contains(colour)));
    let bare = OrientedPoints { points_m: lattice().points_m, ..OrientedPoints::default() };
    let of_bare = Selection { thin: Some(2.0), ..Selection::default() }.of(bare).unwrap();
    assert_eq!(lengths(&of_bare), [8, 0, 0]);
    assert!(thin(0.0).unwrap_err().to_string().contains("--thin"));
}

#[test]
fn a_map_is_moved_after_it_was_cropped() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let selection = Selection {
        crop: numbers("0 0 0 1 1 1"),
        transform: Some(vec![10.0, 0.0, 0.0, 0.0, 0.0, quarter]),
        ..Selection::default()
    };
    let moved = selection.of(lattice()).unwrap();
    assert!((moved.points_m[0] - Point3::new(9.5, 0.5, 0.5)).norm() < 1e-6);
    assert!((moved.normals[0] - Vector3::y()).norm() < 1e-6);
    let wrong = Selection { transform: numbers("0 0 0 0 0 inf"), ..Selection::default() };
    assert!(wrong.of(lattice()).unwrap_err().to_string().contains("--transform"));
}

/// Regression: an empty map became an empty LAS, E57 or PCD file, and nothing was said.
#[test]
fn an_empty_map_is_refused() {
    let none = OrientedPoints { points_m: Vec::new(), normals: Vec::new(), colours: Vec::new() };
    let error = Selection::default().of(none).unwrap_err().to_string();
    assert!(error.contains("empty"), "{error}");
}
