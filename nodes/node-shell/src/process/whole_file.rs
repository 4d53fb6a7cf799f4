//! Files that are there as a whole or not at all.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use super::failure::NodeFailure;
use super::file_lock::is_at;

/// The end of the name of a file that is being written: `map.ply.PROCESS-NUMBER.part`.
const PART: &str = ".part";

/// The writes of one process have numbers of their own.
static NUMBER: AtomicU32 = AtomicU32::new(0);

/// Writes beside, makes sure that it is on the disk, and gives it the name; then the name is on the disk too. A reader never
/// finds half a file, and what had the name before is lost only to a whole one, also when the power fails, and when another process writes
/// the same file at the same time. What a killed process has left beside is removed.
///
/// A file that is a mount of its own, as a container has it (`docker run -v map.ply:/map.ply`), cannot be replaced. It is written in place,
/// and until it is whole the file beside it remains.
///
/// # Errors
/// When the folder is not there, may not be written, or is full; a previous file of that name is kept.
pub fn write_whole_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    remove_leftovers(path);
    let (part, mut file) = part_beside(path)?;
    let fill = |file: &mut File| {
        file.write_all(bytes)?;
        file.sync_all()
    };
    let written = fill(&mut file).and_then(|()| fs::rename(&part, path));
    if written.as_ref().is_err_and(|error| error.kind() == ErrorKind::ResourceBusy) {
        fill(&mut File::create(path)?)?;
        return fs::remove_file(&part);
    }
    if written.is_err() {
        // The partial file is useless; a failure to remove it adds nothing to the error.
        let _ = fs::remove_file(&part);
        return written;
    }
    File::open(folder_of(path))?.sync_all()
}

/// A new file beside, of this write alone, and locked where the file system has locks: others see by it that it is being written.
fn part_beside(path: &Path) -> io::Result<(PathBuf, File)> {
    loop {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let part = beside(path, &format!(".{}-{number}{PART}", std::process::id()));
        match File::create_new(&part) {
            // Else another writer took it for a leftover before it was locked.
            Ok(file) if !matches!(file.try_lock(), Err(TryLockError::WouldBlock)) => {
                if is_at(&file, &part) {
                    return Ok((part, file));
                }
            }
            Ok(_) => {}
            // Of a process with the same number, as each container counts them anew.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
}

/// Removes what killed processes have left of this file. Where that cannot be told or done, it stays: it only takes room.
fn remove_leftovers(path: &Path) {
    for entry in fs::read_dir(folder_of(path)).into_iter().flatten().flatten() {
        let is_part = entry.file_name().to_str().is_some_and(|name| is_part_of(path, name));
        let part = is_part.then(|| OpenOptions::new().write(true).open(entry.path()));
        if part.and_then(Result::ok).is_some_and(|part| part.try_lock().is_ok()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Whether a file has such a name as [`part_beside`] gives.
fn is_part_of(path: &Path, name: &str) -> bool {
    let own = path.file_name().and_then(|own| own.to_str());
    let numbers = own
        .and_then(|own| name.strip_prefix(own)?.strip_prefix('.')?.strip_suffix(PART))
        .and_then(|numbers| numbers.split_once('-'));
    numbers.is_some_and(|(process, number)| {
        process.parse::<u32>().is_ok() && number.parse::<u32>().is_ok()
    })
}

/// The name of a file with an ending behind it.
pub(super) fn beside(path: &Path, ending: &str) -> PathBuf {
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

    /// Both wrote into one file beside, and each gave the name to what the other one had half written.
    #[test]
    fn two_writers_of_one_file_at_a_time_never_share_the_file_beside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.ply");
        write_whole_file(&path, &[0; 100_000]).unwrap();
        std::thread::scope(|scope| {
            let writers = [1_u8, 2].map(|writer| {
                let path = &path;
                scope.spawn(move || {
                    (0..100).try_for_each(|_| write_whole_file(path, &[writer; 100_000]))
                })
            });
            while writers.iter().any(|writer| !writer.is_finished()) {
                let read = fs::read(&path).unwrap();
                assert_eq!(read.len(), 100_000, "half a file");
                assert!(read.iter().all(|byte| *byte == read[0]), "parts of two files");
            }
            writers.into_iter().for_each(|writer| writer.join().unwrap().unwrap());
        });
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_a_killed_process_has_left_is_removed_and_what_is_being_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let others =
            ["map.ply.1-x.part", "map.ply.part", "other.ply.1-0.part", "map.ply.1-0.parts"];
        for name in others.into_iter().chain(["map.ply.4711-0.part"]) {
            fs::write(at(name), "half").unwrap();
        }
        let written = File::create(at("map.ply.4712-3.part")).unwrap();
        written.lock().unwrap();
        write_whole_file(&at("map.ply"), b"map").unwrap();
        assert!(!at("map.ply.4711-0.part").exists() && at("map.ply.4712-3.part").exists());
        assert!(others.iter().all(|name| at(name).exists()));
    }
}
