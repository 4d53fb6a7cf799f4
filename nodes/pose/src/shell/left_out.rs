//! Which images the node has left out since it is slower than they come: their partners were not lost by the cameras.

use geometry::Stamp;

/// The camera that an image is of.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Of {
    Color,
    Depth,
}

/// How many images the subscription of each camera has left out so far.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct LeftOutCounts {
    pub(super) colors: u64,
    pub(super) depths: u64,
}

/// The images that were left out.
#[derive(Clone, Debug, Default)]
pub(super) struct LeftOut {
    colors: Camera,
    depths: Camera,
    /// Images up to this stamp may have lost their partner so.
    until: Option<Stamp>,
    /// How many colour images have.
    unpaired_colors: u64,
}

/// What is known of one camera since its last image.
#[derive(Clone, Copy, Debug, Default)]
struct Camera {
    last: Option<Stamp>,
    left_out: u64,
}

impl LeftOut {
    /// Notes that an image of a camera is the next one that is taken, and how many were left out by then.
    pub(super) fn take(&mut self, of: Of, stamp: Stamp, counts: LeftOutCounts) {
        // The one that is not taken yet stands behind a gap in its own images.
        let is_more = counts.colors > self.colors.left_out || counts.depths > self.depths.left_out;
        let (camera, left_out) = match of {
            Of::Color => (&mut self.colors, counts.colors),
            Of::Depth => (&mut self.depths, counts.depths),
        };
        let is_restart = camera.last.is_some_and(|last| stamp < last);
        *camera = Camera { last: Some(stamp), left_out };
        if is_restart {
            self.until = None;
        }
        if is_more {
            self.until = self.until.max(Some(stamp));
        }
    }

    /// Whether an image without a partner has lost it so.
    pub(super) fn explains(&mut self, of: Of, stamp: Stamp) -> bool {
        let explains = self.until.is_some_and(|until| stamp <= until);
        self.unpaired_colors += u64::from(explains && of == Of::Color);
        explains
    }

    /// How many pairs came to nothing, where the subscriptions have left out so many images: a colour image is left out, without a
    /// partner, or one of a pair.
    pub(super) fn pairs(&self, counts: LeftOutCounts) -> u64 {
        counts.colors + self.unpaired_colors
    }

    /// Forgets the images of the time before, but not how many were left out.
    pub(super) fn forget(&mut self) {
        (self.colors.last, self.depths.last, self.until) = (None, None, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: i64) -> Stamp {
        Stamp::from_nanos(seconds * 1_000_000_000)
    }

    fn counts(colors: u64, depths: u64) -> LeftOutCounts {
        LeftOutCounts { colors, depths }
    }

    #[test]
    fn an_image_has_lost_its_partner_to_the_node_where_the_partner_is_in_a_gap_of_the_queue() {
        let mut left_out = LeftOut::default();
        left_out.take(Of::Depth, at(1), counts(0, 0));
        assert!(!left_out.explains(Of::Depth, at(1)), "nothing was left out");
        // Colour images 2 to 4 have given way to later ones, of which none is taken yet.
        left_out.take(Of::Depth, at(2), counts(3, 0));
        assert!(left_out.explains(Of::Depth, at(2)));
        left_out.take(Of::Depth, at(3), counts(3, 0));
        left_out.take(Of::Depth, at(4), counts(3, 0));
        left_out.take(Of::Color, at(5), counts(3, 0));
        assert!(left_out.explains(Of::Depth, at(4)));
        left_out.take(Of::Depth, at(6), counts(3, 0));
        assert!(!left_out.explains(Of::Depth, at(6)), "nothing was left out since");
        assert_eq!(left_out.pairs(counts(3, 0)), 3);
    }

    #[test]
    fn a_pair_counts_once_whichever_of_its_images_was_left_out() {
        let mut left_out = LeftOut::default();
        // Colour 1 and 2, and depth 2 and 3 are missing.
        left_out.take(Of::Depth, at(1), counts(2, 0));
        left_out.take(Of::Color, at(3), counts(2, 2));
        assert!(left_out.explains(Of::Depth, at(1)) && left_out.explains(Of::Color, at(3)));
        assert_eq!(left_out.pairs(counts(2, 2)), 3);
    }

    #[test]
    fn what_was_left_out_before_a_restart_explains_nothing_after_it() {
        let mut left_out = LeftOut::default();
        left_out.take(Of::Color, at(90), counts(5, 0));
        left_out.take(Of::Color, at(3), counts(5, 0));
        assert!(!left_out.explains(Of::Color, at(3)));
    }
}
