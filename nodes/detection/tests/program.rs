//! The node as a process: its exit codes, its messages, and its end.
#![cfg(feature = "ros")]

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use free_domain::FreeDomain;

/// Longer than anything takes on a busy machine; a test that waits so long has failed.
const PATIENCE: Duration = Duration::from_secs(120);

fn detection(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_detection"));
    let domain = FreeDomain::of_this_process().number();
    command.args(arguments).env("ROS_DOMAIN_ID", domain.to_string()).stdin(Stdio::null());
    command
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn was_told(child: &Child, signal: &str) -> bool {
    let kill = format!("kill -{signal} {}", child.id());
    Command::new("sh").args(["-c", &kill]).status().is_ok_and(|status| status.success())
}

#[test]
fn a_signal_ends_the_node_soon_and_well() {
    for name in ["INT", "TERM"] {
        let mut child = detection(&[]).stderr(Stdio::piped()).spawn().unwrap();
        // Where the process may, it takes a larger receive buffer, and says so first.
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
        assert!(lines.any(|line| line.contains("node /detection on domain")));
        let told = Instant::now();
        assert!(was_told(&child, name));
        let status = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break status;
            }
            assert!(told.elapsed() < PATIENCE, "the node does not end");
            std::thread::sleep(Duration::from_millis(5));
        };
        assert_eq!(status.code(), Some(0), "SIG{name}");
    }
}

#[test]
fn what_it_cannot_do_it_says_in_one_line() {
    for (arguments, part) in [
        (&["bag.mcap"][..], "unknown argument `bag.mcap`"),
        (&["--ros-args", "-p", "voxel_edge:=1"], "did you mean `voxel_edge_m`"),
        (&["--ros-args", "-p", "voxel_edge_m:=-1"], "must be above 0, not -1"),
        (&["--ros-args", "-p", "input:=cloud"], "one of `depth`"),
        (&["--ros-args", "--params-file", "/no/such/file.yaml"], "/no/such/file.yaml"),
        (&["--ros-args", "-r", "scan"], "FROM:=TO"),
    ] {
        let output = detection(arguments).output().unwrap();
        // A file may be there at another start.
        let is_for_good = !arguments.contains(&"--params-file");
        let code = if is_for_good { 2 } else { 1 };
        assert_eq!(output.status.code(), Some(code), "{arguments:?}");
        let text = stderr(&output);
        let last = text.lines().last().unwrap_or_default();
        assert!(last.starts_with("detection: ") && last.contains(part), "{arguments:?}: {text}");
    }
    let output = detection(&[]).env("ROS_DOMAIN_ID", "many").output().unwrap();
    assert!(stderr(&output).contains("ROS_DOMAIN_ID=many: accepted is"), "{}", stderr(&output));
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn help_names_topics_and_parameters() {
    let output = detection(&["--help"]).output().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    for part in [
        "Example:",
        "scan (sensor_msgs/msg/LaserScan)",
        "voxel_edge_m (double; above 0, in m; default 0.08)",
    ] {
        assert!(text.contains(part), "{part} is missing: {text}");
    }
}
