//! The packages for colcon and for Debian say what the workspace says, and the tools of ROS 2 take them.

use std::collections::BTreeSet;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};

use crate::python::python_with;

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The text of the first element of a name.
fn element<'a>(xml: &'a str, name: &str) -> &'a str {
    let rest = xml.split(&format!("<{name}>")).nth(1).unwrap_or_else(|| panic!("no <{name}>"));
    rest.split(&format!("</{name}>")).next().unwrap()
}

#[test]
fn packages_say_what_the_workspace_says() {
    let workspace = read("Cargo.toml");
    let value = |key: &str| {
        let line = workspace.lines().find(|line| line.starts_with(&format!("{key} = "))).unwrap();
        line.split('"').nth(1).unwrap().to_owned()
    };
    for (folder, name) in [("msgs", "stillmap_msgs"), ("nodes/stillmap", "stillmap")] {
        let package = read(&format!("{folder}/package.xml"));
        assert!(package.contains("<package format=\"3\">"), "{folder}");
        assert_eq!(element(&package, "name"), name);
        assert_eq!(element(&package, "version"), value("version"));
        assert_eq!(element(&package, "license"), value("license"));
        let cmake = read(&format!("{folder}/CMakeLists.txt"));
        assert!(cmake.contains(&format!("project({name}")), "{folder}");
    }
    // What the messages are made of is what their package depends on.
    let (package, cmake) = (read("msgs/package.xml"), read("msgs/CMakeLists.txt"));
    let mut needed = BTreeSet::new();
    let folders = ["msgs/msg/stillmap_msgs", "msgs/srv/stillmap_msgs"];
    for file in folders.into_iter().flat_map(|folder| std::fs::read_dir(root(folder)).unwrap()) {
        let text = std::fs::read_to_string(file.unwrap().path()).unwrap();
        let types =
            text.lines().filter_map(|line| line.split('#').next()?.split_whitespace().next());
        needed.extend(types.filter_map(|name| Some(name.split_once('/')?.0.to_owned())));
    }
    needed.remove("stillmap_msgs");
    for name in &needed {
        assert!(package.contains(&format!("<depend>{name}</depend>")), "{name}");
        assert!(cmake.contains(&format!("find_package({name} REQUIRED)")), "{name}");
    }
    // The programs that colcon installs are those of the workspace, all of them.
    let cmake = read("nodes/stillmap/CMakeLists.txt");
    let installed = cmake.split("set(programs ").nth(1).unwrap().split(')').next().unwrap();
    let installed: BTreeSet<String> = installed.split(' ').map(str::to_owned).collect();
    assert_eq!(installed, programs());
    // The wheel has the version of its crate.
    let python = read("nodes/python/pyproject.toml");
    assert!(python.contains("dynamic = [\"version\"]"));
    assert!(python.contains(&format!("license = \"{}\"", value("license"))));
    // A robot needs no laboratory.
    assert!(cmake.contains("--no-default-features"));
    let debian = read(".ci/package");
    assert!(debian.contains("-p stillmap --no-default-features && .ci/package "));
}

/// What the package for Debian may weigh, uncompressed by the test: a debug build is larger than a release.
const MOST_INSTALLED_BYTES: u64 = 100_000_000;

/// The package for Debian, of the program under test, unpacked into another root: the program starts there, and what is installed
/// beside it is what the repository has.
#[test]
fn the_package_for_debian_unpacks_to_a_program_that_starts() {
    if Command::new("dpkg-shlibdeps").arg("--version").output().is_err() {
        assert_ne!(std::env::var("CI").as_deref(), Ok("true"), "dpkg-dev is missing");
        println!("skipped: dpkg-shlibdeps is not here (.ci/install_peers installs it)");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let made = Command::new(root(".ci/package"))
        .args([env!("CARGO_BIN_EXE_stillmap-under-test").as_ref(), folder.path()])
        // What takes half a minute is the compression.
        .env("DPKG_DEB_COMPRESSOR_TYPE", "none")
        .output()
        .unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let package = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
    let name = package.file_name().unwrap().to_str().unwrap();
    let version = env!("CARGO_PKG_VERSION");
    assert!(name.starts_with(&format!("stillmap_{version}_")) && name.ends_with(".deb"), "{name}");
    let bytes = std::fs::metadata(&package).unwrap().len();
    assert!(bytes < MOST_INSTALLED_BYTES, "{bytes}");
    let installed = folder.path().join("installed");
    let unpacked = Command::new("dpkg-deb").arg("-x").args([&package, &installed]).status();
    assert!(unpacked.unwrap().success());
    let said = Command::new(installed.join("usr/bin/stillmap")).arg("--version").output().unwrap();
    assert_eq!(String::from_utf8(said.stdout).unwrap(), format!("stillmap {version}\n"));

    let same = |path: &str, original: &str| {
        let bytes = |path: &Path| {
            std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
        };
        assert!(bytes(&installed.join(path)) == bytes(&root(original)), "{path}");
    };
    same("usr/lib/systemd/system/stillmap.service", "config/systemd/stillmap.service");
    same("usr/lib/sysctl.d/60-stillmap.conf", "config/sysctl/60-stillmap.conf");
    same("usr/share/stillmap/config/pipeline.yaml", "config/pipeline.yaml");
    // It looks for its parameters beside its own folder.
    same("usr/share/stillmap/launch-scripts/robot.launch.py", "launch-scripts/robot.launch.py");
    for file in [
        "man/man1/stillmap.1.gz",
        "man/man1/stillmap-run.1.gz",
        "bash-completion/completions/stillmap",
        "zsh/vendor-completions/_stillmap",
        "fish/vendor_completions.d/stillmap.fish",
        "doc/stillmap/copyright",
    ] {
        let file = installed.join("usr/share").join(file);
        assert!(std::fs::metadata(&file).is_ok_and(|file| file.len() > 100), "{}", file.display());
    }
    // An upgraded service went on as the former program, and a removed one was started without end.
    let scripts = folder.path().join("scripts");
    let taken = Command::new("dpkg-deb").arg("-e").args([&package, &scripts]).status();
    assert!(taken.unwrap().success());
    for (script, does) in [
        ("postinst", "systemctl try-restart stillmap.service"),
        ("prerm", "systemctl stop stillmap.service"),
        ("postrm", "systemctl daemon-reload"),
    ] {
        let text = std::fs::read_to_string(scripts.join(script)).unwrap();
        assert!(text.contains(does), "{script}");
    }
    // The service's user is one that the package makes.
    let service = read("config/systemd/stillmap.service");
    let user = service.split("\nUser=").nth(1).unwrap().lines().next().unwrap();
    let users = installed.join("usr/lib/sysusers.d/stillmap.conf");
    assert!(std::fs::read_to_string(users).unwrap().starts_with(&format!("u {user} ")));
}

/// The programs of the workspace.
fn programs() -> BTreeSet<String> {
    let mut programs = BTreeSet::new();
    for folder in std::fs::read_dir(root("nodes")).unwrap() {
        let manifest = folder.unwrap().path().join("Cargo.toml");
        let Ok(manifest) = std::fs::read_to_string(manifest) else { continue };
        let names = manifest.split("[[bin]]\nname = \"").skip(1);
        programs.extend(names.map(|rest| rest.split('"').next().unwrap().to_owned()));
    }
    programs
}

/// Where Debian has the CMake of ROS 2.
const AMENT: &str = "/usr/share/ament_cmake/cmake/ament_cmakeConfig.cmake";
/// The Python that goes with it.
const PYTHON: &str = "/usr/bin/python3";

/// The CMake of ROS 2 builds the package, and installs what `ros2 run` and `ros2 launch` look for. What cargo builds is not
/// this test's: a stand-in makes files of those names.
#[test]
fn ament_cmake_builds_and_installs_the_suite() {
    if !Path::new(AMENT).is_file() {
        assert_ne!(std::env::var("CI").as_deref(), Ok("true"), "ament_cmake is missing");
        println!("skipped: ament_cmake is not here (.ci/install_peers installs it)");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let [cargo, build, installed] =
        ["cargo", "build", "install"].map(|name| folder.path().join(name));
    let names: Vec<String> = programs().into_iter().collect();
    let script = format!(
        "#!/bin/sh\nwhile [ $# -gt 0 ]; do case $1 in --target-dir) target=$2;; esac; shift; done\n\
         mkdir -p \"$target/release\" && cd \"$target/release\" && touch {}\n",
        names.join(" ")
    );
    std::fs::write(&cargo, script).unwrap();
    std::fs::set_permissions(&cargo, std::fs::Permissions::from_mode(0o755)).unwrap();
    let cmake = |arguments: &[&str]| {
        let output = Command::new("cmake").args(arguments).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "cmake {arguments:?}: {stderr}");
    };
    let (source, build) = (root("nodes/stillmap"), build.to_str().unwrap());
    let cargo = format!("-DCARGO={}", cargo.display());
    let prefix = format!("-DCMAKE_INSTALL_PREFIX={}", installed.display());
    let python = format!("-DPython3_EXECUTABLE={PYTHON}");
    cmake(&["-S", source.to_str().unwrap(), "-B", build, &cargo, &prefix, &python]);
    cmake(&["--build", build]);
    cmake(&["--install", build]);
    for name in names {
        let program = installed.join("lib/stillmap").join(&name);
        let mode = std::fs::metadata(&program).unwrap_or_else(|_| panic!("{name}")).permissions();
        assert_eq!(mode.mode() & 0o111, 0o111, "{name}");
    }
    let share = installed.join("share/stillmap");
    for name in ["package.xml", "launch-scripts/robot.launch.py", "config/detection.yaml"] {
        assert!(share.join(name).is_file(), "{name}");
    }
    assert!(installed.join("share/ament_index/resource_index/packages/stillmap").is_file());
}

/// As colcon reads them.
#[test]
fn catkin_pkg_takes_the_packages() {
    let Some(python) = python_with("catkin_pkg") else { return };
    let script = "import json, sys\n\
                  from catkin_pkg.package import parse_package\n\
                  for folder in sys.argv[1:]:\n\
                  \x20   warnings = []\n\
                  \x20   package = parse_package(folder, warnings=warnings)\n\
                  \x20   print(json.dumps([package.name, package.get_build_type(), warnings]))\n";
    let folders = ["nodes/stillmap", "msgs"].map(root);
    let output = Command::new(python).args(["-B", "-c", script]).args(folders).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    let told = String::from_utf8(output.stdout).unwrap();
    let told: Vec<Value> = told.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let package = |name| json!([name, "ament_cmake", []]);
    assert_eq!(told, [package("stillmap"), package("stillmap_msgs")]);
}

/// The generators of ROS 2 itself take the messages.
#[test]
fn rosidl_takes_the_messages() {
    let script = "import pathlib, sys\n\
                  from rosidl_adapter.msg import convert_msg_to_idl\n\
                  from rosidl_adapter.srv import convert_srv_to_idl\n\
                  from rosidl_parser.definition import IdlLocator\n\
                  from rosidl_parser.parser import parse_idl_file\n\
                  base, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])\n\
                  for kind, convert in (('msg', convert_msg_to_idl), ('srv', convert_srv_to_idl)):\n\
                  \x20   for path in sorted((base / kind).glob(f'stillmap_msgs/*.{kind}')):\n\
                  \x20       package = path.parent.name\n\
                  \x20       convert(path.parent, package, pathlib.Path(path.name), out / package / kind)\n\
                  \x20       parse_idl_file(IdlLocator(out, pathlib.Path(package) / kind / f'{path.stem}.idl'))\n\
                  \x20       print(path.stem)\n";
    let python = ["/usr/bin/python3", "python3"].into_iter().find(|python| {
        let asked =
            Command::new(python).args(["-c", "import rosidl_adapter, rosidl_parser"]).output();
        asked.is_ok_and(|output| output.status.success())
    });
    let Some(python) = python else {
        println!("skipped: rosidl is not here (Debian: python3-rosidl)");
        return;
    };
    let out = tempfile::tempdir().unwrap();
    let output = Command::new(python)
        .args(["-B", "-c", script])
        .arg(root("msgs").canonicalize().unwrap())
        .arg(out.path())
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    let told = String::from_utf8(output.stdout).unwrap();
    let messages = ["DynamicZones", "ReducedCloud", "SegmentedCloud", "StageReport", "Tracks"];
    let services = ["GetDistances", "GetDistanceField"];
    for name in messages.into_iter().chain(services) {
        assert!(told.lines().any(|line| line == name), "{name}: {told}");
    }
}
