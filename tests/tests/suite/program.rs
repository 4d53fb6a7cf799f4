//! The program under test as a process.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Output, Stdio};

use rustix::process::{Pid, Signal, kill_process};

/// Runs the program to its end.
pub(crate) fn stillmap<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

/// Runs the program to its end on a DDS domain.
pub(crate) fn stillmap_with_domain<A: AsRef<OsStr>>(
    domain: &str,
    arguments: impl IntoIterator<Item = A>,
) -> Output {
    Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
        .args(arguments)
        .env("ROS_DOMAIN_ID", domain)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

/// Runs the program, which must succeed; returns what it printed.
pub(crate) fn succeed<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>) -> String {
    let output = stillmap(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}\n{stderr}", output.status);
    String::from_utf8(output.stdout).unwrap()
}

/// The summary that a run left.
pub(crate) fn summary(out: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap()
}

/// A process that runs until it is told to end, and never longer than the test.
pub(crate) struct Running {
    child: Child,
}

impl Running {
    pub(crate) fn start<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>) -> Self {
        Self::spawn(Command::new(env!("CARGO_BIN_EXE_stillmap-under-test")).args(arguments))
    }

    /// The same, without a cycle that is dropped for a newer one, however slow the machine is.
    pub(crate) fn start_for_every_cycle<A: AsRef<OsStr>>(
        arguments: impl IntoIterator<Item = A>,
    ) -> Self {
        let (variable, value) = node_shell::EVERY_CYCLE;
        let mut program = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"));
        Self::spawn(program.args(arguments).env(variable, value))
    }

    /// The same as it is without cargo, whose configuration for tests has every cycle taken: live, the newest count. With its log in a
    /// file.
    pub(crate) fn start_live<A: AsRef<OsStr>>(
        log: &Path,
        arguments: impl IntoIterator<Item = A>,
    ) -> Self {
        let (variable, _) = node_shell::EVERY_CYCLE;
        let mut program = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"));
        let log = std::fs::File::create(log).unwrap();
        Self::spawn(program.args(arguments).env_remove(variable).stderr(log))
    }

    /// The same on a DDS domain.
    pub(crate) fn start_on<A: AsRef<OsStr>>(
        domain_id: u16,
        arguments: impl IntoIterator<Item = A>,
    ) -> Self {
        let domain_id = domain_id.to_string();
        let mut program = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"));
        Self::spawn(program.args(arguments).env("ROS_DOMAIN_ID", domain_id))
    }

    /// The same with its log in a file.
    pub(crate) fn start_on_with_log<A: AsRef<OsStr>>(
        domain_id: u16,
        log: &Path,
        arguments: impl IntoIterator<Item = A>,
    ) -> Self {
        let domain_id = domain_id.to_string();
        let log = std::fs::File::create(log).unwrap();
        let mut program = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"));
        Self::spawn(program.args(arguments).env("ROS_DOMAIN_ID", domain_id).stderr(log))
    }

    /// The same with the current folder of a service.
    pub(crate) fn start_in<A: AsRef<OsStr>>(
        folder: &Path,
        domain_id: u16,
        arguments: impl IntoIterator<Item = A>,
    ) -> Self {
        let mut program = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"));
        let domain_id = domain_id.to_string();
        Self::spawn(program.args(arguments).env("ROS_DOMAIN_ID", domain_id).current_dir(folder))
    }

    /// Starts it and waits until it prints a line on stderr with `before`: what follows there is the other result.
    pub(crate) fn start_and_hear<A: AsRef<OsStr>>(
        arguments: impl IntoIterator<Item = A>,
        before: &str,
    ) -> (Self, String) {
        let mut program = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"));
        let mut running = Self::spawn(program.args(arguments).stderr(Stdio::piped()));
        let mut lines = BufReader::new(running.child.stderr.take().unwrap()).lines();
        let told = |line: std::io::Result<String>| {
            line.unwrap().split_once(before).map(|(_, said)| said.to_owned())
        };
        let said = lines.by_ref().find_map(told).unwrap();
        // The log goes on.
        std::thread::spawn(move || lines.for_each(drop));
        (running, said)
    }

    pub(crate) fn spawn(program: &mut Command) -> Self {
        let child = program.stdin(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
        Self { child }
    }

    /// Whether it runs still.
    pub(crate) fn is_up(&mut self) -> bool {
        self.child.try_wait().unwrap().is_none()
    }

    /// Waits until it ends by itself.
    pub(crate) fn wait(mut self) -> ExitStatus {
        self.child.wait().unwrap()
    }

    /// Kills it, with no chance to say good-bye.
    pub(crate) fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Asks it to end as a shell does, and returns whether it ended well.
    pub(crate) fn interrupt(self) -> bool {
        self.end(Signal::INT).success()
    }

    /// Asks it to end twice, as `ros2 launch` does on Ctrl-C, and returns whether it ended well.
    pub(crate) fn interrupt_twice(self) -> bool {
        self.signal(Signal::INT);
        // What launch was seen to take until its own signal.
        std::thread::sleep(std::time::Duration::from_millis(5));
        self.interrupt()
    }

    /// Sends it a signal, and waits for its end.
    pub(crate) fn end(mut self, signal: Signal) -> ExitStatus {
        self.signal(signal);
        self.child.wait().unwrap()
    }

    pub(crate) fn signal(&self, signal: Signal) {
        let pid = Pid::from_raw(i32::try_from(self.child.id()).unwrap()).unwrap();
        kill_process(pid, signal).unwrap();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
