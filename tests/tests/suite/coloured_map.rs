//! A bag with a colour camera gives a map with colours, a grid and a mesh, whatever connects the nodes.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use geometry::{NO_COLOUR, OrientedPoints, pcd, ply};

use crate::bags::{made_once, small_room};
use crate::local_run::files_of;
use crate::program::{stillmap, succeed, summary};

/// The small room with a colour camera beside the depth camera.
pub(crate) fn coloured_room(folder: &Path) -> PathBuf {
    static BAG: OnceLock<Vec<u8>> = OnceLock::new();
    made_once(&BAG, folder.join("coloured.mcap"), &["simulate", "small", "--colour"])
}

fn run(bag: &Path, out: &Path, more: &[&str]) {
    let run = ["run", bag.to_str().unwrap(), "--no-timing", "--map-edge", "0.03"];
    let out = ["--out", out.to_str().unwrap()];
    succeed(run.into_iter().chain(out).chain(more.iter().copied()));
}

fn map_of(out: &Path) -> OrientedPoints {
    ply::decode_with_normals(&std::fs::read(out.join("map.ply")).unwrap()).unwrap()
}

#[test]
fn the_map_has_the_colours_of_the_bag_and_the_same_ones_over_dds() {
    let folder = tempfile::tempdir().unwrap();
    let bag = coloured_room(folder.path());
    let [first, second, dds] = ["first", "second", "dds"].map(|name| folder.path().join(name));
    let how = ["--grid", "scan", "--mesh", "glb"];
    run(&bag, &first, &how);
    run(&bag, &second, &how);
    run(&bag, &dds, &[&how[..], &["--transport", "dds"]].concat());
    let (first_files, second_files) = (files_of(&first), files_of(&second));
    assert!(first_files == second_files, "two runs differ");
    assert_eq!(summary(&dds)["drops"], serde_json::json!([]), "nothing may be lost on the way");
    let names = ["map.ply", "map.pcd", "mesh.glb", "grid.yaml", "grid.pgm", "parameters.yaml"];
    let dds_files = files_of(&dds);
    for name in names {
        assert!(first_files[name] == dds_files[name], "{name} differs over DDS");
    }
    let map = map_of(&first);
    assert_eq!(map.colours.len(), map.points_m.len());
    let seen = map.colours.iter().filter(|colour| **colour != NO_COLOUR).count();
    assert!(seen > map.colours.len() * 95 / 100, "{seen} of {}", map.colours.len());
    // The room is painted: it has more than shades of one colour.
    let is_colourful =
        |colour: &&[u8; 3]| colour.iter().max().unwrap() - colour.iter().min().unwrap() > 20;
    let colourful = map.colours.iter().filter(is_colourful).count();
    assert!(colourful > map.colours.len() / 20, "{colourful} of {}", map.colours.len());
    // The normals of the volume.
    assert_eq!(map.normals.len(), map.points_m.len());
    assert!(map.normals.iter().all(|normal| (normal.norm() - 1.0).abs() < 1e-3));
    assert_eq!(pcd::decode_with_normals(&first_files["map.pcd"]).unwrap(), map);
}

/// Colours change nothing else, and without them the files are byte for byte those of a bag without a colour camera.
#[test]
fn without_colours_the_files_are_those_of_a_bag_without_a_colour_camera() {
    let folder = tempfile::tempdir().unwrap();
    let (coloured, plain) = (coloured_room(folder.path()), small_room(folder.path()));
    let [with, without, never] = ["with", "without", "never"].map(|name| folder.path().join(name));
    run(&coloured, &with, &[]);
    run(&coloured, &without, &["--no-colour"]);
    run(&plain, &never, &[]);
    for name in ["map.ply", "map.pcd"] {
        assert!(files_of(&without)[name] == files_of(&never)[name], "{name}");
    }
    assert!(map_of(&without).colours.is_empty());
    assert_eq!(map_of(&with).points_m, map_of(&without).points_m);
    let header = |out: &Path| {
        let text = std::fs::read(out.join("map.ply")).unwrap();
        String::from_utf8_lossy(&text[..600]).into_owned()
    };
    assert!(header(&with).contains("property uchar red") && !header(&without).contains("red"));
}

#[test]
fn a_colour_topic_that_is_not_there_is_said_and_one_of_depths_is_no_colour() {
    let folder = tempfile::tempdir().unwrap();
    let bag = coloured_room(folder.path());
    let out = folder.path().join("out");
    let run = |more: &[&str]| {
        let run = ["run", bag.to_str().unwrap(), "--overwrite", "--out", out.to_str().unwrap()];
        let output = stillmap(run.into_iter().chain(more.iter().copied()));
        (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (is_done, said) = run(&["--image", "/no/such/topic"]);
    assert!(!is_done && said.contains("/no/such/topic"), "{said}");
    let (is_done, said) = run(&["--image", "/camera/depth/image_raw"]);
    assert!(is_done && said.contains("the map has no colours") && said.contains("16UC1"), "{said}");
    assert!(map_of(&out).colours.is_empty());
}
