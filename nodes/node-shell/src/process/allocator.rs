//! The C library's allocator, told to give memory back to the system.

/// Each of its arenas keeps what was freed at its end, up to twice the largest block that was ever freed, and there are eight arenas
/// a core: after a quarter of an hour of `stillmap bench soak` the suite held 450 MB, of which 110 MB were in use. With these limits it
/// held 266 MB after nine minutes.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod limits {
    pub(super) const MOST_ARENAS: libc::c_int = 2;
    /// A larger block is returned when it is freed: 8 MB, more than an image or a cloud of each cycle.
    pub(super) const LARGE_BYTES: libc::c_int = 8 << 20;
    /// As much may stay free at the end of an arena.
    pub(super) const MOST_FREE_BYTES: libc::c_int = 2 * LARGE_BYTES;
}

/// Sets the limits, for arenas that are made from now on: before there are many threads. Whether the allocator took them.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code, reason = "the C library has no other interface to these limits")]
pub(crate) fn limit() -> bool {
    let limits = [
        (libc::M_ARENA_MAX, limits::MOST_ARENAS),
        (libc::M_MMAP_THRESHOLD, limits::LARGE_BYTES),
        (libc::M_TRIM_THRESHOLD, limits::MOST_FREE_BYTES),
    ];
    // SAFETY: `mallopt` takes two numbers and keeps no pointer; it returns 0 for what it does not know.
    limits.into_iter().all(|(name, value)| unsafe { libc::mallopt(name, value) } == 1)
}

/// Other allocators have limits of their own.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(crate) fn limit() -> bool {
    false
}

#[cfg(all(test, target_os = "linux", target_env = "gnu"))]
mod tests {
    #[test]
    fn the_allocator_takes_the_limits() {
        assert!(super::limit());
    }
}
