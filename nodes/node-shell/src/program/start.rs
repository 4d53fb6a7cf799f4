//! How a node starts, with what it does beside its body.

use crate::node::Node;
use crate::node::host::Host;
use crate::process::log;
use crate::settings::arguments::RosArguments;
use crate::wire::error::ShellError;
use crate::wire::transport::Transport;

impl Host {
    /// Starts a node of this host.
    ///
    /// # Errors
    /// When names or network do not allow it.
    pub fn node(&self, default_name: &str, arguments: &RosArguments) -> Result<Node, ShellError> {
        let identity = arguments.identity(default_name)?;
        let _within = log::span_of(&identity.logger_name()).entered();
        let node = Node::of(self, identity, arguments)?;
        node.start_clock()?;
        node.start_diagnostics()?;
        node.start_rosout()?;
        node.watch_library();
        Ok(node)
    }
}

impl Node {
    /// Starts a node on the network that the environment names, alone in its process. From then on SIGINT
    /// and SIGTERM trigger its [`Node::shutdown_signal`].
    ///
    /// # Errors
    /// When names, environment or network do not allow it. Must be called within a tokio runtime.
    pub fn start(default_name: &str, arguments: &RosArguments) -> Result<Self, ShellError> {
        Self::start_on(Transport::from_environment()?, default_name, arguments)
    }

    /// Starts a node on a given network, alone in its process.
    ///
    /// # Errors
    /// As [`Node::start`].
    pub fn start_on(
        transport: Transport,
        default_name: &str,
        arguments: &RosArguments,
    ) -> Result<Self, ShellError> {
        Host::on(transport)?.node(default_name, arguments)
    }
}
