use std::os::fd::AsRawFd;

use super::*;

/// The names of what is in the folder, in order.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn files_are_there_until_the_run_ends() {
    let parent = tempfile::tempdir().unwrap();
    let spill_folder = parent.path().join("a/b");
    let folder = SpillFolder::below(&spill_folder).unwrap();
    folder.write("-7_-2_0.tile", b"one").unwrap();
    folder.write("3_-2_0.tile", b"two").unwrap();
    folder.write("3_-2_0.tile", b"three").unwrap();
    assert_eq!(names(folder.path()), ["-7_-2_0.tile", "3_-2_0.tile", "lock"]);
    assert_eq!(folder.read("3_-2_0.tile").unwrap(), Some(b"three".to_vec()));
    assert_eq!(folder.read("4_-2_0.tile").unwrap(), None);
    folder.clear().unwrap();
    assert_eq!(names(folder.path()), ["lock"]);
    drop(folder);
    assert!(names(&spill_folder).is_empty());
}

#[test]
fn bytes_are_appended_to_a_file_which_the_first_ones_make() {
    let parent = tempfile::tempdir().unwrap();
    let folder = SpillFolder::below(parent.path()).unwrap();
    folder.append("0_0.tile", b"one").unwrap();
    folder.append("0_0.tile", b" two").unwrap();
    assert_eq!(folder.read("0_0.tile").unwrap(), Some(b"one two".to_vec()));
}

#[test]
fn what_cannot_be_written_or_read_is_an_error_that_names_the_file() {
    let parent = tempfile::tempdir().unwrap();
    let folder = SpillFolder::below(parent.path()).unwrap();
    fs::create_dir(folder.path().join("0_0.tile")).unwrap();
    for error in [
        folder.write("0_0.tile", b"").unwrap_err(),
        folder.append("0_0.tile", b"").unwrap_err(),
        folder.read("0_0.tile").unwrap_err(),
    ] {
        assert!(error.to_string().contains("0_0.tile: "), "{error}");
    }
    assert_eq!(names(folder.path()), ["0_0.tile", "lock"], "no part of a file is left");
}

#[test]
fn what_a_killed_run_has_left_goes_and_what_another_one_has_stays() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path();
    let other = SpillFolder::below(path).unwrap();
    let left = path.join("tiles-1-0");
    fs::create_dir(&left).unwrap();
    fs::write(left.join(LOCK), "").unwrap();
    fs::write(left.join("0_0_0.tile"), "old").unwrap();
    fs::create_dir(path.join("tiles-of-somebody")).unwrap();
    let own = other.beside().unwrap();
    assert!(!left.exists() && other.path().exists() && own.path() != other.path());
    assert_eq!(own.path().parent(), Some(path));
    assert!(path.join("tiles-of-somebody").exists());
}

/// Process numbers are not unique over containers that share a disk.
#[test]
fn a_folder_that_another_run_has_by_the_same_name_is_left_to_it() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("tiles-1-0");
    let first = SpillFolder::at(path.clone(), File::try_lock).unwrap();
    assert!(first.is_some() && SpillFolder::at(path, File::try_lock).unwrap().is_none());
    let next = NUMBER.load(Ordering::Relaxed);
    // Other tests count on meanwhile.
    let process = std::process::id();
    for number in next..next + 20 {
        let of_other = parent.path().join(format!("tiles-{process}-{number}"));
        fs::create_dir(&of_other).unwrap();
        fs::write(of_other.join(NO_LOCK), "").unwrap();
    }
    let own = SpillFolder::below(parent.path()).unwrap();
    assert_eq!(names(own.path()), ["lock"]);
}

/// It was left for ever.
#[test]
fn a_folder_of_a_run_that_was_killed_before_it_made_the_lock_goes() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path();
    let left = path.join("tiles-1-0");
    fs::create_dir(&left).unwrap();
    // Empty, too, but no run's.
    let others = ["tiles-of-somebody", "tiles-1", "tiles-1-0-0", "tiles-x-0"];
    for other in others {
        fs::create_dir(path.join(other)).unwrap();
    }
    let own = SpillFolder::below(path).unwrap();
    assert!(!left.exists() && own.path().exists());
    assert!(others.iter().all(|other| path.join(other).exists()));
}

/// `run --pose lidar` once failed on file systems without locks, which it does not need.
#[test]
fn without_locks_the_folder_is_used_and_no_other_run_removes_it() {
    for kind in [io::Error::from(ErrorKind::Unsupported), no_lock_manager()] {
        assert!(has_no_locks(&kind), "{kind}");
    }
    assert!(!has_no_locks(&ErrorKind::PermissionDenied.into()));
    let parent = tempfile::tempdir().unwrap();
    let unsupported: TryLock = |_| Err(TryLockError::Error(ErrorKind::Unsupported.into()));
    let without = SpillFolder::below_with(parent.path(), unsupported).unwrap();
    assert_eq!(names(without.path()), ["no_lock"]);
    let other = SpillFolder::below(parent.path()).unwrap();
    without.write("0_0_0.tile", b"bytes").unwrap();
    assert_eq!(without.read("0_0_0.tile").unwrap(), Some(b"bytes".to_vec()));
    without.clear().unwrap();
    assert_eq!(names(without.path()), ["no_lock"]);
    drop((without, other));
    assert!(names(parent.path()).is_empty());
    // What fails for another reason is an error.
    let broken: TryLock = |_| Err(TryLockError::Error(ErrorKind::StorageFull.into()));
    let error = SpillFolder::below_with(parent.path(), broken).unwrap_err().to_string();
    assert!(error.contains("cannot lock the file"), "{error}");
}

fn no_lock_manager() -> io::Error {
    rustix::io::Errno::NOLCK.into()
}

/// Two containers may have the same process number: the lock of a file that was removed and made anew is no lock.
#[test]
fn the_lock_of_a_file_that_was_made_anew_is_not_taken_for_ones_own() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("tiles-1-0");
    let made_anew: TryLock = |lock| {
        let path = fs::read_link(format!("/proc/self/fd/{}", lock.as_raw_fd())).unwrap();
        fs::remove_file(&path).unwrap();
        File::create(&path).unwrap();
        lock.try_lock()
    };
    assert!(SpillFolder::at(path, made_anew).unwrap().is_none());
}

/// A run that starts may take the folder of another one that is about to lock its own for a leftover.
#[test]
fn runs_that_start_at_the_same_time_do_not_remove_each_others_folders() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path();
    let folders: Vec<SpillFolder> = std::thread::scope(|scope| {
        let starting: Vec<_> = (0..8)
            .map(|_| scope.spawn(|| (0..20).map(|_| SpillFolder::below(path).unwrap()).collect()))
            .collect();
        starting.into_iter().flat_map(|thread| -> Vec<_> { thread.join().unwrap() }).collect()
    });
    for folder in folders {
        folder.write("0_0_0.tile", b"bytes").unwrap();
        assert_eq!(folder.read("0_0_0.tile").unwrap(), Some(b"bytes".to_vec()));
    }
}

#[test]
fn a_folder_without_permission_is_an_error_with_what_was_tried() {
    use std::os::unix::fs::PermissionsExt;

    let parent = tempfile::tempdir().unwrap();
    fs::set_permissions(parent.path(), fs::Permissions::from_mode(0o500)).unwrap();
    if fs::create_dir(parent.path().join("root")).is_ok() {
        eprintln!("skipped: this user may write everywhere");
        return;
    }
    let error = SpillFolder::below(parent.path()).unwrap_err().to_string();
    assert!(error.contains("cannot make the folder") && error.contains("denied"), "{error}");
}
