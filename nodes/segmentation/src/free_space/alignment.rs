//! The small turn about the camera that takes an image onto the surfaces that are known.
//!
//! Poses do not tell all: wheels slip, a threshold tilts the platform, the stamps of images are late while it turns. Then the whole image
//! lies beside what is known, and the rims of furniture and walls come to lie where space was seen to be free. One turn that takes
//! most points back onto surfaces is likelier than that all of these have moved; what does move is too little to turn an image by.
//!
//! Turns are compared by how many points they take onto surfaces, less those that they take into free space, and are searched for axis by
//! axis, from coarse to fine: the correlation of a scan with a grid (Olson, "Real-time correlative scan matching", ICRA 2009), about
//! three axes and without shifts.
//!
//! The turn decides what moves in this one cycle, and nothing else: evidence and map keep the poses that were told, so that the errors of
//! turns add up to nothing.

use geometry::VoxelKey;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use volume::{CellState, Occupancy};

/// So many points are looked up for each turn that is tried, at most twice as many.
const SAMPLES: usize = 400;
/// A point no farther from the voxel of a surface is on it: surfaces that lie between two voxels are seen in the one or the other by
/// the noise of depths and poses.
const BESIDE_EDGES: f64 = 0.375;
/// A turn must take this share of the points more onto surfaces: poses with 1 cm and 0.3 degrees of noise give 5 %.
const LEAST_GAIN: f64 = 0.08;
/// No turn is larger about any axis: images that are 80 ms late on a platform that turns at 1 rad/s.
const LARGEST_RAD: f64 = 0.08;
/// The steps of the search, one after the other: by the last, what is 4 m away moves by a quarter of a voxel of the thesis.
const STEPS_RAD: [f64; 3] = [0.02, 0.01, 0.005];

#[derive(Clone, Copy)]
struct Tried {
    /// About the axes of the map.
    turn_rad: Vector3<f64>,
    score: i32,
}

/// The turn about the camera that takes points of the map onto the surfaces known, where it takes many more than lie on them as they
/// are.
pub(super) fn turn_onto_known<'a>(
    occupancy: &Occupancy,
    camera_in_map: &Point3<f64>,
    points_in_map: impl ExactSizeIterator<Item = &'a Point3<f64>>,
) -> Option<UnitQuaternion<f64>> {
    let every = (points_in_map.len() / SAMPLES).max(1);
    let known = KnownSpace { occupancy, beside_m: BESIDE_EDGES * occupancy.grid().edge_m() };
    let of_known = points_in_map.step_by(every).filter(|point| known.says_something(point));
    let rays_m: Vec<Vector3<f64>> = of_known.map(|point| point - camera_in_map).collect();
    let most = rays_m.len() as i32;
    let tried = |turn_rad: Vector3<f64>, more_than: i32| {
        let turn = UnitQuaternion::from_scaled_axis(turn_rad).to_rotation_matrix();
        let mut score = most;
        for ray_m in &rays_m {
            score -= 1 - known.score_of(&(camera_in_map + turn * ray_m));
            if score <= more_than {
                break;
            }
        }
        Tried { turn_rad, score }
    };
    let is_worth_it = |gained: i32| f64::from(gained) > LEAST_GAIN * rays_m.len() as f64;
    let told = tried(Vector3::zeros(), i32::MIN);
    if !is_worth_it(most - told.score) {
        return None;
    }
    let found = best_from(told, tried);
    is_worth_it(found.score - told.score).then(|| UnitQuaternion::from_scaled_axis(found.turn_rad))
}

/// The best turn that the search comes to. `tried` scores a turn; it may end as soon as it is clear that the turn scores no more than so
/// much, with a score that is no more than that either.
fn best_from(told: Tried, tried: impl Fn(Vector3<f64>, i32) -> Tried) -> Tried {
    let mut best = told;
    for step_rad in STEPS_RAD {
        while let Some(better) = better_beside(best, step_rad, &tried) {
            best = better;
        }
        // A turn that is worth taking shows at the first step.
        if best.turn_rad == told.turn_rad {
            break;
        }
    }
    best
}

/// The best of the turns that are a step away along an axis, if it is better.
fn better_beside(
    from: Tried,
    step_rad: f64,
    tried: impl Fn(Vector3<f64>, i32) -> Tried,
) -> Option<Tried> {
    let steps = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| step_rad * axis);
    let beside = steps.iter().flat_map(|step| [from.turn_rad + step, from.turn_rad - step]);
    let allowed = beside.filter(|turn_rad| turn_rad.amax() <= LARGEST_RAD);
    let tried = allowed.map(|turn_rad| tried(turn_rad, from.score));
    tried.max_by_key(|tried| tried.score).filter(|best| best.score > from.score)
}

/// What is known of space.
struct KnownSpace<'a> {
    occupancy: &'a Occupancy,
    beside_m: f64,
}

impl KnownSpace<'_> {
    /// Whether a point is on a surface, near one or in free space. What comes into view for the first time is none of these: any turn
    /// that takes it back to what is known would seem to be right.
    fn says_something(&self, point: &Point3<f64>) -> bool {
        let voxel = self.occupancy.grid().key(point);
        self.occupancy.cell(voxel).state() != CellState::Unknown
            || self.occupancy.is_near_surface(voxel, 1)
    }

    /// 1 on a surface, -1 in free space apart from surfaces.
    fn score_of(&self, place: &Point3<f64>) -> i32 {
        let voxel = self.occupancy.grid().key(place);
        let state = self.occupancy.cell(voxel).state();
        if state == CellState::Occupied || self.is_beside_surface(place, voxel) {
            1
        } else if state == CellState::Free && !self.occupancy.is_near_surface(voxel, 1) {
            -1
        } else {
            0
        }
    }

    /// Whether a step along an axis leads out of the voxel and onto a surface.
    fn is_beside_surface(&self, place: &Point3<f64>, voxel: VoxelKey) -> bool {
        let (grid, step_m) = (self.occupancy.grid(), Vector3::repeat(self.beside_m));
        let (least, most) = (grid.key(&(place - step_m)), grid.key(&(place + step_m)));
        let beside = [least, most].into_iter().flat_map(|VoxelKey { x, y, z }| {
            [VoxelKey { x, ..voxel }, VoxelKey { y, ..voxel }, VoxelKey { z, ..voxel }]
        });
        let mut others = beside.filter(|beside| *beside != voxel);
        others.any(|beside| self.occupancy.cell(beside).state() == CellState::Occupied)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use volume::{DepthNoise, DepthRange, DepthView, OccupancyConfig};

    use super::*;

    const EDGE_M: f64 = 0.08;

    /// The same, step by step.
    fn plain_score(known: &KnownSpace<'_>, place: &Point3<f64>) -> i32 {
        let grid = known.occupancy.grid();
        let state = |place: &Point3<f64>| known.occupancy.cell(grid.key(place)).state();
        let steps = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| known.beside_m * axis);
        let mut beside = steps.iter().flat_map(|step| [place + step, place - step]);
        let is_on_surface = state(place) == CellState::Occupied
            || beside.any(|place| state(&place) == CellState::Occupied);
        let is_free =
            state(place) == CellState::Free && !known.occupancy.is_near_surface(grid.key(place), 1);
        i32::from(is_on_surface) - i32::from(!is_on_surface && is_free)
    }

    /// The same, with all points of each turn.
    fn plain_turn(
        occupancy: &Occupancy,
        camera_in_map: &Point3<f64>,
        points_in_map: &[Point3<f64>],
    ) -> Option<UnitQuaternion<f64>> {
        let beside_m = BESIDE_EDGES * occupancy.grid().edge_m();
        let known = KnownSpace { occupancy, beside_m };
        let of_known = points_in_map.iter().filter(|point| known.says_something(point));
        let rays_m: Vec<Vector3<f64>> = of_known.map(|point| point - camera_in_map).collect();
        let tried = |turn_rad: Vector3<f64>, _: i32| {
            let turn = UnitQuaternion::from_scaled_axis(turn_rad).to_rotation_matrix();
            let places = rays_m.iter().map(|ray_m| camera_in_map + turn * ray_m);
            Tried { turn_rad, score: places.map(|place| plain_score(&known, &place)).sum() }
        };
        let told = tried(Vector3::zeros(), 0);
        let found = best_from(told, tried);
        (f64::from(found.score - told.score) > LEAST_GAIN * rays_m.len() as f64)
            .then(|| UnitQuaternion::from_scaled_axis(found.turn_rad))
    }

    /// What was seen for some cycles: free space, and surfaces in it.
    fn known(free: &[VoxelKey], surfaces: &[VoxelKey]) -> Occupancy {
        let config = OccupancyConfig { edge_m: EDGE_M, ..OccupancyConfig::default() };
        let mut occupancy = Occupancy::new(config).unwrap();
        free.iter().for_each(|free| occupancy.take_for_free(*free));
        let nothing = DepthView::new(DepthRange::default(), DepthNoise::default()).unwrap();
        for cycle in 1..6 {
            occupancy.begin_cycle(geometry::Stamp::from_secs_nanos(cycle, 0));
            occupancy.integrate(&nothing, surfaces.iter().copied());
        }
        occupancy
    }

    proptest! {
        /// A wall with holes, turned and with noise.
        #[test]
        fn the_turn_is_that_of_all_points(
            holes in prop::collection::vec((-9..9_i32, -9..9_i32), 0..60),
            turn_rad in prop::array::uniform3(-0.05..0.05_f64),
            noise_m in prop::collection::vec(-0.06..0.06_f64, 324),
        ) {
            let all = (-9..9).flat_map(|y| (-9..9).map(move |z| (y, z)));
            let wall = all.filter(|cell| !holes.contains(cell));
            let wall: Vec<VoxelKey> = wall.map(|(y, z)| VoxelKey { x: 25, y, z }).collect();
            let before = wall.iter().flat_map(|wall| [23, 24].map(|x| VoxelKey { x, ..*wall }));
            let occupancy = known(&before.collect::<Vec<_>>(), &wall);
            let turn = UnitQuaternion::from_scaled_axis(Vector3::from(turn_rad));
            let seen = wall.iter().zip(noise_m).map(|(voxel, noise_m)| {
                turn * (occupancy.grid().middle_m(*voxel) + noise_m * Vector3::x())
            });
            let seen: Vec<Point3<f64>> = seen.collect();
            let camera = Point3::origin();
            prop_assert_eq!(
                turn_onto_known(&occupancy, &camera, seen.iter()),
                plain_turn(&occupancy, &camera, &seen)
            );
        }

        #[test]
        fn places_score_as_step_by_step(
            surfaces in prop::collection::vec(prop::array::uniform3(-3..3_i32), 0..20),
            free in prop::collection::vec(prop::array::uniform3(-3..3_i32), 0..80),
            places in prop::collection::vec(prop::array::uniform3(-0.32..0.32_f64), 40),
        ) {
            let voxels = |cells: Vec<[i32; 3]>| -> Vec<VoxelKey> {
                cells.into_iter().map(|[x, y, z]| VoxelKey { x, y, z }).collect()
            };
            let occupancy = known(&voxels(free), &voxels(surfaces));
            let known = KnownSpace { occupancy: &occupancy, beside_m: BESIDE_EDGES * EDGE_M };
            for place in places.into_iter().map(Point3::from) {
                prop_assert_eq!(known.score_of(&place), plain_score(&known, &place), "{}", place);
            }
        }
    }
}
