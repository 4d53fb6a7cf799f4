//! Where a node's log goes.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use node_shell::{Node, RosArguments};
use rustix::process::{Pid, Signal, kill_process};

/// Longer than anything here takes on a busy machine; reached only by a fault.
const PATIENCE: Duration = Duration::from_secs(60);

/// A node that runs until another one sees it, and whether it was seen to tell its log.
async fn seen(name: &str, arguments: &[&str], variables: &[(&str, &Path)]) -> (Output, bool) {
    let namespace = format!("/logs_{}", std::process::id());
    let observer = Node::start("observer", &RosArguments::parse([""; 0]).unwrap()).unwrap();
    let rules = [format!("__ns:={namespace}"), format!("__node:={name}")];
    let child = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
        .args(["node", "segmentation", "--ros-args", "-r", &rules[0], "-r", &rules[1]])
        .args(arguments)
        .envs(variables.iter().copied())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let full_name = format!("{namespace}/{name}");
    let topics = async {
        loop {
            let survey = observer.survey();
            let of_node = survey.iter().filter(|one| one.node.as_deref() == Some(&full_name));
            let topics: Vec<String> = of_node.map(|one| one.topic.clone()).collect();
            // Its last publisher of all.
            if topics.iter().any(|topic| topic.ends_with("/transition_event")) {
                return topics;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    let topics = tokio::time::timeout(PATIENCE, topics).await.unwrap();
    let pid = Pid::from_raw(i32::try_from(child.id()).unwrap()).unwrap();
    kill_process(pid, Signal::TERM).unwrap();
    let output = tokio::task::spawn_blocking(move || child.wait_with_output().unwrap());
    let output = output.await.unwrap();
    assert!(output.status.success());
    observer.close().await;
    (output, topics.iter().any(|topic| topic == "/rosout"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_log_goes_where_arguments_and_variables_say() {
    let folder = tempfile::tempdir().unwrap();
    let (output, on_rosout) = seen("plain", &[], &[]).await;
    let lines = String::from_utf8(output.stderr).unwrap();
    assert!(on_rosout && lines.contains(".plain]: parameters: "), "{lines}");
    assert!(!lines.contains("\x1b["), "nobody sees the colours");

    let one = Path::new("1");
    let variables = [("RCUTILS_COLORIZED_OUTPUT", one), ("ROS_LOG_DIR", folder.path())];
    let (output, _) = seen("coloured", &["--log-level", "debug"], &variables).await;
    let lines = String::from_utf8(output.stderr).unwrap();
    assert!(lines.contains("\x1b[32m[DEBUG]"), "{lines}");
    let file = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
    let name = file.file_name().unwrap().to_str().unwrap();
    assert!(name.contains(".coloured_") && name.ends_with(".log"), "{name}");
    let written = std::fs::read_to_string(&file).unwrap();
    assert!(
        written.contains(".coloured]: parameters: ") && !written.contains("\x1b["),
        "{written}"
    );
    std::fs::remove_file(file).unwrap();

    let arguments = ["--disable-stdout-logs", "--disable-rosout-logs", "--log-file-name", "only"];
    let (output, on_rosout) = seen("silent", &arguments, &variables).await;
    assert!(!on_rosout && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    let file = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
    assert!(file.file_name().unwrap().to_str().unwrap().starts_with("only_"), "{file:?}");
    std::fs::remove_file(file).unwrap();

    let arguments = ["--disable-external-lib-logs"];
    seen("without_file", &arguments, &variables).await;
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// Regression: neither variable had an effect.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_log_has_the_form_and_the_stream_of_ros_2s_variables() {
    let variables = [
        ("RCUTILS_CONSOLE_OUTPUT_FORMAT", Path::new("{name}|{severity}|{message} {no}")),
        ("RCUTILS_LOGGING_USE_STDOUT", Path::new("1")),
    ];
    let (output, _) = seen("formed", &[], &variables).await;
    let lines = String::from_utf8(output.stdout).unwrap();
    assert!(lines.contains(".formed|INFO|parameters: ") && lines.contains(" {no}\n"), "{lines}");
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Regression: they were those that the program gives its nodes, whatever the namespace and the names.
#[test]
fn the_nodes_of_one_process_have_the_loggers_of_ros_2() {
    let rules = ["-r", "__ns:=/logs_up", "-r", "segmentation:__node:=left"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
        .args(["up", "--ros-args"])
        .args(rules)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    let mut begins =
        lines.filter_map(|line| Some(line.split_once("]: parameters: ")?.0.to_owned()));
    let mut loggers: Vec<String> =
        begins.by_ref().take(3).map(|begin| begin.rsplit_once('[').unwrap().1.to_owned()).collect();
    let pid = Pid::from_raw(i32::try_from(child.id()).unwrap()).unwrap();
    kill_process(pid, Signal::TERM).unwrap();
    begins.for_each(drop);
    assert!(child.wait().unwrap().success());
    loggers.sort_unstable();
    assert_eq!(loggers, ["logs_up.detection", "logs_up.left", "logs_up.reconstruction"]);
}
