//! The results of one run, and the medians of several runs.

use estimation::quantile::median;
use serde::Serialize;

use super::case::Case;

/// The measured implementation.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Peers {
    /// This program.
    Stillmap,
    /// `ddsperf`, the benchmark of Cyclone DDS.
    CycloneDds,
}

/// The resources that one end used.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub(super) struct Cost {
    /// CPU time as a share of one core.
    pub(super) cpu_percent: f64,
    /// The peak memory.
    pub(super) rss_peak_bytes: Option<u64>,
}

/// One run.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(super) struct Measurement {
    pub(super) published: u64,
    pub(super) received: u64,
    /// Messages received after a later one; absent if the tool does not report them.
    pub(super) out_of_order: Option<u64>,
    /// The achieved rate of the sender.
    pub(super) sent_hz: f64,
    pub(super) latency_median_ms: Option<f64>,
    pub(super) latency_p99_ms: Option<f64>,
    pub(super) publisher: Cost,
    pub(super) subscriber: Cost,
    /// The receive buffer of a socket; absent if nothing is sent.
    pub(super) buffer_bytes: Option<usize>,
    /// Whether a message of this size arrives completely with that buffer.
    pub(super) expected_whole: bool,
}

impl Measurement {
    /// The share of the published messages that were received; 1 where none was published.
    pub(super) fn delivered(&self) -> f64 {
        if self.published == 0 { 1.0 } else { self.received as f64 / self.published as f64 }
    }
}

/// The medians of the runs of a case.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(super) struct Row {
    pub(super) peers: Peers,
    #[serde(flatten)]
    pub(super) case: Case,
    pub(super) delivered: f64,
    pub(super) sent_hz: f64,
    pub(super) latency_median_ms: Option<f64>,
    pub(super) latency_p99_ms: Option<f64>,
    pub(super) publisher: Cost,
    pub(super) subscriber: Cost,
    pub(super) buffer_bytes: Option<usize>,
    pub(super) expected_whole: bool,
    pub(super) runs: Vec<Measurement>,
}

impl Row {
    /// `None` without a run.
    pub(super) fn of(peers: Peers, case: Case, runs: Vec<Measurement>) -> Option<Self> {
        let first = runs.first()?;
        let of = |value: &dyn Fn(&Measurement) -> Option<f64>| {
            median(runs.iter().filter_map(value).filter(|value| !value.is_nan()))
        };
        let cost = |end: &dyn Fn(&Measurement) -> Cost| Cost {
            cpu_percent: of(&|run| Some(end(run).cpu_percent)).unwrap_or(0.0),
            rss_peak_bytes: of(&|run| end(run).rss_peak_bytes.map(|bytes| bytes as f64))
                .map(|bytes| bytes as u64),
        };
        Some(Self {
            peers,
            case,
            delivered: of(&|run| Some(run.delivered())).unwrap_or(0.0),
            sent_hz: of(&|run| Some(run.sent_hz)).unwrap_or(0.0),
            latency_median_ms: of(&|run| run.latency_median_ms),
            latency_p99_ms: of(&|run| run.latency_p99_ms),
            publisher: cost(&|run| run.publisher),
            subscriber: cost(&|run| run.subscriber),
            buffer_bytes: first.buffer_bytes,
            expected_whole: first.expected_whole,
            runs,
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::case::{Mode, Reliability};
    use super::*;

    pub(in super::super) fn a_case() -> Case {
        Case {
            mode: Mode::Localhost,
            reliability: Reliability::BestEffort,
            payload_bytes: 4_900_000,
            hz: 30.0,
        }
    }

    pub(in super::super) fn a_run(received: u64, latency_median_ms: Option<f64>) -> Measurement {
        Measurement {
            published: 100,
            received,
            out_of_order: Some(0),
            sent_hz: 30.0,
            latency_median_ms,
            latency_p99_ms: latency_median_ms.map(|median| median * 2.0),
            publisher: Cost { cpu_percent: 12.0, rss_peak_bytes: Some(50_000_000) },
            subscriber: Cost { cpu_percent: 10.0, rss_peak_bytes: None },
            buffer_bytes: Some(4 << 20),
            expected_whole: false,
        }
    }

    #[test]
    fn a_row_has_the_medians_of_its_runs() {
        let runs = vec![a_run(100, Some(4.0)), a_run(0, None), a_run(50, Some(6.0))];
        let row = Row::of(Peers::Stillmap, a_case(), runs).unwrap();
        assert_eq!(row.delivered, 0.5);
        assert_eq!(row.latency_median_ms, Some(5.0));
        assert_eq!(row.publisher.rss_peak_bytes, Some(50_000_000));
        assert_eq!(row.subscriber.rss_peak_bytes, None);
        assert_eq!(Row::of(Peers::Stillmap, a_case(), vec![]), None);
    }
}
