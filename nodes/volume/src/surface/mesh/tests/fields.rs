//! Of distances that are given.

use geometry::MeshEdges;
use nalgebra::Vector3;
use proptest::prelude::*;

use super::super::cases::{CASES, STARTS};
use super::*;
use crate::testing::Noise;

const EDGE_M: f64 = 0.03;

fn place(node: [i32; 3]) -> Vector3<f32> {
    Vector3::from(node).cast()
}

/// The sum of the volumes of the tetrahedra between the triangles and the origin: positive where they turn outwards.
fn volume_m3(mesh: &geometry::TriangleMesh) -> f64 {
    let corners = (0..mesh.triangles.len()).map(|index| mesh.corners_m(index).unwrap());
    corners.map(|[a, b, c]| f64::from(a.coords.dot(&b.coords.cross(&c.coords))) / 6.0).sum()
}

fn check_triangles(mesh: &geometry::TriangleMesh) {
    assert_eq!(mesh.edges().wrong, 0);
    let normals = mesh.normals.iter().map(|normal| (normal.norm() - 1.0).abs());
    assert!(normals.fold(0.0, f32::max) < 1e-5);
    for index in 0..mesh.triangles.len() {
        let normal = mesh.area_normal(index);
        assert!(normal.norm() > 0.0, "triangle {index} has no area");
        for corner in mesh.triangles[index] {
            let along = normal.normalize().dot(&mesh.normals[corner as usize]);
            assert!(along > 0.0, "triangle {index}: {along}");
        }
    }
}

#[test]
fn a_ball_is_closed_and_where_it_is() {
    const RADIUS: f32 = 11.3;
    let middle = Vector3::new(0.2, -0.4, 0.7);
    let surface = field(EDGE_M, 2, |node| Some((place(node) - middle).norm() - RADIUS));
    let mesh = whole(&surface);
    check_triangles(&mesh);
    let MeshEdges { inner, border, .. } = mesh.edges();
    assert_eq!(border, 0);
    assert_eq!(mesh.points_m.len() + mesh.triangles.len() - inner, 2, "as of a ball, after Euler");
    let mut error = 0.0;
    for (point_m, normal) in mesh.points_m.iter().zip(&mesh.normals) {
        let from_middle = point_m.coords / EDGE_M as f32 - middle;
        error += (from_middle.norm() - RADIUS).abs() / mesh.points_m.len() as f32;
        assert!(normal.dot(&from_middle.normalize()) > 0.99);
    }
    assert!(error < 0.01, "{error} edges");
    let truth_m3 = 4.0 / 3.0 * std::f64::consts::PI * (f64::from(RADIUS) * EDGE_M).powi(3);
    assert!((volume_m3(&mesh) / truth_m3 - 1.0).abs() < 0.01, "{}", volume_m3(&mesh));
}

#[test]
fn a_plane_through_nodes_ends_where_the_known_ends() {
    // Each node of the plane has the distance 0: all vertices would be in one place with their neighbours.
    let surface = field(EDGE_M, 1, |[x, y, z]| {
        (x.abs() < 6 && y.abs() < 5).then_some((z - x) as f32 / std::f32::consts::SQRT_2)
    });
    let mesh = whole(&surface);
    check_triangles(&mesh);
    let (across, along) = (10, 8);
    // A square of the lattice seen from above is two triangles, or four where the plane passes through a second layer of cells.
    assert!(mesh.triangles.len() >= 2 * across * along, "{}", mesh.triangles.len());
    for (point_m, normal) in mesh.points_m.iter().zip(&mesh.normals) {
        let off = (point_m.z - point_m.x) / std::f32::consts::SQRT_2;
        assert!(off.abs() < 2e-3 * EDGE_M as f32, "{point_m}");
        assert!(normal.dot(&Vector3::new(-1.0, 0.0, 1.0)) > 1.4, "{normal}");
        assert!(point_m.x.abs() <= 0.151 && point_m.y.abs() <= 0.121, "{point_m}");
    }
    let border = mesh.edges().border;
    assert!((2 * (across + along)..5 * (across + along)).contains(&border), "{border}");
}

/// The corner of a room, and the outside of one.
#[test]
fn a_corner_is_one_sheet() {
    for side in [1.0, -1.0] {
        let surface = field(EDGE_M, 2, |node| {
            let walls = place(node) + Vector3::new(3.3, 2.6, 4.1);
            Some(side * walls.x.min(walls.y).min(walls.z))
        });
        let mesh = whole(&surface);
        assert_eq!(mesh.edges().wrong, 0);
        let walls = |index: usize| {
            (mesh.points_m[index].coords / EDGE_M as f32 + Vector3::new(3.3, 2.6, 4.1)).min().abs()
        };
        let error: f32 = (0..mesh.points_m.len()).map(walls).sum::<f32>();
        assert!(error < 0.03 * mesh.points_m.len() as f32, "{error}");
        // A sheet with one border around it, after Euler.
        let MeshEdges { inner, border, .. } = mesh.edges();
        assert_eq!(mesh.points_m.len() + mesh.triangles.len() - inner - border, 1);
    }
}

/// However noisy, the surface between what is all before and what is all behind has no hole.
#[test]
fn noise_makes_no_hole() {
    let mut noise = Noise::new(7);
    let noise: Vec<f32> = (0..40 * 40 * 40).map(|_| noise.normal() as f32).collect();
    let surface = field(EDGE_M, 2, |node| {
        let [x, y, z] = node.map(|along| (along + 20) as usize);
        Some(place(node).norm() - 11.3 + 0.8 * noise[(z * 40 + y) * 40 + x])
    });
    let edges = whole(&surface).edges();
    assert!(edges.inner > 5_000 && edges.border == 0 && edges.wrong == 0, "{edges:?}");
}

/// Without blocks: each cell whose corners are all known.
fn plain_triangles(half: i32, value: impl Fn([i32; 3]) -> Option<f32>) -> Vec<[Vertex; 3]> {
    let range = -8 * half..8 * half - 1;
    let mut triangles = Vec::new();
    for z in range.clone() {
        for y in range.clone() {
            for x in range.clone() {
                let corner =
                    |corner: i32| [x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)];
                let Some(values) = (0..8).map(|n| value(corner(n))).collect::<Option<Vec<_>>>()
                else {
                    continue;
                };
                let behind = values
                    .iter()
                    .rev()
                    .fold(0, |bits, value| bits << 1 | usize::from(*value < 0.0));
                triangles.extend(CASES[behind].triangles().iter().map(|triangle| {
                    triangle.map(|edge| {
                        let [x, y, z] = corner(i32::from(STARTS[usize::from(edge)]));
                        (VoxelKey { x, y, z }, usize::from(edge) / 4)
                    })
                }));
            }
        }
    }
    triangles
}

/// The cells that have both edges of the grid.
fn cells_of([a, b]: [Vertex; 2]) -> Vec<[i32; 3]> {
    let of_edge = |(VoxelKey { x, y, z }, axis): Vertex| {
        let steps = (0..8).filter(move |step| step >> axis & 1 == 0);
        steps.map(move |step: i32| [x - (step & 1), y - (step >> 1 & 1), z - (step >> 2)])
    };
    let of_b: Vec<_> = of_edge(b).collect();
    of_edge(a).filter(|cell| of_b.contains(cell)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// Of any signs, with any nodes unknown, the mesh is a manifold, turned one way, and ends at cells that are not known alone.
    /// That of the blocks is that of all cells.
    #[test]
    fn any_field_gives_a_manifold(seed in any::<u64>(), unknown in 0.0..0.3_f64, bias in -0.4..0.4_f64) {
        let mut noise = Noise::new(seed);
        let of_node: Vec<Option<f32>> = (0..16 * 16 * 16)
            .map(|_| {
                let is_known = noise.uniform() >= unknown * noise.uniform();
                // Some are 0.
                let value = (((noise.uniform() - 0.5 + bias) * 20.0) as i32) as f32 / 5.0;
                is_known.then_some(value)
            })
            .collect();
        let value = |[x, y, z]: [i32; 3]| of_node[((z + 8) * 256 + (y + 8) * 16 + x + 8) as usize];
        let surface = field(EDGE_M, 1, value);
        let mut triangles = keyed_triangles(&surface);
        let mut plain = plain_triangles(1, value);
        triangles.sort_unstable();
        plain.sort_unstable();
        prop_assert_eq!(&triangles, &plain);

        let mesh = whole(&surface);
        prop_assert_eq!(mesh.triangles.len(), triangles.len());
        prop_assert_eq!(mesh.edges().wrong, 0);
        let mut passes: BTreeMap<[Vertex; 2], usize> = BTreeMap::new();
        for [a, b, c] in triangles {
            prop_assert!(a != b && b != c && c != a);
            for edge in [[a, b], [b, c], [c, a]] {
                *passes.entry(edge).or_default() += 1;
            }
        }
        let is_known = |[x, y, z]: [i32; 3]| {
            (0..8).all(|corner| {
                let node = [x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)];
                node.iter().all(|along| (-8..8).contains(along)) && value(node).is_some()
            })
        };
        for (&[a, b], &count) in &passes {
            prop_assert_eq!(count, 1);
            let is_border = !passes.contains_key(&[b, a]);
            let cells = cells_of([a, b]);
            prop_assert_eq!(is_border, !cells.into_iter().all(is_known), "{:?} {:?}", a, b);
        }
    }
}

#[test]
fn one_node_behind_is_closed() {
    let surface = field(EDGE_M, 1, |node| Some(if node == [0; 3] { -1.0 } else { 1.0 }));
    let mesh = whole(&surface);
    assert_eq!((mesh.triangles.len(), mesh.edges().border), (8, 0));
    check_triangles(&mesh);
}

/// Nodes before and behind by turns: the gradient is 0 everywhere.
#[test]
fn without_a_gradient_the_normals_are_those_of_the_triangles() {
    let surface = field(EDGE_M, 1, |node| {
        let is_inside = node.iter().all(|along| (-6..6).contains(along));
        Some(if is_inside && node.iter().sum::<i32>() % 2 != 0 { -1.0 } else { 1.0 })
    });
    let mesh = whole(&surface);
    assert_eq!(
        (mesh.triangles.len(), mesh.edges()),
        (8 * 6 * 12 * 12, MeshEdges { inner: 10_368, ..MeshEdges::default() })
    );
    let is_within =
        |corner: &u32| mesh.points_m[*corner as usize].coords.amax() < 4.5 * EDGE_M as f32;
    let within =
        (0..mesh.triangles.len()).filter(|index| mesh.triangles[*index].iter().all(is_within));
    for index in within {
        let normal = mesh.area_normal(index).normalize();
        let corners = mesh.triangles[index].map(|corner| mesh.normals[corner as usize]);
        assert!(corners.iter().all(|of_corner| of_corner.dot(&normal) > 0.5), "triangle {index}");
    }
}

#[test]
fn a_part_in_another_surface_makes_no_difference() {
    let all = field(EDGE_M, 1, |node| Some(place(node).norm() - 4.2));
    let (mut one, mut other) = (all.emptied(), all.emptied());
    for (index, key) in all.block_keys().into_iter().enumerate() {
        let part = if index % 2 == 0 { &mut one } else { &mut other };
        part.put_block(&all.block_bytes(key).unwrap()).unwrap();
    }
    for key in all.block_keys() {
        let mut mesh = BlockMesh::default();
        one.mesh_of_both(&other, key, PointRules::default(), &mut mesh);
        assert_eq!(mesh, mesh_of(&all, key));
        assert!(!mesh.is_empty());
    }
}
