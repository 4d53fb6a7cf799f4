//! Parts of one straight edge that something has broken, joined again.

use nalgebra::{Point2, Vector2};

use super::LineConfig;
use super::false_alarms::FalseAlarms;
use super::growing::StraightEdge;

/// The ends of two parts may lie this far beside each other: each is fitted with an uncertainty of its own.
const MOST_BESIDE_PX: f64 = 3.0;
/// A part may begin this far before the end of the one that it continues: an edge that a crossing one has bent.
const MOST_OVERLAP_PX: f64 = 4.0;
/// A cell of the grid that starts are looked up in is no smaller than this.
const LEAST_CELL_PX: f64 = 16.0;

/// A straight edge, and the logarithm of how many such are expected of noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct RatedEdge {
    pub(super) edge: StraightEdge,
    pub(super) log_expected: f64,
}

/// Joins edges that follow each other on one line, the longest first and the nearest to each first, wherever the whole
/// is less to be expected of noise than either part: pixels between them count, and not as aligned unless they are.
pub(super) fn merge(
    edges: Vec<RatedEdge>,
    false_alarms: &FalseAlarms<'_>,
    size_px: (usize, usize),
    config: &LineConfig,
) -> Vec<RatedEdge> {
    let mut order: Vec<(f64, usize)> =
        edges.iter().enumerate().map(|(index, rated)| (rated.edge.length_px(), index)).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let starts = StartGrid::new(&edges, size_px, config.max_gap_px);
    let mut parts: Vec<Option<RatedEdge>> = edges.into_iter().map(Some).collect();
    for (_, index) in order {
        let Some(mut whole) = parts[index].take() else { continue };
        while let Some((next, joined)) = continued(&whole, &starts, &parts, false_alarms, config) {
            parts[next] = None;
            whole = joined;
        }
        parts[index] = Some(whole);
    }
    parts.into_iter().flatten().collect()
}

/// The nearest part that continues an edge, and both as one.
fn continued(
    edge: &RatedEdge,
    starts: &StartGrid,
    parts: &[Option<RatedEdge>],
    false_alarms: &FalseAlarms<'_>,
    config: &LineConfig,
) -> Option<(usize, RatedEdge)> {
    let (end, direction) = (edge.edge.end_px(), edge.edge.line.direction);
    let least_cosine = config.max_turn_rad.cos();
    let (mut nearest, mut least_gap_px) = (None, config.max_gap_px);
    for start in starts.around(end + 0.5 * config.max_gap_px * direction) {
        let between = start.start_px - end;
        let gap_px = between.dot(&direction);
        if gap_px > least_gap_px
            || gap_px < -MOST_OVERLAP_PX
            || direction.perp(&between).abs() > MOST_BESIDE_PX
            || direction.dot(&start.direction) < least_cosine
        {
            continue;
        }
        let joined =
            parts[start.part].as_ref().and_then(|next| joined(edge, next, false_alarms, config));
        if let Some(joined) = joined {
            (nearest, least_gap_px) = (Some((start.part, joined)), gap_px);
        }
    }
    nearest
}

/// Two parts as one edge; `None` where they do not lie on one line, or are better off as two.
fn joined(
    first: &RatedEdge,
    second: &RatedEdge,
    false_alarms: &FalseAlarms<'_>,
    config: &LineConfig,
) -> Option<RatedEdge> {
    let moments = first.edge.moments.joined(&second.edge.moments);
    if !moments.lie_within(config.max_rms_px * config.max_rms_px) {
        return None;
    }
    let line = moments.line(first.edge.line.direction);
    let [start, end] = [first.edge.start_px(), second.edge.end_px()];
    let ends = [start, first.edge.end_px(), second.edge.start_px(), end];
    if ends.iter().any(|&end| line.across_px(end).abs() > config.max_deviation_px) {
        return None;
    }
    let (start_along_px, end_along_px) = (line.along_px(start), line.along_px(end));
    let edge = StraightEdge { moments, line, start_along_px, end_along_px };
    if edge.length_px() < first.edge.length_px().max(second.edge.length_px()) {
        return None;
    }
    let log_expected = false_alarms.log_expected(&edge);
    (log_expected < first.log_expected.min(second.log_expected))
        .then_some(RatedEdge { edge, log_expected })
}

/// Where a part begins.
#[derive(Clone, Copy, Debug)]
struct Start {
    part: usize,
    start_px: Point2<f64>,
    direction: Vector2<f64>,
}

/// The starts of parts by where they are.
struct StartGrid {
    cell_px: f64,
    columns: usize,
    rows: usize,
    /// Cell by cell.
    starts: Vec<Start>,
    /// Where each cell's starts begin, and after the last one the number of all.
    firsts: Vec<usize>,
    half_box_px: f64,
}

impl StartGrid {
    fn new(parts: &[RatedEdge], (width_px, height_px): (usize, usize), max_gap_px: f64) -> Self {
        let cell_px = max_gap_px.max(LEAST_CELL_PX);
        let cells = |size: usize| (size as f64 / cell_px) as usize + 1;
        let (columns, rows) = (cells(width_px), cells(height_px));
        let half_box_px = 0.5 * max_gap_px + MOST_OVERLAP_PX.max(MOST_BESIDE_PX);
        let mut grid = Self {
            cell_px,
            columns,
            rows,
            starts: Vec::new(),
            firsts: vec![0; columns * rows + 1],
            half_box_px,
        };
        let mut starts: Vec<(usize, Start)> = parts
            .iter()
            .enumerate()
            .map(|(part, rated)| {
                let start_px = rated.edge.start_px();
                let direction = rated.edge.line.direction;
                let cell = grid.row_of(start_px.y) * columns + grid.column_of(start_px.x);
                (cell, Start { part, start_px, direction })
            })
            .collect();
        starts.sort_by_key(|&(cell, _)| cell);
        for &(cell, _) in &starts {
            grid.firsts[cell + 1] += 1;
        }
        for cell in 0..columns * rows {
            grid.firsts[cell + 1] += grid.firsts[cell];
        }
        grid.starts = starts.into_iter().map(|(_, start)| start).collect();
        grid
    }

    /// A negative number is cast to 0.
    fn column_of(&self, x_px: f64) -> usize {
        ((x_px / self.cell_px) as usize).min(self.columns - 1)
    }

    fn row_of(&self, y_px: f64) -> usize {
        ((y_px / self.cell_px) as usize).min(self.rows - 1)
    }

    /// The starts in the cells that a box around a point touches, which reaches over the longest gap and the most that
    /// two parts may lie beside each other.
    fn around(&self, centre: Point2<f64>) -> impl Iterator<Item = &Start> {
        let half = self.half_box_px;
        let columns = self.column_of(centre.x - half)..=self.column_of(centre.x + half);
        let rows = self.row_of(centre.y - half)..=self.row_of(centre.y + half);
        rows.flat_map(move |row| {
            let first = row * self.columns;
            let from = self.firsts[first + *columns.start()];
            let to = self.firsts[first + *columns.end() + 1];
            &self.starts[from..to]
        })
    }
}
