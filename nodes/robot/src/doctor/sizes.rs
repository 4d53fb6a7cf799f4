//! Sizes of usual messages, and how sizes are printed.

/// A raw depth image of 640x480 pixels of 2 bytes.
pub(super) const DEPTH_IMAGE_BYTES: usize = 640 * 480 * 2;
/// A cloud of as many points of 16 bytes.
pub(super) const CLOUD_BYTES: usize = 640 * 480 * 16;
/// A cloud of as many points of 32 bytes, which some drivers send: x y z and rgb, each padded to 16 bytes.
pub(super) const PADDED_CLOUD_BYTES: usize = 640 * 480 * 32;

/// A size in kB, as in the suite's other messages.
pub(super) fn kb(bytes: usize) -> String {
    format!("{} kB", bytes / 1000)
}

/// A buffer in KiB, as the kernel counts.
pub(super) fn kib(bytes: u64) -> String {
    format!("{} KiB", bytes / 1024)
}
