//! The Python package `stillmap`. A shell: what it offers is [`robot`]'s and [`evaluation`]'s, as NumPy arrays.
//!
//! Long work runs without the interpreter's lock and looks for signals between messages. Failures are exceptions with the words of
//! the program; a panic is one, too.

mod arrays;
mod bag;
mod cycle;
mod errors;
mod map;
mod run;
mod trajectory;

use pyo3::pymodule;

/// What `stillmap` exports.
#[pymodule]
mod _native {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::bag::{Bag, Message, Messages, Topic};
    #[pymodule_export]
    use super::cycle::{Cycle, Track, Zone};
    #[pymodule_export]
    use super::errors::Error;
    #[pymodule_export]
    use super::map::{Map, read_map};
    #[pymodule_export]
    use super::run::{Run, run};
    #[pymodule_export]
    use super::trajectory::score_trajectories;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
