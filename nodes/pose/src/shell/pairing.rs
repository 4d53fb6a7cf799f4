//! Colour and depth images that belong together.

use std::collections::VecDeque;

use geometry::Stamp;

/// Holds what waits for its partner, in the order of stamps.
#[derive(Clone, Debug)]
pub(super) struct Pairing<C, D> {
    colors: VecDeque<(Stamp, C)>,
    depths: VecDeque<(Stamp, D)>,
    max_gap_s: f64,
    capacity: usize,
}

/// The outcome of an image.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Paired<C, D> {
    /// Both were taken at the same time, nearly: that of the colour image.
    Pair(Stamp, C, D),
    /// No depth image belongs to a colour image.
    ColorAlone(Stamp),
    /// No colour image belongs to a depth image.
    DepthAlone(Stamp),
}

impl<C, D> Pairing<C, D> {
    pub(super) fn new(max_gap_s: f64, capacity: usize) -> Self {
        let (colors, depths) = (VecDeque::new(), VecDeque::new());
        Self { colors, depths, max_gap_s, capacity: capacity.max(1) }
    }

    pub(super) fn push_color(&mut self, stamp: Stamp, color: C) -> Vec<Paired<C, D>> {
        if self.colors.back().is_some_and(|(last, _)| *last > stamp) {
            self.clear();
        }
        self.colors.push_back((stamp, color));
        self.pairs()
    }

    pub(super) fn push_depth(&mut self, stamp: Stamp, depth: D) -> Vec<Paired<C, D>> {
        if self.depths.back().is_some_and(|(last, _)| *last > stamp) {
            self.clear();
        }
        self.depths.push_back((stamp, depth));
        self.pairs()
    }

    /// After a restart the waiting images are dropped.
    fn clear(&mut self) {
        self.colors.clear();
        self.depths.clear();
    }

    /// All that can be decided: the oldest of each either belong together, or the older one has missed its partner.
    fn pairs(&mut self) -> Vec<Paired<C, D>> {
        let mut done = Vec::new();
        while let (Some((color_at, _)), Some((depth_at, _))) =
            (self.colors.front(), self.depths.front())
        {
            let (color_at, depth_at) = (*color_at, *depth_at);
            let late_s = depth_at.seconds_since(color_at);
            if late_s < -self.max_gap_s {
                self.depths.pop_front();
                done.push(Paired::DepthAlone(depth_at));
            } else if late_s > self.max_gap_s {
                self.colors.pop_front();
                done.push(Paired::ColorAlone(color_at));
            } else if let (Some((at, color)), Some((_, depth))) =
                (self.colors.pop_front(), self.depths.pop_front())
            {
                done.push(Paired::Pair(at, color, depth));
            }
        }
        if self.colors.len() > self.capacity
            && let Some((at, _)) = self.colors.pop_front()
        {
            done.push(Paired::ColorAlone(at));
        }
        if self.depths.len() > self.capacity
            && let Some((at, _)) = self.depths.pop_front()
        {
            done.push(Paired::DepthAlone(at));
        }
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: i64) -> Stamp {
        Stamp::from_nanos(milliseconds * 1_000_000)
    }

    #[test]
    fn images_are_paired_in_either_order_and_the_others_are_named() {
        let mut pairing = Pairing::new(0.02, 3);
        assert_eq!(pairing.push_color(at(0), 'a'), []);
        assert_eq!(pairing.push_depth(at(5), 1), [Paired::Pair(at(0), 'a', 1)]);
        assert_eq!(pairing.push_depth(at(33), 2), []);
        assert_eq!(pairing.push_color(at(34), 'b'), [Paired::Pair(at(34), 'b', 2)]);
        assert_eq!(pairing.push_color(at(67), 'c'), []);
        let missed = [Paired::ColorAlone(at(67)), Paired::Pair(at(100), 'd', 3)];
        assert_eq!(pairing.push_depth(at(100), 3), [Paired::ColorAlone(at(67))]);
        assert_eq!(pairing.push_color(at(100), 'd'), missed[1..]);
        assert_eq!(pairing.push_depth(at(133), 4), []);
        let missed = [Paired::DepthAlone(at(133))];
        assert_eq!(pairing.push_color(at(167), 'e'), missed);
    }

    #[test]
    fn what_waits_is_bounded_and_forgotten_when_a_clock_jumps_back() {
        let mut pairing: Pairing<char, u8> = Pairing::new(0.02, 2);
        for index in 0..2 {
            assert_eq!(pairing.push_color(at(33 * index), 'a'), []);
        }
        assert_eq!(pairing.push_color(at(66), 'b'), [Paired::ColorAlone(at(0))]);
        assert_eq!(pairing.push_color(at(10), 'c'), []);
        assert_eq!(pairing.push_depth(at(10), 1), [Paired::Pair(at(10), 'c', 1)]);
    }
}
