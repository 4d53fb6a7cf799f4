//! A panic in a step of a node: a defect of this program, which must not end the nodes beside it.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A step ended in a panic. Where it was is on the standard error: the runtime says so before this is known.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("a defect of this program, please report it: {said}")]
pub struct Panicked {
    said: String,
}

impl Panicked {
    /// The cause of the drop of what was worked on.
    pub const CAUSE: &str = "a defect of this program";
}

/// What a step gives, or the panic that it ended in. The caller sees to it that what the step has changed is fit to go on with.
///
/// # Errors
/// When the step panics.
pub fn caught<T>(step: impl FnOnce() -> T) -> Result<T, Panicked> {
    catch_unwind(AssertUnwindSafe(step)).map_err(|panic| Panicked { said: said(panic.as_ref()) })
}

fn said(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "a panic".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_an_error_with_its_words() {
        assert_eq!(caught(|| 7), Ok(7));
        let index = [1, 2].len();
        let out_of_bounds = caught(|| [1, 2][index]).unwrap_err().to_string();
        assert!(out_of_bounds.contains("the len is 2 but the index is 2"), "{out_of_bounds}");
        assert!(caught(|| panic!("a number")).unwrap_err().to_string().ends_with("a number"));
        let other = caught(|| std::panic::panic_any(3_u8)).unwrap_err().to_string();
        assert!(other.ends_with("a panic"), "{other}");
    }
}
