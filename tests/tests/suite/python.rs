//! A Python with what some tests ask for.

use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Stdio};

/// Where one is.
const PYTHON: &str = "STILLMAP_TEST_PYTHON";
/// Where `.ci/install_peers` puts one, beside the folder of the tests' own files.
const ENVIRONMENT: &str = "peers-venv/bin/python3";

/// A Python with a package; `None`, and a line that says so, where it cannot be had.
pub(crate) fn python_with(package: &str) -> Option<OsString> {
    let mut candidates = vec![
        Path::new(env!("CARGO_TARGET_TMPDIR")).join("..").join(ENVIRONMENT).into_os_string(),
        "python3".into(),
    ];
    if let Some(given) = std::env::var_os(PYTHON) {
        candidates = vec![given];
    }
    let code = format!("from importlib.metadata import version; version('{package}')");
    let has_it = |python: &OsString| {
        let mut command = Command::new(python);
        command.args(["-c", &code]).stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    let found = candidates.into_iter().find(has_it);
    if found.is_none() {
        assert_ne!(
            std::env::var("CI").as_deref(),
            Ok("true"),
            "a Python with {package} is missing"
        );
        println!("skipped: no Python with {package} is here (.ci/install_peers installs it)");
    }
    found
}
