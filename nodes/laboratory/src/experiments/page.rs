//! The sections as one HTML page.

use report::{CellTone, Page, PageCell, PagePart, PageRow, PageSection, PageTable, page_html};

use super::section::Section;
use super::settings::Settings;
use super::table::{Cell, Table, Verdict};

/// The page of all sections.
pub(crate) fn page(settings: &Settings, sections: &[Section]) -> String {
    page_html(&Page {
        kicker: "stillmap experiments".to_owned(),
        title: "The experiments of Rec-HV, run again".to_owned(),
        facts: vec![
            ("Methods".to_owned(), "rec_hv (as published), free_space".to_owned()),
            ("Seeds".to_owned(), settings.seeds.to_string()),
        ],
        lead: lead(settings, sections),
        sections: sections.iter().map(page_section).collect(),
    })
}

/// The results as sentences.
pub(crate) fn lead(settings: &Settings, sections: &[Section]) -> Vec<String> {
    let count = |verdict| sections.iter().map(|section| section.count(verdict)).sum::<usize>();
    let (met, missed) = (count(Verdict::Met), count(Verdict::Missed));
    let mut lead = Vec::new();
    if met + missed > 0 {
        lead.push(format!(
            "Of {} targets that were measured, free_space meets {met} and misses {missed}.",
            met + missed
        ));
    }
    for row in sections.iter().flat_map(|section| &section.tables).flat_map(|table| &table.rows) {
        if row.cells.contains(&Cell::Verdict(Verdict::Missed))
            && let [target, _, ours, place, ..] = &row.cells[..]
        {
            lead.push(format!(
                "Missed: {}: {} ({}), where the target is {}.",
                row.name,
                ours.text(),
                place.text(),
                target.text()
            ));
        }
    }
    lead.push(
        "Figures are medians over the seeds, with the least and the largest in brackets. The rooms of the thesis, \
         its objects and its recordings are not to be had: everything here is simulated, and each section says what \
         can be compared."
            .to_owned(),
    );
    if settings.is_quick() {
        lead.push(
            "This was a quick run, with one seed, few cycles and a quarter of the pixels: it shows that everything \
             works, and its figures mean little."
                .to_owned(),
        );
    }
    lead
}

fn page_section(section: &Section) -> PageSection {
    let text =
        |label: &str, text: &String| PagePart::Text { label: label.to_owned(), text: text.clone() };
    let mut parts = vec![
        text("The thesis", &section.thesis),
        text("Here", &section.here),
        text("To compare", &section.comparability),
        PagePart::Tables(section.tables.iter().map(page_table).collect()),
    ];
    let details = section
        .details
        .iter()
        .map(|table| PagePart::Details { title: table.caption.clone(), table: page_table(table) });
    parts.extend(details);
    if !section.charts.is_empty() {
        parts.push(PagePart::Charts(section.charts.clone()));
    }
    if !section.pictures.is_empty() {
        parts.push(PagePart::Pictures(section.pictures.clone()));
    }
    PageSection { id: format!("experiment-{}", section.key), title: section.title.clone(), parts }
}

fn page_table(table: &Table) -> PageTable {
    let row = |row: &super::table::Row| PageRow {
        name: row.name.clone(),
        cells: row.cells.iter().map(page_cell).collect(),
    };
    PageTable {
        caption: table.caption.clone(),
        columns: std::iter::once(String::new()).chain(table.columns.iter().cloned()).collect(),
        rows: table.rows.iter().map(row).collect(),
    }
}

/// The longest text of a cell that does not wrap.
const LONGEST_LINE: usize = 24;

fn page_cell(cell: &Cell) -> PageCell {
    let tone = match cell {
        Cell::Verdict(Verdict::Met) => CellTone::Good,
        Cell::Verdict(Verdict::Missed) => CellTone::Bad,
        Cell::Words(words) if words.chars().count() > LONGEST_LINE => CellTone::Words,
        Cell::Words(_) | Cell::Figure(_) | Cell::Verdict(Verdict::NotRun) | Cell::Absent => {
            CellTone::Plain
        }
    };
    PageCell { text: cell.text(), tone }
}
