//! A run between two ends of this program.

use std::time::Duration;

use super::super::pair::PairReport;
use super::super::publish::PublishReport;
use super::super::subscribe::SubscribeReport;
use super::case::{Case, Mode, Reliability};
use super::end::End;
use super::measurement::{Cost, Measurement};
use super::place::Place;
use robot::Failure;

/// The timeout of discovery, which takes a fraction of a second, and more on a busy machine.
pub(super) const LONGEST_DISCOVERY: Duration = Duration::from_secs(30);
/// How long the sending end runs after its last message, so that messages in transit arrive and lost ones are
/// sent again.
const LINGER_S: f64 = 1.0;
/// The size of a message without its payload, in bytes, rounded up.
const ENVELOPE: usize = 128;

/// Measures a case.
pub(super) fn run(case: &Case, seconds: f64, place: &Place) -> Result<Measurement, Failure> {
    let longest = LONGEST_DISCOVERY + Duration::from_secs_f64(seconds + LINGER_S);
    if case.mode == Mode::Composed {
        let mut pair = End::start(place, "the composed pair", &publishing("pair", case, seconds))?;
        pair.wait(longest)?;
        let PairReport { publish, subscribe } = pair.finish()?;
        return Ok(measurement(case, &publish, &subscribe));
    }
    let subscriber = End::start(place, "the subscribing end", &subscribing(case))?;
    let mut publisher =
        End::start(place, "the publishing end", &publishing("publish", case, seconds))?;
    publisher.wait(longest)?;
    // It is stopped when no message is in transit.
    let subscribe = subscriber.finish()?;
    Ok(measurement(case, &publisher.finish()?, &subscribe))
}

/// The command line of a publishing end that begins when it has discovered a subscriber.
pub(super) fn publishing(command: &str, case: &Case, seconds: f64) -> Vec<String> {
    let mut line = vec![command.to_owned(), "--wait".to_owned()];
    line.extend(publishing_at_once(case, seconds));
    line.extend(["--linger".to_owned(), LINGER_S.to_string()]);
    line
}

/// The arguments of every publishing end.
pub(super) fn publishing_at_once(case: &Case, seconds: f64) -> Vec<String> {
    let mut line: Vec<String> = ["--topic", "image"].map(str::to_owned).to_vec();
    line.extend(["--bytes".to_owned(), case.payload_bytes.to_string()]);
    line.extend(["--hz".to_owned(), case.hz.to_string()]);
    line.extend(["--seconds".to_owned(), seconds.to_string()]);
    line.extend(reliability(case));
    line
}

/// The command line of a subscribing end, which runs until it is stopped.
pub(super) fn subscribing(case: &Case) -> Vec<String> {
    let mut line: Vec<String> =
        ["subscribe", "--topic", "image", "--seconds"].map(str::to_owned).to_vec();
    line.push(super::super::LONGEST_RUN_S.to_string());
    line.extend(reliability(case));
    line
}

fn reliability(case: &Case) -> Option<String> {
    (case.reliability == Reliability::Reliable).then(|| "--reliable".to_owned())
}

fn measurement(case: &Case, publish: &PublishReport, subscribe: &SubscribeReport) -> Measurement {
    // With no message or one there is no time span.
    let (cpu_s, span_s) = if subscribe.received > 1 {
        (subscribe.active_cpu_s, subscribe.active_s)
    } else {
        (subscribe.cpu_s, publish.active_s)
    };
    let largest_safe =
        if case.mode == Mode::Composed { None } else { subscribe.largest_safe_bytes };
    Measurement {
        published: publish.published,
        received: subscribe.received,
        out_of_order: Some(subscribe.out_of_order),
        sent_hz: per(publish.published as f64, publish.active_s),
        latency_median_ms: subscribe.latency_ms.map(|latency| latency.median),
        latency_p99_ms: subscribe.latency_ms.map(|latency| latency.p99),
        publisher: Cost {
            cpu_percent: per(publish.active_cpu_s, publish.active_s) * 100.0,
            rss_peak_bytes: publish.rss_peak_bytes,
        },
        subscriber: Cost {
            cpu_percent: per(cpu_s, span_s) * 100.0,
            rss_peak_bytes: subscribe.rss_peak_bytes,
        },
        buffer_bytes: largest_safe.and(subscribe.granted_buffer_bytes),
        expected_whole: largest_safe
            .is_none_or(|safe| case.payload_bytes as usize + ENVELOPE <= safe),
    }
}

fn per(amount: f64, seconds: f64) -> f64 {
    if seconds > 0.0 { amount / seconds } else { 0.0 }
}
