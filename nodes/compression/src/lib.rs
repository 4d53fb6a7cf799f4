//! The node `compression`: raw images in, compressed ones out, in the formats of image_transport. It
//! stands on the driver's machine, beside a driver that sends only raw images, so that what crosses the
//! network is small: 30 depth images a second are 18 MB raw and 3 to 6 MB compressed, as many colour
//! images 28 MB and 1 to 3 MB.
//!
//! Compressed images have their topic below that of the raw ones, wherever remapping puts those. An
//! image that nobody wants compressed is not.

mod parameters;
#[cfg(test)]
mod tests;

use std::process::ExitCode;

use msgs::convert::{self, COMPRESSED_DEPTH_TOPIC, COMPRESSED_IMAGE_TOPIC, ConvertError};
use msgs::sensor_msgs::{CompressedImage, Image};
use node_shell::{
    Counters, Node, NodeFailure, Program, Publisher, Qos, Received, ShellError, StepTimer,
    Subscription, Throttle,
};

pub use parameters::{ColorFormat, CompressionParameters, DepthFormat, DepthMetres, Images};

const PROGRAM: Program = Program {
    name: "compression",
    about: "Publishes a camera's raw images compressed, as image_transport would.",
    topics: "in  depth/image (sensor_msgs/msg/Image: 16UC1, 32FC1), best effort
             in  color/image (sensor_msgs/msg/Image), best effort; with images:=color or both
             out depth/image/compressedDepth (sensor_msgs/msg/CompressedImage), best effort
             out color/image/compressed (sensor_msgs/msg/CompressedImage), best effort",
};

const DEPTH_TOPIC: &str = "depth/image";
const COLOR_TOPIC: &str = "color/image";

/// Images that may wait while one is compressed: later ones are worth more than all of them.
const IMAGES_KEPT: usize = 2;
/// Compressed images that a reader may be behind: that of sensors (REP-2003).
const COMPRESSED_KEPT: usize = 5;

/// Runs the node until SIGINT or SIGTERM, with the arguments behind the program's name.
pub fn run(arguments: impl IntoIterator<Item = String>) -> ExitCode {
    PROGRAM.run(arguments, serve)
}

/// The node's body: serves until the node is to end.
///
/// # Errors
/// When a parameter is out of its range, or a topic cannot be had.
pub async fn serve(node: &Node, parameters: CompressionParameters) -> Result<(), NodeFailure> {
    parameters.validate()?;
    let (mut depth_codec, mut metres_as) = parameters.depth_codec()?;
    let mut color_codec = parameters.color_codec()?;
    let mut lanes = Lanes::new(node, &parameters)?;
    let mut live = node.serve_parameters(&parameters)?;
    let mut lifecycle = node.manage()?;
    let shutdown = node.shutdown_signal();
    loop {
        tokio::select! {
            biased;
            () = shutdown.wait() => return Ok(()),
            // It holds nothing.
            _reset = lifecycle.reset() => {}
            parameters = live.changed() => {
                (depth_codec, metres_as) = parameters.depth_codec()?;
                color_codec = parameters.color_codec()?;
            }
            (kind, image) = lanes.next() => match kind {
                Kind::Depth => lanes.take(kind, &image.message, |image| {
                    let image = convert::depth_from_message(image)?;
                    convert::compressed_message_from_depth_with(&image, depth_codec, metres_as)
                }),
                Kind::Color => lanes.take(kind, &image.message, |image| {
                    convert::compressed_message_from_image(image, color_codec)
                }),
            },
        }
    }
}

/// What an image is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Depth,
    Color,
}

impl Kind {
    fn other(self) -> Self {
        match self {
            Self::Depth => Self::Color,
            Self::Color => Self::Depth,
        }
    }
}

/// The images of both kinds. They take turns: where compressing takes all of the time, each has half of it.
struct Lanes {
    depth: Option<Lane>,
    color: Option<Lane>,
    turn: Kind,
}

impl Lanes {
    fn new(node: &Node, parameters: &CompressionParameters) -> Result<Self, ShellError> {
        let lane = |is_wanted: bool, topic, part| {
            is_wanted.then(|| Lane::new(node, topic, part, parameters.reliable)).transpose()
        };
        let images = parameters.images;
        Ok(Self {
            depth: lane(images.has_depth(), DEPTH_TOPIC, COMPRESSED_DEPTH_TOPIC)?,
            color: lane(images.has_color(), COLOR_TOPIC, COMPRESSED_IMAGE_TOPIC)?,
            turn: Kind::Depth,
        })
    }

    fn of(&self, kind: Kind) -> Option<&Lane> {
        match kind {
            Kind::Depth => self.depth.as_ref(),
            Kind::Color => self.color.as_ref(),
        }
    }

    /// The next image. May be dropped while it waits.
    async fn next(&self) -> (Kind, Received<Image>) {
        let other = self.turn.other();
        tokio::select! {
            biased;
            image = next(self.of(self.turn)) => (self.turn, image),
            image = next(self.of(other)) => (other, image),
        }
    }

    /// Compresses an image, after which the other kind has its turn.
    fn take(
        &mut self,
        kind: Kind,
        image: &Image,
        compress: impl FnOnce(&Image) -> Result<CompressedImage, ConvertError>,
    ) {
        self.turn = kind.other();
        if let Some(lane) = self.of(kind) {
            lane.take(image, compress);
        }
    }
}

/// The next image, where there is a lane for it at all.
async fn next(lane: Option<&Lane>) -> Received<Image> {
    match lane {
        Some(lane) => lane.images.next().await,
        None => std::future::pending().await,
    }
}

/// A topic of images and the one of what becomes of them.
struct Lane {
    images: Subscription<Image>,
    compressed: Publisher<CompressedImage>,
    counters: Counters,
    failed: Throttle,
}

impl Lane {
    fn new(node: &Node, topic: &str, part: &str, is_reliable: bool) -> Result<Self, ShellError> {
        // Below the name that the raw image has after all remapping.
        let compressed = format!("{}/{part}", node.resolve(topic)?);
        let latched = false;
        Ok(Self {
            images: node.subscription(topic, &Qos::sensor(IMAGES_KEPT))?,
            compressed: node
                .publisher(&compressed, &Qos::new(is_reliable, latched, COMPRESSED_KEPT))?,
            counters: node.counters(),
            failed: Throttle::for_warnings(),
        })
    }

    fn take(
        &self,
        image: &Image,
        compress: impl FnOnce(&Image) -> Result<CompressedImage, ConvertError>,
    ) {
        if self.compressed.subscriber_count() == 0 {
            return;
        }
        let mut timer = StepTimer::start();
        match compress(image) {
            Ok(compressed) => {
                timer.end_of("compress");
                if self.compressed.publish_or_warn(compressed) {
                    self.counters.count_cycle();
                }
            }
            Err(error) => {
                self.counters.count_drop("compression failed");
                if let Some(held_back) = self.failed.pass() {
                    let topic = self.images.topic();
                    tracing::warn!("{topic}: {error} ({held_back} more since the last warning)");
                }
            }
        }
    }
}
