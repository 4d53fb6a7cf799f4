//! The errors of arguments, with what is accepted.

use crate::settings::names::NameError;

/// An argument that cannot be understood.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum ArgumentError {
    /// No option of `--ros-args` has this name.
    #[error(
        "unknown ROS argument `{argument}`; accepted are -r FROM:=TO, -p NAME:=VALUE, --params-file \
         FILE, --log-level LEVEL, --enclave PATH, and `--` to end them"
    )]
    Unknown {
        /// The argument.
        argument: String,
    },
    /// An option is at the end, without its value.
    #[error("`{option}` must be followed by {accepted}")]
    NoValue {
        /// The option.
        option: String,
        /// The form of its value.
        accepted: &'static str,
    },
    /// The value of an option has another form.
    #[error("`{option} {value}` is not understood: accepted is {accepted}")]
    BadValue {
        /// The option.
        option: String,
        /// Its value.
        value: String,
        /// The form of its value.
        accepted: &'static str,
    },
    /// A name in a remapping breaks the rules for names.
    #[error("`{option} {value}`: {source}")]
    BadName {
        /// The option.
        option: String,
        /// Its value.
        value: String,
        /// What is wrong with the name.
        source: NameError,
    },
}
