//! The files of a sequence, and the times of its scans.

use std::path::{Path, PathBuf};

use geometry::Stamp;

use super::START;
use crate::failure::Failure;

/// A scan of a sequence.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Scan {
    /// Its number in the sequence.
    pub(super) number: usize,
    pub(super) path: PathBuf,
}

/// The numbered `.bin` files below `velodyne` or `data`, or in the folder itself.
pub(super) fn scans(folder: &Path) -> Result<Vec<Scan>, Failure> {
    for below in ["velodyne", "data", "."] {
        let folder = folder.join(below);
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        let mut scans: Vec<Scan> = entries
            .filter_map(|entry| {
                let path = entry.ok()?.path();
                let is_scan = path.extension()? == "bin";
                let number = path.file_stem()?.to_str()?.parse().ok()?;
                is_scan.then_some(Scan { number, path })
            })
            .collect();
        if !scans.is_empty() {
            scans.sort();
            return Ok(scans);
        }
    }
    Err(Failure::new(format!("{} holds no numbered .bin files", folder.display()))
        .fix("give the folder of a sequence: it holds velodyne/000000.bin, 000001.bin, ..."))
}

/// The names of the files with times in KITTI's odometry benchmark and in KITTI-360.
const SECONDS: &str = "times.txt";
const DATES: &str = "timestamps.txt";

/// The times of all frames of the sequence: seconds since its start (`times.txt`) or dates (`timestamps.txt`).
pub(super) fn times(folder: &Path) -> Result<Option<Vec<Stamp>>, Failure> {
    for name in [SECONDS, DATES] {
        let path = folder.join(name);
        if !path.is_file() {
            continue;
        }
        let text = std::fs::read_to_string(&path)
            .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))?;
        let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let stamps = lines.map(|(index, line)| {
            let stamp = if name == SECONDS { since_start(line) } else { date(line) };
            stamp.ok_or_else(|| {
                let place = format!("{} line {}", path.display(), index + 1);
                Failure::new(format!("{place}: cannot read '{}'", line.trim()))
            })
        });
        return stamps.collect::<Result<_, _>>().map(Some);
    }
    Ok(None)
}

fn since_start(line: &str) -> Option<Stamp> {
    let seconds = line.trim().parse::<f64>().ok().filter(|seconds| seconds.is_finite())?;
    Some(START.plus_seconds(seconds))
}

/// `poses/07.txt` beside `sequences/07`.
pub(super) fn published_poses(folder: &Path) -> Option<PathBuf> {
    let folder = folder.canonicalize().ok()?;
    let name = folder.file_name()?.to_str()?;
    let path = folder.parent()?.parent()?.join("poses").join(format!("{name}.txt"));
    path.is_file().then_some(path)
}

/// `2013-05-28 10:47:00.123456789`, in UTC.
fn date(line: &str) -> Option<Stamp> {
    let (day, time) = line.trim().split_once(' ')?;
    let [year, month, date] = numbers(day, '-')?;
    let (time, fraction) = time.split_once('.').unwrap_or((time, ""));
    let [hours, minutes, seconds] = numbers(time, ':')?;
    let known = (1970..2200).contains(&year)
        && (1..=12).contains(&month)
        && (1..=31).contains(&date)
        && hours < 24
        && minutes < 60
        && seconds < 61;
    if !known || fraction.len() > 9 {
        return None;
    }
    let nanos: i64 = format!("{fraction:0<9}").parse().ok()?;
    let days: i64 = (1970..year).map(|year| if is_leap(year) { 366 } else { 365 }).sum::<i64>()
        + (1..month).map(|month| days_of(month, year)).sum::<i64>()
        + date
        - 1;
    let seconds = ((days * 24 + hours) * 60 + minutes) * 60 + seconds;
    Some(Stamp::from_nanos(seconds * 1_000_000_000 + nanos))
}

fn numbers(text: &str, separator: char) -> Option<[i64; 3]> {
    let numbers: Vec<i64> = text
        .split(separator)
        .map(|part| part.parse().ok().filter(|number| *number >= 0))
        .collect::<Option<_>>()?;
    numbers.try_into().ok()
}

fn is_leap(year: i64) -> bool {
    year % 4 == 0 && (year % 100 != 0 || year % 400 == 0)
}

fn days_of(month: i64, year: i64) -> i64 {
    match month {
        2 if is_leap(year) => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_become_stamps() {
        let stamp = date("2013-05-28 09:57:31.995970538").unwrap();
        assert_eq!(stamp, Stamp::from_secs_nanos(1_369_735_051, 995_970_538));
        assert_eq!(date("1970-03-01 00:00:00").unwrap(), Stamp::from_secs_nanos(59 * 86_400, 0));
        assert_eq!(date("2000-02-29 00:00:01.5").unwrap().secs_nanos(), (951_782_401, 500_000_000));
        for line in [
            "2013-13-01 00:00:00",
            "2013-05-28",
            "2013-05-28 24:00:00",
            "x",
            "2013-05-28 00:00:00.1234567890",
        ] {
            assert_eq!(date(line), None, "{line}");
        }
    }
}
