//! Numbered versions of a file: what another file is about to replace stays beside it.

#[cfg(test)]
mod tests;

use std::ffi::OsString;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::whole_file::{folder_of, write_whole_file};

/// The versions of a file that are kept; the oldest is removed when there is another one.
pub const VERSIONS_KEPT: usize = 5;

/// Between the file's stem and the number.
const MARK: &str = ".version-";

/// Keeps the file at `path` as its next version: `map.ply` as `map.version-1.ply`, then `map.version-2.ply`. The file
/// itself stays too, so that there is one under its name at each moment. Versions beyond [`VERSIONS_KEPT`] are removed,
/// those of the lowest numbers. A file that is the same as its newest version has it already. Returns the path of the
/// version; `None` where there is no file.
///
/// # Errors
/// When the folder cannot be read or written. Nothing has been removed then.
pub fn keep_version(path: &Path) -> io::Result<Option<PathBuf>> {
    if !path.exists() {
        return Ok(None);
    }
    let mut numbers = version_numbers(path)?;
    if let Some(newest) = numbers.last().map(|newest| version_path(path, *newest))
        && is_same(path, &newest)?
    {
        // Kept before, and not replaced since: as when the disk was full.
        return Ok(Some(newest));
    }
    let next = numbers.last().map_or(1, |newest| newest.saturating_add(1));
    let version = version_path(path, next);
    match fs::hard_link(path, &version) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::AlreadyExists => return Err(error),
        // A file system without links, as those of many memory cards.
        Err(_) => write_whole_file(&version, &fs::read(path)?)?,
    }
    numbers.push(next);
    for number in &numbers[..numbers.len().saturating_sub(VERSIONS_KEPT)] {
        fs::remove_file(version_path(path, *number))?;
    }
    Ok(Some(version))
}

fn is_same(one: &Path, other: &Path) -> io::Result<bool> {
    Ok(fs::metadata(one)?.len() == fs::metadata(other)?.len() && fs::read(one)? == fs::read(other)?)
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
