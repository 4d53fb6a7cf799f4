//! The bag player as a separate program; see [`bag_player::shell`].

use std::process::ExitCode;

fn main() -> ExitCode {
    bag_player::shell::run(std::env::args().skip(1))
}
