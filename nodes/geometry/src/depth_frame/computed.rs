//! What one holder of a frame has computed of it, for others who would compute the same.

use std::any::Any;
use std::sync::{Arc, OnceLock, Weak};

/// So many kinds of things are computed of a frame: the voxels of its pixels, and the tiles of its depths.
const KINDS: usize = 2;

/// The first thing of each kind that was computed of a frame, as long as somebody keeps it.
#[derive(Clone, Default, Debug)]
pub(super) struct Computed([OnceLock<Weak<dyn Any + Send + Sync>>; KINDS]);

/// It follows from the frame.
impl PartialEq for Computed {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Computed {
    pub(super) fn get<T: Any + Send + Sync>(&self) -> Option<Arc<T>> {
        let shared = self.0.iter().filter_map(OnceLock::get);
        shared.filter_map(Weak::upgrade).find_map(|shared| shared.downcast().ok())
    }

    pub(super) fn share<T: Any + Send + Sync>(&self, computed: &Arc<T>) {
        if self.get::<T>().is_some() {
            return;
        }
        let mut weak: Weak<dyn Any + Send + Sync> = Arc::<T>::downgrade(computed);
        // The first ones stay.
        for place in &self.0 {
            match place.set(weak) {
                Ok(()) => break,
                Err(not_set) => weak = not_set,
            }
        }
    }
}
