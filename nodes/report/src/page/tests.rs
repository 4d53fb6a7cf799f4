use super::*;
use crate::{Axis, Marks, Series};

fn cell(text: &str, tone: CellTone) -> PageCell {
    PageCell { text: text.to_owned(), tone }
}

fn example() -> Page {
    let table = PageTable {
        caption: "Shares".to_owned(),
        columns: ["", "published", "here"].map(str::to_owned).to_vec(),
        rows: vec![PageRow {
            name: "a < b".to_owned(),
            cells: vec![cell("94.4 %", CellTone::Plain), cell("missed", CellTone::Bad)],
        }],
    };
    let line = Marks::Line(vec![(0.0, 0.0), (1.0, 1.0)]);
    let chart = Chart {
        id: "rising".to_owned(),
        title: "Rising".to_owned(),
        description: "A line.".to_owned(),
        x: Axis::spanning("x", [0.0, 1.0]),
        y: Axis::spanning("y", [0.0, 1.0]),
        series: vec![Series { name: "ours".to_owned(), class: "free-space", marks: line }],
    };
    let picture = PagePicture {
        png: vec![1, 2, 3],
        size_px: (4, 2),
        caption: "The map".to_owned(),
        alt: "A \"map\".".to_owned(),
    };
    let parts = vec![
        PagePart::Text { label: "Here".to_owned(), text: "Scene <B>.".to_owned() },
        PagePart::Tables(vec![table.clone()]),
        PagePart::Details { title: "All runs".to_owned(), table },
        PagePart::Charts(vec![chart]),
        PagePart::Pictures(vec![picture]),
    ];
    Page {
        kicker: "stillmap".to_owned(),
        title: "Experiments".to_owned(),
        facts: vec![("Seeds".to_owned(), "3".to_owned())],
        lead: vec!["All is well.".to_owned()],
        sections: vec![PageSection { id: "one".to_owned(), title: "One".to_owned(), parts }],
    }
}

#[test]
fn all_parts_are_on_the_page_and_escaped() {
    let page = page_html(&example());
    for expected in [
        "<h2 id=\"one\">One</h2>",
        "href=\"#one\"",
        "Scene &lt;B&gt;.",
        "a &lt; b",
        "<td class=\"bad\">missed</td>",
        "<td>94.4 %</td>",
        "<summary>All runs</summary>",
        "id=\"rising-t\"",
        "data:image/png;base64,AQID",
        "alt=\"A &quot;map&quot;.\"",
    ] {
        assert!(page.contains(expected), "no {expected} in {page}");
    }
}

#[test]
fn the_page_needs_nothing_else() {
    let page = page_html(&example());
    for outside in ["http:", "https:", "<script", "<link", "@import", "url("] {
        assert!(!page.contains(outside), "{outside} in the page");
    }
    assert!(page.contains("width=device-width") && page.contains("prefers-color-scheme: dark"));
}

#[test]
fn every_class_of_a_series_has_a_colour_in_both_modes() {
    for class in ["published", "rec-hv", "free-space", "truth"] {
        assert!(STYLE.contains(&format!(".{class} {{ --series: var(--{class}); }}")), "{class}");
        assert_eq!(STYLE.matches(&format!("--{class}: #")).count(), 2, "{class}");
    }
}
