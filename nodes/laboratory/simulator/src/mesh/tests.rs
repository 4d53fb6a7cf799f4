use proptest::prelude::*;

use super::*;
use crate::{Body, Material, Sample, Scenario, Scene, Shape};

/// A cuboid of 12 triangles.
fn cuboid([x, y, z]: [f64; 3]) -> Mesh {
    let vertices_m = (0..8_u8)
        .map(|corner| {
            let sign = |axis: u8| if corner >> axis & 1 == 0 { -0.5 } else { 0.5 };
            [sign(0) * x, sign(1) * y, sign(2) * z]
        })
        .collect();
    let faces =
        [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Mesh::new(vertices_m, triangles).unwrap()
}

fn coordinate() -> impl Strategy<Value = f64> {
    -3.0..3.0_f64
}

fn place() -> impl Strategy<Value = [f64; 3]> {
    [coordinate(), coordinate(), coordinate()]
}

fn rays() -> impl Strategy<Value = Ray> {
    (place(), place()).prop_filter_map("a ray needs a direction", |(origin, target)| {
        let (origin, target) = (Point3::from(origin), Point3::from(target) * 0.3);
        let direction = target - origin;
        (direction.norm() > 1e-3).then_some(Ray { origin, direction })
    })
}

proptest! {
    /// The tree finds the same hits as brute force.
    #[test]
    fn the_nearest_triangle_is_that_of_all(
        soup in prop::collection::vec([place(), place(), place()], 1..80),
        ray in rays(),
    ) {
        let vertices: Vec<[f64; 3]> = soup.iter().flatten().copied().collect();
        let triangles = (0..soup.len() as u32).map(|at| [3 * at, 3 * at + 1, 3 * at + 2]).collect();
        let mesh = Mesh::new(vertices, triangles).unwrap();
        let plain = soup
            .iter()
            .filter_map(|corners| intersect_triangle(&corners.map(Point3::from), &ray))
            .min_by(f64::total_cmp);
        prop_assert_eq!(mesh.intersect(&ray).map(|hit| hit.parameter), plain);
    }

    /// A cuboid of triangles has the same hits as the cuboid.
    #[test]
    fn triangles_of_a_cuboid_are_met_where_the_cuboid_is(ray in rays()) {
        let size_m = [1.2, 0.8, 0.6];
        let (mesh, shape) = (cuboid(size_m), Shape::Box { size_m });
        let (found, expected) = (mesh.intersect(&ray), shape.intersect(&ray));
        prop_assert_eq!(found.is_some(), expected.is_some());
        if let (Some(found), Some(expected)) = (found, expected) {
            prop_assert!((found.parameter - expected.parameter).abs() < 1e-9);
            prop_assert!(found.normal.dot(&ray.direction) <= 0.0);
        }
    }
}

#[test]
fn a_camera_sees_a_mesh_as_it_sees_the_shape() {
    let with = |shape: Shape| {
        let body = Body {
            name: "box".to_owned(),
            shape,
            pose: [3.0, 0.1, 0.2, 0.4, 0.3, 0.1],
            material: Material::PLASTER,
        };
        let wall = Body::cuboid("wall", [5.0, -9.0, -9.0], [5.1, 9.0, 9.0], Material::PLASTER);
        let scene = Scene { bodies: vec![body, wall], ..Scene::default() };
        let mut scenario =
            Scenario { scene, ..Scenario::default() }.with_depth_size(80, 60).with_duration_s(0.1);
        scenario.rig.path = crate::Path::still([0.0; 6]);
        scenario.rig.colour_camera = Some(crate::ColourCamera::default());
        let images: Vec<Sample> = scenario
            .samples()
            .unwrap()
            .filter(|sample| matches!(sample, Sample::Depth { .. }))
            .collect();
        images
    };
    let size_m = [0.9, 0.7, 0.5];
    assert_eq!(with(Shape::Mesh(cuboid(size_m))), with(Shape::Box { size_m }));
}

#[test]
fn files_are_asked_for_and_filled_in() {
    let text = "scene:\n  bodies:\n    - name: chair\n      shape: {mesh: {file: chair.obj, scale: 0.5}}\n      \
                pose: [2, 0, 0, 0, 0, 0]\n      material: {reflectivity: 0.5, max_incidence_rad: 1.3}\n";
    let scenario: Scenario = serde_saphyr::from_str(text).unwrap();
    let error = scenario.validate().unwrap_err().to_string();
    assert!(error.contains("chair of the scene") && error.contains("chair.obj"), "{error}");
    let filled = scenario
        .with_meshes(|file| {
            assert_eq!(file, "chair.obj");
            let corners = vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
            Ok::<_, MeshError>((corners, vec![[0, 1, 2]]))
        })
        .unwrap();
    assert_eq!(filled.validate(), Ok(()));
    let Shape::Mesh(mesh) = &filled.scene.bodies[0].shape else { panic!("no mesh") };
    assert_eq!(mesh.half_extent_m(), Vector3::new(1.0, 1.0, 0.0));
    // Loaded triangles are written and read again.
    let text = serde_json::to_string(&filled).unwrap();
    assert_eq!(serde_json::from_str::<Scenario>(&text).unwrap(), filled);
}

#[test]
fn triangles_that_are_none_are_refused() {
    let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0]];
    assert_eq!(
        Mesh::new(vertices.clone(), vec![[0, 1, 2]]),
        Err(MeshError::Vertex { triangle: 0, vertex: 2, vertices: 2 })
    );
    let nowhere = Mesh::new(vec![[0.0, f64::NAN, 0.0]], Vec::new()).unwrap_err();
    assert!(matches!(nowhere, MeshError::Coordinate { vertex: 0, .. }));
    // A triangle without an area is never hit.
    let line = Mesh::new(vertices, vec![[0, 1, 1]]).unwrap();
    let ray = Ray { origin: Point3::new(0.5, 0.0, 1.0), direction: -Vector3::z() };
    assert_eq!(line.intersect(&ray), None);
}
