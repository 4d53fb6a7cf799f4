//! Which colour image belongs to the depth image of a cycle.

use std::collections::VecDeque;

use geometry::Stamp;

use crate::matching::{Nearest, nearest};

/// A camera whose latest image is older than this has stopped: nobody waits for it.
const STOPPED_AFTER_S: f64 = 1.0;

/// Colour images of payload `T`, not read, in the order of their stamps.
///
/// The image of a depth image is the one nearest in stamp within `max_offset_s`, the earlier of two. It is known once an image
/// of the same stamp or a later one has come, whatever the order of arrival.
#[derive(Clone, Debug)]
pub struct ColourImages<T> {
    images: VecDeque<(Stamp, T)>,
    max_offset_s: f64,
    most: usize,
}

/// What is known of the colour image of a depth image.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ColourChoice<T> {
    /// A nearer one may still come.
    Open {
        /// The nearest so far.
        so_far: Option<T>,
        /// Whether the camera sends images now.
        is_alive: bool,
    },
    /// This is it; or there is none.
    Settled(Option<T>),
}

impl<T> ColourChoice<T> {
    /// The image, as far as it is known.
    pub fn image(self) -> Option<T> {
        match self {
            Self::Open { so_far: image, .. } | Self::Settled(image) => image,
        }
    }
}

impl<T: Clone> ColourImages<T> {
    /// No image yet; `most` are kept at a time.
    #[must_use]
    pub fn new(max_offset_s: f64, most: usize) -> Self {
        Self { images: VecDeque::new(), max_offset_s, most }
    }

    /// Adds an image. One that is not later than the last one is left out, unless the clock has jumped back by more than a
    /// second: then those before are forgotten. Returns whether it was added.
    pub fn push(&mut self, stamp: Stamp, image: T) -> bool {
        if let Some((last, _)) = self.images.back()
            && stamp <= *last
        {
            if last.seconds_since(stamp) <= STOPPED_AFTER_S {
                return false;
            }
            self.clear();
        }
        self.images.push_back((stamp, image));
        while self.images.len() > self.most.max(1) {
            self.images.pop_front();
        }
        true
    }

    /// What is known of the image of a depth image. Images that are too old for it are dropped: depth images come in the order
    /// of their stamps.
    pub fn choose(&mut self, depth: Stamp) -> ColourChoice<T> {
        let oldest = depth.plus_seconds(-self.max_offset_s);
        let (near, max_offset_s) = (nearest(&self.images, depth), self.max_offset_s);
        let within = |stamp: Stamp| stamp.seconds_since(depth).abs() <= max_offset_s;
        let choice = match near {
            Nearest::At(stamp, image) => {
                ColourChoice::Settled(within(stamp).then(|| image.clone()))
            }
            Nearest::Undecided => {
                let last = self.images.back();
                let is_alive =
                    last.is_some_and(|(last, _)| depth.seconds_since(*last) <= STOPPED_AFTER_S);
                let so_far = last.filter(|(stamp, _)| within(*stamp));
                ColourChoice::Open { so_far: so_far.map(|(_, image)| image.clone()), is_alive }
            }
        };
        // The last one stays: it tells whether the camera has stopped.
        while self.images.len() > 1 && self.images.front().is_some_and(|(first, _)| *first < oldest)
        {
            self.images.pop_front();
        }
        choice
    }

    /// How far apart the stamps of two images that belong together may be.
    #[must_use]
    pub fn max_offset_s(&self) -> f64 {
        self.max_offset_s
    }

    /// Forgets all images.
    pub fn clear(&mut self) {
        self.images.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: i64) -> Stamp {
        Stamp::from_nanos(milliseconds * 1_000_000)
    }

    fn images(milliseconds: &[i64]) -> ColourImages<i64> {
        let mut images = ColourImages::new(0.02, 5);
        milliseconds.iter().for_each(|one| assert!(images.push(at(*one), *one), "{one}"));
        images
    }

    #[test]
    fn the_nearest_image_belongs_to_a_depth_image_once_a_later_one_cannot_be_nearer() {
        let settled = ColourChoice::Settled;
        assert_eq!(images(&[0, 33, 66]).choose(at(40)), settled(Some(33)));
        assert_eq!(images(&[0, 33, 66]).choose(at(55)), settled(Some(66)));
        assert_eq!(images(&[20, 40]).choose(at(30)), settled(Some(20)), "the earlier of two");
        assert_eq!(images(&[0, 33]).choose(at(33)), settled(Some(33)), "of one stamp, at once");
        assert_eq!(images(&[0, 100]).choose(at(50)), settled(None), "none is near");
        let open = |so_far, is_alive| ColourChoice::Open { so_far, is_alive };
        assert_eq!(images(&[0, 33]).choose(at(40)), open(Some(33), true));
        assert_eq!(images(&[0]).choose(at(40)), open(None, true));
        assert_eq!(images(&[0]).choose(at(1_040)), open(None, false), "the camera has stopped");
        assert_eq!(images(&[]).choose(at(40)), open(None, false));
    }

    #[test]
    fn an_image_serves_all_depth_images_that_it_is_nearest_to() {
        let mut images = images(&[0, 33]);
        for depth in [18, 25, 33] {
            assert_eq!(images.choose(at(depth)).image(), Some(33), "{depth}");
        }
    }

    #[test]
    fn what_waits_is_bounded_and_forgotten_when_the_clock_jumps_back() {
        let mut images = images(&[0, 10, 20, 30, 40, 50, 60]);
        assert_eq!(images.images.len(), 5);
        assert!(!images.push(at(60), 0) && !images.push(at(10), 0));
        assert_eq!(images.choose(at(60)), ColourChoice::Settled(Some(60)));
        assert_eq!(images.images.len(), 3, "those before 40 ms are too old");
        assert!(images.push(at(2_000), 2_000) && images.push(at(10), 10));
        assert_eq!(images.choose(at(10)), ColourChoice::Settled(Some(10)));
        assert_eq!(images.images.len(), 1);
    }
}
