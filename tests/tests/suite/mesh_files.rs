//! The map of a run as triangles, as a foreign reader loads them.

use std::process::Command;

use serde_json::Value;

use crate::coloured_map::coloured_room;
use crate::program::succeed;
use crate::python::python_with;

fn loaded(python: &std::ffi::OsStr, paths: &[&str]) -> Vec<Value> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/trimesh/load.py");
    let output = Command::new(python).arg(script).args(paths).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let lines = String::from_utf8(output.stdout).unwrap();
    lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn a_foreign_reader_loads_the_mesh_of_a_run_and_that_of_its_map() {
    let Some(python) = python_with("trimesh") else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let bag = coloured_room(folder.path());
    let run = ["run", bag.to_str().unwrap(), "--map-edge", "0.05", "--no-timing"];
    for form in ["ply", "glb"] {
        succeed(run.into_iter().chain(["--mesh", form, "--out", &path(form)]));
    }
    succeed(["export", &path("ply/map.ply"), "-o", &path("again.obj")]);
    let meshes =
        loaded(&python, &[&path("ply/mesh.ply"), &path("glb/mesh.glb"), &path("again.obj")]);
    let [ply, glb, again] = &meshes[..] else { panic!("{meshes:?}") };
    for mesh in &meshes {
        let number = |name: &str| mesh[name].as_u64().unwrap();
        assert!(number("triangles") > 5_000 && number("border") * 4 < number("inner"), "{mesh}");
        assert_eq!((number("wrong"), &mesh["is_turned_one_way"]), (0, &true.into()), "{mesh}");
        assert!(number("coloured") * 10 > number("vertices") * 9, "{mesh}");
    }
    for name in ["vertices", "triangles", "inner", "border"] {
        assert_eq!(ply[name], glb[name], "{name}");
    }
    // The map's z axis is up, and glTF's y axis; the map's y axis is then the z axis turned around.
    let bound = |mesh: &Value, name: &str, axis: usize| mesh[name][axis].as_f64().unwrap();
    for (name, other) in [("least", "most"), ("most", "least")] {
        let of_ply = [0, 1, 2].map(|axis| bound(ply, name, axis));
        let of_glb = [bound(glb, name, 0), -bound(glb, other, 2), bound(glb, name, 1)];
        for (ply_m, glb_m) in of_ply.iter().zip(of_glb) {
            assert!((ply_m - glb_m).abs() < 1e-3, "{ply} {glb}");
        }
    }
    let share = again["triangles"].as_f64().unwrap() / ply["triangles"].as_f64().unwrap();
    assert!((0.7..1.3).contains(&share), "{share}");
}
