//! The way of the rig, as the map has it by now: whoever keeps something by the poses takes it along when the map is
//! corrected.

use geometry::{MapPath, PathVertex, Stamp};
use msgs::convert;
use msgs::nav_msgs::Path;
use nalgebra::Isometry3;
use node_shell::{Node, Publisher, Qos, ShellError};

/// A path that only goes on is told no more often: it grows with the way.
const PERIOD_S: f64 = 1.0;
/// What has moved the map by more is told at once: an eighth of the thesis' voxel ...
const MOVED_M: f64 = 0.01;
/// ... of what is so far from the rig at most.
const REACH_M: f64 = 5.0;

/// Tells the way.
pub(super) struct MapPathTeller {
    paths: Publisher<Path>,
    frame_id: String,
    told: Option<MapPath>,
}

impl MapPathTeller {
    pub(super) fn new(node: &Node, frame_id: &str) -> Result<Self, ShellError> {
        // Whoever comes later still needs it.
        let paths = node.publisher("map_path", &Qos::latched())?;
        Ok(Self { paths, frame_id: frame_id.to_owned(), told: None })
    }

    /// Whether the way is to be looked at: the map has changed, or the way has gone on and was not told for a while.
    pub(super) fn is_due(
        &self,
        now: Stamp,
        last_waypoint: Option<Stamp>,
        has_changed: bool,
    ) -> bool {
        let Some(told) = &self.told else { return true };
        let goes_on = told.vertices().last().map(|last| last.stamp) != last_waypoint;
        has_changed || goes_on && !(0.0..PERIOD_S).contains(&now.seconds_since(told.since()))
    }

    /// Tells the way where there is news: `map_from_rig` by rising stamp, as poses from `now` on have the map.
    pub(super) fn tell(&mut self, now: Stamp, way: impl Iterator<Item = (Stamp, Isometry3<f64>)>) {
        let vertices = way.map(|(stamp, map_from_rig)| PathVertex { stamp, map_from_rig });
        // A map that has a pose at infinity tells nothing.
        let Ok(path) = MapPath::new(now, &self.frame_id, vertices.collect()) else { return };
        if path.vertices().is_empty() || !self.is_news(now, &path) {
            return;
        }
        self.paths.publish_or_warn(convert::message_from_map_path(&path));
        self.told = Some(path);
    }

    fn is_news(&self, now: Stamp, path: &MapPath) -> bool {
        let Some(told) = &self.told else { return true };
        let last = |path: &MapPath| path.vertices().last().map(|last| last.stamp);
        let is_due = !(0.0..PERIOD_S).contains(&now.seconds_since(told.since()));
        let has_moved = || {
            let moved = path.correction_since(told);
            moved.is_none_or(|moved| moved.largest_shift_m(REACH_M) > MOVED_M)
        };
        (is_due && last(path) != last(told)) || has_moved()
    }

    /// The way begins anew.
    pub(super) fn reset(&mut self) {
        self.told = None;
    }
}

#[cfg(test)]
mod tests {
    use node_shell::{Host, RosArguments, Subscription};

    use super::*;

    struct Ear {
        teller: MapPathTeller,
        paths: Subscription<Path>,
        _host: Host,
    }

    impl Ear {
        fn new() -> Self {
            let host = Host::in_process();
            let arguments = RosArguments::parse([] as [String; 0]).unwrap();
            let node = |name: &str| host.node(name, &arguments).unwrap();
            let teller = MapPathTeller::new(&node("pose"), "map").unwrap();
            let paths = node("peer").subscription("map_path", &Qos::reliable(9)).unwrap();
            Self { teller, paths, _host: host }
        }

        /// What is told of a way by seconds and places; the vertices of the paths.
        fn told(&mut self, now_s: f64, way: &[(f64, f64)]) -> Vec<usize> {
            let at = |seconds: f64| Stamp::default().plus_seconds(seconds);
            let pose = |(seconds, x_m): &(f64, f64)| {
                (at(*seconds), Isometry3::translation(*x_m, 0.0, 0.0))
            };
            self.teller.tell(at(now_s), way.iter().map(pose));
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
    fn a_way_is_told_at_once_when_it_has_moved_and_now_and_then_when_it_goes_on() {
        let mut ear = Ear::new();
        assert_eq!(ear.told(5.0, &[]), [0; 0], "nothing to tell yet");
        let mut way = vec![(5.0, 0.0)];
        assert_eq!(ear.told(5.1, &way), [1]);
        assert_eq!(ear.told(9.0, &way), [0; 0], "nothing has changed");
        way.push((9.0, 0.5));
        assert_eq!(ear.told(9.1, &way), [2]);
        way.push((9.4, 1.0));
        assert_eq!(ear.told(9.5, &way), [0; 0], "told a moment ago");
        way[1].1 += 0.005;
        assert_eq!(ear.told(9.6, &way), [0; 0], "by a trifle");
        way[1].1 += 0.01;
        assert_eq!(ear.told(9.7, &way), [3], "by a trifle and a little");
        assert_eq!(ear.told(20.0, &[(19.0, 0.0)]), [1], "begun anew");
        ear.teller.reset();
        assert_eq!(ear.told(20.1, &[(19.0, 0.0)]), [1]);
        assert_eq!(ear.told(20.2, &[(19.0, f64::NAN)]), [0; 0]);
    }

    #[test]
    fn it_is_looked_at_when_the_map_has_changed_or_the_way_goes_on() {
        let mut ear = Ear::new();
        let at = |seconds: f64| Stamp::default().plus_seconds(seconds);
        assert!(ear.teller.is_due(at(0.0), None, false));
        ear.told(5.0, &[(5.0, 0.0)]);
        for (now_s, last_s, has_changed, is_due) in [
            (5.1, 5.0, false, false),
            (5.1, 5.0, true, true),
            (9.0, 5.0, false, false),
            (5.5, 5.5, false, false),
            (6.1, 5.5, false, true),
        ] {
            let got = ear.teller.is_due(at(now_s), Some(at(last_s)), has_changed);
            assert_eq!(got, is_due, "{now_s} {last_s} {has_changed}");
        }
    }
}
