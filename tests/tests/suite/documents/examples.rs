//! The programs that pages of `docs/` print: each is the file beside this one, which is compiled here and runs.

use super::page::Page;
use super::root;

#[allow(
    dead_code,
    unreachable_pub,
    missing_docs,
    reason = "as the reader has it, in a file of its own"
)]
mod cores;
#[allow(
    dead_code,
    unreachable_pub,
    missing_docs,
    reason = "as the reader has it, in a file of its own"
)]
mod near_scan;

/// The file is what the page prints.
fn is_printed(page: &str, file: &str) {
    let page = Page::read(&root().join("docs").join(page));
    let here = "tests/tests/suite/documents/examples";
    let text = std::fs::read_to_string(root().join(here).join(file)).unwrap();
    assert_eq!(page.rust, [text], "{}: its Rust is {here}/{file}", page.name());
}

#[test]
fn the_cores_find_what_moves_without_ros() {
    is_printed("cores.md", "cores.rs");
    cores::main().unwrap();
    // It is written where the program runs.
    std::fs::remove_file("map.ply").unwrap();
}

#[test]
fn a_node_is_written_as_its_page_says() {
    is_printed("write_a_node.md", "near_scan.rs");
    let scan =
        msgs::sensor_msgs::LaserScan { ranges: vec![1.0, 5.0, f32::NAN], ..Default::default() };
    let near = near_scan::without_far(&scan, 4.0).ranges;
    assert!(near[0] == 1.0 && near[1] == f32::INFINITY && near[2].is_nan(), "{near:?}");
}
