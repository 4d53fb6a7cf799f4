//! `stillmap view`: the live view of a running graph, in a process of its own.

use std::net::SocketAddr;

use clap::{Args, ValueEnum};
use detection::shell::DetectionParameters;
use lidar_odometry::shell::LidarOdometryParameters;
use live_view::shell::{
    DEFAULT_ADDRESS, FOXGLOVE_ADDRESS, FOXGLOVE_NODE, FoxgloveServer, GraphOf, LiveView, NODE,
    ShownNode, ViewError,
};
use node_shell::parameters::{NodeParameters, ParameterError};
use node_shell::{Host, Node, RosArguments, Transport, descriptors, log};
use pose::shell::PoseParameters;
use reconstruction::shell::ReconstructionParameters;
use segmentation::shell::SegmentationParameters;
use tracing::Instrument;

use crate::console;
use crate::failure::{Failure, Outcome};
use crate::run::Stage;
use crate::up::PoseNode;

/// Arguments of `stillmap view`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap view --ros-args -r __ns:=/robot

The page is served until Ctrl-C or SIGTERM. On an address that other machines reach, the page needs the token that is in the
printed address.")]
pub struct ViewArgs {
    /// Where the page is served; port 0 is a free one
    #[arg(value_name = "ADDRESS:PORT", default_value = DEFAULT_ADDRESS)]
    address: SocketAddr,
    #[command(flatten)]
    foxglove: FoxgloveArgs,
}

/// Where viewers of another maker connect.
#[derive(Args, Debug)]
pub(crate) struct FoxgloveArgs {
    /// Let Foxglove, or what speaks its websocket protocol, connect: at this address, or from this machine alone; port 0 is a free one
    #[arg(long, value_name = "ADDRESS:PORT", num_args = 0..=1, default_missing_value = FOXGLOVE_ADDRESS)]
    pub(crate) foxglove: Option<SocketAddr>,
}

impl FoxgloveArgs {
    /// Listens, where that is asked for.
    pub(crate) fn listen(&self) -> Result<Option<FoxgloveServer>, Failure> {
        self.foxglove
            .map(|address| FoxgloveServer::bind(address).map_err(cannot_listen("--foxglove")))
            .transpose()
    }
}

pub(crate) fn run(args: &ViewArgs, ros: &RosArguments) -> Result<Outcome, Failure> {
    log::start("stillmap", &ros.log, &ros.outputs);
    ros.warn_of_options_without_effect();
    let failed = |error: &dyn std::error::Error| Failure::new(error.to_string());
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .map_err(|error| Failure::new(format!("cannot start threads: {error}")))?;
    runtime.block_on(async {
        let view = listen(args.address, "stillmap view")?;
        let foxglove = args.foxglove.listen()?;
        let transport = Transport::from_environment().map_err(|error| failed(&error))?;
        let host = Host::on(transport).map_err(|error| failed(&error))?;
        let node = host.node(NODE, ros).map_err(|error| failed(&error))?;
        let shown = shown_nodes(PoseNode::value_variants(), true)?;
        announce(&view);
        let viewers = async {
            let Some(server) = foxglove else { return Ok(()) };
            let node = host.node(FOXGLOVE_NODE, ros).map_err(|error| failed(&error))?;
            serve_foxglove(server, node, GraphOf::OtherProcesses)
                .await
                .map_err(|reason| Failure::new(format!("{FOXGLOVE_NODE}: {reason}")))
        };
        let page = async {
            serve(view, node, GraphOf::OtherProcesses, shown)
                .await
                .map_err(|reason| Failure::new(format!("{NODE}: {reason}")))
        };
        tokio::try_join!(page, viewers)?;
        host.shutdown_signal()
            .failure()
            .map_or(Ok(Outcome::Complete), |reason| Err(Failure::new(reason)))
    })
}

/// Listens on the address that stands behind these words of the command line.
pub(crate) fn listen(address: SocketAddr, words: &str) -> Result<LiveView, Failure> {
    LiveView::bind(address).map_err(cannot_listen(words))
}

/// Another suite on this machine may serve there.
fn cannot_listen(words: &str) -> impl Fn(ViewError) -> Failure {
    move |error| {
        Failure::new(error.to_string()).fix(format!(
            "choose another address or port: {words} ADDRESS:PORT; port 0 is a free one, as in {words} 127.0.0.1:0"
        ))
    }
}

/// Says where the page is.
pub(crate) fn announce(view: &LiveView) {
    console::note(format!("live view: {}", view.url()));
}

/// Serves the page until the process is to end; else the reason.
pub(crate) async fn serve(
    view: LiveView,
    node: Node,
    graph: GraphOf,
    shown: Vec<ShownNode>,
) -> Result<(), String> {
    let span = node.span();
    let served = view.serve(node, graph, shown).instrument(span);
    served.await.map_err(|error| error.to_string())
}

/// Says where viewers connect, and serves them until the process is to end; else the reason.
pub(crate) async fn serve_foxglove(
    server: FoxgloveServer,
    node: Node,
    graph: GraphOf,
) -> Result<(), String> {
    let (url, with_token) = (server.url(), server.url_with_token());
    console::note(format!("foxglove: {url}"));
    if url != with_token {
        console::note(format!(
            "foxglove, for a page of another site than Foxglove's: {with_token}"
        ));
    }
    let span = node.span();
    let served = server.serve(node, graph).instrument(span);
    served.await.map_err(|error| error.to_string())
}

/// The nodes whose parameters the page shows: the three stages, and those that make the pose, which may be absent.
pub(crate) fn shown_nodes(
    pose: &[PoseNode],
    may_be_absent: bool,
) -> Result<Vec<ShownNode>, Failure> {
    fn of<P: NodeParameters>(name: &str) -> Result<ShownNode, ParameterError> {
        let parameters = descriptors::<P>()?;
        Ok(ShownNode { name: name.to_owned(), parameters, may_be_absent: false })
    }
    let mut nodes = vec![
        of::<DetectionParameters>(Stage::Detection.name()),
        of::<SegmentationParameters>(Stage::Segmentation.name()),
        of::<ReconstructionParameters>(Stage::Reconstruction.name()),
    ];
    nodes.extend(pose.iter().map(|pose| {
        let shown = match pose {
            PoseNode::Visual => of::<PoseParameters>(pose.name()),
            PoseNode::Lidar => of::<LidarOdometryParameters>(pose.name()),
        };
        shown.map(|shown| ShownNode { may_be_absent, ..shown })
    }));
    let nodes: Result<Vec<_>, _> = nodes.into_iter().collect();
    nodes.map_err(|error| Failure::new(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: a second suite with a page on one machine ended without a word of the option that chooses another port.
    #[test]
    fn a_port_that_is_taken_is_answered_with_the_option_for_another_one() {
        let first = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = first.local_addr().unwrap();
        let said = |failure: Failure| format!("{failure:?}");
        let failure = said(listen(address, "--view").err().unwrap());
        assert!(failure.contains("--view 127.0.0.1:0"), "{failure}");
        let foxglove = FoxgloveArgs { foxglove: Some(address) };
        let failure = said(foxglove.listen().err().unwrap());
        assert!(failure.contains("--foxglove ADDRESS:PORT"), "{failure}");
    }
}
