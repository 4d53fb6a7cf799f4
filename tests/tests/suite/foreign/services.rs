//! A service of ours, asked by clients of other makes: each wants to be answered in its own way.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Stdio;

use msgs::std_srvs::{SetBool, SetBoolResponse};
use node_shell::Service;
use tokio::process::Command;
use tokio::time::timeout;

use super::build::{Make, program};
use super::fresh_clients::fresh_processes;
use super::place::{PATIENCE, Place};

/// How often each of the two clients asks.
const TIMES: usize = 6;

/// Answers every request with what it asked for, and a message of any length modulo 4.
async fn serve(service: &Service<SetBool>) {
    for count in 0.. {
        let request = service.next().await;
        let success = request.message.data;
        let message = "answered"[..4 + count % 4].to_owned();
        request.respond(&SetBoolResponse { success, message }).unwrap();
    }
}

/// Lets a program's two clients ask, again and again in a fresh process: the second one for `true`.
async fn clients_are_answered(place: Place, mut client: Command) {
    let node = place.node("ours");
    let service = node.service::<SetBool>("~/switch").unwrap();
    let domain_id = place.domain_id().to_string();
    client.args([&domain_id, service.name(), &TIMES.to_string()]);
    client.stdin(Stdio::null()).stderr(Stdio::inherit()).kill_on_drop(true);
    for _ in 0..fresh_processes() {
        let output = tokio::select! {
            () = serve(&service) => None,
            output = timeout(PATIENCE, client.output()) => Some(output.expect("the clients end in time").unwrap()),
        };
        let output = output.expect("the service serves until the clients end");
        assert!(output.status.success(), "{}", output.status);
        each_is_answered(String::from_utf8(output.stdout).unwrap());
    }
    drop(service);
    node.close().await;
}

fn each_is_answered(answers: String) {
    let answers: Vec<Vec<&str>> = answers.lines().map(|line| line.split(' ').collect()).collect();
    assert_eq!(answers.len(), 2 * TIMES);
    for (count, answer) in answers.iter().enumerate() {
        let (client, success) = if count % 2 == 0 { ("0", "false") } else { ("1", "true") };
        assert_eq!(answer[..3], ["answer", client, success], "{answer:?}");
        assert!(answer[3].len() >= 4 && "answered".starts_with(answer[3]), "{answer:?}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn cyclone_clients_are_answered() {
    let place = Place::new().await;
    let Some(python) = program(Make::CyclonePython) else { return };
    let mut client = Command::new(python.path);
    client.arg("-B").arg(sources().join("cyclone_python/ask.py"));
    clients_are_answered(place, client).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn fast_dds_clients_are_answered() {
    let place = Place::new().await;
    // Whether there is what it takes to build one.
    if program(Make::FastDds).is_none() {
        return;
    }
    clients_are_answered(place, Command::new(fast_dds_client("ask").await)).await;
}

fn sources() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/peers"))
}

/// A client on Fast DDS (`tests/peers/fastdds`), built unless that was done from the very same sources.
pub(super) async fn fast_dds_client(name: &str) -> PathBuf {
    let folder =
        Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("peers/fastdds_client_{name}"));
    fs::create_dir_all(&folder).unwrap();
    let lock = File::create(folder.join("lock")).unwrap();
    lock.lock().unwrap();

    let sources = sources().join("fastdds");
    let text = |name: &str| fs::read_to_string(sources.join(name)).unwrap();
    let source = format!("{name}.cpp");
    let built_from = ["set_bool.idl", "client.hpp", &source].map(text).concat();
    let (program, record) = (folder.join(name), folder.join("built-from"));
    if fs::read_to_string(&record).ok().as_ref() != Some(&built_from) || !program.is_file() {
        // Whatever stops the build, the next one must not believe it was done.
        fs::write(&record, "").unwrap();
        fs::write(folder.join("set_bool.idl"), text("set_bool.idl")).unwrap();
        run(Command::new("fastddsgen").args(["-replace", "set_bool.idl"]).current_dir(&folder))
            .await;
        run(Command::new("g++")
            .args(["-std=c++17", "-Wall", "-O1", "-I."])
            .args([sources.join(&source).as_path(), Path::new("-o"), &program])
            .args(["-lfastrtps", "-lfastcdr", "-lpthread"])
            .current_dir(&folder))
        .await;
        fs::write(&record, built_from).unwrap();
    }
    program
}

async fn run(command: &mut Command) {
    let output = command.stdin(Stdio::null()).output().await.unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{command:?}: {}\n{stdout}{stderr}", output.status);
}
