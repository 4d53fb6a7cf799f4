//! Builds the peers, once, from the messages' definitions and the sources in `tests/peers`.

use std::ffi::OsString;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::definitions::Definitions;
use super::idl;

/// What a peer is made with.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Make {
    /// Cyclone DDS in C.
    Cyclone,
    /// Its Python package.
    CyclonePython,
    /// Fast DDS in C++.
    FastDds,
}

/// How to start a peer.
pub(crate) struct Program {
    pub(crate) path: PathBuf,
    /// What stands before the peer's own arguments.
    pub(crate) arguments: Vec<OsString>,
}

/// Where a Python with `cyclonedds` is.
const PYTHON: &str = "STILLMAP_TEST_PYTHON";
/// Where `.ci/install_peers` puts one, beside the folder of the tests' own files.
const PYTHON_ENVIRONMENT: &str = "peers-venv/bin/python3";

/// The peer's program; `None`, and a line that says what is missing, where it cannot be had.
pub(crate) fn program(make: Make) -> Option<Program> {
    let found = match make {
        Make::Cyclone => cyclone(),
        Make::FastDds => fast_dds(),
        Make::CyclonePython => python(),
    };
    match found {
        Ok(program) => Some(program),
        Err(missing) => {
            assert_ne!(
                std::env::var("CI").as_deref(),
                Ok("true"),
                "{make:?}: {missing} is missing"
            );
            println!("skipped: what is exchanged with {make:?} is not shown, {missing} is missing");
            println!("(.ci/install_peers installs it)");
            None
        }
    }
}

fn cyclone() -> Result<Program, String> {
    need(Command::new("idlc").arg("-h"), "idlc (Debian: cyclonedds-tools)")?;
    need_header("cc", "dds/dds.h", "the C library (Debian: gcc, cyclonedds-dev)")?;
    built("cyclone", "peer.c", |folder, source, program| {
        run(Command::new("idlc").args(["-l", "c", "messages.idl"]).current_dir(folder));
        run(Command::new("cc")
            .args(["-std=c11", "-D_GNU_SOURCE", "-Wall", "-Wextra", "-Werror", "-O1", "-I."])
            .args([source, Path::new("messages.c"), Path::new("-o"), program])
            .args(["-lddsc", "-lpthread"])
            .current_dir(folder));
    })
}

fn fast_dds() -> Result<Program, String> {
    need(Command::new("fastddsgen").arg("-version"), "fastddsgen (Debian: fastddsgen)")?;
    let header = "fastdds/dds/domain/DomainParticipant.hpp";
    need_header("g++", header, "the C++ library (Debian: g++, libfastrtps-dev)")?;
    built("fastdds", "peer.cpp", |folder, source, program| {
        run(Command::new("fastddsgen").args(["-replace", "messages.idl"]).current_dir(folder));
        run(Command::new("g++")
            .args(["-std=c++17", "-Wall", "-O1", "-I."])
            .args([source, Path::new("-o"), program])
            .args(["-lfastrtps", "-lfastcdr", "-lpthread"])
            .current_dir(folder));
    })
}

fn python() -> Result<Program, String> {
    let mut candidates = vec![
        Path::new(env!("CARGO_TARGET_TMPDIR")).join("..").join(PYTHON_ENVIRONMENT),
        PathBuf::from("python3"),
    ];
    if let Some(given) = std::env::var_os(PYTHON) {
        candidates = vec![given.into()];
    }
    let missing = format!("a Python with the package cyclonedds (name it in {PYTHON})");
    let found = candidates
        .into_iter()
        .find(|python| {
            need(Command::new(python).args(["-c", "import cyclonedds.domain"]), "").is_ok()
        })
        .ok_or(missing)?;
    // `-B`: no byte code into the source tree.
    let script = sources().join("cyclone_python/peer.py").into_os_string();
    Ok(Program { path: found, arguments: vec!["-B".into(), script] })
}

fn sources() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/peers"))
}

/// Builds a peer unless that was done from the very same sources. Tests run at once and so do test
/// runs: one of them builds, under a lock.
fn built(
    name: &str,
    source: &str,
    build: impl FnOnce(&Path, &Path, &Path),
) -> Result<Program, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("peers").join(name);
    fs::create_dir_all(&folder).unwrap();
    let lock = File::create(folder.join("lock")).unwrap();
    lock.lock().unwrap();

    let definitions = Definitions::read();
    let source = sources().join(name).join(source);
    let (idl, table) = (idl::idl(&definitions), idl::table(&definitions));
    let built_from =
        [&idl, &table, &fs::read_to_string(&source).unwrap()].map(String::as_str).concat();
    let (program, record) = (folder.join("peer"), folder.join("built-from"));
    if fs::read_to_string(&record).ok().as_ref() != Some(&built_from) || !program.is_file() {
        // Whatever stops the build, the next one must not believe it was done.
        fs::write(&record, "").unwrap();
        fs::write(folder.join("messages.idl"), idl).unwrap();
        fs::write(folder.join("messages.def"), table).unwrap();
        build(&folder, &source, &program);
        fs::write(&record, built_from).unwrap();
    }
    Ok(Program { path: program, arguments: Vec::new() })
}

fn need(command: &mut Command, what: &str) -> Result<(), String> {
    let status = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    match status {
        Ok(status) if status.success() => Ok(()),
        _ => Err(what.to_owned()),
    }
}

fn need_header(compiler: &str, header: &str, what: &str) -> Result<(), String> {
    let language = if compiler == "cc" { "c" } else { "c++" };
    need(Command::new(compiler).args(["-x", language, "-E", "-include", header, "/dev/null"]), what)
}

fn run(command: &mut Command) {
    let output = command.stdin(Stdio::null()).output().unwrap();
    assert!(
        output.status.success(),
        "{command:?}: {}\n{}{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}
