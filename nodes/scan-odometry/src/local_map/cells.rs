//! The lines of the map by the cells of a square grid.

use nalgebra::Point2;

use super::{CELL_M, MapLine};

/// A grid around the platform. The lines of a row of neighbouring cells are in one slice.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    /// Cells along a side.
    side: usize,
    reach_m: f64,
    origin_m: Point2<f64>,
    /// Where the lines of a cell start in `order`; one more than there are cells.
    starts: Vec<u32>,
    /// Indices of lines, cell by cell.
    order: Vec<u32>,
}

impl Cells {
    pub(super) fn new(reach_m: f64) -> Self {
        let side = (2.0 * reach_m / CELL_M).ceil() as usize + 1;
        let origin_m = Point2::new(-reach_m, -reach_m);
        Self { side, reach_m, origin_m, starts: vec![0; side * side + 1], order: Vec::new() }
    }

    /// Puts the lines into the cells of a grid around a point, by counting. Lines beyond the grid are left out.
    pub(super) fn fill(&mut self, around_m: &Point2<f64>, lines: &[MapLine]) {
        // At whole cells: a static platform does not shift the grid.
        let corner = |coordinate: f64| ((coordinate - self.reach_m) / CELL_M).floor() * CELL_M;
        self.origin_m = Point2::new(corner(around_m.x), corner(around_m.y));
        self.starts.fill(0);
        let cell_of = |line: &MapLine| self.cell(&line.position_m);
        let cells: Vec<Option<usize>> = lines.iter().map(cell_of).collect();
        for cell in cells.iter().flatten() {
            self.starts[cell + 1] += 1;
        }
        let mut total = 0;
        for start in &mut self.starts {
            total += *start;
            *start = total;
        }
        self.order.clear();
        self.order.resize(total as usize, 0);
        let mut next = self.starts.clone();
        for (index, cell) in cells.iter().enumerate() {
            if let Some(cell) = cell {
                self.order[next[*cell] as usize] = index as u32;
                next[*cell] += 1;
            }
        }
    }

    /// The indices of the lines in the cells around a point, a slice a row.
    pub(super) fn rows_around(
        &self,
        point_m: &Point2<f64>,
        ring: usize,
    ) -> impl Iterator<Item = &[u32]> {
        let (column, row) =
            (self.place(point_m.x, self.origin_m.x), self.place(point_m.y, self.origin_m.y));
        let ring = ring as i64;
        let last = self.side as i64 - 1;
        let columns = (column - ring).max(0)..=(column + ring).min(last);
        let rows = (row - ring).max(0)..=(row + ring).min(last);
        rows.filter_map(move |row| {
            if columns.is_empty() {
                return None;
            }
            let at = |column: i64| (row * self.side as i64 + column) as usize;
            let (from, to) =
                (self.starts[at(*columns.start())], self.starts[at(*columns.end()) + 1]);
            self.order.get(from as usize..to as usize)
        })
    }

    fn place(&self, coordinate_m: f64, origin_m: f64) -> i64 {
        // Saturates where the number is large or none.
        ((coordinate_m - origin_m) / CELL_M).floor().clamp(-1e9, 1e9) as i64
    }

    fn cell(&self, point_m: &Point2<f64>) -> Option<usize> {
        let (column, row) =
            (self.place(point_m.x, self.origin_m.x), self.place(point_m.y, self.origin_m.y));
        let side = self.side as i64;
        let is_within = (0..side).contains(&column) && (0..side).contains(&row);
        is_within.then_some((row * side + column) as usize)
    }
}
