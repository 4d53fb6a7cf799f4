//! The node's log on `/rosout`.

use msgs::rcl_interfaces::Log;

use crate::endpoints::publisher::Publisher;
use crate::node::clock::NodeClock;
use crate::process::log::NodeLines;

/// The topic, of all nodes.
pub(crate) const TOPIC: &str = "/rosout";
/// Lines that late subscribers still get. ROS 2 keeps a thousand for ten seconds; lines are few here.
pub(crate) const LINES_KEPT: usize = 100;

/// Publishes the lines until `stop` resolves, with the node's own time.
pub(crate) async fn publish(
    mut lines: NodeLines,
    publisher: Publisher<Log>,
    clock: NodeClock,
    stop: impl Future<Output = ()>,
) {
    futures::pin_mut!(stop);
    loop {
        tokio::select! {
            () = &mut stop => return,
            Some(line) = lines.next() => {
                // A failure that is logged would be a line, and so on.
                let _ = publisher.publish(Log { stamp: clock.now(), ..line });
            }
        }
    }
}
