//! A map under random steps.

use nalgebra::{Isometry3, Vector3};

use super::{PLACE_M, blank, blank_frame, blank_map};
use crate::map::{Arena, ByOdometry, Id, Map, NewKeyframe};
use crate::solve::testing::Random;

/// A map under random steps, each of which may be refused.
pub(crate) struct Fuzz {
    pub(crate) map: Map,
    random: Random,
    refused: usize,
    /// How often each kind of step was done.
    pub(crate) done: [usize; 8],
}

impl Fuzz {
    /// Begins with this many keyframes that see nothing.
    pub(crate) fn new(keyframes: usize, seed: u64) -> Self {
        let (map, _) = blank_map(keyframes);
        Self { map, random: Random::new(seed), refused: 0, done: [0; 8] }
    }

    fn pick<T>(&mut self, arena: &Arena<T>) -> Option<Id<T>> {
        let at = self.random.between(0.0, arena.len() as f64) as usize;
        arena.ids().nth(at)
    }

    /// One more step.
    pub(crate) fn step(&mut self) {
        let kind = self.random.between(0.0, 20.0) as usize;
        let map = self.map.clone();
        let (Some(one), Some(two)) = (self.pick(&map.keyframes), self.pick(&map.keyframes)) else {
            return self.insert();
        };
        let (point, other) = (self.pick(&map.points), self.pick(&map.points));
        let (line, other_line) = (self.pick(&map.lines), self.pick(&map.lines));
        let feature = self.random.between(0.0, 11.0) as usize;
        let (step, result) = match kind {
            0 | 1 => {
                self.insert();
                return;
            }
            2..=5 => (0, self.map.insert_point(one, feature, &PLACE_M).map(|_| ())),
            6 => {
                let ends = [PLACE_M, PLACE_M + Vector3::x()];
                (1, self.map.insert_line(one, feature, &ends).map(|_| ()))
            }
            7..=10 => {
                let Some(point) = point else { return };
                (2, self.map.observe(one, feature, point))
            }
            11 | 12 => {
                let Some(line) = line else { return };
                (3, self.map.observe(one, feature, line))
            }
            13 => {
                let Some((point, other)) = point.zip(other) else { return };
                (4, self.map.fuse(point, other).map(|_| ()))
            }
            14 => {
                let Some((line, other)) = line.zip(other_line) else { return };
                (4, self.map.fuse(line, other).map(|_| ()))
            }
            15 => {
                let Some(point) = point else { return };
                (5, self.map.unobserve(one, point).map(|_| ()))
            }
            16 if feature < 2 => {
                let Some(point) = point else { return };
                (5, self.map.cull_landmark(point))
            }
            17 => (6, self.map.close_loop(one, two, &Isometry3::identity())),
            16 | 18 => (7, self.map.cull_keyframe(one).map(|_| ())),
            _ => return,
        };
        match result {
            Ok(()) => self.done[step] += 1,
            Err(_) => self.refused += 1,
        }
    }

    fn insert(&mut self) {
        let frame = blank_frame(10, 5);
        let points = [self.pick(&self.map.points.clone()), self.pick(&self.map.points.clone())];
        let points: Vec<_> = points.into_iter().flatten().enumerate().collect();
        let travelled_m = self.random.between(-1.0, 1.0);
        let by_odometry = (travelled_m > 0.0).then(|| ByOdometry {
            leg: 3,
            camera_from_odom: Isometry3::translation(travelled_m, 0.0, 0.0),
            travelled_m,
            turned_rad: 0.5,
        });
        let new = NewKeyframe { points: &points, by_odometry, ..blank(&frame) };
        self.map.insert_keyframe(new).unwrap();
    }
}
