//! How many corners of each level, and which: evenly over the image.

use std::{cmp::Reverse, collections::BinaryHeap, ops::Range};

use super::detection::Candidate;

/// How many corners to take of each level: in proportion to the side of the level, so that each scale is searched
/// as densely as the others (Mur-Artal et al. 2015), and more of the others where a level has too few.
pub(super) fn allot(wanted: usize, sides_px: &[usize], available: &[usize]) -> Vec<usize> {
    let mut allotted = vec![0; available.len()];
    let mut left = wanted.min(available.iter().sum());
    while left > 0 {
        let open: Vec<usize> =
            (0..available.len()).filter(|&level| allotted[level] < available[level]).collect();
        let sides: usize = open.iter().filter_map(|&level| sides_px.get(level)).sum();
        let round = left;
        for level in open {
            let side = sides_px.get(level).copied().unwrap_or_default();
            let share = (round * side / sides.max(1)).clamp(1, left.max(1));
            let taken = share.min(available[level] - allotted[level]).min(left);
            allotted[level] += taken;
            left -= taken;
        }
    }
    allotted
}

/// A part of a level and the candidates within.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Node {
    candidates: Range<usize>,
    columns: Range<u16>,
    rows: Range<u16>,
}

/// Chooses `count` of the candidates: a share of them so that they cover the level evenly, and the strongest of the
/// others. The order is that of the image, row by row.
pub(super) fn choose(
    mut candidates: Vec<Candidate>,
    size_px: (usize, usize),
    count: usize,
    even_share: f64,
) -> Vec<Candidate> {
    if candidates.len() > count {
        let even = (count as f64 * even_share).round() as usize;
        spread_to_front(&mut candidates, size_px, even.min(count));
        if let Some(others) = candidates.get_mut(even..) {
            others.sort_unstable_by_key(|candidate| Reverse(strength_order(candidate)));
        }
        candidates.truncate(count);
        candidates.sort_unstable_by_key(|candidate| (candidate.row, candidate.column));
    }
    candidates
}

/// Moves `count` of the candidates to the front, so that these cover the level evenly: it is quartered until there are
/// as many parts with candidates in them, the larger parts first, and of equally large ones the fuller; the strongest
/// of each part is taken.
fn spread_to_front(candidates: &mut [Candidate], (width, height): (usize, usize), count: usize) {
    // The first is split next: the least deep, then the fullest, then the earliest.
    let mut open = BinaryHeap::new();
    let mut nodes = vec![Node {
        candidates: 0..candidates.len(),
        columns: 0..width as u16,
        rows: 0..height as u16,
    }];
    open.push((Reverse(0_u32), candidates.len(), Reverse(0_usize)));
    let mut parts = 1;
    while parts < count {
        let Some((Reverse(depth), _, Reverse(index))) = open.pop() else { break };
        let quarters = quarter(candidates, &nodes[index]);
        let mut filled = quarters.into_iter().filter(|node| !node.candidates.is_empty());
        // The first takes the place of the node that is split.
        let Some(first) = filled.next() else { continue };
        let mut keep = |node: Node, index: usize, nodes: &mut Vec<Node>| {
            let held = node.candidates.len();
            if held > 1 && node.columns.len().max(node.rows.len()) > 1 {
                open.push((Reverse(depth + 1), held, Reverse(index)));
            }
            match nodes.get_mut(index) {
                Some(place) => *place = node,
                None => nodes.push(node),
            }
        };
        keep(first, index, &mut nodes);
        for node in filled {
            let index = nodes.len();
            keep(node, index, &mut nodes);
            parts += 1;
        }
    }
    let strongest = |node: &Node| {
        let held = candidates.get(node.candidates.clone()).unwrap_or_default();
        node.candidates.clone().zip(held).max_by_key(|(_, candidate)| strength_order(candidate))
    };
    let mut chosen: Vec<(usize, Candidate)> =
        nodes.iter().filter_map(strongest).map(|(index, candidate)| (index, *candidate)).collect();
    // The last split may have made up to three parts too many.
    chosen.sort_unstable_by_key(|(_, candidate)| Reverse(strength_order(candidate)));
    chosen.truncate(count);
    // From the front on, a place is taken only by one that came from there or from behind.
    chosen.sort_unstable_by_key(|(index, _)| *index);
    for (place, (index, _)) in chosen.into_iter().enumerate() {
        candidates.swap(place, index);
    }
}

/// The stronger is larger; of equally strong ones the one further up or left.
fn strength_order(candidate: &Candidate) -> (u8, Reverse<(u16, u16)>) {
    (candidate.strength, Reverse((candidate.row, candidate.column)))
}

/// Splits a node in the middle of both sides.
fn quarter(candidates: &mut [Candidate], node: &Node) -> [Node; 4] {
    let middle = |range: &Range<u16>| range.start + (range.end - range.start) / 2;
    let (column, row) = (middle(&node.columns), middle(&node.rows));
    let held = candidates.get_mut(node.candidates.clone()).unwrap_or_default();
    let start = node.candidates.start;
    let below = partition(held, |candidate| candidate.row < row);
    let (upper, lower) = held.split_at_mut(below);
    let upper_right = partition(upper, |candidate| candidate.column < column);
    let lower_right = below + partition(lower, |candidate| candidate.column < column);
    let end = held.len();
    let part = |candidates: Range<usize>, columns: Range<u16>, rows: Range<u16>| Node {
        candidates: start + candidates.start..start + candidates.end,
        columns,
        rows,
    };
    let (left, right) = (node.columns.start..column, column..node.columns.end);
    let (above, under) = (node.rows.start..row, row..node.rows.end);
    [
        part(0..upper_right, left.clone(), above.clone()),
        part(upper_right..below, right.clone(), above),
        part(below..lower_right, left, under.clone()),
        part(lower_right..end, right, under),
    ]
}

/// Moves those that are `first` to the front, and says how many they are.
fn partition(candidates: &mut [Candidate], first: impl Fn(&Candidate) -> bool) -> usize {
    let mut count = 0;
    for index in 0..candidates.len() {
        if first(&candidates[index]) {
            candidates.swap(count, index);
            count += 1;
        }
    }
    count
}
