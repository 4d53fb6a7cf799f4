use std::process::ExitCode;

use msgs::sensor_msgs::LaserScan;
use node_shell::parameters::NodeParameters;
use node_shell::{Node, NodeFailure, Program, Qos};

geometry::parameters! {
    /// The parameters of the node.
    #[derive(Clone, Debug)]
    pub struct Parameters {
        /// Farther returns are left out.
        max_range_m: f64 = 4.0, positive, changeable;
    }
}

impl NodeParameters for Parameters {}

const PROGRAM: Program = Program {
    name: "near_scan",
    about: "Leaves far returns out of a scan.",
    topics: "in  scan (sensor_msgs/msg/LaserScan), best effort
             out near_scan (sensor_msgs/msg/LaserScan), reliable",
};

pub fn main() -> ExitCode {
    PROGRAM.run(std::env::args().skip(1), serve)
}

pub async fn serve(node: &Node, mut parameters: Parameters) -> Result<(), NodeFailure> {
    let scans = node.subscription::<LaserScan>("scan", &Qos::sensor(5))?;
    let near = node.publisher::<LaserScan>("near_scan", &Qos::reliable(5))?;
    let mut live = node.serve_parameters(&parameters)?;
    let shutdown = node.shutdown_signal();
    loop {
        tokio::select! {
            () = shutdown.wait() => return Ok(()),
            changed = live.changed() => parameters = changed,
            scan = scans.next() => {
                near.publish_if_awaited(|| without_far(&scan.message, parameters.max_range_m));
                node.counters().count_cycle();
            }
        }
    }
}

/// Pure: this is what a test calls.
pub fn without_far(scan: &LaserScan, max_range_m: f64) -> LaserScan {
    let mut near = scan.clone();
    for range_m in &mut near.ranges {
        if f64::from(*range_m) > max_range_m {
            // REP-117: too far.
            *range_m = f32::INFINITY;
        }
    }
    near
}
