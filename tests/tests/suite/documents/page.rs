//! A Markdown page: its links, headings and code.

use std::path::{Path, PathBuf};

use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};

/// What a page refers to.
pub(super) struct Page {
    pub(super) path: PathBuf,
    /// The targets of links and pictures.
    pub(super) links: Vec<String>,
    /// The anchors of the headings, as GitHub makes them.
    pub(super) headings: Vec<String>,
    /// Code within the text.
    pub(super) spans: Vec<String>,
    /// Blocks of code in no language or a shell's.
    pub(super) blocks: Vec<Block>,
    /// Blocks of code in Rust.
    pub(super) rust: Vec<String>,
}

/// A block of commands.
#[derive(Default)]
pub(super) struct Block {
    pub(super) text: String,
    /// What stands behind the language at its head.
    pub(super) mark: String,
}

impl Page {
    pub(super) fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let mut page = Self {
            path: path.to_owned(),
            links: Vec::new(),
            headings: Vec::new(),
            spans: Vec::new(),
            blocks: Vec::new(),
            rust: Vec::new(),
        };
        let mut heading: Option<String> = None;
        let mut block: Option<(String, Block)> = None;
        for event in Parser::new_ext(&text, Options::ENABLE_TABLES) {
            match event {
                Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                    page.links.push(dest_url.into_string());
                }
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => {
                    let anchor = anchor(&heading.take().unwrap_or_default());
                    let taken = page.headings.iter().filter(|one| **one == anchor).count();
                    page.headings.push(match taken {
                        0 => anchor,
                        taken => format!("{anchor}-{taken}"),
                    });
                }
                Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(head))) => {
                    let (language, mark) = head.split_once(' ').unwrap_or((&head, ""));
                    let mark = mark.trim().to_owned();
                    block = Some((language.to_owned(), Block { mark, ..Block::default() }));
                }
                Event::End(TagEnd::CodeBlock) => match block.take() {
                    Some((language, block)) if matches!(&*language, "" | "sh" | "bash") => {
                        page.blocks.push(block);
                    }
                    Some((language, block)) if language == "rust" => page.rust.push(block.text),
                    _ => {}
                },
                Event::Text(text) => match (&mut heading, &mut block) {
                    (Some(into), _) | (None, Some((_, Block { text: into, .. }))) => {
                        into.push_str(&text);
                    }
                    (None, None) => {}
                },
                Event::Code(code) => {
                    if let Some(heading) = &mut heading {
                        heading.push_str(&code);
                    }
                    page.spans.push(code.into_string());
                }
                _ => {}
            }
        }
        page
    }

    /// The path within the repository.
    pub(super) fn name(&self) -> String {
        self.path.strip_prefix(super::root()).unwrap_or(&self.path).display().to_string()
    }
}

/// The anchor of a heading: lower case, hyphens for spaces, no punctuation.
fn anchor(heading: &str) -> String {
    let is_kept = |one: &char| one.is_alphanumeric() || matches!(one, ' ' | '-' | '_');
    heading.to_lowercase().chars().filter(is_kept).collect::<String>().replace(' ', "-")
}

#[test]
fn anchors_are_those_of_github() {
    assert_eq!(anchor("The kernel's receive buffer"), "the-kernels-receive-buffer");
    assert_eq!(anchor("`rec_hv`, as published"), "rec_hv-as-published");
}
