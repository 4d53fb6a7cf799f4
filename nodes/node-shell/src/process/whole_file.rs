//! Files that are there as a whole or not at all.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::failure::NodeFailure;

/// Writes beside, makes sure that it is on the disk, and gives it the name; then the name is on the disk too. A reader never
/// finds half a file, and what had the name before is lost only to a whole one, also when the power fails.
///
/// # Errors
/// When the folder is not there, may not be written, or is full; a previous file of that name is kept.
pub fn write_whole_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut temporary = path.as_os_str().to_owned();
    temporary.push(".part");
    let write = || {
        let mut file = File::create(&temporary)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&temporary, path)
    };
    let written = write();
    if written.is_err() {
        // The partial file is useless; a failure to remove it adds nothing to the error.
        let _ = fs::remove_file(&temporary);
        return written;
    }
    File::open(folder_of(path))?.sync_all()
}

/// The file that `parameter` names; none for an empty path. A file that could not be written is found out now, and not when there is
/// something to lose.
///
/// # Errors
/// When its folder is not there.
pub fn output_file(parameter: &str, path: &str) -> Result<Option<PathBuf>, NodeFailure> {
    if path.is_empty() {
        return Ok(None);
    }
    let path = PathBuf::from(path);
    if !folder_of(&path).is_dir() {
        let shown = path.display();
        return Err(format!("parameter {parameter}: the folder of {shown} does not exist").into());
    }
    Ok(Some(path))
}

/// The folder that a file is in, or will be.
#[must_use]
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_of_a_name_alone_is_this_one() {
        assert_eq!(folder_of(Path::new("map.ply")), Path::new("."));
        assert_eq!(folder_of(Path::new("maps/map.ply")), Path::new("maps"));
    }

    #[test]
    fn an_output_file_is_in_a_folder_that_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let of = |path: &Path| output_file("mesh_file", path.to_str().unwrap());
        assert_eq!(of(Path::new("")).unwrap(), None);
        let path = folder.path().join("house.glb");
        assert_eq!(of(&path).unwrap(), Some(path.clone()));
        let error = of(&folder.path().join("none").join("house.glb")).unwrap_err().to_string();
        assert!(error.contains("mesh_file") && error.contains("does not exist"), "{error}");
    }

    #[test]
    fn a_file_takes_the_place_of_another_and_leaves_nothing_beside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        write_whole_file(&path, b"before").unwrap();
        write_whole_file(&path, b"after").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"after");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        // A folder has the name: nothing can take it.
        let taken = folder.path().join("taken");
        fs::create_dir(&taken).unwrap();
        assert!(write_whole_file(&taken, b"file").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
