//! What one holder of a frame has computed of it, for others who would compute the same.

use std::any::Any;
use std::sync::{Arc, OnceLock, Weak};

/// The first thing that was computed of a frame, as long as somebody keeps it.
#[derive(Clone, Default, Debug)]
pub(super) struct Computed(OnceLock<Weak<dyn Any + Send + Sync>>);

/// It follows from the frame.
impl PartialEq for Computed {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Computed {
    pub(super) fn get<T: Any + Send + Sync>(&self) -> Option<Arc<T>> {
        self.0.get()?.upgrade()?.downcast().ok()
    }

    pub(super) fn share<T: Any + Send + Sync>(&self, computed: &Arc<T>) {
        let weak: Weak<T> = Arc::downgrade(computed);
        // The first one stays.
        let _ = self.0.set(weak);
    }
}
