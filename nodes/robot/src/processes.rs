//! Processes that this program starts, this same program with other arguments for the most part, and
//! that do not outlive it.

use std::io::Read;
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStderr, ChildStdout, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::failure::Failure;

/// Set for a process that must not outlive the one that started it, not even one that was killed.
pub const END_WITH_PARENT: &str = "STILLMAP_END_WITH_PARENT";

/// A node ends within a second when it is told to; more than that is a fault, and it is killed.
const LONGEST_END: Duration = Duration::from_secs(5);
/// How often an ending process is looked at.
const LOOK_AGAIN: Duration = Duration::from_millis(10);

/// A process that does not outlive its owner.
pub struct Process {
    name: String,
    child: Child,
}

impl Process {
    /// Starts this program with other arguments.
    pub fn start(name: &str, arguments: &[String], output: Stdio) -> Result<Self, Failure> {
        let mut command = Self::this_program(name)?;
        command.args(arguments).stdout(output);
        Self::spawn(name, command)
    }

    /// This program, for arguments and environment to be added.
    pub fn this_program(name: &str) -> Result<Command, Failure> {
        let program = std::env::current_exe()
            .map_err(|error| Failure::new(format!("cannot start {name}: {error}")))?;
        let mut command = Command::new(program);
        command.env(END_WITH_PARENT, "1");
        Ok(command)
    }

    /// Starts any program.
    pub fn spawn(name: &str, mut command: Command) -> Result<Self, Failure> {
        // A group of its own: Ctrl-C on the terminal is this process' to hear, which then ends the
        // others in order.
        let child = command
            .process_group(0)
            .stdin(Stdio::null())
            .spawn()
            .map_err(|error| Failure::new(format!("cannot start {name}: {error}")))?;
        Ok(Self { name: name.to_owned(), child })
    }

    /// What messages about it call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The number that the system knows it by.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// What it will write on stdout, when that was made a pipe; once.
    pub fn take_stdout(&mut self) -> Option<ChildStdout> {
        self.child.stdout.take()
    }

    /// What it will write on stderr, when that was made a pipe; once.
    pub fn take_stderr(&mut self) -> Option<ChildStderr> {
        self.child.stderr.take()
    }

    /// How it ended, if it has.
    pub fn ended(&mut self) -> Result<Option<ExitStatus>, Failure> {
        self.child
            .try_wait()
            .map_err(|error| Failure::new(format!("cannot watch {}: {error}", self.name)))
    }

    /// What it wrote, once it has ended.
    pub fn output(&mut self) -> Result<String, Failure> {
        let mut text = String::new();
        if let Some(mut output) = self.child.stdout.take() {
            output
                .read_to_string(&mut text)
                .map_err(|error| Failure::new(format!("cannot read {}: {error}", self.name)))?;
        }
        Ok(text)
    }

    /// Asks it to end, and waits until it has.
    pub fn stop(&mut self) -> Result<ExitStatus, Failure> {
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

    /// Ends it with no chance to say good-bye.
    pub fn kill(mut self) -> Result<(), Failure> {
        let unable = |error| Failure::new(format!("cannot kill {}: {error}", self.name));
        self.child.kill().and_then(|()| self.child.wait()).map_err(unable)?;
        Ok(())
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
