use std::collections::BTreeSet;
use std::time::{Duration, SystemTime};

use super::*;

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn a_version_is_what_the_file_was_and_the_oldest_beyond_the_bound_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.ply");
    assert_eq!(keep_version(&path).unwrap(), None, "there is no file");
    for number in 1..=7_u64 {
        write_whole_file(&path, number.to_string().as_bytes()).unwrap();
        let version = keep_version(&path).unwrap().unwrap();
        assert_eq!(version, folder.path().join(format!("map.version-{number}.ply")));
        // The file is there at each moment, and the version does not change with it.
        assert_eq!(fs::read(&path).unwrap(), number.to_string().as_bytes());
    }
    write_whole_file(&path, b"8").unwrap();
    let kept = [1, 3, 4, 5, 6, 7].map(|number| format!("map.version-{number}.ply"));
    assert_eq!(names(folder.path()), kept.into_iter().chain(["map.ply".to_owned()]).collect());
    for number in 3..=7_u64 {
        let version = fs::read(folder.path().join(format!("map.version-{number}.ply"))).unwrap();
        assert_eq!(version, number.to_string().as_bytes());
    }
}

#[test]
fn files_that_are_no_versions_of_it_stay() {
    let folder = tempfile::tempdir().unwrap();
    let others = [
        "map.version-1.pcd",
        "map.version-01.ply",
        "map.version-x.ply",
        "map.version-2.ply.part",
        "other.version-1.ply",
        "map.1.ply",
        "map.version-.ply",
    ];
    for name in others {
        fs::write(folder.path().join(name), "of somebody else").unwrap();
    }
    let path = folder.path().join("map.ply");
    for number in 0..9 {
        write_whole_file(&path, &[number]).unwrap();
        keep_version(&path).unwrap();
    }
    for name in others {
        assert_eq!(fs::read(folder.path().join(name)).unwrap(), b"of somebody else", "{name}");
    }
    assert_eq!(names(folder.path()).len(), others.len() + 1 + VERSIONS_KEPT + 1);
}

#[test]
fn a_name_without_an_extension_has_versions_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("keyframes");
    for number in 1..=7_u8 {
        write_whole_file(&path, &[number]).unwrap();
        let version = keep_version(&path).unwrap().unwrap();
        assert_eq!(version, folder.path().join(format!("keyframes.version-{number}")));
    }
    assert_eq!(names(folder.path()).len(), 1 + VERSIONS_KEPT + 1);
}

#[test]
fn a_file_that_was_not_replaced_has_one_version() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.ply");
    write_whole_file(&path, b"map").unwrap();
    let version = keep_version(&path).unwrap();
    for _ in 0..9 {
        assert_eq!(keep_version(&path).unwrap(), version);
    }
    assert_eq!(names(folder.path()).len(), 2);
}

/// Five starts that went wrong pushed out the map of the day before.
#[test]
fn the_first_version_of_each_day_stays_beside_the_newest_ones() {
    const DAY: Duration = Duration::from_secs(24 * 3600);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.ply");
    let begin = SystemTime::now() - 20 * DAY;
    let mut written = 0_u8;
    let mut write_on = |day: u32, times: u8| {
        for _ in 0..times {
            written += 1;
            write_whole_file(&path, &[written]).unwrap();
            let file = File::options().write(true).open(&path).unwrap();
            file.set_modified(begin + day * DAY).unwrap();
            keep_version(&path).unwrap();
        }
        version_numbers(&path).unwrap()
    };
    assert_eq!(write_on(0, 1), [1]);
    assert_eq!(write_on(1, 9), [1, 2, 6, 7, 8, 9, 10], "one of each day and the five newest");
    // One a day: the five days before the newest five.
    assert_eq!(write_on(2, 1), [1, 2, 7, 8, 9, 10, 11]);
    let last = (3..12).map(|day| write_on(day, 1)).last();
    assert_eq!(last.unwrap(), [11, 12, 13, 14, 15, 16, 17, 18, 19, 20]);
}

#[test]
fn a_file_and_one_that_belongs_to_it_have_versions_of_the_same_number() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (yaml, image) = (at("house.yaml"), at("house.pgm"));
    fs::write(&yaml, "image: house.pgm").unwrap();
    for number in 1..=9_u8 {
        // The one does not change.
        write_whole_file(&image, &[number]).unwrap();
        for _ in 0..2 {
            let version = keep_version_with(&yaml, Some(&image)).unwrap();
            assert_eq!(version, Some(at(&format!("house.version-{number}.yaml"))));
        }
        assert_eq!(fs::read(at(&format!("house.version-{number}.pgm"))).unwrap(), [number]);
    }
    assert_eq!(names(folder.path()).len(), 2 * (1 + VERSIONS_KEPT + 1));
}
