//! What somebody carried, pushed or opened, and left.
//!
//! It and its mover were one object, and came apart: one of the two began as an object beside the other, which one does not tell. Then
//! one goes, and the other remains. Two who walk together and part are like that, too. So it is only asked of what is no person by its
//! shape, and it waits for a part of the longest stop.

use nalgebra::Point3;

use super::tracked_object::TrackedObject;

/// So far from a thing a mover has left it: farther than arms reach.
const LEFT_M: f64 = 1.0;

/// Two objects that were one, or came to view together.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Pair(pub(super) [u32; 2]);

/// Whether what begins at a place was with an object: part of it in an earlier cycle, or beside it.
pub(super) fn was_with(object: &TrackedObject, place_m: &Point3<f64>) -> bool {
    object.gap_m(place_m) <= LEFT_M
}

/// Finds in each cycle which of the two has gone from the other.
pub(super) fn find_left(pairs: &mut Vec<Pair>, objects: &mut [TrackedObject]) {
    pairs.retain(|Pair(keys)| {
        let [Some(one), Some(other)] =
            keys.map(|key| objects.iter().position(|object| object.key == key))
        else {
            return false;
        };
        let (one, other) = match objects.get_disjoint_mut([one, other]) {
            // Who goes has stopped later.
            Ok([one, other]) if one.stopped_since_s() <= other.stopped_since_s() => (one, other),
            Ok([one, other]) => (other, one),
            Err(_) => return false,
        };
        let has_gone = one.gap_m(&other.visible_centre_m()) > LEFT_M;
        if has_gone {
            one.leave();
        }
        !has_gone
    });
}
