//! The transforms that a node publishes on `/tf`.

use geometry::Stamp;
use msgs::convert;
use msgs::geometry_msgs::TransformStamped;
use msgs::std_msgs::Header;
use msgs::tf2_msgs::TFMessage;
use nalgebra::Isometry3;

use crate::endpoints::publisher::Publisher;
use crate::node::Node;
use crate::settings::qos::Qos;
use crate::wire::error::ShellError;

/// tf2's own.
const TRANSFORMS_KEPT: usize = 100;

/// Publishes where moving frames are, as `map` to `odom` and `odom` to `base_link` (REP 105). The topic is absolute, as
/// everywhere in ROS 2.
pub struct TransformBroadcaster {
    publisher: Publisher<TFMessage>,
}

impl TransformBroadcaster {
    /// Publishes to `/tf`, reliable, which fits every listener.
    ///
    /// # Errors
    /// When the publisher cannot be had.
    pub fn new(node: &Node) -> Result<Self, ShellError> {
        Ok(Self { publisher: node.publisher("/tf", &Qos::reliable(TRANSFORMS_KEPT))? })
    }

    /// Publishes that at the moment `stamp` `parent_from_child * point_in_child` was a point in the parent. A failure is logged
    /// once in a while; the next transform comes soon.
    pub fn send(
        &self,
        stamp: Stamp,
        parent: &str,
        child: &str,
        parent_from_child: &Isometry3<f64>,
    ) {
        let transform = TransformStamped {
            header: Header { stamp: convert::time_from_stamp(stamp), frame_id: parent.to_owned() },
            child_frame_id: child.to_owned(),
            transform: convert::transform_from_isometry(parent_from_child),
        };
        self.publisher.publish_or_warn(TFMessage { transforms: vec![transform] });
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::{Host, RosArguments, TransformListener};

    #[test]
    fn a_listener_receives_the_chain_that_two_broadcasters_publish() {
        let host = Host::in_process();
        let node = |name| host.node(name, &RosArguments::parse([] as [&str; 0]).unwrap()).unwrap();
        let (map, odometry, user) = (node("map"), node("odometry"), node("user"));
        let (in_map, in_odom) = (
            TransformBroadcaster::new(&map).unwrap(),
            TransformBroadcaster::new(&odometry).unwrap(),
        );
        let mut listener = TransformListener::new(&user).unwrap();
        let at = |seconds: i32| Stamp::from_secs_nanos(seconds, 0);
        let turn = Isometry3::rotation(Vector3::z() * std::f64::consts::FRAC_PI_2);
        for second in 0..2 {
            in_map.send(at(second), "map", "odom", &turn);
            let base = Isometry3::translation(f64::from(second), 0.0, 0.0);
            in_odom.send(at(second), "odom", "base_link", &base);
        }
        while let Some(arrival) = listener.try_next() {
            listener.take(&arrival);
        }
        let halfway = Stamp::from_secs_nanos(0, 500_000_000);
        let map_from_base = listener.tree().lookup("map", "base_link", halfway).unwrap();
        let place = map_from_base.translation.vector;
        assert!((place - Vector3::new(0.0, 0.5, 0.0)).norm() < 1e-12, "{place}");
        assert!(listener.tree().lookup("map", "base_link", at(2)).is_err(), "it is not carried on");
    }
}
