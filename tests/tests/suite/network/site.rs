//! Machines that a test makes: network namespaces joined by veth pairs.
//!
//! A namespace has no name. It lives as long as the process that holds it, and that process ends when
//! the pipe from the test to it closes: also when the test panics, and even when it is killed.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::os::fd::AsFd;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU8, Ordering};

use rustix::thread::{LinkNameSpaceType, move_into_link_name_space};

/// What a holder runs: it says that it stands, and stays until its input ends. `/sys` shows the
/// interfaces of the namespace in which it was mounted, so a machine has one of its own.
const HOLD: &str = "mount -t sysfs sysfs /sys 2>/dev/null; echo stands; exec cat";

/// The chance that a machine loses a packet that arrives, in percent.
pub(crate) const LOSS_PERCENT: u32 = 1;

/// Drops [`LOSS_PERCENT`] of the packets where the kernel has no `netem`: classic BPF that loads a
/// random number (ancillary data 56), drops the packet when it is below a hundredth of 2^32, and else
/// leaves it to the rest of the stack.
const LOSS_PROGRAM: &str = "4,32 0 0 4294963256,53 1 0 42949673,6 0 0 2,6 0 0 4294967295";

/// How the test makes namespaces.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Right {
    /// As root.
    Root,
    /// In a user namespace, where the test's user is root.
    OwnUserNamespace,
}

/// The machines of one test.
pub(crate) struct Site {
    right: Right,
    /// Holds the user namespace in which the machines stand.
    user: Option<Holder>,
    links: AtomicU8,
}

impl Site {
    /// `None` where no namespaces can be had; one line says so.
    pub(crate) fn new() -> Option<Self> {
        let is_ci = std::env::var_os("CI").is_some_and(|value| value == "true");
        for (tool, package) in [
            ("ip", "iproute2"),
            ("tc", "iproute2"),
            ("unshare", "util-linux"),
            ("nsenter", "util-linux"),
        ] {
            if Command::new(tool).arg("-V").output().is_err() {
                assert!(!is_ci, "{tool} is not installed: apt-get install {package}");
                println!("not shown, {tool} ({package}) is missing: nodes on several machines");
                return None;
            }
        }
        let is_allowed = |user: &[&str]| {
            let setting = without_ipv6().unwrap_or("true");
            let words = user.iter().copied().chain(["--net", "--mount"]);
            let arguments: Vec<&str> = words.chain(setting.split(' ')).collect();
            output("unshare", &arguments).is_ok_and(|output| output.status.success())
        };
        let (right, user) = if is_allowed(&[]) {
            (Right::Root, None)
        } else if is_allowed(&["--map-root-user"]) {
            let user = Holder::start("unshare", &["--map-root-user"]);
            (Right::OwnUserNamespace, Some(user))
        } else {
            assert!(
                !(is_ci && rustix::process::geteuid().is_root()),
                "root may make no network namespaces here, or not set them up"
            );
            println!(
                "not shown, no network namespaces may be made and set up here: nodes on several machines"
            );
            return None;
        };
        Some(Self { right, user, links: AtomicU8::new(0) })
    }

    /// A machine without any network but its loopback.
    pub(crate) fn machine(&self) -> Machine {
        let own = ["--net", "--mount"];
        let holder = match &self.user {
            None => Holder::start("unshare", &own),
            Some(user) => {
                let user = user.pid();
                let enter = ["--target", &user, "--user", "--preserve-credentials", "unshare"];
                Holder::start("nsenter", &[&enter[..], &own].concat())
            }
        };
        let machine = Machine { holder, right: self.right };
        if let Some(setting) = without_ipv6() {
            machine.configure(setting);
        }
        machine.configure("ip link set lo up");
        machine
    }

    /// Two machines joined by a link.
    pub(crate) fn two_machines(&self) -> (Machine, Machine, Link) {
        let (driver, compute) = (self.machine(), self.machine());
        let link = self.link(&driver, &compute);
        (driver, compute, link)
    }

    /// Joins two machines. The interface has the same name on both, and an MTU of 1500.
    pub(crate) fn link(&self, a: &Machine, b: &Machine) -> Link {
        let number = self.links.fetch_add(1, Ordering::Relaxed);
        let link = Link { number };
        let name = link.interface();
        a.configure(&format!(
            "ip link add {name} type veth peer name {name} netns {}",
            b.holder.pid()
        ));
        for (machine, address) in [(a, link.first_address()), (b, link.second_address())] {
            machine.configure(&format!("ip address add {address}/24 dev {name}"));
            machine.configure(&format!("ip link set {name} up"));
        }
        link
    }
}

/// A veth pair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    number: u8,
}

impl Link {
    /// The interface's name on both machines.
    pub(crate) fn interface(self) -> String {
        format!("lan{}", self.number)
    }

    pub(crate) fn first_address(self) -> String {
        format!("10.77.{}.1", self.number)
    }

    pub(crate) fn second_address(self) -> String {
        format!("10.77.{}.2", self.number)
    }

    /// One that nobody has.
    pub(crate) fn another_address(self) -> String {
        format!("10.77.{}.3", self.number)
    }
}

/// A network namespace.
pub(crate) struct Machine {
    holder: Holder,
    right: Right,
}

impl Machine {
    /// A command that runs in the machine. It becomes the program itself, so its process id is the
    /// program's.
    pub(crate) fn command(&self, program: impl AsRef<OsStr>) -> Command {
        let mut command = Command::new("nsenter");
        command.args(["--target", &self.holder.pid(), "--net", "--mount"]);
        if self.right == Right::OwnUserNamespace {
            command.args(["--user", "--preserve-credentials"]);
        }
        command.arg("--").arg(program).stdin(Stdio::null());
        command
    }

    /// Runs a line of words, which must succeed, and returns what it printed.
    fn configure(&self, line: &str) -> String {
        let output = self.try_to_configure(line);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{line}: {stderr}");
        String::from_utf8(output.stdout).unwrap()
    }

    fn try_to_configure(&self, line: &str) -> Output {
        let mut words = line.split_whitespace();
        self.command(words.next().unwrap()).args(words).output().unwrap()
    }

    /// Takes multicast from an interface, as some access points and clouds do.
    pub(crate) fn without_multicast(&self, link: Link) {
        self.configure(&format!("ip link set {} multicast off", link.interface()));
    }

    /// Pulls the cable out of an interface, or puts it back.
    pub(crate) fn set_up(&self, link: Link, is_up: bool) {
        let state = if is_up { "up" } else { "down" };
        self.configure(&format!("ip link set {} {state}", link.interface()));
    }

    /// Takes the addresses of an interface, as where a lease ends.
    pub(crate) fn take_addresses(&self, link: Link) {
        self.configure(&format!("ip address flush dev {}", link.interface()));
    }

    /// Gives an interface an address, as DHCP does.
    pub(crate) fn give_address(&self, link: Link, address: &str) {
        self.configure(&format!("ip address add {address}/24 dev {}", link.interface()));
    }

    /// Loses [`LOSS_PERCENT`] of what comes from the link's other machine, `other`, from now on.
    pub(crate) fn lose_packets_from(&self, other: &Machine, link: Link) -> Loss {
        let name = link.interface();
        let netem = format!("tc qdisc add dev {name} root netem loss {LOSS_PERCENT}%");
        if other.try_to_configure(&netem).status.success() {
            return Loss { kind: "netem" };
        }
        self.configure(&format!("tc qdisc add dev {name} clsact"));
        // Four words and the program, which has blanks.
        let filter = ["filter", "add", "dev", &name, "ingress", "bpf", "direct-action", "bytecode"];
        let output = self.command("tc").args(filter).arg(LOSS_PROGRAM).output().unwrap();
        assert!(output.status.success(), "tc: {}", String::from_utf8_lossy(&output.stderr));
        Loss { kind: "clsact" }
    }

    /// How many packets the loss took, on this machine or on the other.
    pub(crate) fn lost_packets(&self, other: &Machine, link: Link, loss: &Loss) -> u64 {
        let machine = if loss.kind == "netem" { other } else { self };
        let shown = machine.configure(&format!("tc -s -j qdisc show dev {}", link.interface()));
        let disciplines: serde_json::Value = serde_json::from_str(&shown).unwrap();
        let ours = disciplines.as_array().unwrap().iter().find(|one| one["kind"] == loss.kind);
        ours.unwrap()["drops"].as_u64().unwrap()
    }

    /// How many packets the machine has sent into a link.
    pub(crate) fn sent_packets(&self, link: Link) -> u64 {
        self.packets(link, "tx")
    }

    /// How many packets have come out of a link.
    pub(crate) fn received_packets(&self, link: Link) -> u64 {
        self.packets(link, "rx")
    }

    fn packets(&self, link: Link, direction: &str) -> u64 {
        let shown = self.configure(&format!("ip -s -j link show {}", link.interface()));
        let links: serde_json::Value = serde_json::from_str(&shown).unwrap();
        links[0]["stats64"][direction]["packets"].as_u64().unwrap()
    }

    /// What a socket may buffer in this machine, after an attempt to raise it to `wanted` bytes.
    pub(crate) fn raise_receive_buffer(&self, wanted: u64) -> u64 {
        let _ = self.try_to_configure(&format!("sysctl -qw net.core.rmem_max={wanted}"));
        self.configure("sysctl -n net.core.rmem_max").trim().parse().unwrap()
    }

    /// Runs `work` on a thread of the test that stands in this machine, with a runtime whose threads
    /// stand there too. `None` where the process may not enter: only root may.
    pub(crate) fn inside<T: Send, F: Future<Output = T>>(
        &self,
        work: impl FnOnce() -> F + Send,
    ) -> Option<T> {
        if self.right != Right::Root {
            println!("not shown, only root enters a network namespace: nodes within the test");
            return None;
        }
        let namespace = File::open(format!("/proc/{}/ns/net", self.holder.pid())).unwrap();
        let body = || {
            move_into_link_name_space(namespace.as_fd(), Some(LinkNameSpaceType::Network)).unwrap();
            let runtime = tokio::runtime::Builder::new_multi_thread()
                .worker_threads(2)
                .enable_all()
                .build()
                .unwrap();
            runtime.block_on(work())
        };
        let outcome = std::thread::scope(|scope| scope.spawn(body).join());
        match outcome {
            Ok(value) => Some(value),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }
}

/// How a machine loses packets.
#[derive(Debug)]
pub(crate) struct Loss {
    /// The kind of the queueing discipline that loses them.
    kind: &'static str,
}

/// A process that keeps its namespaces alive.
struct Holder {
    child: Child,
}

impl Holder {
    /// Runs [`HOLD`] behind a command that makes namespaces.
    fn start(program: &str, arguments: &[&str]) -> Self {
        let mut child = Command::new(program)
            .args(arguments)
            .args(["sh", "-c", HOLD])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let holder = Self { child };
        assert_eq!(line, "stands\n", "{program} {arguments:?}");
        holder
    }

    fn pid(&self) -> String {
        self.child.id().to_string()
    }
}

impl Drop for Holder {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The command that takes IPv6 from a machine: its address resolution and router solicitations would be counted among the packets.
/// `None` where the kernel has none. In containers whose `/proc/sys` may not be written it fails.
fn without_ipv6() -> Option<&'static str> {
    let command =
        "sysctl -qw net.ipv6.conf.all.disable_ipv6=1 net.ipv6.conf.default.disable_ipv6=1";
    Path::new("/proc/sys/net/ipv6").exists().then_some(command)
}

fn output(program: &str, arguments: &[&str]) -> std::io::Result<Output> {
    Command::new(program).args(arguments).stdin(Stdio::null()).output()
}
