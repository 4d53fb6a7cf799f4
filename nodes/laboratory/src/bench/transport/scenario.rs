//! Memory and message age over a long time, with a normal reader and with one that crashes, is slow or absent.

use std::time::{Duration, Instant};

use clap::ValueEnum;
use serde::Serialize;

use super::super::publish::PublishReport;
use super::super::subscribe::SubscribeReport;
use super::super::usage::Usage;
use super::case::Case;
use super::end::{End, LOOK_AGAIN};
use super::ours::{LONGEST_DISCOVERY, publishing, publishing_at_once, subscribing};
use super::place::Place;
use super::table::render;
use robot::Failure;
use robot::Progress;

/// The memory limit of each end.
const MEMORY_BOUND_BYTES: u64 = 200_000_000;
/// The accepted age of a message when a slow reader with a depth of 1 takes it.
const AGE_BOUND_MS: f64 = 100.0;
/// The processing time of a slow reader.
const SLOW_MS: u32 = 300;
/// The time between crashes of a reader; in a shorter run there are three crashes.
const CRASH_PERIOD_S: f64 = 20.0;
/// The number of memory samples, which show whether it grows.
const MOMENTS: u32 = 30;

/// The scenario.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Scenario {
    /// A publisher and a normal subscriber
    Steady,
    /// A second subscriber, which is killed and restarted every 20 s
    ReaderCrash,
    /// A subscriber of depth 1 that processes each message for 300 ms
    SlowReader,
    /// No subscriber
    NoReader,
}

/// The memory at one time.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(super) struct MemoryAt {
    pub(super) s: f64,
    pub(super) publisher_bytes: Option<u64>,
    pub(super) subscriber_bytes: Option<u64>,
}

/// The result of a scenario.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(super) struct ScenarioReport {
    pub(super) scenario: Scenario,
    #[serde(flatten)]
    pub(super) case: Case,
    pub(super) seconds: f64,
    pub(super) publish: PublishReport,
    pub(super) subscribe: Option<SubscribeReport>,
    /// The number of times the other reader was killed.
    pub(super) crashes: u32,
    /// The peak memory of the killed readers.
    pub(super) crashed_rss_peak_bytes: Option<u64>,
    pub(super) memory: Vec<MemoryAt>,
    /// Whether all ends stayed within the limit; absent if the system does not report it.
    pub(super) within_memory: Option<bool>,
    /// Whether the age of all messages was accepted; absent if it is not checked.
    pub(super) within_age: Option<bool>,
}

/// Runs a scenario.
pub(super) fn run(
    scenario: Scenario,
    case: &Case,
    seconds: f64,
    place: &Place,
    progress: &Progress,
) -> Result<ScenarioReport, Failure> {
    let mut play = Play {
        place,
        case,
        subscriber: None,
        crashing: None,
        crashes: 0,
        crashed_rss_peak_bytes: None,
    };
    let publishing = match scenario {
        Scenario::NoReader => {
            let mut line = vec!["publish".to_owned()];
            line.extend(publishing_at_once(case, seconds));
            line
        }
        _ => publishing("publish", case, seconds),
    };
    match scenario {
        Scenario::NoReader => {}
        Scenario::Steady | Scenario::ReaderCrash => play.subscribe(&[])?,
        Scenario::SlowReader => {
            play.subscribe(&["--depth", "1", "--slow-ms", &SLOW_MS.to_string()])?;
        }
    }
    let mut publisher = End::start(place, "the publishing end", &publishing)?;
    let memory = play.watch(scenario, &mut publisher, seconds, progress)?;
    let subscribe = play.subscriber.take().map(End::finish::<SubscribeReport>).transpose()?;
    if let Some(crashing) = play.crashing.take() {
        crashing.kill()?;
    }
    let publish: PublishReport = publisher.finish()?;
    let peaks = [
        publish.rss_peak_bytes,
        subscribe.as_ref().and_then(|end| end.rss_peak_bytes),
        play.crashed_rss_peak_bytes,
    ];
    Ok(ScenarioReport {
        scenario,
        case: *case,
        seconds,
        within_memory: peaks
            .into_iter()
            .flatten()
            .max()
            .map(|largest| largest < MEMORY_BOUND_BYTES),
        within_age: subscribe
            .as_ref()
            .filter(|_| scenario == Scenario::SlowReader)
            .and_then(|end| end.oldest_age_ms)
            .map(|age| age <= AGE_BOUND_MS),
        publish,
        subscribe,
        crashes: play.crashes,
        crashed_rss_peak_bytes: play.crashed_rss_peak_bytes,
        memory,
    })
}

struct Play<'a> {
    place: &'a Place,
    case: &'a Case,
    subscriber: Option<End>,
    crashing: Option<End>,
    crashes: u32,
    crashed_rss_peak_bytes: Option<u64>,
}

impl Play<'_> {
    fn subscribe(&mut self, more: &[&str]) -> Result<(), Failure> {
        let mut line = subscribing(self.case);
        line.extend(more.iter().map(|&one| one.to_owned()));
        self.subscriber = Some(End::start(self.place, "the subscribing end", &line)?);
        Ok(())
    }

    /// Waits until the publisher ends.
    fn watch(
        &mut self,
        scenario: Scenario,
        publisher: &mut End,
        seconds: f64,
        progress: &Progress,
    ) -> Result<Vec<MemoryAt>, Failure> {
        let started = Instant::now();
        let longest = Duration::from_secs_f64(seconds) + LONGEST_DISCOVERY;
        let period = Duration::from_secs_f64(CRASH_PERIOD_S.min(seconds / 3.0));
        let moment = Duration::from_secs_f64(seconds / f64::from(MOMENTS));
        let (mut next_crash, mut next_moment) = (period, Duration::ZERO);
        let mut memory = Vec::new();
        if scenario == Scenario::ReaderCrash {
            self.start_crashing()?;
        }
        while !publisher.has_ended()? {
            let elapsed = started.elapsed();
            if elapsed > longest {
                return Err(Failure::new("the publishing end did not end in time"));
            }
            self.note_crashing();
            if scenario == Scenario::ReaderCrash && elapsed >= next_crash {
                next_crash += period;
                self.crash()?;
            }
            if elapsed >= next_moment {
                next_moment += moment;
                let of = |end: &End| Usage::of(end.id())?.rss_bytes;
                memory.push(MemoryAt {
                    s: elapsed.as_secs_f64(),
                    publisher_bytes: of(publisher),
                    subscriber_bytes: self.subscriber.as_ref().and_then(of),
                });
                progress.set(elapsed.as_secs());
            }
            std::thread::sleep(LOOK_AGAIN);
        }
        Ok(memory)
    }

    fn start_crashing(&mut self) -> Result<(), Failure> {
        let line = subscribing(self.case);
        self.crashing = Some(End::start(self.place, "the crashing end", &line)?);
        Ok(())
    }

    fn crash(&mut self) -> Result<(), Failure> {
        if let Some(crashing) = self.crashing.take() {
            crashing.kill()?;
            self.crashes += 1;
        }
        self.start_crashing()
    }

    fn note_crashing(&mut self) {
        // A killed process cannot report.
        let usage = self.crashing.as_ref().and_then(|end| Usage::of(end.id()));
        let peak = usage.and_then(|usage| usage.rss_peak_bytes);
        self.crashed_rss_peak_bytes = self.crashed_rss_peak_bytes.max(peak);
    }
}

/// The reports as a table.
pub(super) fn table(reports: &[ScenarioReport]) -> String {
    let mut lines = vec![
        [
            "scenario",
            "delivery",
            "MB",
            "Hz",
            "s",
            "published",
            "received",
            "pub MB peak/end",
            "sub MB peak/end",
            "crashed MB peak",
            "oldest ms",
            "< 200 MB",
            "<= 100 ms",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    let absent = || "-".to_owned();
    let megabytes = |bytes: Option<u64>| {
        bytes.map_or_else(absent, |bytes| format!("{:.0}", bytes as f64 / 1e6))
    };
    let verdict = |verdict: Option<bool>| {
        verdict.map_or("-", |yes| if yes { "yes" } else { "NO" }).to_owned()
    };
    for report in reports {
        let subscribe = report.subscribe.as_ref();
        let of_subscriber =
            |value: &dyn Fn(&SubscribeReport) -> String| subscribe.map_or_else(absent, value);
        let name = report.scenario.to_possible_value();
        lines.push(vec![
            name.map_or_else(absent, |name| name.get_name().to_owned()),
            report.case.reliability.to_string(),
            report.case.payload_mb().to_string(),
            report.case.hz.to_string(),
            format!("{:.0}", report.seconds),
            report.publish.published.to_string(),
            of_subscriber(&|end| end.received.to_string()),
            format!(
                "{}/{}",
                megabytes(report.publish.rss_peak_bytes),
                megabytes(report.publish.rss_end_bytes)
            ),
            of_subscriber(&|end| {
                format!("{}/{}", megabytes(end.rss_peak_bytes), megabytes(end.rss_end_bytes))
            }),
            megabytes(report.crashed_rss_peak_bytes),
            of_subscriber(&|end| end.oldest_age_ms.map_or_else(absent, |age| format!("{age:.0}"))),
            verdict(report.within_memory),
            verdict(report.within_age),
        ]);
    }
    render(&lines)
}
