//! What all nodes of the suite share of ROS 2: arguments, names, parameters, quality of service,
//! transport, publishers and subscriptions, diagnostics, logging and the ordered end.
//!
//! A node is a [`Program`] whose body gets a [`Node`]:
//!
//! ```no_run
//! use msgs::sensor_msgs::LaserScan;
//! use node_shell::{Program, Qos};
//! use serde::{Deserialize, Serialize};
//!
//! #[derive(Default, Serialize, Deserialize)]
//! struct Parameters {
//!     verbose: bool,
//! }
//!
//! let program = Program { name: "listener", about: "Counts scans.", topics: "scan (in)" };
//! program.run(std::env::args().skip(1), async |node, parameters: Parameters| {
//!     let scans = node.subscription::<LaserScan>("scan", &Qos::sensor(5))?;
//!     let shutdown = node.shutdown_signal();
//!     loop {
//!         tokio::select! {
//!             () = shutdown.wait() => return Ok(()),
//!             scan = scans.next() => {
//!                 if parameters.verbose {
//!                     tracing::info!("{} beams", scan.message.ranges.len());
//!                 }
//!                 node.counters().count_cycle();
//!             }
//!         }
//!     }
//! });
//! ```
//!
//! What is absent: clients of services, and actions.
//! They come when a node needs them.

pub mod arguments;
mod assembly;
mod clock;
mod counters;
mod diagnostics;
mod encoded;
mod error;
mod exchange;
mod graph;
mod host;
#[cfg(test)]
mod in_process;
mod inbox;
mod lifecycle;
pub mod log;
pub mod names;
mod network;
mod node;
#[cfg(test)]
mod over_dds;
mod parameter_services;
pub mod parameters;
mod payload;
mod program;
mod publisher;
mod qos;
mod raw_subscription;
mod reader;
mod rosout;
mod service;
mod shutdown;
mod stage_report;
mod steps;
mod subscription;
mod survey;
mod throttle;
mod transforms;
mod transport;
mod whole_file;
mod writer;

pub use arguments::RosArguments;
pub use clock::{ClockJumps, NodeClock};
pub use counters::Counters;
pub use error::{PublishError, ShellError};
pub use graph::{Match, Role};
pub use host::Host;
pub use lifecycle::{Lifecycle, LifecycleState, Reset};
pub use node::Node;
pub use parameter_services::{LiveParameters, descriptors};
pub use payload::PayloadError;
pub use program::{NodeFailure, Program};
pub use publisher::{Publisher, RawPublisher};
pub use qos::Qos;
pub use raw_subscription::{RawSubscription, ReceivedBytes};
pub use service::{Request, Service};
pub use shutdown::Shutdown;
pub use stage_report::StageReporter;
pub use steps::StepTimer;
pub use subscription::{Received, Subscription};
pub use survey::{DiscoveredEndpoint, DiscoveredQos, ParticipantId, QosMismatch};
pub use throttle::{Throttle, WARNING_PERIOD};
pub use transforms::{
    TransformArrival, TransformBroadcaster, TransformError, TransformListener, TransformRefused,
    TransformTree, TransformWait,
};
pub use transport::{
    Announcer, BacklogWatch, DiscoveryRange, GrantedBuffer, InterfaceInUse, Joined,
    MessageTooLarge, RAISE_RECEIVE_BUFFER, ReceiveHealth, StaticPeer, Transport, TransportError,
};
pub use whole_file::{folder_of, write_whole_file};
