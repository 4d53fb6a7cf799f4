//! How much memory a thread holds, and a ceiling beyond which it gets none.
#![allow(
    unsafe_code,
    reason = "an allocator is unsafe; this one hands every call on to the system's"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// No case holds more than this: what asks for more gets nothing, and the process aborts with the number of bytes that were asked for.
/// Zeroed memory that is never touched counts too, which costs a machine nothing, and a case no success.
const CEILING_BYTES: isize = 2 << 30;

thread_local! {
    static HELD: Cell<isize> = const { Cell::new(0) };
    static MOST: Cell<isize> = const { Cell::new(0) };
    static IS_BOUND: Cell<bool> = const { Cell::new(false) };
}

/// The system's allocator, which counts what each thread holds. What a thread frees for another counts as its own.
pub struct Counting;

#[global_allocator]
static COUNTING: Counting = Counting;

/// Counts bytes that the thread takes; whether it may have them.
fn take(bytes: usize) -> bool {
    let held = HELD.get().saturating_add(isize::try_from(bytes).unwrap_or(isize::MAX));
    if IS_BOUND.get() && held > CEILING_BYTES {
        return false;
    }
    HELD.set(held);
    MOST.set(MOST.get().max(held));
    true
}

fn give_back(bytes: usize) {
    HELD.set(HELD.get().saturating_sub(isize::try_from(bytes).unwrap_or(isize::MAX)));
}

// SAFETY: each method hands its arguments on to the system's allocator, whose contract is the caller's, or gives nothing, which
// is what an allocator does that has nothing left. The counters allocate nothing and have no destructors.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if !take(layout.size()) {
            return std::ptr::null_mut();
        }
        // SAFETY: as above.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if !take(layout.size()) {
            return std::ptr::null_mut();
        }
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        give_back(layout.size());
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        // While it is copied both are there.
        if !take(new_size) {
            return std::ptr::null_mut();
        }
        give_back(layout.size());
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, new_size) }
    }
}

/// What `body` returns, and the most bytes that this thread held at a time beyond those that it held before.
pub fn most_held<T>(body: impl FnOnce() -> T) -> (T, usize) {
    let before = HELD.get();
    MOST.set(before);
    IS_BOUND.set(true);
    let value = body();
    IS_BOUND.set(false);
    let most = MOST.get().saturating_sub(before);
    (value, usize::try_from(most).unwrap_or_default())
}
