//! The results of an experiment, before they are formatted as text or a page.

use report::{Chart, PagePicture};
use serde::Serialize;

use super::table::{Table, Verdict};

/// An experiment of the thesis, or another part of the report.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct Section {
    /// `1` to `11`, or `acceptance`.
    pub(crate) key: &'static str,
    pub(crate) title: String,
    /// The experiment of the thesis.
    pub(crate) thesis: String,
    /// The experiment here.
    pub(crate) here: String,
    /// The limits of the comparison.
    pub(crate) comparability: String,
    pub(crate) tables: Vec<Table>,
    /// Tables that most readers skip.
    pub(crate) details: Vec<Table>,
    #[serde(skip)]
    pub(crate) charts: Vec<Chart>,
    #[serde(skip)]
    pub(crate) pictures: Vec<PagePicture>,
}

/// A builder of the figures of a section.
#[derive(Default)]
pub(crate) struct Shown {
    pub(crate) tables: Vec<Table>,
    pub(crate) details: Vec<Table>,
    pub(crate) charts: Vec<Chart>,
    pub(crate) pictures: Vec<PagePicture>,
}

/// The sentences of a section.
pub(crate) struct Words {
    pub(crate) key: &'static str,
    pub(crate) title: &'static str,
    pub(crate) thesis: &'static str,
    pub(crate) here: String,
    pub(crate) comparability: &'static str,
}

impl Section {
    pub(crate) fn new(words: Words, shown: Shown) -> Self {
        Self {
            key: words.key,
            title: words.title.to_owned(),
            thesis: words.thesis.to_owned(),
            here: words.here,
            comparability: words.comparability.to_owned(),
            tables: shown.tables,
            details: shown.details,
            charts: shown.charts,
            pictures: shown.pictures,
        }
    }

    /// The number of targets with this result.
    pub(crate) fn count(&self, verdict: Verdict) -> usize {
        let rows = self.tables.iter().flat_map(|table| &table.rows);
        let cells = rows.flat_map(|row| &row.cells);
        cells.filter(|cell| **cell == super::table::Cell::Verdict(verdict)).count()
    }
}
