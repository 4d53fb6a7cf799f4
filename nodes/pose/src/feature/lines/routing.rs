//! Edges drawn from anchor to anchor, along the ridge of the gradient.

use std::ops::Range;

use super::gradient::GradientField;

/// Chains of neighbouring pixels, one edge each, in the order in which they were drawn. Along a chain the brighter side
/// is on the left.
#[derive(Clone, Default, Debug)]
pub(super) struct EdgeChains {
    /// The pixels of all chains.
    pub(super) pixels: Vec<usize>,
    /// Which of them make up a chain.
    pub(super) chains: Vec<Range<usize>>,
    /// Whether a pixel of the image belongs to an edge, of a chain or of one that was too short.
    drawn: Vec<bool>,
}

/// The direction in which an edge is followed.
#[derive(Clone, Copy, PartialEq)]
enum Heading {
    /// The brighter side on the left.
    Forward,
    /// The brighter side on the right.
    Backward,
}

impl EdgeChains {
    /// Draws an edge through each anchor that no edge has reached yet, in both directions, as far as gradients have
    /// `least_magnitude`. Chains of fewer than `least_pixels` are not kept.
    ///
    /// Edge Drawing ("smart routing") remembers from where it came and searches for the next pixel. Here the gradient itself
    /// gives it: with the brighter side on the left there is one direction to follow, also where an edge turns from running along
    /// rows to running along columns, and never steps over to an edge of the other polarity beside it.
    pub(super) fn draw(
        &mut self,
        field: &GradientField,
        anchors: &[usize],
        least_magnitude: u16,
        least_pixels: usize,
    ) {
        let Self { pixels, chains, drawn } = self;
        pixels.clear();
        chains.clear();
        drawn.clear();
        drawn.resize(field.gradients.len(), false);
        let mut router = Router { field, least_magnitude: least_magnitude.max(1), drawn };
        for &anchor in anchors {
            if router.drawn[anchor] {
                continue;
            }
            let start = pixels.len();
            router.drawn[anchor] = true;
            router.walk(anchor, Heading::Backward, pixels);
            pixels[start..].reverse();
            pixels.push(anchor);
            router.walk(anchor, Heading::Forward, pixels);
            if pixels.len() - start >= least_pixels {
                chains.push(start..pixels.len());
            } else {
                pixels.truncate(start);
            }
        }
    }
}

struct Router<'a> {
    field: &'a GradientField,
    least_magnitude: u16,
    drawn: &'a mut [bool],
}

impl Router<'_> {
    /// Appends the pixels that follow an anchor.
    fn walk(&mut self, anchor: usize, heading: Heading, pixels: &mut Vec<usize>) {
        let mut here = anchor;
        while let Some(next) = self.next(here, heading) {
            self.drawn[next] = true;
            pixels.push(next);
            here = next;
        }
    }

    /// The strongest of the three pixels ahead, of those that are part of the same edge; `None` where there is none,
    /// or where one of them is drawn already. A pixel with a gradient is not outermost, so that the three exist.
    fn next(&self, here: usize, heading: Heading) -> Option<usize> {
        let width_px = self.field.width_px;
        let gradient = self.field.gradients[here];
        let forward = heading == Heading::Forward;
        // With rows counted downwards the brighter side is on the left of (-y, x).
        let (ahead, aside) = if gradient.edge_runs_along_row() {
            (if (gradient.y < 0) == forward { here + 1 } else { here - 1 }, width_px)
        } else {
            (if (gradient.x > 0) == forward { here + width_px } else { here - width_px }, 1)
        };
        let (mut best, mut most) = (None, self.least_magnitude - 1);
        for pixel in [ahead, ahead - aside, ahead + aside] {
            let candidate = self.field.gradients[pixel];
            let magnitude = candidate.magnitude();
            if magnitude < self.least_magnitude || !candidate.agrees(gradient) {
                continue;
            }
            if self.drawn[pixel] {
                return None;
            }
            if magnitude > most {
                (best, most) = (Some(pixel), magnitude);
            }
        }
        best
    }
}
