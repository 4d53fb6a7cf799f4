//! The commands of the pages of `docs/`, run as a reader would run them, on small data.
//!
//! Each block of a shell runs as it stands, block after block in one folder, in which the recordings and maps are that the pages name.
//! The word behind `sh` at the head of a block says why one does not run here: see [`Mark`].

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use super::page::Page;
use super::root;
use crate::bags::made_once;
use crate::merged_maps;
use crate::program::succeed;
use free_domain::FreeDomain;

/// Why a block of commands is read and not run.
const MARKS: [(&str, &str); 6] = [
    ("robot", "it needs sensors, a graph of nodes or ROS 2, or ends when somebody ends it"),
    ("root", "it changes the machine"),
    ("network", "it needs the network"),
    ("data", "it needs a recording that is not in the repository"),
    ("build", "it builds; the gate and the workflow do so"),
    ("slow", "it takes longer than a test may; the gate runs it, or its like"),
];

/// The files that the pages name beside those that their own commands make.
fn data(page: &str, folder: &Path) {
    static ROOM: OnceLock<Vec<u8>> = OnceLock::new();
    static DRIVE: OnceLock<Vec<u8>> = OnceLock::new();
    let at = |name: &str| folder.join(name);
    let room = |name: &str| {
        made_once(&ROOM, at(name), &["simulate", "small", "--colour", "--seconds", "2"]);
    };
    let drive = |name: &str| {
        let command = ["simulate", "road", "--velodyne", "vlp16", "--seconds", "1"];
        made_once(&DRIVE, at(name), &command);
    };
    match page {
        "bag" => {
            room("room.mcap");
            // Two scenes with small images, of which one has no scanner.
            let scenes = root().join("nodes/laboratory/simulator/scenes/sensors");
            std::fs::copy(scenes.join("image-80x60.yaml"), at("scene.yaml")).unwrap();
            let (scene, bag) = (scenes.join("no-laser.yaml"), at("camera.mcap"));
            let size = ["--seconds", "1", "--depth-size", "80", "60", "-o"];
            let paths = [scene, bag].map(|path| path.to_str().unwrap().to_owned());
            succeed(["simulate", &paths[0]].into_iter().chain(size).chain([&*paths[1]]));
        }
        "flat" => {
            room("flat.mcap");
            merged_maps::write_two_days(folder);
        }
        "grid" | "mesh" => {
            room("room.mcap");
            merged_maps::write_two_days(folder);
            std::fs::rename(at("monday.ply"), at("house.ply")).unwrap();
        }
        "merge" => merged_maps::write_two_days(folder),
        "trajectory" => {
            room("camera.mcap");
            drive("drive.mcap");
        }
        _ => room("room.mcap"),
    }
}

/// Runs the blocks of a page.
fn run(name: &str) {
    let page = Page::read(&root().join("docs").join(name).with_extension("md"));
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir(path("bin")).unwrap();
    let link =
        |target: PathBuf, name: &str| std::os::unix::fs::symlink(target, path(name)).unwrap();
    link(env!("CARGO_BIN_EXE_stillmap-under-test").into(), "bin/stillmap");
    for of_repository in ["config", "launch-scripts"] {
        link(root().join(of_repository), of_repository);
    }
    let programs = std::env::var("PATH").unwrap_or_default();
    let programs = format!("{}:{programs}", path("bin").display());
    // Some pages send.
    let domain = FreeDomain::new();
    let mut has_data = false;
    for block in page.blocks.iter().filter(|block| block.mark.is_empty()) {
        if !has_data {
            data(name, folder.path());
            has_data = true;
        }
        let output = Command::new("bash")
            .args(["-euc", &block.text])
            .current_dir(folder.path())
            .env("PATH", &programs)
            .env("ROS_DOMAIN_ID", domain.number().to_string())
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let said =
            [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
        assert!(
            output.status.success(),
            "docs/{name}.md: {}\n{}\n{}",
            output.status,
            block.text,
            said.concat()
        );
    }
}

/// A test for each page that has a block to run, and their names.
macro_rules! pages {
    ($($name:ident),* $(,)?) => {
        const RUN: &[&str] = &[$(stringify!($name)),*];
        $(
            #[test]
            fn $name() {
                run(stringify!($name));
            }
        )*
    };
}

pages!(
    bag,
    calibrate,
    clean,
    filter,
    flat,
    grid,
    merge,
    mesh,
    methods,
    pictures,
    road,
    trajectory,
    troubleshooting,
    tune,
);

#[test]
fn each_page_is_run_and_what_is_not_says_why() {
    let mut with_blocks = Vec::new();
    let mut unknown = Vec::new();
    for page in super::pages().iter().filter(|page| page.name().starts_with("docs/")) {
        let name = page.path.file_stem().unwrap().to_string_lossy().into_owned();
        if page.blocks.iter().any(|block| block.mark.is_empty()) {
            with_blocks.push(name);
        }
        let marks = page.blocks.iter().map(|block| &*block.mark).filter(|mark| !mark.is_empty());
        let is_unknown = |mark: &&str| !MARKS.iter().any(|(known, _)| known == mark);
        unknown.extend(marks.filter(is_unknown).map(|mark| format!("{}: {mark}", page.name())));
    }
    with_blocks.sort();
    assert_eq!(
        with_blocks, RUN,
        "pages with commands to run; give each a test, in the order of the alphabet"
    );
    assert!(unknown.is_empty(), "marks that nobody knows: {unknown:?}");
}
