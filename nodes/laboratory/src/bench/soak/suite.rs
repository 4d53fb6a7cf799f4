//! The suite that is watched, a process of `stillmap up`, and what it holds.

use std::collections::VecDeque;
use std::process::Stdio;
use std::time::Instant;

use robot::{Failure, Process};

use super::super::transport::pipe::{self, Lines};
use super::super::usage::{Usage, descriptors_of, threads_of};
use super::SoakArgs;

/// What a process holds at one time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Held {
    pub(super) at: Instant,
    /// CPU time so far, on all cores.
    pub(super) cpu_s: f64,
    pub(super) rss_bytes: u64,
    pub(super) descriptors: usize,
    pub(super) threads: usize,
}

/// The running suite; it is stopped when this is dropped.
pub(super) struct Suite {
    process: Process,
    trouble: Lines<VecDeque<String>>,
    /// With the map file; removed at the end.
    _folder: tempfile::TempDir,
}

impl Suite {
    pub(super) fn start(args: &SoakArgs, namespace: &str) -> Result<Self, Failure> {
        let folder = tempfile::tempdir()
            .map_err(|error| Failure::new(format!("cannot make a folder for the map: {error}")))?;
        let map_file = folder.path().join("map.ply");
        let mut command = Process::this_program("the suite")?;
        command.args(["up", "--map-edge", &args.map_edge.to_string(), "--view", "127.0.0.1:0"]);
        command.args(["--ros-args", "--log-level", "warn", "-r", &format!("__ns:={namespace}")]);
        command.args(["-r", &format!("/diagnostics:={namespace}/diagnostics")]);
        for parameter in [
            format!("max_map_blocks:={}", args.max_map_blocks),
            "at_max_voxels:=drop_oldest".to_owned(),
            "grid:=height_band".to_owned(),
            format!("map_file:={}", map_file.display()),
        ] {
            command.args(["-p", &format!("reconstruction:{parameter}")]);
        }
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = Process::spawn("the suite", command)?;
        let trouble = pipe::last_lines(process.take_stderr());
        Ok(Self { process, trouble, _folder: folder })
    }

    /// What it holds now.
    ///
    /// # Errors
    /// When it has ended, or the system does not tell.
    pub(super) fn held(&mut self) -> Result<Held, Failure> {
        if let Some(status) = self.process.ended()? {
            return Err(Failure::new(format!("the suite has ended: {status}")));
        }
        let id = self.process.id();
        let held = || {
            let usage = Usage::of(id)?;
            Some(Held {
                at: Instant::now(),
                cpu_s: usage.cpu_s,
                rss_bytes: usage.rss_bytes?,
                descriptors: descriptors_of(id)?,
                threads: threads_of(id)?,
            })
        };
        held().ok_or_else(|| Failure::new("this system does not tell what a process holds"))
    }

    /// Ends it in order.
    pub(super) fn stop(mut self) -> Result<(), Failure> {
        let status = self.process.stop()?;
        if status.success() {
            return Ok(());
        }
        let last: Vec<String> = self.trouble.finish().into();
        Err(Failure::new(format!("the suite ended with {status}: {}", last.join("; "))))
    }
}
