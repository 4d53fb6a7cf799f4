//! The triangles of the map as the page carries them; `page/src/mesh_layer.js` reads them.

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, TriangleMesh, VoxelGrid, VoxelKey, is_finite};
use nalgebra::{Point3, Vector3};
use serde_json::{Value, json};

use super::point_set::curve;
use crate::payload::{drawn_colour, push_colours, push_differences_16, push_varint};

/// Steps of the coordinates along a triangle's edge, of a mesh that is not too large for them ...
const STEPS_IN_EDGE: f64 = 16.0;
/// ... and the finest step.
const LEAST_STEP_M: f32 = 0.001;
/// Where a mesh is made coarser the cells for its vertices begin with this share of the edge that is expected to suffice ...
const FIRST_SHARE: f64 = 0.8;
/// ... and grow by this factor until it does.
const GROWTH: f64 = 1.25;

/// Triangles on a grid of 16 bits an axis.
pub(super) struct Triangles {
    /// Before compression.
    pub(super) bytes: Vec<u8>,
    /// The triangles of the run, of which there can be more.
    total: usize,
    triangles: usize,
    vertices: usize,
    origin_m: Point3<f32>,
    step_m: f32,
    has_colours: bool,
}

impl Triangles {
    /// Of a mesh, made coarser if it has more than `most` triangles. `spacing_m` is about the length of their edges.
    pub(super) fn of(mesh: &TriangleMesh, most: usize, spacing_m: f64) -> Self {
        let total = mesh.triangles.len();
        let mut drawn = Surface::of(mesh);
        let mut drawn_edge_m = spacing_m;
        // The number of triangles goes with the square of their edges.
        let mut edge_m = FIRST_SHARE * spacing_m * (total as f64 / most.max(1) as f64).sqrt();
        while drawn.triangles.len() > most.max(1) {
            let Ok(grid) = VoxelGrid::new(edge_m) else { break };
            drawn = Surface::of(mesh).coarser(&grid);
            drawn_edge_m = edge_m;
            edge_m *= GROWTH;
        }
        let step_m = ((drawn_edge_m / STEPS_IN_EDGE) as f32).max(LEAST_STEP_M);
        drawn.encoded(total, step_m, !mesh.colours.is_empty())
    }

    pub(super) fn header(&self) -> Value {
        json!({
            "total": self.total, "triangles": self.triangles, "vertices": self.vertices, "step_m": self.step_m,
            "origin_m": <[f32; 3]>::from(self.origin_m), "has_colours": self.has_colours,
        })
    }
}

/// Vertices with colours, and triangles between them.
struct Surface {
    vertices: Vec<(Point3<f32>, [u8; 3])>,
    triangles: Vec<[usize; 3]>,
}

impl Surface {
    /// What of a mesh can be drawn.
    fn of(mesh: &TriangleMesh) -> Self {
        let colour = |index: usize| mesh.colours.get(index).copied().map_or([255; 3], drawn_colour);
        let vertices =
            mesh.points_m.iter().enumerate().map(|(index, at_m)| (*at_m, colour(index))).collect();
        let is_drawn = |corner: &usize| mesh.points_m.get(*corner).is_some_and(is_finite);
        let triangles = mesh.triangles.iter().map(|corners| corners.map(|corner| corner as usize));
        Self {
            vertices,
            triangles: triangles.filter(|corners| corners.iter().all(is_drawn)).collect(),
        }
    }

    /// With one vertex for each voxel of a grid, the mean of those in it, and the triangles that are left (Rossignac and Borrel,
    /// "Multi-resolution 3D approximations for rendering complex scenes", 1993).
    fn coarser(self, grid: &VoxelGrid) -> Self {
        let mut cells: HashMap<VoxelKey, usize, BuildVoxelHasher> = HashMap::default();
        let mut sums: Vec<(Vector3<f64>, [u32; 3], u32)> = Vec::new();
        let cell_of: Vec<usize> = self
            .vertices
            .iter()
            .map(|(at_m, colour)| {
                let cell = *cells.entry(grid.key(at_m)).or_insert_with(|| {
                    sums.push((Vector3::zeros(), [0; 3], 0));
                    sums.len() - 1
                });
                if let Some((at, colours, count)) = sums.get_mut(cell) {
                    *at += at_m.coords.cast::<f64>();
                    for (sum, channel) in colours.iter_mut().zip(colour) {
                        *sum = sum.saturating_add(u32::from(*channel));
                    }
                    *count += 1;
                }
                cell
            })
            .collect();
        let mean = |(at, colours, count): &(Vector3<f64>, [u32; 3], u32)| {
            let at_m = (at / f64::from(*count)).cast::<f32>().into();
            (at_m, colours.map(|sum| (sum / count.max(&1)) as u8))
        };
        let in_cells =
            self.triangles.iter().map(|corners| least_first(corners.map(|corner| cell_of[corner])));
        let has_area = |[a, b, c]: &[usize; 3]| a != b && b != c && a != c;
        let mut triangles: Vec<[usize; 3]> = in_cells.filter(has_area).collect();
        triangles.sort_unstable();
        triangles.dedup();
        Self { vertices: sums.iter().map(mean).collect(), triangles }
    }

    fn encoded(self, total: usize, finest_step_m: f32, has_colours: bool) -> Triangles {
        let mut is_used = vec![false; self.vertices.len()];
        self.triangles.iter().flatten().for_each(|corner| is_used[*corner] = true);
        let used: Vec<usize> = (0..is_used.len()).filter(|vertex| is_used[*vertex]).collect();
        let places_m = || used.iter().map(|vertex| self.vertices[*vertex].0);
        let least_m = places_m().reduce(|low, at_m| low.inf(&at_m)).unwrap_or_default();
        let most_m = places_m().reduce(|high, at_m| high.sup(&at_m)).unwrap_or_default();
        let step_m = ((most_m / 2.0 - least_m.coords / 2.0).coords.amax()
            / f32::from(u16::MAX / 2))
        .max(finest_step_m);
        // The cast saturates.
        let steps = |at_m: &Point3<f32>| {
            <[f32; 3]>::from((at_m / step_m - least_m.coords / step_m).coords)
                .map(|value| value.round() as u16)
        };
        let mut ordered: Vec<(u64, usize)> =
            used.iter().map(|vertex| (curve(steps(&self.vertices[*vertex].0)), *vertex)).collect();
        ordered.sort_unstable();
        let mut number_of = vec![0; self.vertices.len()];
        for (number, (_, vertex)) in ordered.iter().enumerate() {
            number_of[*vertex] = number;
        }
        let mut triangles: Vec<[usize; 3]> = self
            .triangles
            .iter()
            .map(|corners| least_first(corners.map(|corner| number_of[corner])))
            .collect();
        triangles.sort_unstable();

        let mut bytes = Vec::new();
        let placed = || ordered.iter().map(|(_, vertex)| &self.vertices[*vertex]);
        for axis in 0..3 {
            push_differences_16(&mut bytes, placed().map(|(at_m, _)| steps(at_m)[axis]));
        }
        if has_colours {
            push_colours(&mut bytes, placed().map(|(_, colour)| *colour));
        }
        let mut before = 0;
        for [least, ..] in &triangles {
            push_varint(&mut bytes, (least - before) as u64);
            before = *least;
        }
        for other in [1, 2] {
            triangles
                .iter()
                .for_each(|corners| push_varint(&mut bytes, (corners[other] - corners[0]) as u64));
        }
        Triangles {
            bytes,
            total,
            triangles: triangles.len(),
            vertices: ordered.len(),
            origin_m: least_m,
            step_m,
            has_colours,
        }
    }
}

/// The same triangle, turned the same way, with its least corner first.
fn least_first([a, b, c]: [usize; 3]) -> [usize; 3] {
    if a <= b && a <= c {
        [a, b, c]
    } else if b <= a && b <= c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A square of `cells` by `cells` cells of two triangles each.
    fn sheet(cells: u32, cell_m: f32) -> TriangleMesh {
        let row = cells + 1;
        let at = |n: u32| Point3::new((n % row) as f32 * cell_m, (n / row) as f32 * cell_m, 1.0);
        let corner = |x: u32, y: u32| y * row + x;
        let cell = |x: u32, y: u32| {
            let (here, up) =
                ([corner(x, y), corner(x + 1, y)], [corner(x, y + 1), corner(x + 1, y + 1)]);
            [[here[0], here[1], up[0]], [here[1], up[1], up[0]]]
        };
        TriangleMesh {
            points_m: (0..row * row).map(at).collect(),
            colours: vec![[10, 20, 30]; (row * row) as usize],
            triangles: (0..cells).flat_map(|x| (0..cells).flat_map(move |y| cell(x, y))).collect(),
            ..TriangleMesh::default()
        }
    }

    /// What the page reads: the plain twin of `page/src/mesh_layer.js`.
    fn read(triangles: &Triangles) -> (Vec<Point3<f32>>, Vec<[usize; 3]>) {
        let mut at = 0;
        let mut differences = || {
            let planes = &triangles.bytes[at..at + 2 * triangles.vertices];
            at += 2 * triangles.vertices;
            let (low, high) = planes.split_at(triangles.vertices);
            let mut value = 0_u16;
            let values = low.iter().zip(high).map(|(low, high)| {
                let folded = u16::from_le_bytes([*low, *high]);
                value = value.wrapping_add((folded >> 1) ^ (folded & 1).wrapping_neg());
                value
            });
            values.collect::<Vec<u16>>()
        };
        let axes = [differences(), differences(), differences()];
        at += if triangles.has_colours { 3 * triangles.vertices } else { 0 };
        let mut varint = || {
            let (mut value, mut shift) = (0, 0);
            loop {
                let byte = triangles.bytes[at];
                at += 1;
                value |= usize::from(byte & 0x7f) << shift;
                shift += 7;
                if byte & 0x80 == 0 {
                    return value;
                }
            }
        };
        let mut least = 0;
        let mut corners = vec![[0; 3]; triangles.triangles];
        for triangle in &mut corners {
            least += varint();
            *triangle = [least; 3];
        }
        for other in [1, 2] {
            corners.iter_mut().for_each(|triangle| triangle[other] += varint());
        }
        let place = |n: usize| {
            triangles.origin_m
                + Vector3::from(axes.each_ref().map(|axis| f32::from(axis[n]) * triangles.step_m))
        };
        ((0..triangles.vertices).map(place).collect(), corners)
    }

    fn area_m2(points_m: &[Point3<f32>], triangles: &[[usize; 3]]) -> f32 {
        let of = |[a, b, c]: &[usize; 3]| {
            (points_m[*b] - points_m[*a]).cross(&(points_m[*c] - points_m[*a])).z / 2.0
        };
        triangles.iter().map(of).sum()
    }

    #[test]
    fn the_least_corner_comes_first_and_the_turn_stays() {
        for corners in [[3, 7, 5], [5, 3, 7], [7, 5, 3]] {
            assert_eq!(least_first(corners), [3, 7, 5]);
        }
    }

    #[test]
    fn the_page_reads_the_same_surface_turned_the_same_way() {
        let mesh = sheet(20, 0.05);
        let triangles = Triangles::of(&mesh, usize::MAX, 0.05);
        let (points_m, corners) = read(&triangles);
        assert_eq!((points_m.len(), corners.len()), (21 * 21, 800));
        // The sum is that of all areas only if each is counterclockwise from above.
        assert!((area_m2(&points_m, &corners) - 1.0).abs() < 1e-3);
        let half_step_m = 0.501 * triangles.step_m;
        assert!((0.05 / 17.0..0.05 / 15.0).contains(&triangles.step_m));
        let is_known = |at_m: &Point3<f32>| {
            mesh.points_m.iter().any(|known| (known - at_m).amax() <= half_step_m)
        };
        assert!(points_m.iter().all(is_known));
    }

    #[test]
    fn too_many_triangles_become_fewer_over_the_same_surface() {
        let mesh = sheet(100, 0.02);
        let triangles = Triangles::of(&mesh, 2_000, 0.02);
        let (points_m, corners) = read(&triangles);
        assert!((500..=2_000).contains(&corners.len()), "{}", corners.len());
        assert_eq!(triangles.header()["total"], 20_000);
        let area_m2 = area_m2(&points_m, &corners);
        assert!((3.6..=4.0).contains(&area_m2), "{area_m2}");
    }

    #[test]
    fn a_mesh_without_triangles_has_no_bytes() {
        let triangles = Triangles::of(&TriangleMesh::default(), 10, 0.02);
        assert_eq!((triangles.bytes.len(), triangles.triangles), (0, 0));
    }

    proptest! {
        /// Whatever the mesh, nothing panics, and what is read are its triangles with finite corners.
        #[test]
        fn any_mesh_is_carried(
            points in prop::collection::vec(prop::array::uniform3(prop_oneof![-5.0_f32..5.0, any::<f32>()]), 0..30),
            corners in prop::collection::vec(prop::array::uniform3(0_u32..32), 0..40),
            most in 0_usize..50,
        ) {
            let points_m: Vec<Point3<f32>> = points.iter().map(|at| Point3::from(*at)).collect();
            let mesh = TriangleMesh { points_m, triangles: corners, ..TriangleMesh::default() };
            let triangles = Triangles::of(&mesh, most, 0.1);
            let (read_m, read_corners) = read(&triangles);
            // Around the origin eight cells remain, of the largest edge, too.
            let of_eight_cells = 8 * 7 * 6 / 3;
            prop_assert!(read_corners.len() <= mesh.triangles.len().min(most.max(of_eight_cells)));
            prop_assert!(read_corners.iter().flatten().all(|corner| *corner < read_m.len()));
        }
    }
}
