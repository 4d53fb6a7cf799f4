//! The ROS 2 parts that all nodes of the suite share: arguments, names, parameters, quality of service,
//! transport, publishers and subscriptions, diagnostics, logging and the ordered end.
//!
//! A node is a [`Program`] whose body gets a [`Node`]:
//!
//! ```no_run
//! use msgs::sensor_msgs::LaserScan;
//! use node_shell::parameters::NodeParameters;
//! use node_shell::{NodeFailure, Program, Qos};
//!
//! geometry::parameters! {
//!     /// The parameters of the node.
//!     #[derive(Clone, Debug)]
//!     pub struct Parameters {
//!         /// Whether each scan is logged.
//!         verbose: bool = false;
//!     }
//! }
//!
//! impl NodeParameters for Parameters {}
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
//! The crate has eight floors, a folder each; a module imports from its own and from those below it:
//!
//! | floor | its contents |
//! |---|---|
//! | `program` | a node as a program: how it starts, `--help`, the exit code |
//! | `services` | what nodes offer beside their topics: parameters, lifecycle, diagnostics, log, reports; tf |
//! | `node` | a node and the host of its process, its time, where it is in its life |
//! | `endpoints` | publishers, subscriptions and services, with their DDS readers and writers, and the counters |
//! | `graph` | who is at the other end: messages within the process, peers outside of it |
//! | `wire` | sockets, discovery, encoded messages, Zenoh, and the errors of all that |
//! | `settings` | arguments, names, parameters, quality of service |
//! | `process` | log, signals, warnings that do not repeat, files written whole, spilled files |
//!
//! Absent: actions. They come when a node needs them.

mod endpoints;
#[cfg(test)]
mod floors;
mod graph;
#[cfg(test)]
mod in_process;
mod node;
#[cfg(test)]
mod over_dds;
#[cfg(all(test, feature = "zenoh"))]
mod over_zenoh;
mod process;
mod program;
mod services;
mod settings;
#[cfg(test)]
mod two_nodes;
mod wire;

pub use endpoints::counters::Counters;
pub use endpoints::publisher::{Publisher, RawPublisher, ValuePublisher};
pub use endpoints::raw_subscription::{RawSubscription, ReceivedBytes};
pub use endpoints::service::{Request, Service};
pub use endpoints::service_client::{AskError, ServiceClient};
pub use endpoints::subscription::{Subscription, ValueSubscription};
pub use graph::inbox::Received;
pub use graph::survey::{DiscoveredEndpoint, DiscoveredQos, ParticipantId, QosMismatch};
pub use graph::value::{Arrived, Incoming};
pub use graph::{Match, Role};
pub use node::Node;
pub use node::clock::{ClockJumps, NodeClock};
pub use node::endpoints::RawType;
pub use node::host::{Host, let_peers_run};
pub use node::life::LifecycleState;
pub use node::stamp_check::{StampCheck, StampOrder};
pub use process::failure::{EXIT_UNUSABLE, NodeFailure, Unusable, is_for_good};
pub use process::file_lock::ClaimedFile;
pub use process::log;
pub use process::panicked::{Panicked, caught};
pub use process::shutdown::{Shutdown, ending_signals};
pub use process::spill_folder::{SpillFolder, SpillFolderError};
pub use process::status_line::StatusLine;
pub use process::throttle::{Throttle, WARNING_PERIOD};
pub use process::versions::{VERSIONS_KEPT, keep_version, keep_version_with};
pub use process::whole_file::{check_folder_of, folder_of, output_file, write_whole_file};
pub use program::Program;
pub use services::lifecycle::{Lifecycle, Reset};
pub use services::odometry_output::{MapFromOdom, OdometryFrames, OdometryOutput, PublishedPose};
pub use services::parameter_services::{
    LiveParameters, descriptors, message_from_parameter, parameter_from_message,
};
pub use services::pipeline_watch::PipelineWatch;
pub use services::stage_report::StageReporter;
pub use services::steps::StepTimer;
pub use services::transforms::{
    TransformArrival, TransformBroadcaster, TransformError, TransformListener, TransformRefused,
    TransformTree, TransformWait,
};
pub use settings::arguments::RosArguments;
pub use settings::qos::Qos;
pub use settings::waiting_cycles::EVERY_CYCLE;
pub use settings::{arguments, names, parameters};
pub use wire::error::{PublishError, ShellError};
pub use wire::payload::PayloadError;
pub use wire::rmw_zenoh::ZenohLinks;
pub use wire::transport::{
    Announcer, BacklogWatch, DatagramFilter, DiscoveryRange, GrantedBuffer, InterfaceInUse, Joined,
    MessageTooLarge, RAISE_RECEIVE_BUFFER, ReceiveHealth, StaticPeer, Transport, TransportError,
};
