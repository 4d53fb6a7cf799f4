//! Long work is interrupted: it ends in order, and what was made until then is written.

use std::path::Path;
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::time::{Duration, Instant};

use bag_player::Bag;
use free_domain::FreeDomain;
use geometry::Stamp;
use rustix::process::{Pid, Signal, kill_process};

use crate::bags::{bag_of, pose, scan, small_room, wall};
use crate::program::summary;

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);
/// What has not come yet is looked for again after so long.
const LOOK_AGAIN: Duration = Duration::from_millis(5);
/// So many cycles take minutes.
const CYCLES: u32 = 30_000;

/// Starts the program.
fn start(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Interrupts the program once `has_begun`, as Ctrl-C does. Returns what it said.
fn interrupt(mut child: Child, has_begun: impl Fn() -> bool) -> String {
    let started = Instant::now();
    while !has_begun() {
        if started.elapsed() >= PATIENCE || child.try_wait().unwrap().is_some() {
            let _ = child.kill();
            let (status, said) = end_of(child);
            panic!("it did not begin within {:?}: {status}: {said}", started.elapsed());
        }
        std::thread::sleep(LOOK_AGAIN);
    }
    let pid = Pid::from_raw(i32::try_from(child.id()).unwrap()).unwrap();
    kill_process(pid, Signal::INT).unwrap();
    let interrupted = Instant::now();
    let (status, said) = end_of(child);
    let (before, after) = (interrupted - started, interrupted.elapsed());
    assert_eq!(
        status.code(),
        Some(130),
        "{before:?} before the signal, {after:?} after it: {said}"
    );
    assert!(said.contains("interrupted"), "{said}");
    said
}

/// How the program ended, and what it wrote on stderr.
fn end_of(child: Child) -> (ExitStatus, String) {
    let Output { status, stderr, .. } = child.wait_with_output().unwrap();
    (status, String::from_utf8(stderr).unwrap())
}

/// No temporary file is left below a folder.
fn is_tidy(folder: &Path) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let is_temporary = path.extension().is_some_and(|end| end == "tmp" || end == "part");
        assert!(!is_temporary, "{}", path.display());
        if path.is_dir() {
            is_tidy(&path);
        }
    }
}

fn size(path: &Path) -> u64 {
    path.metadata().map_or(0, |file| file.len())
}

#[test]
fn a_simulation_leaves_a_bag_of_what_was_simulated() {
    let folder = tempfile::tempdir().unwrap();
    let (bag, part) = (folder.path().join("x.mcap"), folder.path().join("x.mcap.tmp"));
    let child = start(&["simulate", "small", "--seconds", "3600", "-o", bag.to_str().unwrap()]);
    let said = interrupt(child, || size(&part) > 0);
    assert!(said.contains("of 3600.0 s"), "{said}");
    is_tidy(folder.path());
    let info = Bag::open(&bag).unwrap().info().unwrap();
    assert!(info.losses.is_empty());
}

#[test]
fn an_import_leaves_a_bag_of_what_was_imported() {
    let folder = tempfile::tempdir().unwrap();
    let (bag, part) = (folder.path().join("x.mcap"), folder.path().join("x.mcap.tmp"));
    let cloud = folder.path().join("cloud.ply");
    let points: Vec<_> = (0..50_000_u16)
        .map(|index| nalgebra::Point3::new(f32::from(index), f32::from(index % 7), 0.5))
        .collect();
    std::fs::write(&cloud, geometry::ply::encode(&points)).unwrap();
    let mut arguments = vec!["import", "clouds", "-o", bag.to_str().unwrap()];
    arguments.extend(std::iter::repeat_n(cloud.to_str().unwrap(), 5_000));
    interrupt(start(&arguments), || size(&part) > 0);
    is_tidy(folder.path());
    let info = Bag::open(&bag).unwrap().info().unwrap();
    let messages: u64 = info.topics.iter().map(|topic| topic.message_count).sum();
    assert!(info.losses.is_empty() && messages < 5_000, "{messages}");
}

/// What a run leaves that was interrupted: results of what was read, or nothing at all.
fn has_results_or_nothing(out: &Path, said: &str) {
    if said.contains("nothing is written") {
        assert!(!out.exists(), "{said}");
        return;
    }
    is_tidy(out);
    let cycles = summary(out)["cycles"]["total"].as_u64().unwrap();
    assert!((1..u64::from(CYCLES)).contains(&cycles), "{cycles}: {said}");
    for name in ["map.ply", "map.pcd", "parameters.yaml", "report.html"] {
        assert!(out.join(name).is_file(), "{name}: {said}");
    }
}

#[test]
fn a_run_leaves_the_map_of_what_was_read() {
    let folder = tempfile::tempdir().unwrap();
    let bag = bag_of(folder.path(), "long.mcap", |topics| {
        let stamps = || {
            (0..CYCLES)
                .map(|index| Stamp::from_secs_nanos(100, 0).plus_seconds(f64::from(index) * 0.1))
        };
        topics.messages("/scan", stamps().map(|stamp| (stamp, scan(stamp, 3.0))));
        topics.messages("/points", stamps().map(|stamp| (stamp, wall(stamp, 300))));
        topics.messages("/pose", stamps().map(|stamp| (stamp, pose(stamp))));
    });
    let out = folder.path().join("out");
    let child = start(&["run", bag.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    let said = interrupt(child, || out.join("parameters.yaml.part").is_file());
    has_results_or_nothing(&out, &said);
}

/// Runs a bag over DDS, slowly, and interrupts it once `has_begun` says so of the process and the output folder.
fn interrupt_over_dds(has_begun: impl Fn(u32, &Path) -> bool) {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let out = folder.path().join("out");
    let (from, to) = (bag.to_str().unwrap(), out.to_str().unwrap());
    let child = start(&["run", from, "--transport", "dds", "--rate", "0.05", "--out", to]);
    let pid = child.id();
    let said = interrupt(child, || has_begun(pid, &out));
    has_results_or_nothing(&out, &said);
}

/// The signal was lost that came before the run had joined the network.
#[test]
fn a_run_over_dds_ends_on_a_signal_before_its_nodes_start() {
    interrupt_over_dds(|_, out| out.join("parameters.yaml.part").is_file());
}

#[test]
fn a_run_over_dds_ends_its_nodes_and_leaves_the_map_of_what_was_played() {
    interrupt_over_dds(|pid, _| {
        children_of(pid).iter().any(|arguments| arguments.contains("\0play\0"))
    });
}

/// The arguments of the processes that a process has started.
fn children_of(pid: u32) -> Vec<String> {
    let threads = std::fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
    let children =
        threads.filter_map(|task| std::fs::read_to_string(task.path().join("children")).ok());
    let children = children.collect::<String>();
    let arguments = |child| std::fs::read_to_string(format!("/proc/{child}/cmdline")).ok();
    children.split_whitespace().filter_map(arguments).collect()
}

#[test]
fn experiments_leave_those_that_are_done_or_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let arguments =
        ["experiments", "--only", "5", "10", "--seeds", "2", "--out", out.to_str().unwrap()];
    let said = interrupt(start(&arguments), || out.is_dir());
    assert!(said.contains("nothing is written") && !out.exists(), "{said}");
}

#[test]
fn listening_for_topics_ends_and_nothing_is_started() {
    let (folder, domain) = (tempfile::tempdir().unwrap(), FreeDomain::new());
    let child = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
        .args(["up", "--detect", "--yes"])
        .env("ROS_DOMAIN_ID", domain.number().to_string())
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .env("ROS_LOG_DIR", folder.path())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let is_listening = || {
        let logs = std::fs::read_dir(folder.path()).unwrap();
        let mut texts = logs.map(|log| std::fs::read_to_string(log.unwrap().path()).unwrap());
        texts.any(|text| text.contains("node /stillmap_doctor on domain"))
    };
    let said = interrupt(child, is_listening);
    assert!(said.contains("nothing was started") && !said.contains("laser"), "{said}");
}
