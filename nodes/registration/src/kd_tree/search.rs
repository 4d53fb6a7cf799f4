//! How neighbours are found: from the root to the leaf of the query, and then wherever a nearer point
//! may still be. A half space is left out by its distance, which grows axis by axis (Arya and Mount 1993).

use super::{KdTree, LEAF_POINTS, middle};

/// No more neighbours can be requested.
pub(crate) const MOST_NEIGHBOURS: usize = 32;

/// The nearest points of a place, the nearest first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Neighbours {
    wanted: usize,
    found: usize,
    squares_m2: [f32; MOST_NEIGHBOURS],
    numbers: [u32; MOST_NEIGHBOURS],
    /// The square of the distance from which on points are of no use.
    limit_m2: f32,
}

impl Neighbours {
    /// Nothing yet. Points as far as `limit_m2` or farther are left out.
    pub(crate) fn new(wanted: usize, limit_m2: f32) -> Self {
        Self {
            wanted: wanted.clamp(1, MOST_NEIGHBOURS),
            found: 0,
            squares_m2: [f32::INFINITY; MOST_NEIGHBOURS],
            numbers: [0; MOST_NEIGHBOURS],
            limit_m2,
        }
    }

    /// Their numbers.
    pub(crate) fn numbers(&self) -> &[u32] {
        &self.numbers[..self.found]
    }

    /// The square of the farthest one's distance; infinite while there are too few.
    pub(crate) fn farthest_m2(&self) -> f32 {
        self.squares_m2[self.wanted - 1]
    }

    #[inline]
    fn push(&mut self, square_m2: f32, number: u32) {
        let mut place = self.found.min(self.wanted - 1);
        while place > 0 && self.squares_m2[place - 1] > square_m2 {
            self.squares_m2[place] = self.squares_m2[place - 1];
            self.numbers[place] = self.numbers[place - 1];
            place -= 1;
        }
        self.squares_m2[place] = square_m2;
        self.numbers[place] = number;
        self.found = (self.found + 1).min(self.wanted);
        self.limit_m2 = self.limit_m2.min(self.farthest_m2());
    }
}

/// The test of a search on the points of a leaf.
trait Search {
    /// The square of the distance from which on points are of no use.
    fn limit_m2(&self) -> f32;
    /// Takes in a leaf's points: the squares of their distances, and the number of the first.
    fn look_at(&mut self, squares_m2: &[f32], first: usize);
}

impl Search for Neighbours {
    #[inline]
    fn limit_m2(&self) -> f32 {
        self.limit_m2
    }

    #[inline]
    fn look_at(&mut self, squares_m2: &[f32], first: usize) {
        for (square_m2, number) in squares_m2.iter().zip(first as u32..) {
            if *square_m2 < self.limit_m2 {
                self.push(*square_m2, number);
            }
        }
    }
}

/// The nearest point so far.
struct Nearest {
    square_m2: f32,
    number: Option<u32>,
}

impl Search for Nearest {
    #[inline]
    fn limit_m2(&self) -> f32 {
        self.square_m2
    }

    #[inline]
    fn look_at(&mut self, squares_m2: &[f32], first: usize) {
        for (square_m2, number) in squares_m2.iter().zip(first as u32..) {
            if *square_m2 < self.square_m2 {
                *self = Self { square_m2: *square_m2, number: Some(number) };
            }
        }
    }
}

/// A node with the range of its points, and how far along each axis the query is outside of it.
#[derive(Clone, Copy)]
struct Visit {
    node: usize,
    level: u32,
    from: usize,
    to: usize,
    outside_m: [f32; 3],
}

impl KdTree {
    /// The number of the point nearest to a place, if one is nearer than `limit_m2` (squared). A point that is known to
    /// be near, the `hint`, spares the search of what is farther.
    #[inline]
    pub(crate) fn nearest(
        &self,
        place_m: [f32; 3],
        limit_m2: f32,
        hint: Option<u32>,
    ) -> Option<u32> {
        let mut search = Nearest { square_m2: limit_m2, number: None };
        if let Some(hint) = hint.filter(|hint| (*hint as usize) < self.len()) {
            let square_m2 = square_m2(self.point_m(hint as usize), place_m);
            if square_m2 < limit_m2 {
                search = Nearest { square_m2, number: Some(hint) };
            }
        }
        self.search(place_m, &mut search);
        search.number
    }

    /// Adds the nearest points of a place.
    #[inline]
    pub(crate) fn neighbours(&self, place_m: [f32; 3], neighbours: &mut Neighbours) {
        self.search(place_m, neighbours);
    }

    #[inline]
    fn search(&self, place_m: [f32; 3], search: &mut impl Search) {
        let root = Visit { node: 0, level: 0, from: 0, to: self.len(), outside_m: [0.0; 3] };
        self.visit(place_m, root, search);
    }

    fn visit(&self, place_m: [f32; 3], at: Visit, search: &mut impl Search) {
        let Visit { node, level, from, to, outside_m } = at;
        if level == self.depth {
            return self.visit_leaf(place_m, from, to, search);
        }
        let split = self.splits[node];
        let middle = middle(from, to);
        let beyond_m = place_m[split.axis] - split.at_m;
        let left = Visit { node: 2 * node + 1, level: level + 1, from, to: middle, outside_m };
        let right = Visit { node: 2 * node + 2, level: level + 1, from: middle, to, outside_m };
        let (near, mut far) = if beyond_m < 0.0 { (left, right) } else { (right, left) };
        self.visit(place_m, near, search);
        far.outside_m[split.axis] = beyond_m;
        let [x_m, y_m, z_m] = far.outside_m;
        if x_m * x_m + y_m * y_m + z_m * z_m < search.limit_m2() {
            self.visit(place_m, far, search);
        }
    }

    #[inline]
    fn visit_leaf(&self, place_m: [f32; 3], from: usize, to: usize, search: &mut impl Search) {
        let mut squares_m2 = [0.0; LEAF_POINTS];
        let along = self.x_m[from..to].iter().zip(&self.y_m[from..to]).zip(&self.z_m[from..to]);
        for (square, ((x_m, y_m), z_m)) in squares_m2.iter_mut().zip(along) {
            *square = square_m2([*x_m, *y_m, *z_m], place_m);
        }
        search.look_at(&squares_m2[..(to - from).min(LEAF_POINTS)], from);
    }
}

#[inline]
fn square_m2(a_m: [f32; 3], b_m: [f32; 3]) -> f32 {
    let [x_m, y_m, z_m] = [a_m[0] - b_m[0], a_m[1] - b_m[1], a_m[2] - b_m[2]];
    x_m * x_m + y_m * y_m + z_m * z_m
}
