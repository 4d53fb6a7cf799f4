//! The charts of the experiments.

use report::{Axis, Chart, Marks, Series};

use super::table::Figure;
use geometry::Method;

/// The class of a method's series in the page's style.
pub(crate) fn class(method: Method) -> &'static str {
    match method {
        Method::RecHv => "rec-hv",
        Method::FreeSpace => "free-space",
    }
}

pub(crate) fn series(name: impl Into<String>, class: &'static str, marks: Marks) -> Series {
    Series { name: name.into(), class, marks }
}

/// The texts of a chart.
pub(crate) struct Caption<'a> {
    pub(crate) id: &'a str,
    pub(crate) title: &'a str,
    pub(crate) description: &'a str,
    pub(crate) x: &'a str,
    pub(crate) y: &'a str,
}

/// A chart whose axes cover all of its series; the y axis also 0.
pub(crate) fn chart(caption: Caption<'_>, series: Vec<Series>) -> Chart {
    chart_with(caption, series, Some(0.0))
}

/// A chart whose axes cover all of its series.
pub(crate) fn chart_of_values(caption: Caption<'_>, series: Vec<Series>) -> Chart {
    chart_with(caption, series, None)
}

fn chart_with(caption: Caption<'_>, series: Vec<Series>, also_y: Option<f64>) -> Chart {
    let x_values: Vec<f64> = series.iter().flat_map(|series| xs(&series.marks)).collect();
    let y_values: Vec<f64> = series.iter().flat_map(|series| series.marks.values()).collect();
    Chart {
        id: caption.id.to_owned(),
        title: caption.title.to_owned(),
        description: caption.description.to_owned(),
        x: Axis::within(caption.x, x_values),
        y: Axis::spanning(caption.y, y_values.into_iter().chain(also_y)),
        series,
    }
}

fn xs(marks: &Marks) -> Vec<f64> {
    marks.points().map(|point| point.0).collect()
}

/// The median over several rows at each index, as points of a line. Rows may end early.
pub(crate) fn medians(rows: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let longest = rows.iter().map(Vec::len).max().unwrap_or(0);
    (0..longest)
        .filter_map(|place| {
            let values = rows.iter().filter_map(|row| row.get(place).copied());
            let figure = Figure::median(super::table::Unit::Count, values)?;
            Some((place as f64, figure.median))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_hold_what_is_drawn() {
        let caption = Caption { id: "c", title: "", description: "", x: "x", y: "y" };
        let bars = Marks::Bars(vec![(1.0, -2.0, 3.0), (5.0, 0.0, 9.0)]);
        let chart = chart(caption, vec![series("s", "truth", bars)]);
        assert_eq!((chart.x.position(1.0), chart.x.position(5.0)), (0.0, 1.0));
        assert!(chart.y.position(-2.0) >= 0.0 && chart.y.position(9.0) <= 1.0);
        assert!(chart.y.position(-2.0) < chart.y.position(9.0));
    }

    #[test]
    fn medians_of_rows_of_different_lengths() {
        let rows = [vec![1.0, 5.0], vec![2.0], vec![9.0, 7.0]];
        assert_eq!(medians(&rows), [(0.0, 2.0), (1.0, 6.0)]);
        assert_eq!(medians(&[]), []);
    }
}
