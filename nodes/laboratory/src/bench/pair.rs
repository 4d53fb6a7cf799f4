//! `stillmap bench pair`: both ends as two nodes of one process, as `stillmap up` composes the suite.
//! Between them a message is a shared pointer.

use std::time::{Duration, Instant};

use clap::Args;
use node_shell::{Host, RosArguments, Transport};
use serde::{Deserialize, Serialize};

use super::publish::{PublishArgs, PublishReport, Sender};
use super::subscribe::{Receiver, SubscribeArgs, SubscribeReport};
use robot::{Failure, Outcome};

/// Arguments of `stillmap bench pair`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap bench pair --topic image --bytes 4915200 --hz 30 --seconds 10 --wait")]
pub struct PairArgs {
    #[command(flatten)]
    publish: PublishArgs,
}

/// The reports of both ends. Time and memory are those of the common process in both.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(super) struct PairReport {
    pub(super) publish: PublishReport,
    pub(super) subscribe: SubscribeReport,
}

/// How long the receiving end runs after the sending end is done.
const LAST_ARRIVAL: Duration = Duration::from_millis(200);

pub(super) fn run(args: &PairArgs, ros: &RosArguments) -> Result<Outcome, Failure> {
    let report = super::as_node("bench_pair", ros, async {
        let transport =
            Transport::from_environment().map_err(|error| Failure::new(error.to_string()))?;
        let host = Host::on(transport).map_err(super::shell_failure)?;
        let started = Instant::now();
        let receiving = host.node("bench_subscriber", ros).map_err(super::shell_failure)?;
        let sending = host.node("bench_publisher", ros).map_err(super::shell_failure)?;
        let receiver = SubscribeArgs::beside(&args.publish);
        let receiver = Receiver::new(&receiver, &receiving, started)?;
        let enough = receiver.enough();
        let receiver = tokio::spawn(receiver.run());
        let publish = Sender::new(&args.publish, &sending)?.run().await;
        tokio::time::sleep(LAST_ARRIVAL).await;
        enough.trigger();
        let subscribe = receiver
            .await
            .map_err(|error| Failure::new(format!("the receiving end failed: {error}")))?;
        sending.close().await;
        receiving.close().await;
        Ok(PairReport { publish, subscribe })
    })?;
    super::print_report(&report)
}
