//! Parser of the output of `ddsperf` 0.10, line by line.

use estimation::quantile::median;

/// The counts of a subscribing `ddsperf`: `... size 614400 total 180 lost 0 delta 30 ...`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Counted {
    pub(super) received: u64,
    pub(super) lost: u64,
}

impl Counted {
    /// Adds a line; the counts are cumulative, so that the last ones are valid.
    pub(super) fn take(&mut self, line: &str) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let Some(at) = words.iter().position(|word| *word == "total") else { return };
        let value = |offset: usize| words.get(at + offset)?.parse().ok();
        // A line about timed-out pings has a total as well, but no losses.
        if words.get(at + 2) == Some(&"lost")
            && let (Some(received), Some(lost)) = (value(1), value(3))
        {
            *self = Self { received, lost };
        }
    }
}

/// The output of a publishing `ddsperf`: its rate, `... 30/s 412u | ...`, and the round-trip time of pings,
/// `... mean 786us min ... 50% 762.690us ... 99% 1122.295us max ... cnt 10`; one line of each per second.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Told {
    rates_hz: Vec<f64>,
    medians_us: Vec<f64>,
    p99_us: f64,
}

/// One line per second: those of a day are kept.
const MOST_LINES: usize = 86_400;

impl Told {
    pub(super) fn take(&mut self, line: &str) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let per_second = |word: &&str| word.strip_suffix("/s")?.parse::<f64>().ok();
        let after = |name: &str| {
            let at = words.iter().position(|word| *word == name)?;
            words.get(at + 1)?.strip_suffix("us")?.parse::<f64>().ok()
        };
        if self.rates_hz.len() < MOST_LINES
            && let Some(rate) = words.iter().find_map(per_second)
        {
            self.rates_hz.push(rate);
        }
        if self.medians_us.len() < MOST_LINES
            && words.contains(&"mean")
            && let (Some(median), Some(p99)) = (after("50%"), after("99%"))
        {
            self.medians_us.push(median);
            self.p99_us = self.p99_us.max(p99);
        }
    }

    /// The median rate.
    pub(super) fn rate_hz(&self) -> Option<f64> {
        median(self.rates_hz.iter().copied())
    }

    /// The median of the medians of each second.
    pub(super) fn latency_median_ms(&self) -> Option<f64> {
        median(self.medians_us.iter().copied()).map(|micros| micros / 1e3)
    }

    /// The largest 99th percentile of a second.
    pub(super) fn latency_p99_ms(&self) -> Option<f64> {
        (!self.medians_us.is_empty()).then_some(self.p99_us / 1e3)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SUBSCRIBER: &str = "\
[10070] participant vm:10070: new (self)
[10070] 1.000  size 614400 total 30 lost 0 delta 30 lost 0 rate 0.03 kS/s 147.44 Mb/s (0.00 kS/s 14.74 Mb/s)
[10070] 1.000  rss:11.4MB vcsw:145 ivcsw:85 recvUC:0%+1%
[10070] 1.000  discarded 0 rexmit 0 Trexmit 0 Tthrottle 0 Nthrottle 0
[10070] 2.000  size 614400 total 58 lost 2 delta 28 lost 2 rate 0.03 kS/s 147.46 Mb/s (0.01 kS/s 29.49 Mb/s)
[10070] participant vm:10071: gone
";

    const PUBLISHER: &str = "\
[10071] participant vm:10070: new
[10071] 1.000    31/s 403u |                              | 100%   2m
[10071] 1.000  vm:10070 size 614400 mean 1540.660us min 869.749us 50% 1301.852us 90% 2101.500us 99% 2377.028us max 2377.028us cnt 9
[10071] ping timed out (total 28 times) ... sending new ping
[10071] 2.000    30/s 413u |                              | 100% 941u
[10071] 2.000  vm:10070 size 614400 mean 786.057us min 676.837us 50% 762.690us 90% 1122.295us 99% 1122.295us max 1122.295us cnt 10
[10071] 3.000  24.8/s   3m |                              | 100%  29m
";

    #[test]
    fn the_subscriber_counts() {
        let mut counted = Counted::default();
        SUBSCRIBER.lines().for_each(|line| counted.take(line));
        assert_eq!(counted, Counted { received: 58, lost: 2 });
    }

    #[test]
    fn the_publisher_tells_rate_and_latency() {
        let mut told = Told::default();
        PUBLISHER.lines().for_each(|line| told.take(line));
        assert_eq!(told.rate_hz(), Some(30.0));
        let close = |found: Option<f64>, truth: f64| (found.unwrap() - truth).abs() < 1e-9;
        assert!(close(told.latency_median_ms(), 1.032_271));
        assert!(close(told.latency_p99_ms(), 2.377_028));
    }

    #[test]
    fn who_tells_nothing_is_believed_nothing() {
        let told = Told::default();
        assert_eq!(
            (told.rate_hz(), told.latency_median_ms(), told.latency_p99_ms()),
            (None, None, None)
        );
        let mut counted = Counted::default();
        for line in ["", "total", "total 5", "total 5 lost", "total x lost 0", "total 5 times lost"]
        {
            counted.take(line);
        }
        assert_eq!(counted, Counted::default());
    }

    proptest! {
        #[test]
        fn any_line_is_read_without_a_panic(line in "[ -~]{0,80}|(total|lost|50%|99%|mean|[|]|[0-9/.us% ]){0,20}") {
            let (mut counted, mut told) = (Counted::default(), Told::default());
            counted.take(&line);
            told.take(&line);
        }
    }
}
