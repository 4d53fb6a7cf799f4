//! The figures as a table for a terminal or a Markdown page.

use super::machine::Machine;
use super::measurement::{Cost, Peers, Row};

/// A text table with the names of the columns in its first line, aligned to the right.
pub(in crate::bench) fn render(lines: &[Vec<String>]) -> String {
    let columns = lines.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        lines.iter().filter_map(|line| line.get(column)).map(|cell| cell.chars().count()).max()
    };
    let widths: Vec<usize> = (0..columns).map(|column| width(column).unwrap_or(0)).collect();
    let mut text = String::new();
    for (at, line) in lines.iter().enumerate() {
        if at == 1 {
            let rules: Vec<_> = widths.iter().map(|width| "-".repeat(*width)).collect();
            text.push_str(&format!("| {} |\n", rules.join(" | ")));
        }
        let cells: Vec<_> =
            line.iter().zip(&widths).map(|(cell, &width)| format!("{cell:>width$}")).collect();
        text.push_str(&format!("| {} |\n", cells.join(" | ")));
    }
    text
}

/// The figures, one line per case and implementation.
pub(super) fn of_rows(rows: &[Row]) -> String {
    let mut lines = vec![
        [
            "peers",
            "mode",
            "delivery",
            "MB",
            "Hz",
            "sent Hz",
            "delivered %",
            "median ms",
            "p99 ms",
            "CPU % pub/sub",
            "peak MB pub/sub",
            "buffer KiB",
            "expected",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    lines.extend(rows.iter().map(line));
    render(&lines)
}

fn line(row: &Row) -> Vec<String> {
    let milliseconds =
        |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"));
    vec![
        match row.peers {
            Peers::Stillmap => "stillmap",
            Peers::CycloneDds => "Cyclone",
        }
        .to_owned(),
        row.case.mode.to_string(),
        row.case.reliability.to_string(),
        row.case.payload_mb().to_string(),
        row.case.hz.to_string(),
        format!("{:.1}", row.sent_hz),
        format!("{:.1}", row.delivered * 100.0),
        milliseconds(row.latency_median_ms),
        milliseconds(row.latency_p99_ms),
        format!("{:.0}/{:.0}", row.publisher.cpu_percent, row.subscriber.cpu_percent),
        format!("{}/{}", megabytes(row.publisher), megabytes(row.subscriber)),
        row.buffer_bytes.map_or_else(|| "-".to_owned(), |bytes| (bytes / 1024).to_string()),
        if row.expected_whole { "whole" } else { "losses" }.to_owned(),
    ]
}

fn megabytes(cost: Cost) -> String {
    let in_megabytes = |bytes: u64| format!("{:.0}", bytes as f64 / 1e6);
    cost.rss_peak_bytes.map_or_else(|| "-".to_owned(), in_megabytes)
}

/// The machine, in one line.
pub(in crate::bench) fn of_machine(machine: &Machine) -> String {
    let mut parts = vec![format!("{} cores", machine.cores)];
    if let Some(processor) = &machine.processor {
        parts.push(processor.clone());
    }
    if let Some(kernel) = &machine.kernel {
        parts.push(format!("kernel {kernel}"));
    }
    if let Some(bytes) = machine.largest_buffer_bytes {
        parts.push(format!("net.core.rmem_max {} KiB", bytes / 1024));
    }
    if let Some(mtu) = machine.loopback_mtu {
        parts.push(format!("MTU of lo {mtu}"));
    }
    parts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::super::measurement::tests::{a_case, a_run};
    use super::*;

    #[test]
    fn columns_line_up_whatever_they_hold() {
        let lines = [vec!["a", "long name"], vec!["12345", "ß"]]
            .map(|line| line.into_iter().map(str::to_owned).collect());
        let text = render(&lines);
        assert_eq!(text, "|     a | long name |\n| ----- | --------- |\n| 12345 |         ß |\n");
        assert_eq!(render(&[]), "");
    }

    #[test]
    fn a_row_says_what_was_measured_and_what_was_not() {
        let runs = vec![a_run(99, None)];
        let row = Row::of(Peers::Stillmap, a_case(), runs).unwrap();
        let cells = line(&row);
        let expected = [
            "stillmap",
            "localhost",
            "best effort",
            "4.9",
            "30",
            "30.0",
            "99.0",
            "-",
            "-",
            "12/10",
            "50/-",
            "4096",
            "losses",
        ];
        assert_eq!(cells, expected);
        let text = of_rows(&[row]);
        assert_eq!(text.lines().count(), 3);
        assert!(text.lines().all(|line| line.len() == text.find('\n').unwrap()), "{text}");
    }
}
