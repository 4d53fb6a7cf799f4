//! The node `lidar_odometry` as a program of its own.

use std::process::ExitCode;

fn main() -> ExitCode {
    lidar_odometry::shell::run(std::env::args().skip(1))
}
