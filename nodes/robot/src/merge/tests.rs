use geometry::Stamp;
use nalgebra::{Point3, Vector3};

use super::*;

/// Points 4 cm apart on a rectangle, with their normals.
fn face(map: &mut OrientedPoints, corner_m: [f64; 3], sides_m: [[f64; 3]; 2], normal: [f32; 3]) {
    const APART_M: f64 = 0.04;
    let sides_m = sides_m.map(Vector3::from);
    let steps = sides_m.map(|side_m| (side_m.norm() / APART_M).round().max(1.0) as usize);
    for (i, j) in (0..steps[0]).flat_map(|i| (0..steps[1]).map(move |j| (i, j))) {
        let along = |step: usize, steps: usize| (step as f64 + 0.5) / steps as f64;
        let place = Point3::from(corner_m)
            + sides_m[0] * along(i, steps[0])
            + sides_m[1] * along(j, steps[1]);
        map.points_m.push(place.cast());
        map.normals.push(normal.into());
    }
}

fn cuboid(map: &mut OrientedPoints, least_m: [f64; 3], size_m: [f64; 3]) {
    let [x, y, z] = least_m;
    let [dx, dy, dz] = size_m;
    face(map, least_m, [[dx, 0.0, 0.0], [0.0, 0.0, dz]], [0.0, -1.0, 0.0]);
    face(map, [x, y + dy, z], [[dx, 0.0, 0.0], [0.0, 0.0, dz]], [0.0, 1.0, 0.0]);
    face(map, least_m, [[0.0, dy, 0.0], [0.0, 0.0, dz]], [-1.0, 0.0, 0.0]);
    face(map, [x + dx, y, z], [[0.0, dy, 0.0], [0.0, 0.0, dz]], [1.0, 0.0, 0.0]);
    face(map, [x, y, z + dz], [[dx, 0.0, 0.0], [0.0, dy, 0.0]], [0.0, 0.0, 1.0]);
}

/// An L-shaped room, 6 m by 5 m without a corner of 2 m by 2 m, with a cupboard at a place; seen from four places all around.
fn room(cupboard_m: [f64; 2]) -> (OrientedPoints, Vec<geometry::MapView>) {
    let mut map = OrientedPoints::default();
    face(&mut map, [0.0, 0.0, 0.0], [[6.0, 0.0, 0.0], [0.0, 3.0, 0.0]], [0.0, 0.0, 1.0]);
    face(&mut map, [0.0, 3.0, 0.0], [[4.0, 0.0, 0.0], [0.0, 2.0, 0.0]], [0.0, 0.0, 1.0]);
    let up = [0.0, 0.0, 2.4];
    face(&mut map, [0.0, 0.0, 0.0], [[6.0, 0.0, 0.0], up], [0.0, 1.0, 0.0]);
    face(&mut map, [0.0, 0.0, 0.0], [[0.0, 5.0, 0.0], up], [1.0, 0.0, 0.0]);
    face(&mut map, [6.0, 0.0, 0.0], [[0.0, 3.0, 0.0], up], [-1.0, 0.0, 0.0]);
    face(&mut map, [4.0, 3.0, 0.0], [[2.0, 0.0, 0.0], up], [0.0, -1.0, 0.0]);
    face(&mut map, [4.0, 3.0, 0.0], [[0.0, 2.0, 0.0], up], [-1.0, 0.0, 0.0]);
    face(&mut map, [0.0, 5.0, 0.0], [[4.0, 0.0, 0.0], up], [0.0, -1.0, 0.0]);
    cuboid(&mut map, [cupboard_m[0], cupboard_m[1], 0.0], [0.5, 0.8, 1.2]);
    let camera =
        "1 0 0 0 0 0 0 1 160 120 144 144 79.5 59.5".parse::<geometry::MapView>().unwrap().camera;
    let ahead = geometry::pose_from_vector(&[
        0.0,
        0.0,
        0.0,
        -std::f64::consts::FRAC_PI_2,
        0.0,
        -std::f64::consts::FRAC_PI_2,
    ]);
    let places = [[1.5, 1.2], [4.5, 1.5], [2.0, 3.8], [2.8, 2.2]];
    let views = places
        .into_iter()
        .flat_map(|[x, y]| (0..10).map(move |turn| (x, y, f64::from(turn) * 0.63)));
    let views = views.map(|(x, y, yaw)| geometry::MapView {
        stamp: Stamp::default(),
        map_from_camera: geometry::pose_from_vector(&[x, y, 1.3, yaw, 0.2, 0.0]) * ahead,
        camera,
    });
    (map, views.collect())
}

fn moved(
    (mut points, mut views): (OrientedPoints, Vec<geometry::MapView>),
    new_from_map: &Isometry3<f64>,
) -> Vec<u8> {
    points
        .points_m
        .iter_mut()
        .for_each(|point| *point = (new_from_map * point.cast::<f64>()).cast());
    points
        .normals
        .iter_mut()
        .for_each(|normal| *normal = (new_from_map.rotation * normal.cast::<f64>()).cast());
    views.iter_mut().for_each(|view| view.map_from_camera = new_from_map * view.map_from_camera);
    ply::encode_map(&points, &views)
}

fn args(folder: &Path, names: [&str; 3]) -> MergeArgs {
    let [first, second, output] = names.map(|name| folder.join(name));
    MergeArgs { first, second, output, changes: None, guess: None, overwrite: false, json: false }
}

fn said(result: Result<Outcome, Failure>) -> String {
    result.unwrap_err().to_string()
}

#[test]
fn a_cupboard_that_moved_is_gone_and_added_and_the_merged_map_has_it_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let here = Isometry3::identity();
    let there = Isometry3::new(Vector3::new(3.0, -8.0, 0.7), Vector3::new(0.0, 0.0, 2.2));
    std::fs::write(path("a.ply"), moved(room([0.1, 2.2]), &here)).unwrap();
    std::fs::write(path("b.ply"), moved(room([3.0, 0.1]), &there)).unwrap();
    let changes = Some(path("changed.ply"));
    run(
        &MergeArgs { changes, ..args(folder.path(), ["a.ply", "b.ply", "c.ply"]) },
        &Interrupt::default(),
    )
    .unwrap();
    let merged = MapFile::read(&path("c.ply")).unwrap();
    let within = |points: &OrientedPoints, least_m: [f32; 2]| {
        let is_within = |point: &&Point3<f32>| {
            (0..2).all(|axis| {
                (least_m[axis] - 0.06..least_m[axis] + [0.56, 0.86][axis]).contains(&point[axis])
            }) && point.z > 0.15
        };
        points.points_m.iter().filter(is_within).count()
    };
    let (gone, added) = (within(&merged.points, [0.1, 2.2]), within(&merged.points, [3.0, 0.1]));
    let whole = within(&room([3.0, 0.1]).0, [3.0, 0.1]);
    // The wall behind is within 10 cm.
    assert!(gone < whole / 3 && added * 10 > whole * 9, "{gone} {added} {whole}");
    // Both were seen from the same places.
    assert_eq!(merged.views.len(), 40);
    let changed = MapFile::read(&path("changed.ply")).unwrap().points;
    for (colour, least_m) in [(GONE, [0.1, 2.2]), (ADDED, [3.0, 0.1])] {
        let of_colour =
            changed.colours.iter().zip(&changed.points_m).filter(|(own, _)| **own == colour);
        let points_m = of_colour.map(|(_, point)| *point).collect();
        let part = OrientedPoints { points_m, ..OrientedPoints::default() };
        assert!(within(&part, least_m) * 10 > part.points_m.len() * 8, "{colour:?}");
        assert!(part.points_m.len() > 800, "{}", part.points_m.len());
    }
}

#[test]
fn a_map_is_merged_with_itself_by_the_identity() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("a.ply"), moved(room([0.1, 2.2]), &Isometry3::identity())).unwrap();
    let map = read(&path("a.ply")).unwrap();
    let threads = ScopedThreads::new(NonZeroUsize::MIN);
    let merged = merge(&map, &map, None, &threads, &|| false).unwrap();
    let a_from_b = merged.alignment.a_from_b;
    assert!(
        a_from_b.translation.vector.norm() < 1e-4 && a_from_b.rotation.angle() < 1e-4,
        "{a_from_b}"
    );
    assert_eq!(
        (merged.changes, merged.merged.points),
        (map_merge::Changes::default(), map.points.clone())
    );
    let interrupt = Interrupt::default();
    interrupt.trigger();
    let outcome = run(&args(folder.path(), ["a.ply", "a.ply", "b.ply"]), &interrupt).unwrap();
    assert_eq!((outcome, path("b.ply").exists()), (Outcome::Interrupted, false));
}

#[test]
fn what_cannot_be_merged_is_said_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mut hall = OrientedPoints::default();
    face(&mut hall, [0.0; 3], [[9.0, 0.0, 0.0], [0.0, 9.0, 0.0]], [0.0, 0.0, 1.0]);
    std::fs::write(path("floor.ply"), ply::encode(&hall.points_m)).unwrap();
    face(&mut hall, [0.0; 3], [[9.0, 0.0, 0.0], [0.0, 0.0, 3.0]], [0.0, 1.0, 0.0]);
    face(&mut hall, [0.0; 3], [[0.0, 9.0, 0.0], [0.0, 0.0, 3.0]], [1.0, 0.0, 0.0]);
    face(&mut hall, [9.0, 0.0, 0.0], [[0.0, 9.0, 0.0], [0.0, 0.0, 3.0]], [-1.0, 0.0, 0.0]);
    face(&mut hall, [0.0, 9.0, 0.0], [[9.0, 0.0, 0.0], [0.0, 0.0, 3.0]], [0.0, -1.0, 0.0]);
    std::fs::write(path("hall.ply"), ply::encode_with_normals(&hall.points_m, &hall.normals))
        .unwrap();
    std::fs::write(path("a.ply"), moved(room([0.1, 2.2]), &Isometry3::identity())).unwrap();
    std::fs::write(path("empty.ply"), ply::encode(&[])).unwrap();
    for (names, part) in [
        (["a.ply", "empty.ply", "c.ply"], "empty.ply: the map is empty"),
        (["a.ply", "floor.ply", "c.ply"], "upright surface"),
        (["a.ply", "hall.ply", "c.ply"], "do not fit"),
        (["hall.ply", "hall.ply", "c.ply"], "--guess"),
        (["a.ply", "none.ply", "c.ply"], "none.ply"),
        (["a.ply", "a.ply", "c.yaml"], "-o must end in .ply"),
        (["a.ply", "a.ply", "none/c.ply"], "none does not exist"),
        (["a.ply", "a.ply", "a.ply"], "a.ply already exists"),
    ] {
        let said = said(run(&args(folder.path(), names), &Interrupt::default()));
        assert!(said.contains(part), "{names:?}: {said}");
        assert!(!path("c.ply").exists(), "{names:?}");
    }
    let twice = MergeArgs {
        changes: Some(path("c.ply")),
        ..args(folder.path(), ["a.ply", "a.ply", "c.ply"])
    };
    assert!(said(run(&twice, &Interrupt::default())).contains("cannot be both"));
    let guess = Some(vec![f64::NAN; 6]);
    let wrong = MergeArgs { guess, ..args(folder.path(), ["a.ply", "a.ply", "c.ply"]) };
    assert!(said(run(&wrong, &Interrupt::default())).contains("--guess takes six finite numbers"));
    let guess = Some(vec![0.05, -0.05, 0.0, 0.0, 0.0, 0.02]);
    let right = MergeArgs { guess, ..args(folder.path(), ["hall.ply", "hall.ply", "c.ply"]) };
    run(&right, &Interrupt::default()).unwrap();
}
