//! The sections as text for a terminal.

use std::fmt::Write as _;

use super::section::Section;
use super::table::Table;

/// A section with its tables; charts and images are for the page.
pub(crate) fn section_text(section: &Section) -> String {
    let mut text = format!("== {}\n", section.title);
    for (label, sentence) in [
        ("thesis", &section.thesis),
        ("here", &section.here),
        ("to compare", &section.comparability),
    ] {
        text.push_str(&wrapped(&format!("{label}: {sentence}")));
    }
    for table in &section.tables {
        text.push('\n');
        text.push_str(&table_text(table));
    }
    text
}

const WIDTH: usize = 100;

/// Lines of at most [`WIDTH`] characters, broken between words.
fn wrapped(paragraph: &str) -> String {
    let mut text = String::new();
    let mut length = 0;
    for word in paragraph.split_whitespace() {
        let word_length = word.chars().count();
        if length > 0 && length + 1 + word_length > WIDTH {
            text.push('\n');
            length = 0;
        } else if length > 0 {
            text.push(' ');
            length += 1;
        }
        text.push_str(word);
        length += word_length;
    }
    text.push('\n');
    text
}

/// A table with aligned columns: names to the left, figures to the right.
fn table_text(table: &Table) -> String {
    let mut lines = vec![[vec![String::new()], table.columns.clone()].concat()];
    for row in &table.rows {
        let cells = row.cells.iter().map(|cell| cell.text());
        lines.push([vec![row.name.clone()], cells.collect()].concat());
    }
    let length = |cell: &String| cell.chars().count();
    let columns = lines.iter().map(Vec::len).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns)
        .map(|column| {
            lines.iter().filter_map(|line| line.get(column)).map(length).max().unwrap_or(0)
        })
        .collect();
    let mut text = format!("{}\n", table.caption);
    for line in &lines {
        let mut written = String::new();
        for (column, (cell, width)) in line.iter().zip(widths.iter().copied()).enumerate() {
            // Writing to a string cannot fail.
            let _ = if column == 0 {
                write!(written, "  {cell:<width$}")
            } else {
                write!(written, "  {cell:>width$}")
            };
        }
        text.push_str(written.trim_end());
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::table::{Cell, Row, Unit};
    use super::*;

    #[test]
    fn figures_stand_under_their_heads() {
        let rows = vec![
            Row::new("mean", [Cell::one(Unit::Metres, 0.0559), Cell::Absent]),
            Row::new(
                "largest of all",
                [Cell::one(Unit::Metres, 0.144), Cell::one(Unit::Share, 1.0)],
            ),
        ];
        let text = table_text(&Table::new("Errors", ["published", "here"], rows));
        let expected = [
            "Errors",
            "                  published   here",
            "  mean             0.0559 m      \u{2013}",
            "  largest of all   0.1440 m  100 %",
        ];
        assert_eq!(text.lines().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn long_paragraphs_are_broken_between_words() {
        let text = wrapped(&"word ".repeat(50));
        assert!(text.lines().all(|line| line.len() <= WIDTH && line.ends_with("word")), "{text}");
        assert_eq!(text.split_whitespace().count(), 50);
    }
}
