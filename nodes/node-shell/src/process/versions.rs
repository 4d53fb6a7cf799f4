//! Numbered versions of a file: what another file is about to replace stays beside it.

#[cfg(test)]
mod tests;

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::iter;
use std::path::{Path, PathBuf};

use chrono::{DateTime, Local, NaiveDate};

use super::whole_file::{folder_of, write_whole_file};

/// The newest versions of a file that are kept. Of older ones the first of each day is, of so many days: five starts that went wrong do not
/// push out what was good before them.
pub const VERSIONS_KEPT: usize = 5;

/// Between the file's stem and the number.
const MARK: &str = ".version-";

/// Keeps the file at `path` as its next version: `map.ply` as `map.version-1.ply`, then `map.version-2.ply`. The file
/// itself stays too, so that there is one under its name at each moment. Versions beyond those of [`VERSIONS_KEPT`] are removed.
/// A file that is the same as its newest version has it already. Returns the path of the
/// version; `None` where there is no file.
///
/// # Errors
/// When the folder cannot be read or written. Nothing has been removed then.
pub fn keep_version(path: &Path) -> io::Result<Option<PathBuf>> {
    keep_version_with(path, None)
}

/// The same of a file and of one that belongs to it: both have versions of the same number.
///
/// # Errors
/// As of [`keep_version`].
pub fn keep_version_with(path: &Path, beside: Option<&Path>) -> io::Result<Option<PathBuf>> {
    if !path.exists() {
        return Ok(None);
    }
    let files = || iter::once(path).chain(beside).filter(|file| file.exists());
    let mut numbers = version_numbers(path)?;
    if let Some(beside) = beside {
        numbers.extend(version_numbers(beside)?);
        numbers.sort_unstable();
        numbers.dedup();
    }
    if let Some(newest) = numbers.last().copied() {
        let has_all: io::Result<Vec<bool>> =
            files().map(|file| is_same(file, &version_path(file, newest))).collect();
        if !has_all?.contains(&false) {
            // Kept before, and not replaced since: as when the disk was full.
            return Ok(Some(version_path(path, newest)));
        }
    }
    let next = numbers.last().map_or(1, |newest| newest.saturating_add(1));
    // That which gives the number is there last: what fails before has no version.
    for file in beside.into_iter().filter(|file| file.exists()).chain(iter::once(path)) {
        keep_as(file, &version_path(file, next))?;
    }
    numbers.push(next);
    for number in outdated(path, &numbers) {
        for file in iter::once(path).chain(beside) {
            match fs::remove_file(version_path(file, number)) {
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                removed => removed?,
            }
        }
    }
    Ok(Some(version_path(path, next)))
}

fn keep_as(path: &Path, version: &Path) -> io::Result<()> {
    match fs::hard_link(path, version) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(error),
        // A file system without links, as those of many memory cards.
        Err(_) => {
            write_whole_file(version, &fs::read(path)?)?;
            let written = fs::metadata(path)?.modified()?;
            File::options().write(true).open(version)?.set_modified(written)
        }
    }
}

/// Those of the versions of a file, of ascending numbers, that are not kept any more.
fn outdated(path: &Path, numbers: &[u64]) -> Vec<u64> {
    let older = &numbers[..numbers.len().saturating_sub(VERSIONS_KEPT)];
    let mut days: Vec<Option<NaiveDate>> = Vec::new();
    let (mut firsts, mut outdated) = (Vec::new(), Vec::new());
    for number in older {
        let day = day_of(&version_path(path, *number));
        if days.contains(&day) {
            outdated.push(*number);
        } else {
            days.push(day);
            firsts.push(*number);
        }
    }
    outdated.extend(&firsts[..firsts.len().saturating_sub(VERSIONS_KEPT)]);
    outdated
}

/// The day on which a file was written.
fn day_of(path: &Path) -> Option<NaiveDate> {
    let written = fs::metadata(path).and_then(|file| file.modified()).ok()?;
    Some(DateTime::<Local>::from(written).date_naive())
}

fn is_same(one: &Path, other: &Path) -> io::Result<bool> {
    Ok(other.exists()
        && fs::metadata(one)?.len() == fs::metadata(other)?.len()
        && fs::read(one)? == fs::read(other)?)
}

/// The numbers of the versions of a file, ascending.
fn version_numbers(path: &Path) -> io::Result<Vec<u64>> {
    let mut numbers = Vec::new();
    for entry in fs::read_dir(folder_of(path))? {
        let name = entry?.file_name();
        numbers.extend(name.to_str().and_then(|name| number_in(name, path)));
    }
    numbers.sort_unstable();
    Ok(numbers)
}

/// The number in a file's name, if it is that of a version of `path`.
fn number_in(name: &str, path: &Path) -> Option<u64> {
    let (_, digits) = name.rsplit_once(MARK)?;
    let digits = digits.split('.').next()?;
    let number = digits.parse().ok()?;
    // `version-007` is another file, and not ours to remove.
    (Path::new(name).file_name() == version_path(path, number).file_name()).then_some(number)
}

fn version_path(path: &Path, number: u64) -> PathBuf {
    let mut name: OsString = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("{MARK}{number}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}
