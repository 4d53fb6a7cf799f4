//! The text of `stillmap info`.

use std::fmt;

use super::{BagInfo, Storage};

pub(super) fn write(info: &BagInfo, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    writeln!(f, "bag        {}", info.path.display())?;
    if info.files.len() != 1 {
        writeln!(f, "files      {}", info.files.len())?;
    }
    writeln!(f, "size       {}", size(info.size_bytes))?;
    writeln!(f, "duration   {:.3} s", info.duration_s)?;
    if let (Some(start), Some(end)) = (info.start, info.end) {
        writeln!(f, "start      {}", seconds(start.as_nanos()))?;
        writeln!(f, "end        {}", seconds(end.as_nanos()))?;
    }
    writeln!(f, "messages   {}", info.message_count)?;
    let distinct = |text: &dyn Fn(&super::FileInfo) -> String| {
        let mut all: Vec<String> = info.files.iter().map(text).filter(|t| !t.is_empty()).collect();
        all.sort();
        all.dedup();
        if all.is_empty() { "-".to_owned() } else { all.join("; ") }
    };
    writeln!(f, "profile    {}", distinct(&|file| file.profile.clone()))?;
    writeln!(f, "written by {}", distinct(&|file| file.library.clone()))?;
    let is_mcap = info.files.iter().all(|file| file.storage == Storage::Mcap);
    let compression = distinct(&|file| file.compression.join(", "));
    if !is_mcap {
        let storage = distinct(&|file| match file.storage {
            Storage::Mcap => "mcap".to_owned(),
            Storage::Sqlite3 => "sqlite3".to_owned(),
            Storage::Ros1 => "ROS 1, converted to be read".to_owned(),
        });
        writeln!(f, "storage    {storage}, compression {compression}")?;
    }
    let chunks: usize = info.files.iter().map(|file| file.chunks).sum();
    let index = if info.files.iter().all(|file| file.indexed) { "indexed" } else { "no index" };
    if is_mcap {
        writeln!(f, "chunks     {chunks} ({index}), compression {compression}")?;
    }
    write_topics(info, f)?;
    for remark in &info.remarks {
        writeln!(f, "note: {remark}")?;
    }
    for loss in &info.losses {
        writeln!(f, "lost: {loss}")?;
    }
    Ok(())
}

fn write_topics(info: &BagInfo, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if info.topics.is_empty() {
        return writeln!(f, "\nno topics");
    }
    let header = ["topic", "type", "count", "rate Hz", "QoS"].map(str::to_owned);
    let rows: Vec<[String; 5]> = std::iter::once(header)
        .chain(info.topics.iter().map(|topic| {
            let type_name = if topic.is_playable() {
                topic.type_name.clone()
            } else {
                format!("{} [{}, not played]", topic.type_name, topic.encoding)
            };
            [
                topic.topic.clone(),
                type_name,
                topic.message_count.to_string(),
                topic.rate_hz.map_or_else(|| "-".to_owned(), |rate_hz| format!("{rate_hz:.2}")),
                topic.qos.map_or_else(|| "-".to_owned(), |qos| qos.to_string()),
            ]
        }))
        .collect();
    let mut widths = [0; 5];
    for row in &rows {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = cell.chars().count().max(*width);
        }
    }
    let [topic, type_name, count, rate, _] = widths;
    writeln!(f)?;
    for row in &rows {
        let line = format!(
            "{:topic$}  {:type_name$}  {:>count$}  {:>rate$}  {}",
            row[0], row[1], row[2], row[3], row[4]
        );
        writeln!(f, "{}", line.trim_end())?;
    }
    Ok(())
}

/// Nanoseconds since the epoch as seconds, without the rounding of a float.
fn seconds(nanos: i64) -> String {
    let sign = if nanos < 0 { "-" } else { "" };
    let magnitude = nanos.unsigned_abs();
    format!("{sign}{}.{:09} s", magnitude / 1_000_000_000, magnitude % 1_000_000_000)
}

fn size(bytes: u64) -> String {
    let mib = bytes as f64 / (1 << 20) as f64;
    if bytes < 1 << 20 {
        format!("{:.1} KiB", bytes as f64 / 1024.0)
    } else if bytes < 1 << 30 {
        format!("{mib:.1} MiB")
    } else {
        format!("{:.2} GiB", mib / 1024.0)
    }
}
