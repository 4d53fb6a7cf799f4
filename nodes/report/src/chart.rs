//! Line charts as SVG elements of the page: no fonts, no scripts, and the page's own colours, so that they
//! read in its light and its dark mode.

mod axis;

use std::fmt::Write as _;

use maud::{Markup, html};

pub use self::axis::Axis;

/// The drawing's own units: as wide as a phone's page, so that its text stays legible there.
const WIDTH: f64 = 480.0;
const PLOT_HEIGHT: f64 = 186.0;
const LEFT: f64 = 68.0;
const RIGHT: f64 = 8.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 44.0;
const DOT_RADIUS: f64 = 2.2;

/// One chart: what it shows, its axes, and its series from back to front.
#[derive(Clone, PartialEq, Debug)]
pub struct Chart {
    /// Names the chart in the page's markup; unique within a page.
    pub id: String,
    /// What it shows.
    pub title: String,
    /// The text for readers who do not see it.
    pub description: String,
    /// The axis to the right.
    pub x: Axis,
    /// The axis upwards.
    pub y: Axis,
    /// What is drawn, from back to front.
    pub series: Vec<Series>,
}

/// A series of a chart.
#[derive(Clone, PartialEq, Debug)]
pub struct Series {
    /// Its name, for the legend.
    pub name: String,
    /// The class that the page's style gives a colour.
    pub class: &'static str,
    /// Its values.
    pub marks: Marks,
}

/// How a series is drawn.
#[derive(Clone, PartialEq, Debug)]
pub enum Marks {
    /// A line through points `(x, y)`.
    Line(Vec<(f64, f64)>),
    /// Upright bars `(x, from, to)`.
    Bars(Vec<(f64, f64, f64)>),
    /// Dots at `(x, y)`.
    Dots(Vec<(f64, f64)>),
    /// Lines, each through points `(x, y)` of its own.
    Paths(Vec<Vec<(f64, f64)>>),
}

impl Chart {
    /// The chart as an `svg` element with its legend under it.
    pub(crate) fn render(&self) -> Markup {
        self.render_with(None)
    }

    /// The same, and the page's script marks the moment in it: its axis to the right is the time since the first scan.
    pub(crate) fn render_over_time(&self) -> Markup {
        let (first_s, last_s) = self.x.ends();
        let bottom = self.height() - BOTTOM;
        self.render_with(Some(format!(
            "{LEFT} {} {first_s} {last_s} {TOP} {bottom}",
            WIDTH - RIGHT
        )))
    }

    /// `time` has where the plot begins and ends to the right, the times there, and where it begins and ends downwards.
    fn render_with(&self, time: Option<String>) -> Markup {
        let (title_id, description_id) = (format!("{}-t", self.id), format!("{}-d", self.id));
        html! {
            figure.chart {
                figcaption { (self.title) }
                svg viewBox=(format!("0 0 {WIDTH} {}", number(self.height()))) role="img" data-time=[time]
                    aria-labelledby=(format!("{title_id} {description_id}")) {
                    title id=(title_id) { (self.title) }
                    desc id=(description_id) { (self.description) }
                    (self.render_axes())
                    @for series in &self.series { (self.render_series(series)) }
                }
                ul.legend {
                    @for series in &self.series {
                        li { span.key.(series.class).(series.marks.key_class()) aria-hidden="true" {} (series.name) }
                    }
                }
            }
        }
    }

    fn render_axes(&self) -> Markup {
        let (right, bottom) = (WIDTH - RIGHT, self.height() - BOTTOM);
        html! {
            g.grid {
                @for tick in self.y.ticks() {
                    @let y = self.y_of(tick);
                    line x1=(LEFT) x2=(right) y1=(number(y)) y2=(number(y)) {}
                    text x=(LEFT - 6.0) y=(number(y + 4.0)) text-anchor="end" { (self.y.tick_text(tick)) }
                }
                @for tick in self.x.ticks() {
                    @let x = self.x_of(tick);
                    line x1=(number(x)) x2=(number(x)) y1=(number(bottom)) y2=(number(bottom + 4.0)) {}
                    text x=(number(x)) y=(number(bottom + 18.0)) text-anchor="middle" { (self.x.tick_text(tick)) }
                }
            }
            text.axis x=(f64::midpoint(LEFT, right)) y=(number(self.height() - 6.0)) text-anchor="middle" { (self.x.label()) }
            text.axis x="2" y="15" { (self.y.label()) }
        }
    }

    fn render_series(&self, series: &Series) -> Markup {
        match &series.marks {
            Marks::Line(points) => {
                let mut path = String::new();
                self.write_line(&mut path, points);
                html! { path.line.(series.class) d=(path) {} }
            }
            Marks::Paths(lines) => {
                let mut path = String::new();
                for points in lines {
                    self.write_line(&mut path, points);
                }
                html! { path.line.(series.class) d=(path) {} }
            }
            Marks::Bars(bars) => {
                let mut path = String::new();
                for &(x, from, to) in bars {
                    self.write_point(&mut path, 'M', x, from);
                    self.write_point(&mut path, 'L', x, to);
                }
                html! { path.bars.(series.class) d=(path) stroke-width=(number(self.bar_width())) {} }
            }
            Marks::Dots(points) => html! {
                g.dots.(series.class) {
                    @for &(x, y) in points {
                        circle cx=(number(self.x_of(x))) cy=(number(self.y_of(y))) r=(DOT_RADIUS) {}
                    }
                }
            },
        }
    }

    /// Two thirds of the closest distance of two bars of any series, within what can be seen and what looks
    /// like a bar.
    fn bar_width(&self) -> f64 {
        let bars = self.series.iter().filter_map(|series| match &series.marks {
            Marks::Bars(bars) => Some(bars),
            Marks::Line(_) | Marks::Dots(_) | Marks::Paths(_) => None,
        });
        let mut positions: Vec<f64> = bars.flatten().map(|bar| self.x_of(bar.0)).collect();
        positions.sort_by(f64::total_cmp);
        let closest = positions
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .filter(|distance| *distance > 0.0)
            .fold(f64::INFINITY, f64::min);
        (closest * 2.0 / 3.0).clamp(1.5, 8.0)
    }

    fn write_line(&self, path: &mut String, points: &[(f64, f64)]) {
        for (index, &(x, y)) in points.iter().enumerate() {
            let command = if index == 0 { 'M' } else { 'L' };
            self.write_point(path, command, x, y);
        }
    }

    fn write_point(&self, path: &mut String, command: char, x: f64, y: f64) {
        // Writing to a string cannot fail.
        let _ = write!(path, "{command}{} {}", number(self.x_of(x)), number(self.y_of(y)));
    }

    fn x_of(&self, value: f64) -> f64 {
        LEFT + self.x.position(value) * (WIDTH - LEFT - RIGHT)
    }

    fn y_of(&self, value: f64) -> f64 {
        self.height() - BOTTOM - self.y.position(value) * self.plot_height()
    }

    fn height(&self) -> f64 {
        TOP + self.plot_height() + BOTTOM
    }

    /// Axes of one scale say how high the plot is for its width.
    fn plot_height(&self) -> f64 {
        self.y.height_for_width().map_or(PLOT_HEIGHT, |ratio| ratio * (WIDTH - LEFT - RIGHT))
    }
}

impl Marks {
    /// All values along the y axis.
    #[must_use]
    pub fn values(&self) -> Vec<f64> {
        self.points().map(|point| point.1).collect()
    }

    /// All points; of a bar its two ends.
    #[must_use]
    pub fn points(&self) -> Box<dyn Iterator<Item = (f64, f64)> + '_> {
        match self {
            Self::Line(points) | Self::Dots(points) => Box::new(points.iter().copied()),
            Self::Bars(bars) => {
                Box::new(bars.iter().flat_map(|bar| [(bar.0, bar.1), (bar.0, bar.2)]))
            }
            Self::Paths(lines) => Box::new(lines.iter().flatten().copied()),
        }
    }

    fn key_class(&self) -> &'static str {
        match self {
            Self::Line(_) | Self::Paths(_) => "line",
            Self::Bars(_) => "bars",
            Self::Dots(_) => "dots",
        }
    }
}

/// A coordinate to a tenth of a unit: finer than can be seen, and short.
fn number(value: f64) -> String {
    format!("{value:.1}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(series: Vec<Series>) -> Chart {
        Chart {
            id: "c".to_owned(),
            title: "A < B".to_owned(),
            description: "Rising.".to_owned(),
            x: Axis::spanning("time (s)", [0.0, 10.0]),
            y: Axis::spanning("points", [0.0, 100.0]),
            series,
        }
    }

    #[test]
    fn the_corners_of_the_data_are_the_corners_of_the_plot() {
        let chart = chart(Vec::new());
        assert!((chart.x_of(0.0) - LEFT).abs() < 1e-9);
        assert!((chart.x_of(10.0) - (WIDTH - RIGHT)).abs() < 1e-9);
        assert!((chart.y_of(0.0) - (TOP + PLOT_HEIGHT)).abs() < 1e-9);
        assert!((chart.y_of(100.0) - TOP).abs() < 1e-9);
    }

    #[test]
    fn each_kind_of_marks_is_drawn_at_its_place() {
        let series = |marks| Series { name: "s".to_owned(), class: "one", marks };
        let text = chart(vec![
            series(Marks::Line(vec![(0.0, 0.0), (10.0, 100.0)])),
            series(Marks::Bars(vec![(0.0, 0.0, 100.0)])),
            series(Marks::Dots(vec![(10.0, 0.0)])),
            series(Marks::Paths(vec![
                vec![(0.0, 0.0), (0.0, 100.0)],
                vec![(10.0, 0.0), (10.0, 100.0)],
            ])),
        ])
        .render()
        .into_string();
        assert!(text.contains("d=\"M68.0 220.0L472.0 34.0\""), "{text}");
        assert!(text.contains("d=\"M68.0 220.0L68.0 34.0\""), "{text}");
        let paths = "d=\"M68.0 220.0L68.0 34.0M472.0 220.0L472.0 34.0\"";
        assert!(text.contains(paths), "{text}");
        assert!(text.contains("cx=\"472.0\" cy=\"220.0\""), "{text}");
        assert!(text.contains("A &lt; B"), "the title is escaped: {text}");
    }

    #[test]
    fn a_metre_is_as_long_upwards_as_to_the_right() {
        for (x, y) in [([0.0, 10.0], [0.0, 4.0]), ([0.0, 1.0], [-20.0, 4.0]), ([3.0; 2], [3.0; 2])]
        {
            let [x, y] = Axis::of_one_scale(["x (m)", "y (m)"], [&x, &y]);
            let chart = Chart { x, y, ..chart(Vec::new()) };
            let (right, up) =
                (chart.x_of(2.0) - chart.x_of(1.0), chart.y_of(1.0) - chart.y_of(2.0));
            assert!((right - up).abs() < 1e-9 && (right > 1.0 || right == 0.0), "{right} {up}");
            assert!(chart.height() < WIDTH + 10.0);
        }
    }

    #[test]
    fn bars_of_all_series_stay_apart() {
        let bars = |from: i32| Series {
            name: String::new(),
            class: "one",
            marks: Marks::Bars(
                (from..100).step_by(2).map(|i| (f64::from(i) * 0.1, 0.0, 1.0)).collect(),
            ),
        };
        let chart = chart(vec![bars(0), bars(1)]);
        let distance = chart.x_of(0.1) - chart.x_of(0.0);
        assert!((chart.bar_width() - distance * 2.0 / 3.0).abs() < 1e-9);
    }
}
