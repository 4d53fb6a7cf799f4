//! The processes of a run: the nodes and the player, each this same program.

use std::io::Read;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::END_WITH_PARENT;
use crate::failure::Failure;

/// A node ends within a second when it is told to; more than that is a fault, and it is killed.
const LONGEST_END: Duration = Duration::from_secs(5);
/// How often an ending process is looked at.
const LOOK_AGAIN: Duration = Duration::from_millis(10);

/// A process that does not outlive its owner.
pub(super) struct Process {
    name: String,
    child: Child,
}

impl Process {
    /// Starts this program with other arguments.
    pub(super) fn start(name: &str, arguments: &[String], output: Stdio) -> Result<Self, Failure> {
        let start = || {
            Command::new(std::env::current_exe()?)
                .args(arguments)
                // A group of its own: Ctrl-C on the terminal is this process' to hear, which then ends the
                // others in order. Told twice, a node would end at once and leave its work undone.
                .process_group(0)
                .env(END_WITH_PARENT, "1")
                .stdin(Stdio::null())
                .stdout(output)
                .spawn()
        };
        let child =
            start().map_err(|error| Failure::new(format!("cannot start {name}: {error}")))?;
        Ok(Self { name: name.to_owned(), child })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// How it ended, if it has.
    pub(super) fn ended(&mut self) -> Result<Option<ExitStatus>, Failure> {
        self.child
            .try_wait()
            .map_err(|error| Failure::new(format!("cannot watch {}: {error}", self.name)))
    }

    /// What it wrote, once it has ended.
    pub(super) fn output(&mut self) -> Result<String, Failure> {
        let mut text = String::new();
        if let Some(mut output) = self.child.stdout.take() {
            output
                .read_to_string(&mut text)
                .map_err(|error| Failure::new(format!("cannot read {}: {error}", self.name)))?;
        }
        Ok(text)
    }

    /// Asks it to end, and waits until it has.
    pub(super) fn stop(&mut self) -> Result<ExitStatus, Failure> {
        if let Some(status) = self.ended()? {
            return Ok(status);
        }
        self.signal(Signal::TERM);
        let deadline = Instant::now() + LONGEST_END;
        while Instant::now() < deadline {
            if let Some(status) = self.ended()? {
                return Ok(status);
            }
            std::thread::sleep(LOOK_AGAIN);
        }
        let unable = |error| Failure::new(format!("cannot end {}: {error}", self.name));
        self.child.kill().and_then(|()| self.child.wait()).map_err(unable)
    }

    fn signal(&self, signal: Signal) {
        let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        if let Some(pid) = pid {
            // It fails only for a process that has ended, which is what is wanted.
            let _ = kill_process(pid, signal);
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Nobody is left to hear of a failure here; a process that has ended already is no fault.
        let _ = self.stop();
    }
}
