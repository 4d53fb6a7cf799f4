//! The trajectory of the rig in the current map: nodes that keep data by the poses move them when the map is
//! corrected.

use geometry::{MapPath, PathVertex, Stamp};
use msgs::convert;
use msgs::nav_msgs::Path;
use nalgebra::Isometry3;
use node_shell::{Node, Publisher, Qos, ShellError};

/// A path that is only extended is published no more often: it grows with the distance.
const PERIOD_S: f64 = 1.0;
/// A correction that moves the map by more is published at once: an eighth of the thesis' voxel ...
const MOVED_M: f64 = 0.01;
/// ... at a point this far from the rig at most.
const REACH_M: f64 = 5.0;

/// Publishes the trajectory.
pub(super) struct MapPathPublisher {
    paths: Publisher<Path>,
    frame_id: String,
    published: Option<MapPath>,
}

impl MapPathPublisher {
    pub(super) fn new(node: &Node, frame_id: &str) -> Result<Self, ShellError> {
        // Late subscribers need it, too.
        let paths = node.publisher("map_path", &Qos::latched())?;
        Ok(Self { paths, frame_id: frame_id.to_owned(), published: None })
    }

    /// Whether the trajectory is to be checked: the map has changed, or the trajectory is longer and was not published for a while.
    pub(super) fn is_due(
        &self,
        now: Stamp,
        last_waypoint: Option<Stamp>,
        has_changed: bool,
    ) -> bool {
        let Some(published) = &self.published else { return true };
        let goes_on = published.vertices().last().map(|last| last.stamp) != last_waypoint;
        has_changed || goes_on && !(0.0..PERIOD_S).contains(&now.seconds_since(published.since()))
    }

    /// Publishes the trajectory where it has changed: `map_from_rig` by rising stamp, as poses from `now` on have the map.
    pub(super) fn publish(
        &mut self,
        now: Stamp,
        trajectory: impl Iterator<Item = (Stamp, Isometry3<f64>)>,
    ) {
        let vertices = trajectory.map(|(stamp, map_from_rig)| PathVertex { stamp, map_from_rig });
        // A map that has a pose at infinity is not published.
        let Ok(path) = MapPath::new(now, &self.frame_id, vertices.collect()) else { return };
        if path.vertices().is_empty() || !self.is_news(now, &path) {
            return;
        }
        self.paths.publish_or_warn(convert::message_from_map_path(&path));
        self.published = Some(path);
    }

    fn is_news(&self, now: Stamp, path: &MapPath) -> bool {
        let Some(published) = &self.published else { return true };
        let last = |path: &MapPath| path.vertices().last().map(|last| last.stamp);
        let is_due = !(0.0..PERIOD_S).contains(&now.seconds_since(published.since()));
        let has_moved = || {
            let moved = path.correction_since(published);
            moved.is_none_or(|moved| moved.largest_shift_m(REACH_M) > MOVED_M)
        };
        (is_due && last(path) != last(published)) || has_moved()
    }

    /// The trajectory begins anew.
    pub(super) fn reset(&mut self) {
        self.published = None;
    }
}

#[cfg(test)]
mod tests {
    use node_shell::{Host, RosArguments, Subscription};

    use super::*;

    struct Ear {
        publisher: MapPathPublisher,
        paths: Subscription<Path>,
        _host: Host,
    }

    impl Ear {
        fn new() -> Self {
            let host = Host::in_process();
            let arguments = RosArguments::parse([] as [String; 0]).unwrap();
            let node = |name: &str| host.node(name, &arguments).unwrap();
            let publisher = MapPathPublisher::new(&node("pose"), "map").unwrap();
            let paths = node("peer").subscription("map_path", &Qos::reliable(9)).unwrap();
            Self { publisher, paths, _host: host }
        }

        /// The paths published for a trajectory of seconds and places; their numbers of vertices.
        fn published(&mut self, now_s: f64, trajectory: &[(f64, f64)]) -> Vec<usize> {
            let at = |seconds: f64| Stamp::default().plus_seconds(seconds);
            let pose = |(seconds, x_m): &(f64, f64)| {
                (at(*seconds), Isometry3::translation(*x_m, 0.0, 0.0))
            };
            self.publisher.publish(at(now_s), trajectory.iter().map(pose));
            std::iter::from_fn(|| self.paths.try_next())
                .map(|received| {
                    let path = convert::map_path_from_message(&received.message).unwrap();
                    assert_eq!((path.frame_id(), path.since()), ("map", at(now_s)));
                    path.vertices().len()
                })
                .collect()
        }
    }

    #[test]
    fn a_trajectory_is_published_at_once_when_corrected_and_periodically_when_extended() {
        let mut listener = Ear::new();
        assert_eq!(listener.published(5.0, &[]), [0; 0], "nothing to publish yet");
        let mut trajectory = vec![(5.0, 0.0)];
        assert_eq!(listener.published(5.1, &trajectory), [1]);
        assert_eq!(listener.published(9.0, &trajectory), [0; 0], "nothing has changed");
        trajectory.push((9.0, 0.5));
        assert_eq!(listener.published(9.1, &trajectory), [2]);
        trajectory.push((9.4, 1.0));
        assert_eq!(listener.published(9.5, &trajectory), [0; 0], "published a moment ago");
        trajectory[1].1 += 0.005;
        assert_eq!(listener.published(9.6, &trajectory), [0; 0], "by very little");
        trajectory[1].1 += 0.01;
        assert_eq!(listener.published(9.7, &trajectory), [3], "by very little, twice");
        assert_eq!(listener.published(20.0, &[(19.0, 0.0)]), [1], "begun anew");
        listener.publisher.reset();
        assert_eq!(listener.published(20.1, &[(19.0, 0.0)]), [1]);
        assert_eq!(listener.published(20.2, &[(19.0, f64::NAN)]), [0; 0]);
    }

    #[test]
    fn it_is_checked_when_the_map_has_changed_or_the_trajectory_is_extended() {
        let mut listener = Ear::new();
        let at = |seconds: f64| Stamp::default().plus_seconds(seconds);
        assert!(listener.publisher.is_due(at(0.0), None, false));
        listener.published(5.0, &[(5.0, 0.0)]);
        for (now_s, last_s, has_changed, is_due) in [
            (5.1, 5.0, false, false),
            (5.1, 5.0, true, true),
            (9.0, 5.0, false, false),
            (5.5, 5.5, false, false),
            (6.1, 5.5, false, true),
        ] {
            let got = listener.publisher.is_due(at(now_s), Some(at(last_s)), has_changed);
            assert_eq!(got, is_due, "{now_s} {last_s} {has_changed}");
        }
    }
}
