//! Files that are there as a whole or not at all.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::failure::NodeFailure;

/// Writes beside, makes sure that it is on the disk, and gives it the name; then the name is on the disk too. A reader never
/// finds half a file, and what had the name before is lost only to a whole one, also when the power fails.
///
/// A file that is a mount of its own, as a container has it (`docker run -v map.ply:/map.ply`), cannot be replaced. It is written in place,
/// and until it is whole the file beside it remains.
///
/// # Errors
/// When the folder is not there, may not be written, or is full; a previous file of that name is kept.
pub fn write_whole_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let temporary = beside(path, ".part");
    let create = |path: &Path| {
        let mut file = File::create(path)?;
        file.write_all(bytes)?;
        file.sync_all()
    };
    let write = || {
        create(&temporary)?;
        fs::rename(&temporary, path)
    };
    let written = write();
    if written.as_ref().is_err_and(|error| error.kind() == ErrorKind::ResourceBusy) {
        create(path)?;
        return fs::remove_file(&temporary);
    }
    if written.is_err() {
        // The partial file is useless; a failure to remove it adds nothing to the error.
        let _ = fs::remove_file(&temporary);
        return written;
    }
    File::open(folder_of(path))?.sync_all()
}

/// The name of a file with an ending behind it.
fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

/// The file that `parameter` names, behind a symbolic link if it is one; none for an empty path. A file that could not be written is
/// found out now, and not when there is something to lose.
///
/// # Errors
/// When its folder is not there, or no file can be made in it.
pub fn output_file(parameter: &str, path: &str) -> Result<Option<PathBuf>, NodeFailure> {
    if path.is_empty() {
        return Ok(None);
    }
    let path = behind_link(PathBuf::from(path));
    let shown = path.display();
    if !folder_of(&path).is_dir() {
        return Err(format!("parameter {parameter}: the folder of {shown} does not exist").into());
    }
    check_folder_of(&path).map_err(|error| {
        format!("parameter {parameter}: no file can be made beside {shown}: {error}")
    })?;
    Ok(Some(path))
}

/// What a symbolic link leads to, which need not be there yet: the link is kept, and the file on the other disk is written.
fn behind_link(path: PathBuf) -> PathBuf {
    match fs::read_link(&path) {
        // A chain of links that ends nowhere is resolved by one of them.
        Ok(target) => fs::canonicalize(&path).unwrap_or_else(|_| folder_of(&path).join(target)),
        Err(_) => path,
    }
}

/// Finds out whether files can be made in the folder of a file, by making one: that the rights are there does not say it.
///
/// # Errors
/// When it is not there, is no folder, or none can be made.
pub fn check_folder_of(path: &Path) -> io::Result<()> {
    let folder = folder_of(path);
    if !fs::metadata(folder)?.is_dir() {
        return Err(ErrorKind::NotADirectory.into());
    }
    let probe = beside(path, ".probe");
    File::create(&probe)?;
    fs::remove_file(&probe)
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

    /// It was found out when the map was to be saved, at the end.
    #[test]
    fn a_folder_in_which_nothing_can_be_made_is_refused_at_the_start() {
        let error = output_file("map_file", "/proc/map.ply").unwrap_err().to_string();
        assert!(error.contains("map_file") && error.contains("no file can be made"), "{error}");
    }

    /// The link was replaced by a file, and what it led to was never written.
    #[test]
    fn a_link_is_kept_and_what_it_leads_to_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("disk")).unwrap();
        std::os::unix::fs::symlink("disk/map.ply", at("map.ply")).unwrap();
        for text in ["the first", "the next"] {
            let path = output_file("map_file", at("map.ply").to_str().unwrap()).unwrap().unwrap();
            write_whole_file(&path, text.as_bytes()).unwrap();
            assert!(at("map.ply").is_symlink());
            assert_eq!(fs::read_to_string(at("disk/map.ply")).unwrap(), text);
        }
        assert_eq!(fs::read_dir(at("disk")).unwrap().count(), 1);
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
