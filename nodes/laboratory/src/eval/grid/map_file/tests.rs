use super::*;

/// Two rows of three cells: black, gray, white above white, white, black.
const IMAGE: &[u8] = b"P5\n3 2\n255\n\x00\xcd\xfe\xfe\xfe\x00";

fn read_with(yaml: &str, image: &[u8]) -> Result<OccupancyGrid, Failure> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.yaml");
    std::fs::write(&path, yaml).unwrap();
    std::fs::write(folder.path().join("map.pgm"), image).unwrap();
    read(&path)
}

fn yaml(more: &str) -> String {
    format!(
        "image: map.pgm\norigin: [-1.0, 2.5, 0.0]\noccupied_thresh: 0.65\nfree_thresh: 0.196\n{more}"
    )
}

#[test]
fn a_map_is_read_by_the_rules_of_map_server() {
    use GridCell::{Free, Occupied, Unknown};
    let grid = read_with(&yaml("resolution: 0.5\nnegate: 0\n"), IMAGE).unwrap();
    assert_eq!((grid.least, grid.width, grid.height), ([-2, 5], 3, 2));
    // The first row of cells is the lowest of the image.
    assert_eq!(grid.cells, [Free, Free, Occupied, Occupied, Unknown, Free]);
    let negated = read_with(&yaml("resolution: 0.5\nnegate: 1\n"), IMAGE).unwrap();
    assert_eq!(negated.cells[..3], [Occupied, Occupied, Free]);
}

#[test]
fn a_file_that_is_no_map_is_an_error_that_says_so() {
    for (text, image, said) in [
        (yaml("resolution: 0.0\n"), IMAGE, "a resolution of 0 m"),
        (yaml("resolution: .nan\n"), IMAGE, "a resolution of NaN m"),
        (yaml(""), IMAGE, "resolution"),
        (yaml("resolution: 1.0e-320\n"), IMAGE, "more than 1073741824 cells of 1e-320 m"),
        (yaml("resolution: 0.5\n").replace("2.5", "1.0e23"), IMAGE, "an origin at (-1.0, 1e23) m"),
        (yaml("resolution: 0.5\n"), &IMAGE[..16], "no binary PGM"),
        (yaml("resolution: 0.5\n"), b"P2\n1 1\n255\n7", "no binary PGM"),
        (yaml("resolution: 0.5\n"), b"P5\n0 0\n255\n", "no binary PGM"),
        (yaml("resolution: 0.5\n"), b"P5\n99999999999 99999999999\n255\n", "no binary PGM"),
        (yaml("resolution: 0.5\n").replace("map.pgm", "none.pgm"), IMAGE, "none.pgm"),
    ] {
        let error = read_with(&text, image).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}
