//! Nothing that is there is replaced unless that was asked for, and what cannot be done leaves nothing behind.

use std::path::{Path, PathBuf};

use crate::bags::small_room;
use crate::program::{stillmap, succeed};

/// What stands in the place of a result.
const BEFORE: &str = "of another day";

/// A folder with the inputs of the commands.
struct Inputs {
    folder: tempfile::TempDir,
}

impl Inputs {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let room = small_room(folder.path());
        std::fs::create_dir(folder.path().join("folder")).unwrap();
        std::fs::copy(room, folder.path().join("folder/small.mcap")).unwrap();
        let points = [nalgebra::Point3::new(1.0, 2.0, 3.0)];
        std::fs::write(folder.path().join("cloud.ply"), geometry::ply::encode(&points)).unwrap();
        std::fs::write(folder.path().join("poses.txt"), "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n")
            .unwrap();
        std::fs::write(folder.path().join("words.txt"), "dear diary").unwrap();
        std::fs::write(
            folder.path().join("bad.yaml"),
            "detection:\n  ros__parameters:\n    window: 4\n",
        )
        .unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The words of a line, in which `@NAME` is a path of the folder.
    fn words(&self, line: &str) -> Vec<String> {
        let word = |word: &str| match word.strip_prefix('@') {
            Some(name) => self.path(name).to_str().unwrap().to_owned(),
            None => word.to_owned(),
        };
        line.split(' ').map(word).collect()
    }

    fn files(&self) -> Vec<PathBuf> {
        fn all(folder: &Path, found: &mut Vec<PathBuf>) {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    all(&path, found);
                }
                found.push(path);
            }
        }
        let mut found = Vec::new();
        all(self.folder.path(), &mut found);
        found.sort();
        found
    }
}

/// Each command that writes, and a file that it would replace.
const REPLACING: [(&str, &str); 18] = [
    ("run @small.mcap --out @out", "out/map.ply"),
    ("run @small.mcap --out @out", "out/parameters.yaml"),
    ("run @small.mcap --out @out", "out/dynamic/cycle_000001.ply"),
    ("run @small.mcap --png --out @out", "out/map.png"),
    ("run @small.mcap --animation @out.png --out @out", "out.png"),
    ("run @small.mcap --pose lidar --out @out", "out/map.las"),
    ("demo --out @out", "out/demo.mcap"),
    ("demo --out @out", "out/report.html"),
    ("simulate small -o @out.mcap", "out.mcap"),
    ("import clouds @cloud.ply -o @out.mcap", "out.mcap"),
    ("import ros1 @words.txt -o @out.mcap", "out.mcap"),
    ("import kitti @out -o @out.mcap", "out.mcap"),
    ("experiments --quick --only 10 --out @out", "out/experiments.json"),
    ("odometry @small.mcap -o @out.txt", "out.txt"),
    ("calibrate @small.mcap -o @out.yaml", "out.yaml"),
    ("record -o @out.mcap", "out.mcap"),
    ("eval trajectory @poses.txt --ref @poses.txt --out @out", "out/score.json"),
    ("eval grid @out.yaml --scene B --picture @out.png", "out.png"),
];

#[test]
fn what_is_there_is_replaced_only_with_overwrite() {
    let inputs = Inputs::new();
    for (line, file) in REPLACING {
        let path = inputs.path(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, BEFORE).unwrap();
        let before = inputs.files();
        let output = stillmap(inputs.words(line));
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{line}: {stderr}");
        for part in [path.to_str().unwrap(), "already exists", "--overwrite"] {
            assert!(stderr.contains(part), "{line}: no {part} in: {stderr}");
        }
        assert!(stderr.lines().count() <= 2, "{line}: {stderr}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), BEFORE, "{line}");
        assert_eq!(inputs.files(), before, "{line}");
        std::fs::remove_file(&path).unwrap();
        let _ = std::fs::remove_dir_all(inputs.path("out"));
    }
}

#[test]
fn with_overwrite_it_is_replaced() {
    let inputs = Inputs::new();
    for (line, file) in [
        ("run @small.mcap --out @out", "out/map.ply"),
        ("simulate small -o @out.mcap", "out.mcap"),
        ("import clouds @cloud.ply -o @out.mcap", "out.mcap"),
        ("experiments --quick --only 10 --out @out", "out/experiments.json"),
    ] {
        let path = inputs.path(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, BEFORE).unwrap();
        succeed(inputs.words(&format!("{line} --overwrite")));
        assert_ne!(std::fs::read(&path).unwrap(), BEFORE.as_bytes(), "{line}");
        std::fs::remove_file(&path).unwrap();
    }
}

/// A command that cannot do its job, a part of what it says, and its exit code.
const WRONG: [(&str, &str, i32); 24] = [
    ("run @none.mcap --out @out", "none.mcap", 1),
    ("run @words.txt --out @out", "words.txt", 1),
    ("run @small.mcap --params-file @bad.yaml --out @out", "window", 2),
    ("run @small.mcap --params-file @none.yaml --out @out", "none.yaml", 1),
    ("run @small.mcap --rate 0 --out @out", "--rate 0", 2),
    ("play @small.mcap --rate 0", "the rate must be a positive number", 2),
    ("run @small.mcap --scan /none --out @out", "/none", 1),
    ("run @small.mcap --pose lidar --road-voxel 0 --out @out", "--road-voxel", 2),
    ("import clouds @words.txt -o @out.mcap", "words.txt", 1),
    ("import clouds @cloud.ply --rate 0 -o @out.mcap", "--rate 0", 2),
    ("simulate @words.txt -o @out.mcap", "words.txt", 1),
    ("simulate small -o @none/out.mcap", "none/out.mcap", 1),
    ("experiments --seeds 0 --out @out", "--seeds", 2),
    ("demo --map-edge 5 --out @out", "map_edge_m", 2),
    // Regressions: the one file was replaced by the other, the bag by its copy, and options without effect were taken in silence.
    ("merge @cloud.ply @cloud.ply -o @m.ply --changes @./m.ply", "cannot be both", 1),
    ("odometry @small.mcap --slam -o @x --save-map @./x", "cannot be both", 1),
    ("import bag @folder -o @folder/small.mcap --overwrite", "cannot replace itself", 1),
    ("run @small.mcap --loop-closing --out @out", "--pose lidar", 2),
    ("run @small.mcap --pose lidar --scan /scan --out @out", "--scan has no effect", 2),
    ("eval trajectory @poses.txt --ref @poses.txt --times @poses.txt", "--times has no effect", 2),
    ("odometry @small.mcap --of lidar --features lines -o @x", "are for a camera", 2),
    ("export @cloud.ply -o @out.las --edge 0.1", "--edge is of an octomap", 2),
    ("export @cloud.ply -o @out.las --heights 0.1 1", "--heights are of the occupancy grid", 2),
    ("node reconstruction --ros-args -p map_file:=@words.txt", "must end in .ply", 2),
];

#[test]
fn what_cannot_be_done_is_said_and_leaves_nothing() {
    let inputs = Inputs::new();
    let before = inputs.files();
    for (line, part, code) in WRONG {
        let line = line.replace(":=@", &format!(":={}/", inputs.folder.path().display()));
        let output = stillmap(inputs.words(&line));
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{line}: {stderr}");
        assert!(stderr.contains(part), "{line}: no {part} in: {stderr}");
        assert_eq!(inputs.files(), before, "{line}");
    }
}

#[test]
fn a_node_does_not_start_on_a_file_that_is_no_map_and_leaves_it() {
    let inputs = Inputs::new();
    let path = inputs.path("map.ply");
    std::fs::write(&path, BEFORE).unwrap();
    let parameter = format!("map_file:={}", path.display());
    let output = stillmap(["node", "reconstruction", "--ros-args", "-p", &parameter]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "another start fails in the same way: {stderr}");
    assert!(stderr.contains("could not be loaded") && stderr.contains("moved away"), "{stderr}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), BEFORE);
}
