//! The files that meshes of a scene come from: OBJ, STL and PLY.

use std::path::Path;

use mesh_loader::Loader;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use simulator::Triangles;

/// The vertices and triangles of a file. Polygons become fans of triangles.
///
/// # Errors
/// When it is no such file; a text for the author of the scene.
pub fn read(path: &Path) -> Result<Triangles, String> {
    let extension = path.extension().and_then(|extension| extension.to_str());
    match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("ply") => read_ply(path),
        Some("obj" | "stl") => read_obj_or_stl(path),
        _ => Err("only .obj, .stl and .ply are supported".to_owned()),
    }
}

fn read_obj_or_stl(path: &Path) -> Result<Triangles, String> {
    let scene = Loader::default().load(path).map_err(|error| error.to_string())?;
    let (mut vertices_m, mut triangles) = (Vec::new(), Vec::new());
    for mesh in &scene.meshes {
        let before = index(vertices_m.len())?;
        vertices_m.extend(mesh.vertices.iter().map(|vertex| vertex.map(f64::from)));
        for face in &mesh.faces {
            let corner = |at: u32| at.checked_add(before).ok_or_else(too_many);
            let [a, b, c] = *face;
            triangles.push([corner(a)?, corner(b)?, corner(c)?]);
        }
    }
    Ok((vertices_m, triangles))
}

fn read_ply(path: &Path) -> Result<Triangles, String> {
    let file = std::fs::File::open(path).map_err(|error| error.to_string())?;
    let mut reader = std::io::BufReader::new(file);
    let ply =
        Parser::<DefaultElement>::new().read_ply(&mut reader).map_err(|error| error.to_string())?;
    let elements = |name: &str| ply.payload.get(name).map(Vec::as_slice).unwrap_or_default();
    let vertices_m = elements("vertex")
        .iter()
        .map(|vertex| {
            let coordinate = |name: &str| {
                vertex
                    .get(name)
                    .and_then(number)
                    .ok_or_else(|| format!("a vertex has no number \"{name}\""))
            };
            Ok([coordinate("x")?, coordinate("y")?, coordinate("z")?])
        })
        .collect::<Result<Vec<[f64; 3]>, String>>()?;
    let mut triangles = Vec::new();
    for face in elements("face") {
        let corners = ["vertex_indices", "vertex_index"]
            .iter()
            .find_map(|name| face.get(*name))
            .and_then(indices)
            .ok_or("a face has no list \"vertex_indices\"")?;
        if let [first, rest @ ..] = corners.as_slice() {
            triangles.extend(rest.windows(2).filter_map(|pair| match pair {
                [second, third] => Some([*first, *second, *third]),
                _ => None,
            }));
        }
    }
    Ok((vertices_m, triangles))
}

fn number(property: &Property) -> Option<f64> {
    match property {
        Property::Float(value) => Some(f64::from(*value)),
        Property::Double(value) => Some(*value),
        Property::Int(value) => Some(f64::from(*value)),
        Property::Short(value) => Some(f64::from(*value)),
        _ => None,
    }
}

fn indices(property: &Property) -> Option<Vec<u32>> {
    match property {
        Property::ListInt(values) => {
            values.iter().map(|&value| u32::try_from(value).ok()).collect()
        }
        Property::ListUInt(values) => Some(values.clone()),
        Property::ListUShort(values) => Some(values.iter().copied().map(u32::from).collect()),
        Property::ListUChar(values) => Some(values.iter().copied().map(u32::from).collect()),
        Property::ListShort(values) => {
            values.iter().map(|&value| u32::try_from(value).ok()).collect()
        }
        _ => None,
    }
}

fn index(count: usize) -> Result<u32, String> {
    u32::try_from(count).map_err(|_| too_many())
}

fn too_many() -> String {
    "it has more vertices than 32 bits count".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square in the plane z = 1, as one polygon where the format has any.
    const OBJ: &str = "v 0 0 1\nv 2 0 1\nv 2 2 1\nv 0 2 1\nf 1 2 3 4\n";
    const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                       property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                       end_header\n0 0 1\n2 0 1\n2 2 1\n0 2 1\n4 0 1 2 3\n";
    const STL: &str = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 1\nvertex 2 0 1\nvertex 2 2 1\n\
                       endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 1\nvertex 2 2 1\n\
                       vertex 0 2 1\nendloop\nendfacet\nendsolid s\n";

    fn written(name: &str, text: &str) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        (folder, path)
    }

    #[test]
    fn a_square_is_two_triangles_in_all_formats() {
        for (name, text) in [("a.obj", OBJ), ("a.PLY", PLY), ("a.ply", PLY), ("a.stl", STL)] {
            let (_folder, path) = written(name, text);
            let (vertices_m, triangles) = read(&path).unwrap();
            assert_eq!(triangles.len(), 2, "{name}");
            let area_m2: f64 = triangles
                .iter()
                .map(|corners| {
                    let [a, b, c] = corners.map(|at| vertices_m[at as usize]);
                    assert!([a, b, c].iter().all(|place| place[2] == 1.0));
                    ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs() / 2.0
                })
                .sum();
            assert!((area_m2 - 4.0).abs() < 1e-9, "{name}: {area_m2}");
        }
    }

    #[test]
    fn what_cannot_be_read_is_told() {
        for (name, text) in
            [("a.ply", "ply\nformat ascii"), ("a.png", ""), ("a.stl", "solid s\nfac")]
        {
            let (_folder, path) = written(name, text);
            assert!(!read(&path).unwrap_err().is_empty(), "{name}");
        }
        assert!(read(Path::new("/does/not/exist.obj")).unwrap_err().contains("No such file"));
    }
}
