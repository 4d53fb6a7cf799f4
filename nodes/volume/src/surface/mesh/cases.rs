//! The triangles of a cell by which of its corners are behind the surface.
//!
//! Marching cubes (Lorensen and Cline, SIGGRAPH 1987) with one decision for each face of a cell: where both diagonals of a face
//! have their corners on one side each, those behind the surface are apart (Montani, Scateni and Scopigno, "A modified look-up
//! table for implicit disambiguation of marching cubes", The Visual Computer 10, 1994). It depends on the four corners of the face
//! alone, so that the two cells of a face agree, and there are no holes between them.
//!
//! The table is derived here, at compile time: in each face the surface runs from crossing to crossing, the runs of the six faces
//! close to polygons, and these are cut into triangles, ear by ear. No cut lies in a face of the cell, where the next cell might
//! make the same one: each edge of the mesh has two triangles at most.

use crate::surface::nodes::face_edges;

/// Edges of a cell: edge `4 axis + n` is the `n`th of those along that axis, in the order of the corner that it starts from. A
/// corner's number has a bit for each axis.
pub(super) const EDGES: usize = 12;
/// No table needs more: 256 cases were counted.
const MOST_TRIANGLES: usize = 5;
const NONE: u8 = u8::MAX;

/// What of the surface is in a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Case {
    /// The edges that it crosses, as bits.
    pub(super) crossed: u16,
    count: u8,
    triangles: [[u8; 3]; MOST_TRIANGLES],
}

impl Case {
    /// The edges that the corners of each triangle are on, counterclockwise as seen from before the surface.
    pub(super) fn triangles(&self) -> &[[u8; 3]] {
        self.triangles.get(..usize::from(self.count)).unwrap_or_default()
    }
}

/// By the bits of the corners that are behind the surface.
pub(super) static CASES: [Case; 256] = cases();
/// The corner that each edge starts from.
pub(super) const STARTS: [u8; EDGES] = starts();
/// The edges of each face.
const FACES: [u16; 6] = face_edges();

const fn starts() -> [u8; EDGES] {
    let mut starts = [0; EDGES];
    let mut axis = 0;
    while axis < 3 {
        let (mut corner, mut edge) = (0, 4 * axis);
        while corner < 8 {
            if corner >> axis & 1 == 0 {
                starts[edge] = corner as u8;
                edge += 1;
            }
            corner += 1;
        }
        axis += 1;
    }
    starts
}

const fn cases() -> [Case; 256] {
    let none = Case { crossed: 0, count: 0, triangles: [[0; 3]; MOST_TRIANGLES] };
    let mut cases = [none; 256];
    let mut behind = 0;
    while behind < 256 {
        cases[behind] = case(behind);
        behind += 1;
    }
    cases
}

const fn case(behind: usize) -> Case {
    let mut next = next_crossings(behind);
    let mut case = Case { crossed: 0, count: 0, triangles: [[0; 3]; MOST_TRIANGLES] };
    let mut first = 0;
    while first < EDGES {
        let (mut polygon, mut corners) = ([0; EDGES], 0);
        let mut edge = first;
        while next[edge] != NONE {
            case.crossed |= 1 << edge;
            polygon[corners] = edge as u8;
            corners += 1;
            let following = next[edge];
            next[edge] = NONE;
            edge = following as usize;
        }
        while corners > 2 {
            let ear = first_ear(&polygon, corners);
            let (before, after) = (polygon[(ear + corners - 1) % corners], (ear + 1) % corners);
            case.triangles[case.count as usize] = [before, polygon[ear], polygon[after]];
            case.count += 1;
            corners -= 1;
            let mut moved = ear;
            while moved < corners {
                polygon[moved] = polygon[moved + 1];
                moved += 1;
            }
        }
        first += 1;
    }
    case
}

/// By the edge of a crossing the one of the next crossing: around each run of corners behind the surface, in each face.
const fn next_crossings(behind: usize) -> [u8; EDGES] {
    let mut next = [NONE; EDGES];
    let mut face = 0;
    while face < FACES.len() {
        let corners = corners_of_face(face / 2, face % 2);
        let mut at = 0;
        while at < 4 {
            let (from, to) = (corners[at], corners[(at + 1) % 4]);
            if behind >> from & 1 == 0 && behind >> to & 1 == 1 {
                let mut last = at + 1;
                while behind >> corners[(last + 1) % 4] & 1 == 1 {
                    last += 1;
                }
                let leaves = edge_between(corners[last % 4], corners[(last + 1) % 4]);
                next[edge_between(from, to)] = leaves as u8;
            }
            at += 1;
        }
        face += 1;
    }
    next
}

/// Counterclockwise as seen from outside of the cell.
const fn corners_of_face(axis: usize, side: usize) -> [usize; 4] {
    let (least, u, v) = (side << axis, 1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    if side == 1 {
        [least, least | u, least | u | v, least | v]
    } else {
        [least, least | v, least | u | v, least | u]
    }
}

const fn edge_between(a: usize, b: usize) -> usize {
    let axis = (a ^ b).trailing_zeros() as usize;
    let mut edge = 4 * axis;
    while STARTS[edge] as usize != a & b {
        edge += 1;
    }
    edge
}

/// The first corner of a polygon that can be cut off without a cut in a face of the cell; a triangle is one itself.
const fn first_ear(polygon: &[u8; EDGES], corners: usize) -> usize {
    let mut ear = 0;
    while ear < corners && corners > 3 {
        let before = polygon[(ear + corners - 1) % corners];
        let after = polygon[(ear + 1) % corners];
        if !are_in_one_face(before, after) {
            return ear;
        }
        ear += 1;
    }
    // Of no polygon all cuts lie in faces: a test looks at each.
    if corners > 3 { 0 } else { 1 }
}

pub(super) const fn are_in_one_face(edge: u8, other: u8) -> bool {
    let both = 1 << edge | 1 << other;
    let mut face = 0;
    while face < FACES.len() {
        if FACES[face] & both == both {
            return true;
        }
        face += 1;
    }
    false
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    /// Where edges have their middle, in half edges of the cell.
    fn middle(edge: u8) -> [i32; 3] {
        let start = STARTS[usize::from(edge)];
        let axis = usize::from(edge) / 4;
        [0, 1, 2].map(|along| 2 * i32::from(start >> along & 1) + i32::from(along == axis))
    }

    #[test]
    fn each_case_closes_but_in_the_faces_of_the_cell() {
        for (behind, case) in CASES.iter().enumerate() {
            let mut edges: BTreeMap<(u8, u8), usize> = BTreeMap::new();
            for &[a, b, c] in case.triangles() {
                assert!(a != b && b != c && c != a, "{behind:08b}");
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    *edges.entry((from, to)).or_default() += 1;
                }
            }
            for (&(from, to), &count) in &edges {
                assert_eq!(count, 1, "{behind:08b}: {from} {to}");
                let is_border = !edges.contains_key(&(to, from));
                assert_eq!(is_border, are_in_one_face(from, to), "{behind:08b}: {from} {to}");
            }
            let used: u16 =
                case.triangles().iter().flatten().fold(0, |used, edge| used | 1 << edge);
            let crossed = (0..12_u8).filter(|edge| {
                let start = STARTS[usize::from(*edge)];
                let end = start | 1 << (edge / 4);
                behind >> start & 1 != behind >> end & 1
            });
            let crossed: u16 = crossed.fold(0, |crossed, edge| crossed | 1 << edge);
            assert_eq!((used, case.crossed), (crossed, crossed), "{behind:08b}");
        }
    }

    /// The border of a cell's triangles in a face is the reverse of that of the next cell there.
    #[test]
    fn two_cells_agree_on_their_face() {
        let in_face = |behind: usize, axis: usize, side: usize| {
            let face = FACES[2 * axis + side];
            let mut segments: Vec<_> = CASES[behind]
                .triangles()
                .iter()
                .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
                .filter(|(a, b)| face >> a & face >> b & 1 == 1)
                .map(|(a, b)| {
                    [a, b].map(|edge| {
                        let mut place = middle(edge);
                        place[axis] = 0;
                        place
                    })
                })
                .collect();
            segments.sort_unstable();
            segments
        };
        for axis in 0..3 {
            for behind in 0..256 {
                // The next cell, whose corners of this side are those of that side here.
                let across = (0..8).filter(|corner| corner >> axis & 1 == 0);
                let next = across.fold(0, |next, corner: usize| {
                    let here = corner | 1 << axis;
                    next | (behind >> here & 1) << corner
                });
                let mut reversed = in_face(next, axis, 0);
                reversed.iter_mut().for_each(|segment| segment.reverse());
                reversed.sort_unstable();
                assert_eq!(in_face(behind, axis, 1), reversed, "axis {axis}, {behind:08b}");
            }
        }
    }

    #[test]
    fn a_corner_behind_the_surface_is_seen_from_the_other_ones() {
        let [a, b, c] = CASES[1].triangles()[0].map(middle);
        let [u, v] = [b, c].map(|to| [0, 1, 2].map(|axis: usize| to[axis] - a[axis]));
        let normal =
            [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        assert!(normal.iter().all(|along| *along > 0), "{normal:?}");
    }
}
