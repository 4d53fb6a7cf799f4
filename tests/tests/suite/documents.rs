//! What the Markdown pages of the repository say exists: links, headings, paths, commands that the programs can read; those of `docs/` run,
//! and the book has each page.

mod book;
mod commands;
mod examples;
mod page;
mod runs;

use std::path::{Path, PathBuf};

use self::page::Page;

/// Lines of the README: two screens.
const README_LINES: usize = 100;

/// Folders and files at the top of the repository that a path in the text may begin with.
const TOP: [&str; 9] = [
    ".cargo/",
    ".ci/",
    "config/",
    "docs/",
    "launch-scripts/",
    "msgs/",
    "nodes/",
    "tests/",
    "target/release/",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// The Markdown pages below a folder, without what tools put there.
fn pages_below(folder: &Path, found: &mut Vec<Page>) {
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        let name = path.file_name().unwrap().to_string_lossy();
        if path.is_dir() {
            if name != "target" && name != "node_modules" && !name.starts_with('.') {
                pages_below(&path, found);
            }
        } else if name.ends_with(".md") {
            found.push(Page::read(&path));
        }
    }
}

fn pages() -> Vec<Page> {
    let mut found = Vec::new();
    for name in ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md"] {
        found.push(Page::read(&root().join(name)));
    }
    for folder in ["config", "docs", "launch-scripts", "msgs", "nodes", "tests"] {
        pages_below(&root().join(folder), &mut found);
    }
    assert!(found.len() >= 20, "{} pages", found.len());
    found
}

#[test]
fn the_readme_fits_on_two_screens() {
    let lines = std::fs::read_to_string(root().join("README.md")).unwrap().lines().count();
    assert!(lines <= README_LINES, "README.md has {lines} lines, more than {README_LINES}");
}

#[test]
fn links_lead_to_files_and_headings() {
    let mut broken = Vec::new();
    for page in pages() {
        for link in page.links.iter().filter(|link| !link.contains("://")) {
            let (path, heading) = link
                .split_once('#')
                .map_or((&link[..], None), |(path, heading)| (path, Some(heading)));
            let target = match path {
                "" => page.path.clone(),
                path => page.path.with_file_name("").join(path),
            };
            let is_there = target.exists()
                && heading.is_none_or(|heading| {
                    Page::read(&target).headings.iter().any(|one| one == heading)
                });
            if !is_there {
                broken.push(format!("{}: {link}", page.name()));
            }
        }
    }
    assert!(broken.is_empty(), "links that lead nowhere:\n{}", broken.join("\n"));
}

#[test]
fn paths_in_the_text_exist() {
    let mut missing = Vec::new();
    // The changelog names files that have gone since.
    for page in pages().iter().filter(|page| page.name() != "CHANGELOG.md") {
        let blocks = page.blocks.iter().map(|block| &block.text);
        let code = page.spans.iter().chain(blocks);
        for word in code.flat_map(|text| text.split_whitespace()) {
            let word = word.trim_end_matches([',', '.', ':', ';', ')']).trim_start_matches('(');
            // Of a pattern, the folder that it begins with.
            let path = match word.split_once(['*', '{']) {
                Some((begin, _)) => begin.rsplit_once('/').map_or("", |(folder, _)| folder),
                None => word,
            };
            let is_path = TOP.iter().any(|top| path.starts_with(top) && path.len() > top.len());
            // What a build makes is not in the repository.
            if !is_path || path.starts_with("target/") {
                continue;
            }
            let beside = page.path.with_file_name("").join(path);
            if !root().join(path).exists() && !beside.exists() {
                missing.push(format!("{}: {word}", page.name()));
            }
        }
    }
    assert!(missing.is_empty(), "paths that do not exist:\n{}", missing.join("\n"));
}

#[test]
fn commands_can_be_read() {
    let mut unreadable = Vec::new();
    let mut count = 0;
    for page in pages() {
        let lines = page.blocks.iter().flat_map(|block| commands::lines(&block.text));
        let mentions = page.spans.iter().flat_map(|span| span.split("; "));
        let checked = lines
            .map(|line| (commands::check(&line), line))
            .chain(mentions.map(|span| (commands::check_mention(span), span.to_owned())));
        for (result, line) in checked {
            match result {
                None => {}
                Some(Ok(())) => count += 1,
                Some(Err(reason)) => {
                    unreadable.push(format!("{}: {line}\n    {reason}", page.name()));
                }
            }
        }
    }
    assert!(unreadable.is_empty(), "commands that no program reads:\n{}", unreadable.join("\n"));
    assert!(count >= 100, "only {count} commands were found");
}
