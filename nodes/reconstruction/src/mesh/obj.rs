//! OBJ, Wavefront's text format: `v` with x, y, z and where there are colours r, g, b from 0 to 1, `vn`, `f` with indices from 1.

use std::fmt::Write;

use geometry::TriangleMesh;

/// About how many bytes a line has.
const LINE_BYTES: usize = 40;

pub(super) fn encode(mesh: &TriangleMesh) -> String {
    let TriangleMesh { points_m, normals, colours, triangles } = mesh;
    let lines = points_m.len() + normals.len() + triangles.len();
    let mut text = String::with_capacity(LINE_BYTES * lines);
    text.push_str("# stillmap: metres, z up\n");
    let has_colours = colours.len() == points_m.len();
    let has_normals = normals.len() == points_m.len();
    for (index, point_m) in points_m.iter().enumerate() {
        // Writing to a text does not fail.
        let _ = write!(text, "v {} {} {}", point_m.x, point_m.y, point_m.z);
        if let Some(colour) = colours.get(index).filter(|_| has_colours) {
            let [red, green, blue] = colour.map(|part| f32::from(part) / 255.0);
            let _ = write!(text, " {red:.4} {green:.4} {blue:.4}");
        }
        text.push('\n');
    }
    for normal in normals.iter().filter(|_| has_normals) {
        let _ = writeln!(text, "vn {:.4} {:.4} {:.4}", normal.x, normal.y, normal.z);
    }
    for triangle in triangles {
        text.push('f');
        for index in triangle.map(|index| u64::from(index) + 1) {
            let _ = if has_normals {
                write!(text, " {index}//{index}")
            } else {
                write!(text, " {index}")
            };
        }
        text.push('\n');
    }
    text
}
