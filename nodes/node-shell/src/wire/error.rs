//! The errors of starting a node and its endpoints, and of publishing.

use crate::settings::arguments::ArgumentError;
use crate::settings::names::NameError;
use crate::settings::parameters::ParameterError;
use crate::wire::payload::PayloadError;
use crate::wire::transport::TransportError;

/// A node, or one of its endpoints, could not be had.
#[derive(Debug, thiserror::Error)]
pub enum ShellError {
    /// The command line is not understood.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// The environment is not understood.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// A parameter is not understood.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A name breaks the rules.
    #[error(transparent)]
    Name(#[from] NameError),
    /// A node was started outside of a tokio runtime; this is a mistake in the program.
    #[error("a node must be started within a tokio runtime")]
    NoRuntime,
    /// The process may not handle signals, or has no runtime for its tasks.
    #[error("the process could not be set up: {0}")]
    Process(std::io::Error),
    /// A setting of the process, from the environment, is not understood.
    #[error("{0}")]
    Setting(String),
    /// The DDS participant could not be created.
    #[error(
        "the node could not join {transport}: {reason}; is the network up, and are there fewer than \
         120 participants of this domain on this machine?"
    )]
    Join {
        /// Where it was to join.
        transport: String,
        /// The library's error.
        reason: String,
    },
    /// The Zenoh session could not be had.
    #[error("the node could not join Zenoh: {0}")]
    Zenoh(String),
    /// A publisher or subscription could not be created.
    #[error("the {endpoint} on {topic} could not be created: {reason}")]
    Endpoint {
        /// The kind of endpoint.
        endpoint: &'static str,
        /// Its topic.
        topic: String,
        /// The library's error.
        reason: String,
    },
    /// The node was closed already.
    #[error("the node is closed")]
    Closed,
}

impl ShellError {
    /// Whether another start would fail in the same way: the command line, a parameter or a setting cannot be used. A network that is not
    /// there, or a file that cannot be read, may be there by then.
    #[must_use]
    pub fn is_for_good(&self) -> bool {
        match self {
            Self::Argument(_) | Self::Name(_) | Self::Setting(_) => true,
            Self::Parameter(error) => error.is_for_good(),
            Self::Transport(error) => error.is_for_good(),
            Self::NoRuntime
            | Self::Process(_)
            | Self::Join { .. }
            | Self::Zenoh(_)
            | Self::Endpoint { .. }
            | Self::Closed => false,
        }
    }
}

/// A message was not published.
#[derive(Debug, thiserror::Error)]
pub enum PublishError {
    /// It could not be encoded.
    #[error("a message for {topic} could not be encoded: {source}")]
    Encode {
        /// The topic.
        topic: String,
        /// Why.
        source: msgs::cdr::CdrError,
    },
    /// Its bytes are no message of the type that a subscription of the same process has.
    #[error("a message for {topic} is no message of its type: {source}")]
    Undecodable {
        /// The topic.
        topic: String,
        /// Why.
        source: msgs::cdr::CdrError,
    },
    /// Its bytes are no message that can be published.
    #[error("a message for {topic} cannot be published: {source}")]
    Payload {
        /// The topic.
        topic: String,
        /// Why.
        source: PayloadError,
    },
    /// A response would be sent in fragments, which only clients of Cyclone DDS can read.
    #[error(
        "{service} does not answer: the response has {bytes} bytes, and more than {largest} reach clients of Cyclone \
         DDS alone; ask for less at a time"
    )]
    ResponseTooLarge {
        /// The service.
        service: String,
        /// Of the response.
        bytes: usize,
        /// The largest that every client gets.
        largest: usize,
    },
    /// The node is managed, and does not work now.
    #[error(
        "{topic}: the node is not active and publishes nothing; activate it: ros2 lifecycle set NODE activate"
    )]
    NotActive {
        /// The topic.
        topic: String,
    },
    /// A reliable subscriber is too far behind.
    #[error(
        "a message for {topic} was not taken: a reliable subscriber has not acknowledged the earlier \
         ones; it may have died, and is dropped within 50 s"
    )]
    NotAcknowledged {
        /// The topic.
        topic: String,
    },
    /// The library failed.
    #[error("a message for {topic} was not sent: {reason}")]
    Library {
        /// The topic.
        topic: String,
        /// The error's text.
        reason: String,
    },
}
