//! The distance that odometry has travelled: the longer the distance between keyframes, the less accurate its motion is.

use nalgebra::Isometry3;

use crate::map::{ByOdometry, Map};

/// The distance is counted in steps of this length ...
const STEP_M: f64 = 0.05;
/// ... or of this turn: a static camera trembles by less, and travels nowhere.
const STEP_RAD: f64 = 0.05;

/// The distance travelled by odometry, leg by leg.
#[derive(Clone, Debug, Default)]
pub(super) struct Travelled {
    leg: u64,
    last: Option<ByOdometry>,
}

impl Travelled {
    /// Continues an existing map: its legs are not this odometry's.
    pub(super) fn after(map: &Map) -> Self {
        let legs = map.keyframes().iter().filter_map(|(_, keyframe)| keyframe.by_odometry());
        Self { leg: legs.map(|by| by.leg.saturating_add(1)).max().unwrap_or_default(), last: None }
    }

    /// Odometry has the camera here in this frame, or nowhere.
    pub(super) fn step(&mut self, camera_from_odom: Option<&Isometry3<f64>>) -> Option<ByOdometry> {
        let Some(camera_from_odom) = camera_from_odom else {
            self.leg += u64::from(self.last.take().is_some());
            return None;
        };
        let leg = self.leg;
        let begin = ByOdometry {
            leg,
            camera_from_odom: *camera_from_odom,
            travelled_m: 0.0,
            turned_rad: 0.0,
        };
        let last = self.last.get_or_insert(begin);
        let step = camera_from_odom * last.camera_from_odom.inverse();
        let (step_m, step_rad) = (step.translation.vector.norm(), step.rotation.angle());
        let here = ByOdometry {
            leg,
            camera_from_odom: *camera_from_odom,
            travelled_m: last.travelled_m + step_m,
            turned_rad: last.turned_rad + step_rad,
        };
        if is_step(step_m, step_rad) {
            *last = here;
        }
        Some(here)
    }
}

/// Whether the camera is at another place than at an earlier frame: a step away, or on another leg, whose distance is not
/// known.
pub(super) fn is_elsewhere(before: &ByOdometry, now: &ByOdometry) -> bool {
    let step = now.camera_from_odom * before.camera_from_odom.inverse();
    before.leg != now.leg || is_step(step.translation.vector.norm(), step.rotation.angle())
}

fn is_step(step_m: f64, step_rad: f64) -> bool {
    step_m > STEP_M || step_rad > STEP_RAD
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::testing::{blank, blank_frame};
    use crate::map::{MapConfig, NewKeyframe};

    fn at(x_m: f64) -> Isometry3<f64> {
        Isometry3::translation(-x_m, 0.0, 0.0)
    }

    #[test]
    fn a_camera_that_trembles_goes_nowhere() {
        let mut travelled = Travelled::default();
        for frame in 0..1000 {
            let here = travelled.step(Some(&at(0.01 * f64::from(frame % 2)))).unwrap();
            assert!(here.travelled_m < 0.02, "{}", here.travelled_m);
        }
    }

    #[test]
    fn there_and_back_is_twice_the_distance() {
        let mut travelled = Travelled::default();
        let there = (0..=100).map(|step| 0.02 * f64::from(step));
        let mut travelled_m = 0.0;
        for x_m in there.clone().chain(there.rev()) {
            travelled_m = travelled.step(Some(&at(x_m))).unwrap().travelled_m;
        }
        // Less what was turned round on, of a step.
        assert!((3.9..=4.0 + 1e-9).contains(&travelled_m), "{travelled_m}");
    }

    #[test]
    fn a_map_that_was_there_keeps_its_legs_for_itself() {
        let mut map = Map::new(MapConfig::default());
        let frame = blank_frame(1, 0);
        let by_odometry = Travelled { leg: 4, last: None }.step(Some(&at(1.0)));
        map.insert_keyframe(NewKeyframe { by_odometry, ..blank(&frame) }).unwrap();
        assert_eq!(Travelled::after(&map).step(Some(&at(0.0))).unwrap().leg, 5);
    }

    #[test]
    fn a_new_leg_begins_where_odometry_was_lost() {
        let mut travelled = Travelled::default();
        let first = travelled.step(Some(&at(0.0))).unwrap();
        assert_eq!(travelled.step(None), None);
        assert_eq!(travelled.step(None), None);
        let second = travelled.step(Some(&at(3.0))).unwrap();
        assert_eq!((first.leg, second.leg, second.travelled_m), (0, 1, 0.0));
    }
}
