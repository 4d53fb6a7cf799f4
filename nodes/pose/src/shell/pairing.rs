//! Colour and depth images that belong together.

use std::collections::VecDeque;

use geometry::Stamp;

/// The usual interval of a camera is the median of this many: a lost image makes one of them longer, a stamp that is
/// late makes one longer and one shorter.
const INTERVALS_KEPT: usize = 9;

/// Images that are farther apart than this share of the usual interval have lost their partners: a neighbour of the partner is
/// one interval off, less what the cameras are apart.
const MAX_GAP_SHARE: f64 = 0.75;

/// Holds what waits for its partner, in the order of stamps.
#[derive(Clone, Debug)]
pub(super) struct Pairing<C, D> {
    colors: Waiting<C>,
    depths: Waiting<D>,
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

/// The images of one camera that wait, and how often it takes one.
#[derive(Clone, Debug)]
struct Waiting<I> {
    images: VecDeque<(Stamp, I)>,
    last: Option<Stamp>,
    intervals_s: VecDeque<f64>,
}

/// Whether a camera's next image belongs better to an image of the other camera than its first one does.
enum Next {
    /// It does.
    Better,
    /// It does not.
    NotBetter,
    /// It has not come yet, and may.
    MayCome,
}

impl<I> Waiting<I> {
    fn new() -> Self {
        Self { images: VecDeque::new(), last: None, intervals_s: VecDeque::new() }
    }

    fn is_before_last(&self, stamp: Stamp) -> bool {
        self.last.is_some_and(|last| last > stamp)
    }

    fn push(&mut self, stamp: Stamp, image: I) {
        if let Some(last) = self.last.replace(stamp)
            && last < stamp
        {
            self.intervals_s.push_back(stamp.seconds_since(last));
            if self.intervals_s.len() > INTERVALS_KEPT {
                self.intervals_s.pop_front();
            }
        }
        self.images.push_back((stamp, image));
    }

    fn first(&self) -> Option<Stamp> {
        self.images.front().map(|(stamp, _)| *stamp)
    }

    /// The stamps of those that waited.
    fn clear(&mut self) -> Vec<Stamp> {
        let waited = self.images.iter().map(|(stamp, _)| *stamp).collect();
        *self = Self::new();
        waited
    }

    /// Looks at the image behind the first one, which is earlier than `other` by `gap_s`.
    fn next(&self, other: Stamp, gap_s: f64) -> Next {
        match self.images.get(1) {
            Some((stamp, _)) if stamp.seconds_since(other).abs() < gap_s => Next::Better,
            Some(_) => Next::NotBetter,
            // One that comes an interval after the first is nearer if that is less than twice the gap.
            None if self.usual_interval_s().is_some_and(|interval_s| interval_s < 2.0 * gap_s) => {
                Next::MayCome
            }
            None => Next::NotBetter,
        }
    }

    fn usual_interval_s(&self) -> Option<f64> {
        let mut sorted: Vec<f64> = self.intervals_s.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied()
    }
}

impl<C, D> Pairing<C, D> {
    pub(super) fn new(max_gap_s: f64, capacity: usize) -> Self {
        let (colors, depths) = (Waiting::new(), Waiting::new());
        Self { colors, depths, max_gap_s, capacity: capacity.max(1) }
    }

    pub(super) fn push_color(&mut self, stamp: Stamp, color: C) -> Vec<Paired<C, D>> {
        let mut done = self.cleared(self.colors.is_before_last(stamp));
        self.colors.push(stamp, color);
        self.pairs(&mut done);
        done
    }

    pub(super) fn push_depth(&mut self, stamp: Stamp, depth: D) -> Vec<Paired<C, D>> {
        let mut done = self.cleared(self.depths.is_before_last(stamp));
        self.depths.push(stamp, depth);
        self.pairs(&mut done);
        done
    }

    fn max_gap_s(&self) -> f64 {
        let usual_s = [self.colors.usual_interval_s(), self.depths.usual_interval_s()];
        let by_interval = usual_s.into_iter().flatten().map(|usual_s| MAX_GAP_SHARE * usual_s);
        by_interval.fold(self.max_gap_s, f64::min)
    }

    /// After a restart the waiting images are dropped.
    fn cleared(&mut self, is_restart: bool) -> Vec<Paired<C, D>> {
        if !is_restart {
            return Vec::new();
        }
        let colors = self.colors.clear().into_iter().map(Paired::ColorAlone);
        colors.chain(self.depths.clear().into_iter().map(Paired::DepthAlone)).collect()
    }

    /// All that can be decided: the oldest of each either belong together, or the older one has missed its partner.
    fn pairs(&mut self, done: &mut Vec<Paired<C, D>>) {
        while let (Some(color_at), Some(depth_at)) = (self.colors.first(), self.depths.first()) {
            let late_s = depth_at.seconds_since(color_at);
            let gap_s = late_s.abs();
            // The one behind the earlier of the two may be nearer to the later.
            let next = if gap_s > self.max_gap_s() {
                Next::Better
            } else if late_s > 0.0 {
                self.colors.next(depth_at, gap_s)
            } else {
                self.depths.next(color_at, gap_s)
            };
            match next {
                Next::MayCome => break,
                Next::Better if late_s > 0.0 => {
                    self.colors.images.pop_front();
                    done.push(Paired::ColorAlone(color_at));
                }
                Next::Better => {
                    self.depths.images.pop_front();
                    done.push(Paired::DepthAlone(depth_at));
                }
                Next::NotBetter => {
                    if let (Some((at, color)), Some((_, depth))) =
                        (self.colors.images.pop_front(), self.depths.images.pop_front())
                    {
                        done.push(Paired::Pair(at, color, depth));
                    }
                }
            }
        }
        if self.colors.images.len() > self.capacity
            && let Some((at, _)) = self.colors.images.pop_front()
        {
            done.push(Paired::ColorAlone(at));
        }
        if self.depths.images.len() > self.capacity
            && let Some((at, _)) = self.depths.images.pop_front()
        {
            done.push(Paired::DepthAlone(at));
        }
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
        let waited = [Paired::ColorAlone(at(33)), Paired::ColorAlone(at(66))];
        assert_eq!(pairing.push_color(at(10), 'c'), waited);
        assert_eq!(pairing.push_depth(at(10), 1), [Paired::Pair(at(10), 'c', 1)]);
    }

    /// The images of two cameras, the depth camera's late by `skew_ms`, without those that are lost: how many pairs are of
    /// the same moment, and how many are not.
    fn right_and_wrong(
        interval_ms: i64,
        skew_ms: i64,
        is_lost: impl Fn(i64, bool) -> bool,
    ) -> (usize, usize) {
        let mut pairing = Pairing::new(0.02, 10);
        let mut done = Vec::new();
        for index in 0..600 {
            if !is_lost(index, true) {
                done.extend(pairing.push_color(at(interval_ms * index), index));
            }
            if !is_lost(index, false) {
                done.extend(pairing.push_depth(at(interval_ms * index + skew_ms), index));
            }
        }
        let pairs = done.iter().filter_map(|paired| match paired {
            Paired::Pair(_, color, depth) => Some(color == depth),
            _ => None,
        });
        let (right, wrong): (Vec<bool>, Vec<bool>) = pairs.partition(|is_right| *is_right);
        (right.len(), wrong.len())
    }

    /// Regression: with less time between two images than `max_pair_gap_s` one lost image paired all later ones with the
    /// neighbour of their partner.
    #[test]
    fn a_lost_image_pairs_no_later_one_with_the_neighbour_of_its_partner() {
        for interval_ms in [11, 16, 33] {
            for skew_ms in [0, 2, -2, 4, -4] {
                let case = format!("each {interval_ms} ms, late by {skew_ms} ms");
                let one = |index, is_color| index == 100 && is_color;
                assert_eq!(right_and_wrong(interval_ms, skew_ms, one), (599, 0), "{case}");
                let one = |index, is_color: bool| index == 100 && !is_color;
                assert_eq!(right_and_wrong(interval_ms, skew_ms, one), (599, 0), "{case}");
            }
            // A sixth of the images of each, some of them neighbours.
            let many =
                |index: i64, is_color| index % 12 == 5 || index % 12 == 7 + i64::from(is_color);
            assert_eq!(right_and_wrong(interval_ms, 0, many), (450, 0), "each {interval_ms} ms");
        }
    }
}
