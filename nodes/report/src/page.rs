//! A page of sections with text, tables, charts and pictures, in the style of the report and as independent
//! of everything else: one file, no network, no script, no fonts; light and dark; as narrow as a phone.

#[cfg(test)]
mod tests;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use crate::Chart;
use crate::html_document::{document, scrolling};

const STYLE: &str = include_str!("page/style.css");

/// A page. Everything in it is plain text; the page escapes it.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Page {
    /// What kind of page it is, in a few words.
    pub kicker: String,
    /// Its title.
    pub title: String,
    /// How it was made: name and value.
    pub facts: Vec<(String, String)>,
    /// The outcome, the most important sentence first.
    pub lead: Vec<String>,
    /// Its sections; a list of them is at the top.
    pub sections: Vec<PageSection>,
}

/// A section of a page.
#[derive(Clone, PartialEq, Debug)]
pub struct PageSection {
    /// Names the section in the page's markup and in links; unique within the page.
    pub id: String,
    /// Its title.
    pub title: String,
    /// Its contents, from top to bottom.
    pub parts: Vec<PagePart>,
}

/// A part of a section.
#[derive(Clone, PartialEq, Debug)]
pub enum PagePart {
    /// A paragraph under a word of its own, such as "Here".
    Text {
        /// The word.
        label: String,
        /// The paragraph.
        text: String,
    },
    /// Tables, side by side where there is room.
    Tables(Vec<PageTable>),
    /// A table that most readers skip, behind its title.
    Details {
        /// Its title.
        title: String,
        /// The table.
        table: PageTable,
    },
    /// Charts, side by side where there is room.
    Charts(Vec<Chart>),
    /// Pictures, side by side where there is room.
    Pictures(Vec<PagePicture>),
}

/// A table.
#[derive(Clone, PartialEq, Debug)]
pub struct PageTable {
    /// What it shows.
    pub caption: String,
    /// The heads of its columns, that of the row names first.
    pub columns: Vec<String>,
    /// Its rows.
    pub rows: Vec<PageRow>,
}

/// A row of a table.
#[derive(Clone, PartialEq, Debug)]
pub struct PageRow {
    /// What it is about.
    pub name: String,
    /// Its cells.
    pub cells: Vec<PageCell>,
}

/// A cell of a table.
#[derive(Clone, PartialEq, Debug)]
pub struct PageCell {
    /// Its text.
    pub text: String,
    /// How it is to be read.
    pub tone: CellTone,
}

/// How a cell is to be read.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum CellTone {
    /// A figure like any other.
    #[default]
    Plain,
    /// A target that is reached.
    Good,
    /// A target that is missed.
    Bad,
    /// A sentence: it may wrap.
    Words,
}

/// A picture.
#[derive(Clone, PartialEq, Debug)]
pub struct PagePicture {
    /// The bytes of a PNG file.
    pub png: Vec<u8>,
    /// Its columns and rows.
    pub size_px: (u32, u32),
    /// The caption under it.
    pub caption: String,
    /// The text for readers who do not see it.
    pub alt: String,
}

/// The page as HTML.
#[must_use]
pub fn page_html(page: &Page) -> String {
    let body = html! {
        header {
            p.kicker { (page.kicker) }
            h1 { (page.title) }
            dl.facts {
                @for (name, value) in &page.facts { div { dt { (name) } dd { (value) } } }
            }
        }
        main {
            section aria-label="Outcome" {
                @for (index, sentence) in page.lead.iter().enumerate() {
                    p.lead[index == 0] { (sentence) }
                }
            }
            nav aria-label="Sections" {
                ol {
                    @for section in &page.sections {
                        li { a href=(format!("#{}", section.id)) { (section.title) } }
                    }
                }
            }
            @for section in &page.sections { (section_markup(section)) }
        }
    };
    document(&page.title, STYLE, None, &body)
}

fn section_markup(section: &PageSection) -> Markup {
    html! {
        section aria-labelledby=(section.id) {
            h2 id=(section.id) { (section.title) }
            @for part in &section.parts { (part_markup(part)) }
        }
    }
}

fn part_markup(part: &PagePart) -> Markup {
    match part {
        PagePart::Text { label, text } => html! { p { strong { (label) ". " } (text) } },
        PagePart::Tables(tables) => html! {
            div.tables { @for table in tables { (table_markup(table)) } }
        },
        PagePart::Details { title, table } => html! {
            details { summary { (title) } (table_markup(table)) }
        },
        PagePart::Charts(charts) => html! {
            div.pair { @for chart in charts { (chart.render()) } }
        },
        PagePart::Pictures(pictures) => html! {
            div.pair.pictures { @for picture in pictures { (picture_markup(picture)) } }
        },
    }
}

fn table_markup(table: &PageTable) -> Markup {
    html! {
        (scrolling(&html! {
            table {
                caption { (table.caption) }
                thead { tr {
                    @for (index, column) in table.columns.iter().enumerate() {
                        th.text[index == 0] scope="col" { (column) }
                    }
                } }
                tbody { @for row in &table.rows { tr {
                    th scope="row" { (row.name) }
                    @for cell in &row.cells { td class=[cell.tone.class()] { (cell.text) } }
                } } }
            }
        }))
    }
}

impl CellTone {
    fn class(self) -> Option<&'static str> {
        match self {
            Self::Plain => None,
            Self::Good => Some("good"),
            Self::Bad => Some("bad"),
            Self::Words => Some("text"),
        }
    }
}

fn picture_markup(picture: &PagePicture) -> Markup {
    let (width_px, height_px) = picture.size_px;
    html! {
        figure {
            img width=(width_px) height=(height_px) alt=(picture.alt) loading="lazy"
                src=(format!("data:image/png;base64,{}", STANDARD.encode(&picture.png)));
            figcaption { (picture.caption) }
        }
    }
}
