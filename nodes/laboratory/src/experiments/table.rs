//! Tables of figures, for the page, the terminal and JSON.

use estimation::quantile::median_of_sorted;
use serde::Serialize;

/// The unit of a figure.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Unit {
    /// A part of 1, shown in percent.
    Share,
    Metres,
    Milliseconds,
    Degrees,
    Count,
    /// A ratio.
    Times,
}

/// The median of several values, and their range.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(crate) struct Figure {
    pub(crate) unit: Unit,
    pub(crate) median: f64,
    /// The least, if there are several values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) min: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) max: Option<f64>,
    /// The number of values; 1 for a single value.
    pub(crate) values: usize,
    /// Shown with exactly the digits that it was given with.
    #[serde(skip)]
    pub(crate) is_as_printed: bool,
}

impl Figure {
    /// A single value.
    pub(crate) fn one(unit: Unit, value: f64) -> Self {
        Self { unit, median: value, min: None, max: None, values: 1, is_as_printed: false }
    }

    /// A value of the thesis, or a target: shown with its original digits.
    pub(crate) fn as_printed(unit: Unit, value: f64) -> Self {
        Self { is_as_printed: true, ..Self::one(unit, value) }
    }

    /// The median of values, for an even number the mean of the two middle ones; `None` without values. Non-finite values are
    /// left out.
    pub(crate) fn median(unit: Unit, values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let count = values.len();
        let several = count > 1;
        Some(Self {
            unit,
            median: median_of_sorted(&values)?,
            min: values.first().copied().filter(|_| several),
            max: values.last().copied().filter(|_| several),
            values: count,
            is_as_printed: false,
        })
    }

    /// The value and its unit, followed by the range of several values.
    pub(crate) fn text(&self) -> String {
        let number = |value: f64| {
            if self.is_as_printed { self.unit.as_printed(value) } else { self.unit.number(value) }
        };
        let median = format!("{}{}", number(self.median), self.unit.suffix());
        match (self.min, self.max) {
            // A range that is equal in print is left out.
            (Some(min), Some(max)) if number(min) != number(max) => {
                format!("{median} ({} .. {})", number(min), number(max))
            }
            _ => median,
        }
    }
}

impl Unit {
    fn suffix(self) -> &'static str {
        match self {
            Self::Share => " %",
            Self::Metres => " m",
            Self::Milliseconds => " ms",
            Self::Degrees => "\u{b0}",
            Self::Count => "",
            Self::Times => " x",
        }
    }

    /// The fewest digits that represent the value.
    fn as_printed(self, value: f64) -> String {
        /// Finer digits come from the conversion.
        const STEPS: f64 = 1e7;
        let value = if self == Self::Share { 100.0 * value } else { value };
        format!("{}", (value * STEPS).round() / STEPS)
    }

    fn number(self, value: f64) -> String {
        match self {
            Self::Share => percent(value),
            Self::Metres => format!("{value:.4}"),
            Self::Milliseconds => format!("{value:.2}"),
            Self::Degrees => format!("{value:.1}"),
            Self::Times => format!("{value:.2}"),
            Self::Count if value.fract() == 0.0 => format!("{value:.0}"),
            Self::Count => format!("{value:.1}"),
        }
    }
}

/// Percents with one digit after the point, and with two near 0 and 100, where a tenth is too coarse.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    let near_end = percent.abs() < 2.0 || (98.0..100.0).contains(&percent);
    match percent {
        0.0 => "0".to_owned(),
        100.0 => "100".to_owned(),
        _ if near_end => format!("{percent:.2}"),
        _ => format!("{percent:.1}"),
    }
}

/// A cell.
#[derive(Clone, PartialEq, Debug, Serialize)]
#[serde(untagged)]
pub(crate) enum Cell {
    Figure(Figure),
    /// A text instead of a number.
    Words(String),
    Verdict(Verdict),
    /// No figure.
    Absent,
}

/// Whether a target is met.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Verdict {
    Met,
    Missed,
    /// Not measured by this command, or not measured with these arguments.
    NotRun,
}

impl Verdict {
    pub(crate) fn of(is_met: bool) -> Self {
        if is_met { Self::Met } else { Self::Missed }
    }

    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Met => "met",
            Self::Missed => "missed",
            Self::NotRun => "not run",
        }
    }
}

impl Cell {
    /// A single value.
    pub(crate) fn one(unit: Unit, value: f64) -> Self {
        Self::Figure(Figure::one(unit, value))
    }

    /// A value of the thesis.
    pub(crate) fn published(unit: Unit, value: f64) -> Self {
        Self::Figure(Figure::as_printed(unit, value))
    }

    /// The median of values.
    pub(crate) fn median(unit: Unit, values: impl IntoIterator<Item = f64>) -> Self {
        Figure::median(unit, values).into()
    }

    pub(crate) fn words(words: impl Into<String>) -> Self {
        Self::Words(words.into())
    }

    pub(crate) fn text(&self) -> String {
        match self {
            Self::Figure(figure) => figure.text(),
            Self::Words(words) => words.clone(),
            Self::Verdict(verdict) => verdict.text().to_owned(),
            Self::Absent => "\u{2013}".to_owned(),
        }
    }
}

impl From<Option<Figure>> for Cell {
    fn from(figure: Option<Figure>) -> Self {
        figure.map_or(Self::Absent, Self::Figure)
    }
}

/// A row: its name, and a cell for each column.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct Row {
    pub(crate) name: String,
    pub(crate) cells: Vec<Cell>,
}

impl Row {
    pub(crate) fn new(name: impl Into<String>, cells: impl Into<Vec<Cell>>) -> Self {
        Self { name: name.into(), cells: cells.into() }
    }
}

/// A table. Its first column has the names of the rows and no header.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct Table {
    pub(crate) caption: String,
    /// The headers of the columns of the cells.
    pub(crate) columns: Vec<String>,
    pub(crate) rows: Vec<Row>,
}

/// The columns of most tables.
pub(crate) const AGAINST_THE_THESIS: [&str; 3] = ["published", "rec_hv here", "free_space here"];

impl Table {
    pub(crate) fn new<'a>(
        caption: impl Into<String>,
        columns: impl IntoIterator<Item = &'a str>,
        rows: Vec<Row>,
    ) -> Self {
        let columns = columns.into_iter().map(str::to_owned).collect();
        Self { caption: caption.into(), columns, rows }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_median_and_the_reach_of_values() {
        let figure = Figure::median(Unit::Count, [4.0, 1.0, f64::NAN, 2.0, 9.0]).unwrap();
        assert_eq!((figure.median, figure.min, figure.max), (3.0, Some(1.0), Some(9.0)));
        assert_eq!(figure.text(), "3 (1 .. 9)");
        assert_eq!(Figure::median(Unit::Count, [f64::NAN]), None);
        assert_eq!(Figure::median(Unit::Metres, [0.05]).unwrap().text(), "0.0500 m");
    }

    #[test]
    fn percents_say_more_near_their_ends() {
        for (share, text) in [
            (0.0, "0 %"),
            (1.0, "100 %"),
            (0.9996, "99.96 %"),
            (0.8643, "86.4 %"),
            (0.0042, "0.42 %"),
            (1.15, "115.0 %"),
        ] {
            assert_eq!(Figure::one(Unit::Share, share).text(), text);
        }
    }

    #[test]
    fn what_is_printed_keeps_its_digits() {
        for (unit, value, text) in [
            (Unit::Share, 0.98, "98 %"),
            (Unit::Share, 0.944, "94.4 %"),
            (Unit::Share, 0.8643, "86.43 %"),
            (Unit::Metres, 0.000_798, "0.000798 m"),
            (Unit::Milliseconds, 4210.0, "4210 ms"),
        ] {
            assert_eq!(Cell::published(unit, value).text(), text);
        }
    }

    #[test]
    fn equal_values_show_no_reach() {
        assert_eq!(Figure::median(Unit::Share, [1.0, 1.0, 1.0]).unwrap().text(), "100 %");
    }

    #[test]
    fn json_holds_numbers_and_null() {
        let cells =
            [Cell::median(Unit::Share, [0.5, 0.7]), Cell::Absent, Cell::Verdict(Verdict::Met)];
        let json = serde_json::to_value(cells).unwrap();
        assert!((json[0]["median"].as_f64().unwrap() - 0.6).abs() < 1e-12);
        assert_eq!(
            (json[0]["unit"].as_str(), json[0]["values"].as_u64()),
            (Some("share"), Some(2))
        );
        assert!(json[1].is_null());
        assert_eq!(json[2], "met");
    }

    proptest! {
        #[test]
        fn the_median_lies_within_the_reach(values in prop::collection::vec(-1e6f64..1e6, 2..9)) {
            let figure = Figure::median(Unit::Count, values).unwrap();
            prop_assert!(figure.min.unwrap() <= figure.median && figure.median <= figure.max.unwrap());
        }
    }
}
