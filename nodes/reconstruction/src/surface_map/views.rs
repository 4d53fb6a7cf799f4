//! Where the map was seen from: a view shows what is not in the map as free, so that only those count of which all that they saw
//! is in it.

use geometry::{DepthFrame, MapView, MapViews, Stamp};
use nalgebra::Isometry3;
use volume::{BlockKey, Surface};

use crate::correction::TICK_S;

/// The views of a map.
#[derive(Clone, Debug, Default)]
pub(super) struct Views {
    /// Of its own images.
    own: MapViews,
    /// Of the points that were loaded, which no path moves.
    loaded: MapViews,
}

impl Views {
    /// Adds that of an image all of which is in the map. One without a depth shows nothing.
    pub(super) fn add(
        &mut self,
        stamp: Stamp,
        map_from_camera: Isometry3<f64>,
        frame: &DepthFrame,
    ) {
        if frame.depths_mm().iter().any(|depth_mm| *depth_mm > 0) {
            self.own.add(MapView { stamp, map_from_camera, camera: *frame.camera() });
        }
    }

    /// Adds those of points that were loaded.
    pub(super) fn add_loaded(&mut self, views: impl IntoIterator<Item = MapView>) {
        views.into_iter().for_each(|view| self.loaded.add(view));
    }

    /// All of them, none near another.
    pub(super) fn all(&self) -> Vec<MapView> {
        let both = self.loaded.as_slice().iter().chain(self.own.as_slice());
        both.copied().collect::<MapViews>().as_slice().to_vec()
    }

    /// Forgets those that saw the oldest blocks, which are to be dropped.
    pub(super) fn forget_those_of(&mut self, oldest: &[BlockKey], surface: &Surface) {
        if oldest.is_empty() {
            return;
        }
        // What was not seen since it was loaded goes first, and nobody knows by which views it was.
        self.loaded = MapViews::default();
        let seen_last = oldest.iter().filter_map(|key| Some(surface.seen(*key)?.1)).max();
        if let Some(stamp) = seen_last {
            self.own.forget_until(stamp.plus_seconds(TICK_S));
        }
    }

    /// Forgets all: the map is empty, or a part of it is lost, and nobody knows who saw that.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// The map was corrected.
    pub(super) fn correct(&mut self, now_from_before: impl Fn(Stamp) -> Isometry3<f64>) {
        self.own.correct(now_from_before);
    }
}
