//! The parts of a process that do not depend on ROS: its log, its line at the foot of the terminal, its memory, its descriptors, its end;
//! panics that are caught; warnings that are not repeated at each message; files that are written whole, their versions, and who writes them; the folder of
//! what has no room in memory.

pub(crate) mod allocator;
pub(crate) mod descriptors;
pub(crate) mod failure;
pub(crate) mod file_lock;
pub mod log;
pub(crate) mod memory;
pub(crate) mod panicked;
pub(crate) mod shutdown;
pub(crate) mod spill_folder;
pub(crate) mod status_line;
pub(crate) mod throttle;
pub(crate) mod versions;
pub(crate) mod whole_file;
