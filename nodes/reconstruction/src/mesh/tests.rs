use geometry::{MeshEdges, OrientedPoints};
use nalgebra::{Point3, Vector3};
use volume::{BlockBox, PointRules, Surface, SurfaceConfig};

use super::*;

/// A ball of points of a map with voxels of this edge, each with a normal and a colour.
fn ball(edge_m: f64) -> OrientedPoints {
    let mut surface =
        Surface::new(SurfaceConfig { edge_m, has_colour: true, ..Default::default() }).unwrap();
    let radius_m = 14.0 * edge_m as f32;
    let directions = (0..20_000).map(|index| {
        // Evenly distributed: Fibonacci's lattice on a sphere.
        let up = 1.0 - (2.0 * f64::from(index) + 1.0) / 20_000.0;
        let around = f64::from(index) * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let aside = (1.0 - up * up).sqrt();
        Vector3::new(aside * around.cos(), aside * around.sin(), up).cast::<f32>()
    });
    let points = directions.map(|normal| (Point3::from(normal * radius_m), normal, [200, 100, 50]));
    surface.put_coloured_points(points, 2.0 * edge_m, BlockBox::ALL);
    let points = surface.points(PointRules::default());
    OrientedPoints {
        points_m: points.iter().map(|point| point.position_m).collect(),
        normals: points.iter().map(|point| point.normal).collect(),
        colours: points.iter().map(|point| point.colour.unwrap()).collect(),
    }
}

#[test]
fn a_saved_map_is_put_together_at_its_own_edge() {
    let points = ball(0.03);
    let mesh = mesh_of_points(&points, None).unwrap();
    // Where the planes of points disagree on a node, a cell may be crossed that has no point: it stays open.
    let MeshEdges { inner, border, wrong } = mesh.edges();
    assert!(wrong == 0 && border * 100 < inner, "{border} of {inner}");
    // A closed mesh has two triangles for each vertex, and the map about one point for each vertex.
    let share = mesh.points_m.len() as f64 / points.points_m.len() as f64;
    assert!((0.95..1.05).contains(&share), "{share}");
    for (point_m, normal) in mesh.points_m.iter().zip(&mesh.normals) {
        assert!((point_m.coords.norm() - 0.42).abs() < 0.006, "{point_m}");
        assert!(normal.dot(&point_m.coords.normalize()) > 0.95);
    }
    assert!(mesh.colours.iter().all(|colour| *colour == [200, 100, 50]));
    // The same at that edge.
    assert_eq!(mesh_of_points(&points, Some(0.03)).unwrap(), mesh);
}

#[test]
fn any_other_cloud_has_no_gaps() {
    let mut points = ball(0.03);
    // Turned, so that it is that of no grid.
    let turn = nalgebra::UnitQuaternion::from_euler_angles(0.3, 0.5, 0.7);
    points.points_m.iter_mut().for_each(|point| *point = turn * *point);
    points.normals.iter_mut().for_each(|normal| *normal = turn * *normal);
    points.colours.clear();
    let mesh = mesh_of_points(&points, None).unwrap();
    let MeshEdges { border, wrong, .. } = mesh.edges();
    assert_eq!((border, wrong), (0, 0));
    assert!(mesh.colours.is_empty());
    assert!(mesh.points_m.iter().all(|point| (point.coords.norm() - 0.42).abs() < 0.006));
}

/// Regression: the normals of the means of each voxel were 0 and not estimated, and there was no mesh. (Which side of a closed
/// ball is its outside the points alone do not tell: some of the estimated normals disagree.)
#[test]
fn a_cloud_of_no_grid_needs_no_normals() {
    let mut points = ball(0.03);
    let turn = nalgebra::UnitQuaternion::from_euler_angles(0.3, 0.5, 0.7);
    points.points_m.iter_mut().for_each(|point| *point = turn * *point);
    points.normals.clear();
    for (edge_m, least) in [(None, 4_000), (Some(0.06), 1_000), (Some(0.1), 400)] {
        let mesh = mesh_of_points(&points, edge_m).unwrap();
        let most_m = edge_m.unwrap_or(0.03) as f32;
        let is_off = |point: &&Point3<f32>| (point.coords.norm() - 0.42).abs() > most_m;
        let (off, triangles) = (mesh.points_m.iter().filter(is_off).count(), mesh.triangles.len());
        assert!(triangles > least && off * 5 < mesh.points_m.len(), "{edge_m:?} {triangles} {off}");
    }
}

fn area_m2(mesh: &TriangleMesh) -> f64 {
    let at = |index: u32| mesh.points_m[index as usize].coords.cast::<f64>();
    let triangles = mesh.triangles.iter().map(|corners| corners.map(at));
    triangles.map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0).sum()
}

/// Regression: with a finer edge than the map's each point filled a voxel of its own, and the mesh was dust.
#[test]
fn a_mesh_of_finer_voxels_than_the_map_is_the_same_surface() {
    let points = ball(0.03);
    let own_m2 = area_m2(&mesh_of_points(&points, None).unwrap());
    for share in [1.0, 0.97, 0.9, 0.7, 0.5, 0.4, 0.2, 0.1] {
        let area_m2 = area_m2(&mesh_of_points(&points, Some(0.03 * share)).unwrap());
        println!("{share}: {area_m2:.3} of {own_m2:.3} m2");
        assert!((area_m2 / own_m2 - 1.0).abs() < 0.05, "{share}: {area_m2} of {own_m2} m2");
    }
    let too_fine = mesh_of_points(&points, Some(0.0015)).unwrap_err();
    assert!(matches!(too_fine, MeshError::TooFine { .. }), "{too_fine}");
}

/// Regression: a sparse cloud with a small edge took memory without bound.
#[test]
fn a_mesh_of_more_blocks_than_fit_is_refused() {
    let points = ball(0.03);
    let of_edge = |edge_m| from_points::mesh_of_blocks(&points, Some(edge_m), 1_000);
    assert!(of_edge(0.03).is_ok());
    let refused = of_edge(0.006).unwrap_err();
    assert_eq!(refused, MeshError::TooManyBlocks { edge_m: 0.006, max_blocks: 1_000 });
}

#[test]
fn what_is_no_surface_is_said() {
    let points = |points: &[[f32; 3]]| OrientedPoints {
        points_m: points.iter().copied().map(Point3::from).collect(),
        ..OrientedPoints::default()
    };
    let error = |points, edge_m| mesh_of_points(&points, edge_m).unwrap_err().to_string();
    assert!(error(points(&[]), None).contains("the map is empty"));
    assert!(error(points(&[[0.0; 3]]), Some(0.0)).contains("0"));
    assert!(error(points(&[[f32::NAN; 3]; 9]), None).contains("9 points"));
    assert_eq!(encode(&TriangleMesh::default(), MeshForm::Glb), Err(MeshError::NoTriangles));
}

fn triangle() -> TriangleMesh {
    TriangleMesh {
        points_m: [[0.0, 0.0, 0.5], [1.25, 0.0, 0.0], [0.0, -2.0, 0.0]].map(Point3::from).to_vec(),
        normals: vec![Vector3::z(); 3],
        colours: vec![[255, 0, 128], [0; 3], [1, 2, 3]],
        triangles: vec![[0, 1, 2]],
    }
}

#[test]
fn an_obj_has_what_the_mesh_has() {
    let text = |mesh| String::from_utf8(encode(&mesh, MeshForm::Obj).unwrap()).unwrap();
    let whole = text(triangle());
    assert!(
        whole.contains("v 1.25 0 0 0.0000 0.0000 0.0000\nv 0 -2 0 0.0039 0.0078 0.0118\n"),
        "{whole}"
    );
    assert!(whole.contains("vn 0.0000 0.0000 1.0000\nf 1//1 2//2 3//3\n"), "{whole}");
    let bare = text(TriangleMesh { normals: Vec::new(), colours: Vec::new(), ..triangle() });
    assert!(bare.ends_with("v 0 0 0.5\nv 1.25 0 0\nv 0 -2 0\nf 1 2 3\n"), "{bare}");
}

#[test]
fn a_glb_has_a_valid_header_and_the_numbers() {
    let bytes = encode(&triangle(), MeshForm::Glb).unwrap();
    let number = |at: usize| u32::from_le_bytes(*bytes[at..].first_chunk().unwrap()) as usize;
    assert_eq!((&bytes[..4], number(4), number(8)), (&b"glTF"[..], 2, bytes.len()));
    let json_bytes = number(12);
    assert_eq!((&bytes[16..20], json_bytes % 4), (&b"JSON"[..], 0));
    let numbers = 20 + json_bytes;
    assert_eq!(
        (&bytes[numbers + 4..numbers + 8], number(numbers)),
        (&b"BIN\0"[..], bytes.len() - numbers - 8)
    );
    let root = gltf_json::Root::from_slice(&bytes[20..numbers]).unwrap();
    let mut wrong = Vec::new();
    gltf_json::validation::Validate::validate(
        &root,
        &root,
        gltf_json::Path::new,
        &mut |path, error| {
            wrong.push(format!("{}: {error}", path()));
        },
    );
    assert_eq!(wrong, [""; 0]);
    assert_eq!(root.accessors.len(), 4);
    assert_eq!(root.accessors[0].min, Some(gltf_json::Value::from(vec![0.0, -2.0, 0.0])));
    let floats = &bytes[numbers + 8..];
    assert_eq!(f32::from_le_bytes(*floats[8..].first_chunk().unwrap()), 0.5);
    // Behind three places and three normals: half of sRGB is a fifth of the light.
    let colour: Vec<u16> =
        floats[72..80].chunks(2).map(|part| u16::from_le_bytes([part[0], part[1]])).collect();
    assert_eq!(colour, [65_535, 0, 14_146, 65_535]);
    assert_eq!(&floats[96..], [0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
}
