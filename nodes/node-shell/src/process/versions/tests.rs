use std::collections::BTreeSet;

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
    let kept = (3..=7).map(|number| format!("map.version-{number}.ply"));
    assert_eq!(names(folder.path()), kept.chain(["map.ply".to_owned()]).collect());
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
    assert_eq!(names(folder.path()).len(), others.len() + 1 + VERSIONS_KEPT);
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
    assert_eq!(names(folder.path()).len(), 1 + VERSIONS_KEPT);
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
