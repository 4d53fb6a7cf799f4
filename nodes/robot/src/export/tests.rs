use super::*;

fn read(path: &Path) -> Result<OrientedPoints, Failure> {
    MapFile::read(path).map(|map| map.points)
}

/// A floor of 2 m by 2 m with a wall at x = 2 m, points 2 cm apart.
fn room() -> Vec<Point3<f32>> {
    let lattice = || (0..100).flat_map(|a| (0..100).map(move |b| (a, b)));
    let at = |cell: i32| cell as f32 * 0.02 + 0.01;
    let floor = lattice().map(|(x, y)| Point3::new(at(x), at(y), -0.8));
    let wall = lattice().map(|(y, z)| Point3::new(2.01, at(y), at(z) - 0.8));
    floor.chain(wall).collect()
}

fn args(map: &Path, output: &Path) -> ExportArgs {
    ExportArgs {
        map: map.to_owned(),
        output: output.to_owned(),
        resolution: 0.05,
        heights: None,
        floor: None,
        edge: None,
        mesh: false,
        overwrite: false,
        selection: Selection::default(),
        georeference: Georeference::default(),
    }
}

#[test]
fn a_map_of_each_form_becomes_each_form() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("room.ply"), ply::encode(&room())).unwrap();
    for (from, to) in
        [("room.ply", "a.pcd"), ("a.pcd", "b.bt"), ("b.bt", "c.ply"), ("c.ply", "d.yaml")]
    {
        run(&args(&path(from), &path(to))).unwrap();
    }
    assert_eq!(read(&path("a.pcd")).unwrap().points_m, room());
    let yaml = std::fs::read_to_string(path("d.yaml")).unwrap();
    assert!(yaml.contains("image: \"d.pgm\"\n") && yaml.contains("resolution: 0.05"), "{yaml}");
    let pgm = std::fs::read(path("d.pgm")).unwrap();
    let (free, occupied) =
        (pgm.iter().filter(|shade| **shade == 254), pgm.iter().filter(|shade| **shade == 0));
    assert_eq!((free.count(), occupied.count()), (40 * 40, 40));
}

#[test]
fn a_map_becomes_triangles() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("room.ply"), ply::encode(&room())).unwrap();
    for (name, begins, mesh) in [
        ("a.glb", &b"glTF"[..], false),
        ("a.obj", b"# stillmap", false),
        ("b.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex", true),
    ] {
        run(&ExportArgs { mesh, ..args(&path("room.ply"), &path(name)) }).unwrap();
        let bytes = std::fs::read(path(name)).unwrap();
        assert!(bytes.starts_with(begins) && bytes.len() > 500_000, "{name}");
    }
    // The vertices are on the floor or the wall.
    let vertices = read(&path("b.ply")).unwrap().points_m;
    let off = |point: &&Point3<f32>| (point.z + 0.8).abs() > 0.01 && (point.x - 2.01).abs() > 0.01;
    assert!(vertices.len() > 15_000);
    assert!(vertices.iter().filter(off).count() * 100 < vertices.len());
    let wrong = ExportArgs { mesh: true, ..args(&path("room.ply"), &path("c.pcd")) };
    assert!(run(&wrong).unwrap_err().to_string().contains("no triangles"));
    let wrong = ExportArgs { edge: Some(-1.0), ..args(&path("room.ply"), &path("c.glb")) };
    assert!(run(&wrong).unwrap_err().to_string().contains("-1"));
}

#[test]
fn a_part_of_a_map_is_exported_in_another_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("room.ply"), ply::encode(&room())).unwrap();
    let selection = options_for_test("--crop 1.5 -inf -inf inf inf 0 --transform 1 0 0 0 0 0");
    run(&ExportArgs { selection, ..args(&path("room.ply"), &path("a.ply")) }).unwrap();
    let part = read(&path("a.ply")).unwrap().points_m;
    let expected = room().into_iter().filter(|point| point.x >= 1.5 && point.z < 0.0);
    let expected: Vec<_> = expected.map(|point| point + Vector3::x()).collect();
    assert_eq!(part, expected);
    run(&args(&path("a.ply"), &path("a.laz"))).unwrap();
    assert!(std::fs::read(path("a.laz")).unwrap().starts_with(b"LASF"));
    run(&args(&path("a.ply"), &path("a.e57"))).unwrap();
    assert!(std::fs::read(path("a.e57")).unwrap().starts_with(b"ASTM-E57"));
    // The views of a map go with it.
    let view = "7 1.0 2.0 0.5 0 0 0 1 640 480 525 525 319.5 239.5".parse().unwrap();
    let seen = OrientedPoints { points_m: room(), ..OrientedPoints::default() };
    std::fs::write(path("seen.ply"), ply::encode_map(&seen, &[view])).unwrap();
    let selection = options_for_test("--transform 1 0 0 0 0 0");
    run(&ExportArgs { selection, ..args(&path("seen.ply"), &path("b.ply")) }).unwrap();
    let views = ply::views_of(&std::fs::read(path("b.ply")).unwrap()).unwrap();
    assert_eq!(views.len(), 1);
    assert_eq!(views[0].map_from_camera.translation.vector, Vector3::new(2.0, 2.0, 0.5));
    // Regression: with the views of the whole map a merge took the walls that were cut off for gone.
    let selection = options_for_test("--crop 1.5 -inf -inf inf inf 0");
    run(&ExportArgs { selection, ..args(&path("seen.ply"), &path("part.ply")) }).unwrap();
    assert_eq!(ply::views_of(&std::fs::read(path("part.ply")).unwrap()).unwrap(), []);
    let selection = options_for_test("--crop 5 5 5 6 6 6");
    let error = run(&ExportArgs { selection, ..args(&path("room.ply"), &path("c.ply")) });
    assert!(error.unwrap_err().to_string().contains("20000 points"));
    assert!(!path("c.ply").exists());
}

#[test]
fn a_map_is_put_where_it_is_on_the_earth() {
    let georeference: Georeference =
        options_for_test("--origin 458000.25 5428000 112 --epsg 25832");
    let points = OrientedPoints { points_m: room(), ..OrientedPoints::default() };
    let bytes = las_of(&points, &georeference, true).unwrap();
    let mut reader = las::Reader::new(Cursor::new(bytes)).unwrap();
    let system = reader.header().get_geotiff_crs().unwrap().unwrap();
    assert_eq!(system.get_projected_crs_geo_key_value(), Some(25832));
    let read = reader.read_all().unwrap();
    let origin_m = Vector3::new(458_000.25, 5_428_000.0, 112.0);
    for (read, point_m) in read.points().map(Result::unwrap).zip(room()) {
        let off_m = Point3::new(read.x, read.y, read.z) - (point_m.cast() + origin_m);
        assert!(off_m.amax() < 0.001, "{off_m}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("room.ply"), ply::encode(&room())).unwrap();
    let far = ExportArgs { georeference, ..args(&path("room.ply"), &path("far.pcd")) };
    assert!(run(&far).unwrap_err().to_string().contains("single precision"));
    assert!(!path("far.pcd").exists());
}

#[test]
fn what_cannot_be_exported_is_said_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("room.ply"), ply::encode(&room())).unwrap();
    std::fs::write(path("empty.ply"), ply::encode(&[])).unwrap();
    std::fs::write(path("there.yaml"), "whole").unwrap();
    let wall: Vec<_> = room().into_iter().filter(|point| point.x > 2.0).collect();
    std::fs::write(
        path("wall.ply"),
        ply::encode_with_normals(&wall, &vec![-nalgebra::Vector3::x(); wall.len()]),
    )
    .unwrap();
    for (map, output, said) in [
        ("empty.ply", "out.yaml", "the map is empty"),
        ("empty.ply", "out.glb", "the map is empty"),
        ("wall.ply", "out.yaml", "no floor was found"),
        ("room.ply", "there.yaml", "already exists"),
        ("room.ply", "no/such/out.yaml", "does not exist"),
        ("room.ply", "out.png", "no map that is known"),
        ("none.ply", "out.yaml", "none.ply"),
        ("there.yaml", "out.ply", "no saved map"),
    ] {
        let error = run(&args(&path(map), &path(output))).unwrap_err().to_string();
        assert!(error.contains(said), "{map} {output}: {error}");
    }
    assert!(!path("out.yaml").exists() && !path("out.pgm").exists() && !path("there.pgm").exists());
    assert_eq!(std::fs::read_to_string(path("there.yaml")).unwrap(), "whole");
    let low =
        ExportArgs { heights: Some(vec![0.5, 0.4]), ..args(&path("room.ply"), &path("out.yaml")) };
    assert!(run(&low).unwrap_err().to_string().contains("grid_max_height_m"));
}
