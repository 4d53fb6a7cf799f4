//! The book of the site: its summary has each page once, and `.ci/site` builds it.

use std::collections::BTreeSet;

use super::page::Page;
use super::{pages, root};

/// Pages that are for those who look at test data, and no part of the book.
const NOT_IN_THE_BOOK: [&str; 4] = ["docs/SUMMARY.md", "docs/upstream/", "msgs/tests/", "tests/"];

#[test]
fn the_summary_has_each_page_once() {
    let docs = root().join("docs");
    let summary = Page::read(&docs.join("SUMMARY.md"));
    let listed: Vec<String> = summary
        .links
        .iter()
        .map(|link| docs.join(link).canonicalize().unwrap())
        .map(|path| path.strip_prefix(root()).unwrap().display().to_string())
        .collect();
    let once: BTreeSet<&str> = listed.iter().map(String::as_str).collect();
    assert_eq!(once.len(), listed.len(), "a page stands twice in docs/SUMMARY.md");
    let pages: Vec<String> = pages().iter().map(Page::name).collect();
    let is_of_book = |page: &&str| {
        let is_data = page.contains("/data/") || *page == "nodes/robot/src/doctor/checks.md";
        !is_data && !NOT_IN_THE_BOOK.iter().any(|other| page.starts_with(other))
    };
    let expected: BTreeSet<&str> = pages.iter().map(String::as_str).filter(is_of_book).collect();
    assert_eq!(once, expected, "docs/SUMMARY.md has each page of the repository, and no other");
}
