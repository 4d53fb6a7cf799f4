//! The outcome of a run as a table of characters, for a terminal.

use crate::headline::{grouped, object_name, percent};
use crate::{DynamicScore, Summary};

/// Between two columns.
const GAP: &str = "  ";

/// The figures of a run, in lines of aligned columns: fewer than [`headline`](crate::headline) has, and quicker to read.
#[must_use]
pub fn figures_table(summary: &Summary) -> Vec<String> {
    let objects = summary.truth.as_ref().map(objects).unwrap_or_default();
    let mut lines = aligned(&figures(summary), &[Side::Left, Side::Right, Side::Left]);
    if objects.len() > 1 {
        lines.push(String::new());
        lines.extend(aligned(
            &objects,
            &[Side::Left, Side::Right, Side::Right, Side::Right, Side::Right],
        ));
    }
    lines
}

/// A figure a row: its name, its value, what it is a number of.
fn figures(summary: &Summary) -> Vec<Vec<String>> {
    let map = &summary.map;
    let row = |name: &str, value: String, of: String| vec![name.to_owned(), value, of];
    let moving = summary.cycles.total - summary.cycles.without_zone;
    let mut rows = vec![
        row(
            "cycles",
            grouped(summary.cycles.total),
            format!(
                "in {:.1} s, {} of them with something that moves",
                summary.duration_s,
                grouped(moving)
            ),
        ),
        row("map", grouped(map.points), "points".to_owned()),
        row("removed", grouped(map.kept_out.moved), "voxels in which something moved".to_owned()),
    ];
    if let Some(surface) = summary.truth.as_ref().and_then(|score| score.map.surface.as_ref()) {
        rows.push(row(
            "error",
            format!("{:.1}", 1e3 * surface.accuracy_m),
            format!(
                "mm from the true surface in the mean; {} of it in the map",
                percent(Some(surface.recall))
            ),
        ));
    }
    if summary.dropped() > 0 {
        rows.push(row(
            "dropped",
            grouped(summary.dropped() as usize),
            "inputs; the report says where and why".to_owned(),
        ));
    }
    rows
}

/// What became of each object that was in view, with a row of headings.
fn objects(score: &DynamicScore) -> Vec<Vec<String>> {
    let headings = ["moved", "cycles in view", "found", "removed", "voxels left"];
    let of = |object: &crate::ObjectScore| {
        vec![
            object_name(object),
            grouped(object.cycles_in_view),
            grouped(object.cycles_found_or_removed),
            grouped(object.cycles_removed),
            format!("{} of {}", grouped(object.own_voxels_left), grouped(object.own_voxels)),
        ]
    };
    let in_view = score.objects.iter().filter(|object| object.cycles_in_view > 0);
    std::iter::once(headings.map(str::to_owned).to_vec()).chain(in_view.map(of)).collect()
}

/// On which side the texts of a column begin or end.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Side {
    Left,
    Right,
}

fn aligned(rows: &[Vec<String>], sides: &[Side]) -> Vec<String> {
    let length = |text: &String| text.chars().count();
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.get(column)).map(length).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..sides.len()).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).zip(sides).map(|((text, width), side)| match side {
            Side::Left => format!("{text:<width$}"),
            Side::Right => format!("{text:>width$}"),
        });
        cells.collect::<Vec<_>>().join(GAP).trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run_record::tests::{cycle, run};

    #[test]
    fn columns_are_as_wide_as_their_longest_text() {
        let rows = [["a", "1"], ["long", "1,000"]].map(|row| row.map(str::to_owned).to_vec());
        assert_eq!(aligned(&rows, &[Side::Left, Side::Right]), ["a         1", "long  1,000"]);
    }

    #[test]
    fn a_run_without_truth_has_no_table_of_objects() {
        let summary = Summary::of_run(&run(vec![cycle(0), cycle(1)]), None, false).unwrap();
        assert_eq!(
            figures_table(&summary),
            [
                "cycles   2  in 0.1 s, 0 of them with something that moves",
                "map      0  points",
                "removed  0  voxels in which something moved",
            ]
        );
    }
}
