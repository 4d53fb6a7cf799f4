//! What the tests of nodes that talk with each other share, whatever is between them.

use std::time::Duration;

use msgs::RosMessage;
use msgs::sensor_msgs::LaserScan;
use msgs::std_msgs::Header;

use crate::{Publisher, RosArguments, Subscription};

/// Longer than anything takes on a busy machine; a test that waits this long has failed.
pub(crate) const PATIENCE: Duration = Duration::from_secs(120);

/// A node's, in a namespace, with others behind.
pub(crate) fn arguments(namespace: &str, others: &[&str]) -> RosArguments {
    let rule = format!("__ns:={namespace}");
    let mut line = vec!["--ros-args", "-r", &rule];
    line.extend(others);
    RosArguments::parse(line).unwrap()
}

pub(crate) async fn soon<T>(what: &str, wait: impl Future<Output = T>) -> T {
    match tokio::time::timeout(PATIENCE, wait).await {
        Ok(value) => value,
        Err(_) => panic!("waited in vain: {what}"),
    }
}

pub(crate) async fn matched<M: RosMessage>(
    publisher: &Publisher<M>,
    subscription: &Subscription<M>,
) {
    soon("the match", async {
        publisher.wait_for_subscribers(1).await;
        subscription.wait_for_publishers(1).await;
    })
    .await;
}

pub(crate) fn scan(beams: usize) -> LaserScan {
    LaserScan {
        header: Header { frame_id: "laser".to_owned(), ..Header::default() },
        ranges: (0..beams).map(|beam| beam as f32 * 0.5).collect(),
        ..LaserScan::default()
    }
}
