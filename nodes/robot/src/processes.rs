//! Child processes of this program, mostly the same program with other arguments, which end when it ends.

use std::io::Read;
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStderr, ChildStdout, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::failure::Failure;

/// Environment variable of a child process that must end with its parent, even if the parent was killed.
pub const END_WITH_PARENT: &str = "STILLMAP_END_WITH_PARENT";

/// A node ends within a second after SIGTERM; one that takes longer than this is killed.
const LONGEST_STOP: Duration = Duration::from_secs(5);
/// How often a stopping process is checked.
const POLL_PERIOD: Duration = Duration::from_millis(10);

/// A child process, which is stopped when this is dropped.
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

    /// A command that starts this program; arguments and environment are to be added.
    pub fn this_program(name: &str) -> Result<Command, Failure> {
        let program = std::env::current_exe()
            .map_err(|error| Failure::new(format!("cannot start {name}: {error}")))?;
        let mut command = Command::new(program);
        command.env(END_WITH_PARENT, "1");
        Ok(command)
    }

    /// Starts any program.
    pub fn spawn(name: &str, mut command: Command) -> Result<Self, Failure> {
        // A process group of its own: Ctrl-C on the terminal signals only this process, which then stops the others in
        // order.
        let child = command
            .process_group(0)
            .stdin(Stdio::null())
            .spawn()
            .map_err(|error| Failure::new(format!("cannot start {name}: {error}")))?;
        Ok(Self { name: name.to_owned(), child })
    }

    /// Its name in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Its stdout, if that is a pipe; `None` when called again.
    pub fn take_stdout(&mut self) -> Option<ChildStdout> {
        self.child.stdout.take()
    }

    /// Its stderr, if that is a pipe; `None` when called again.
    pub fn take_stderr(&mut self) -> Option<ChildStderr> {
        self.child.stderr.take()
    }

    /// Its exit status, if it has ended.
    pub fn ended(&mut self) -> Result<Option<ExitStatus>, Failure> {
        self.child
            .try_wait()
            .map_err(|error| Failure::new(format!("cannot watch {}: {error}", self.name)))
    }

    /// What it wrote on stdout; to be called after it has ended.
    pub fn output(&mut self) -> Result<String, Failure> {
        let mut text = String::new();
        if let Some(mut output) = self.child.stdout.take() {
            output
                .read_to_string(&mut text)
                .map_err(|error| Failure::new(format!("cannot read {}: {error}", self.name)))?;
        }
        Ok(text)
    }

    /// Sends SIGTERM, and waits until it has ended; kills it if that takes too long.
    pub fn stop(&mut self) -> Result<ExitStatus, Failure> {
        self.stop_within(LONGEST_STOP)
    }

    /// The same for one that has more to do at its end.
    pub(crate) fn stop_within(&mut self, longest: Duration) -> Result<ExitStatus, Failure> {
        if let Some(status) = self.ended()? {
            return Ok(status);
        }
        self.signal(Signal::TERM);
        let deadline = Instant::now() + longest;
        while Instant::now() < deadline {
            if let Some(status) = self.ended()? {
                return Ok(status);
            }
            std::thread::sleep(POLL_PERIOD);
        }
        let unable = |error| Failure::new(format!("cannot stop {}: {error}", self.name));
        self.child.kill().and_then(|()| self.child.wait()).map_err(unable)
    }

    /// Ends it with SIGKILL.
    pub fn kill(mut self) -> Result<(), Failure> {
        let unable = |error| Failure::new(format!("cannot kill {}: {error}", self.name));
        self.child.kill().and_then(|()| self.child.wait()).map_err(unable)?;
        Ok(())
    }

    fn signal(&self, signal: Signal) {
        let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        if let Some(pid) = pid {
            // It fails only if the process has ended already.
            let _ = kill_process(pid, signal);
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // A failure cannot be reported here.
        let _ = self.stop();
    }
}
