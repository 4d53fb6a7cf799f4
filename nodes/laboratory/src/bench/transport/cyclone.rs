//! The same run between two processes of Cyclone DDS, with its benchmark `ddsperf`.

mod output;

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use self::output::{Counted, Told};
use super::super::usage::Usage;
use super::case::{Case, Mode, Reliability};
use super::end::LOOK_AGAIN;
use super::machine::Machine;
use super::measurement::{Cost, Measurement};
use super::pipe::Lines;
use super::place::Place;
use robot::Failure;
use robot::Process;

/// The tool.
const DDSPERF: &str = "ddsperf";
/// The receive buffer that this suite requests, so that both are measured under the same conditions.
const WANTED_BUFFER: usize = 32 << 20;
/// The history depth of either end, as in this program.
const DEPTH: &str = "5";
/// The share of the messages, in percent, that are sent back at full size, to measure the round-trip time.
/// Sending all back would double the load.
const PING_PERCENT: &str = "10";
/// The time for the publishing process, which starts after the subscribing one, to discover it, and for the
/// subscribing one to print the last second.
const MARGIN_S: f64 = 3.0;

/// Why there are no figures of Cyclone DDS, where the tool is not installed.
pub(super) fn missing() -> Option<String> {
    let found = Command::new(DDSPERF)
        .arg("help")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    found.is_err().then(|| {
        format!(
            "{DDSPERF} is not here, so the figures of Cyclone DDS are left out (Debian: apt install \
             cyclonedds-tools)"
        )
    })
}

/// Measures a case; `None` for nodes of one process.
pub(super) fn run(
    case: &Case,
    seconds: f64,
    place: &Place,
    buffer_kib: Option<u32>,
    machine: &Machine,
) -> Result<Option<Measurement>, Failure> {
    let asked = buffer_kib.map_or(WANTED_BUFFER, |kib| kib as usize * 1024);
    // Cyclone DDS does not start when the requested buffer is not granted.
    let buffer = machine.largest_buffer_bytes.map_or(asked, |largest| largest.min(asked));
    let Some(configuration) = configuration(case.mode, buffer) else { return Ok(None) };
    let mut common = vec!["-i".to_owned(), place.domain.to_string()];
    common.extend(["-k", DEPTH, "-X"].map(str::to_owned));
    if case.reliability == Reliability::BestEffort {
        common.push("-u".to_owned());
    }
    let start = |name: &str, run_s: f64, arguments: &[&str]| {
        let mut command = Command::new(DDSPERF);
        command.args(&common).args(["-D", &run_s.to_string()]).args(arguments);
        command.env("CYCLONEDDS_URI", &configuration);
        command.stdout(Stdio::piped()).stderr(Stdio::null());
        Process::spawn(name, command)
    };
    let mut subscriber = start("ddsperf sub", seconds + MARGIN_S, &["sub"])?;
    let counted = Lines::fold(subscriber.take_stdout(), Counted::take);
    let (rate, size) = (format!("{}Hz", case.hz), case.payload_bytes.to_string());
    let publish = ["pub", &rate, "size", &size, "ping", PING_PERCENT];
    let mut publisher = start("ddsperf pub", seconds, &publish)?;
    let told = Lines::fold(publisher.take_stdout(), Told::take);

    let usages = watch(&mut publisher, &mut subscriber, seconds + 2.0 * MARGIN_S)?;
    publisher.stop()?;
    subscriber.stop()?;
    let (counted, told) = (counted.finish(), told.finish());
    let sent_hz = told.rate_hz().unwrap_or(0.0);
    let published = match counted.received + counted.lost {
        // Nothing was received, so that there is no count; the rate is known.
        0 => (sent_hz * seconds).round() as u64,
        counted => counted,
    };
    let [publisher, subscriber] = usages.map(|usage| Cost {
        cpu_percent: usage.cpu_s / seconds * 100.0,
        rss_peak_bytes: usage.rss_peak_bytes,
    });
    Ok(Some(Measurement {
        published,
        received: counted.received,
        out_of_order: None,
        sent_hz,
        latency_median_ms: told.latency_median_ms(),
        latency_p99_ms: told.latency_p99_ms(),
        publisher,
        subscriber,
        buffer_bytes: Some(buffer),
        expected_whole: case.payload_bytes as usize <= buffer,
    }))
}

/// Waits for both to end; returns their last measured usage.
fn watch(
    publisher: &mut Process,
    subscriber: &mut Process,
    longest_s: f64,
) -> Result<[Usage; 2], Failure> {
    let deadline = Instant::now() + Duration::from_secs_f64(longest_s);
    let mut usages = [Usage::default(); 2];
    loop {
        let ids = [publisher.id(), subscriber.id()];
        for (usage, id) in usages.iter_mut().zip(ids) {
            // A process that has ended has no figures: the last ones are used.
            *usage = Usage::of(id).unwrap_or(*usage);
        }
        let ended = publisher.ended()?.is_some() && subscriber.ended()?.is_some();
        if ended || Instant::now() >= deadline {
            return Ok(usages);
        }
        std::thread::sleep(LOOK_AGAIN);
    }
}

/// The configuration of Cyclone DDS with a buffer size, and with unicast data as in this suite.
fn configuration(mode: Mode, buffer: usize) -> Option<String> {
    let network = match mode {
        Mode::AllNetworks => "<General><AllowMulticast>spdp</AllowMulticast></General>",
        Mode::Localhost => {
            "<General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>\
             <AllowMulticast>false</AllowMulticast></General>\
             <Discovery><ParticipantIndex>auto</ParticipantIndex>\
             <Peers><Peer address=\"localhost\"/></Peers></Discovery>"
        }
        Mode::Composed => return None,
    };
    Some(format!(
        "<CycloneDDS><Domain>{network}<Internal><SocketReceiveBufferSize min=\"{buffer}B\"/></Internal>\
         </Domain></CycloneDDS>"
    ))
}
