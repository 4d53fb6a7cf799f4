//! What an object left in the cycles before it was found.
//!
//! Who is in view from the first image on is in no observed free space, and is found when he has gone some steps: until then he is part
//! of the static scene. Where the camera still sees his places, what is seen behind them clears them. A camera that comes nearer
//! loses them from its image before that. So a new object is followed backwards: what was at its place a cycle ago and is not known to
//! be background is the object, and so on to the first cycle. What is still there in a later cycle, when the object is elsewhere, is none
//! of it: walls and furniture that it passed. What it left in places that are out of view, through which the camera sees, or from which
//! nothing returns, is retracted as soon as that is so: the map forgets it. In a hall whose end is out of reach nothing is ever seen behind.

#[cfg(test)]
mod tests;

use std::collections::{HashSet, VecDeque};

use geometry::{BuildVoxelHasher, VoxelKey};
use nalgebra::{Point2, Point3};
use volume::{Sight, TiledView};

use crate::growth::{Candidates, PointClass};

/// Cycles that are remembered: some two seconds of the RPLIDAR A1. What has stood longer is background.
const CYCLES: usize = 16;
/// An object has moved by so many voxels in a cycle at most that its places still overlap: a body is some four wide, and one who runs
/// before a scanner of 7 Hz moves by five.
const STEPS_A_CYCLE: i32 = 2;

/// Looked up by key alone.
pub type Voxels = HashSet<VoxelKey, BuildVoxelHasher>;

/// A point that was static when it was seen, of a place that was not known to be background.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct StaticPoint {
    /// Its voxel.
    pub voxel: VoxelKey,
    /// Where it is.
    pub in_map_m: Point3<f32>,
}

/// The static points of a cycle.
#[derive(Clone, Debug, Default)]
pub struct StaticPoints {
    /// Those of places that are not known to be background.
    pub of_unknown: Vec<StaticPoint>,
    /// The voxels of all that are not of the floor, on which objects stand.
    pub above_floor: Vec<VoxelKey>,
}

/// The static points of the last cycles.
#[derive(Clone, Debug, Default)]
pub struct EarlierCycles {
    cycles: VecDeque<StaticPoints>,
    /// What objects were taken from them, as long as something returns from there.
    of_found: Vec<PointOfFound>,
}

/// A point of an earlier cycle that is an object's by now.
#[derive(Clone, Copy, PartialEq, Debug)]
struct PointOfFound {
    in_map_m: Point3<f64>,
    /// For so many cycles.
    cycles: usize,
}

impl EarlierCycles {
    /// Forgets them.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Remembers a cycle.
    pub fn remember(&mut self, of_static: StaticPoints) {
        if self.cycles.len() == CYCLES {
            self.cycles.pop_front();
        }
        self.cycles.push_back(of_static);
    }

    /// What objects left in cycles before they were found, and is not there any more by the image of this cycle, whose static points are
    /// `now`. Each object is given by its voxels in this cycle; one beside the voxels that objects had in the last cycle is known already.
    /// What is returned is forgotten here.
    pub fn of_objects(
        &mut self,
        objects: impl Iterator<Item: Iterator<Item = VoxelKey>>,
        last_object_voxels: &Voxels,
        (view, now): (&TiledView, &StaticPoints),
        voxel_edge_m: f64,
    ) -> Vec<Point3<f64>> {
        let is_known = |voxels: &[VoxelKey]| {
            let mut around = voxels.iter().flat_map(|voxel| voxel.within(STEPS_A_CYCLE));
            around.any(|voxel| last_object_voxels.contains(&voxel))
        };
        let mut new: Vec<Object> = objects
            .map(Iterator::collect::<Vec<VoxelKey>>)
            .filter(|voxels| !is_known(voxels))
            .map(|voxels| Object::of(&voxels, voxel_edge_m))
            .collect();
        // Of this cycle all that it is not is known.
        new.iter_mut().for_each(|object| object.stays.extend(&now.above_floor));
        for cycle in self.cycles.iter_mut().rev() {
            if new.iter().all(Object::has_ended) {
                break;
            }
            // Made once for all objects: noise in voxels far below the thesis' edge looks like hundreds.
            let of_unknown = &cycle.of_unknown;
            let voxels: Vec<VoxelKey> = of_unknown.iter().map(|point| point.voxel).collect();
            let classes = vec![PointClass::Unknown; of_unknown.len()];
            let candidates = Candidates::new(&classes, &voxels);
            let mut is_taken = vec![false; of_unknown.len()];
            for object in new.iter_mut().filter(|object| !object.has_ended()) {
                object.step_back(of_unknown, &candidates, &mut is_taken, voxel_edge_m);
                object.note_what_stays(cycle);
            }
            let mut index = 0..;
            cycle.of_unknown.retain(|_| index.next().is_some_and(|index: usize| !is_taken[index]));
        }
        self.of_found.extend(new.into_iter().flat_map(|object| object.found));
        let is_gone = |point: &mut PointOfFound| match view.sight(&point.in_map_m, voxel_edge_m) {
            Sight::OutOfView | Sight::ReturnsBehind | Sight::NoReturn => true,
            Sight::Returns => false,
        };
        let gone = self.of_found.extract_if(.., is_gone).map(|point| point.in_map_m).collect();
        self.of_found.iter_mut().for_each(|point| point.cycles += 1);
        self.of_found.retain(|point| point.cycles < CYCLES);
        gone
    }
}

/// An object on its way back.
struct Object {
    /// The voxels that it may have had a cycle before; none once it had no points in a cycle.
    around: Voxels,
    middle_m: Point2<f64>,
    /// From its middle to what belongs to it, at most: as when it was found.
    reach_m: f64,
    /// Voxels in which something was in a later cycle, when it was elsewhere.
    stays: Voxels,
    /// Its points in the cycles so far.
    found: Vec<PointOfFound>,
}

impl Object {
    fn of(voxels: &[VoxelKey], voxel_edge_m: f64) -> Self {
        let place_m = |voxel: &VoxelKey| {
            Point2::new(voxel.x, voxel.y).map(|cell| (f64::from(cell) + 0.5) * voxel_edge_m)
        };
        let middle_m = middle_of(voxels.iter().map(place_m));
        let farthest_m =
            voxels.iter().map(|voxel| (place_m(voxel) - middle_m).norm()).fold(0.0, f64::max);
        Self {
            around: widened(voxels.iter()),
            middle_m,
            reach_m: farthest_m + voxel_edge_m,
            stays: Voxels::default(),
            found: Vec::new(),
        }
    }

    /// Whether there is nothing of it before.
    fn has_ended(&self) -> bool {
        self.around.is_empty()
    }

    /// Notes what a cycle shows where it is not, nor may have been a cycle before.
    fn note_what_stays(&mut self, cycle: &StaticPoints) {
        let elsewhere = cycle.above_floor.iter().filter(|voxel| !self.around.contains(voxel));
        self.stays.extend(elsewhere);
    }

    /// Goes back by a cycle. Takes its points there: those at its place, and what is connected to them and no farther from their middle
    /// than it is wide. `candidates` are all points of the cycle; those that are taken already are another object's.
    fn step_back(
        &mut self,
        cycle: &[StaticPoint],
        candidates: &Candidates<'_>,
        is_taken: &mut [bool],
        voxel_edge_m: f64,
    ) {
        let place_m = |index: usize| cycle[index].in_map_m.xy().cast::<f64>();
        let step_m = f64::from(STEPS_A_CYCLE) * voxel_edge_m;
        let stays = |index: usize| self.stays.contains(&cycle[index].voxel);
        let may_be_taken: Vec<bool> =
            (0..cycle.len()).map(|index| !is_taken[index] && !stays(index)).collect();
        let is_at_place = |index: &usize| {
            may_be_taken[*index]
                && (place_m(*index) - self.middle_m).norm() <= self.reach_m + step_m
        };
        let around = self.around.iter().flat_map(|voxel| candidates.within(*voxel, 0));
        let around = around.map(|(_, index)| index);
        let mut seeds: Vec<usize> = around.filter(is_at_place).collect();
        seeds.sort_unstable();
        self.middle_m = middle_of(seeds.iter().map(|&seed| place_m(seed)));
        let is_of_it = |index: usize| {
            may_be_taken[index] && (place_m(index) - self.middle_m).norm() <= self.reach_m
        };
        seeds.retain(|&seed| is_of_it(seed));
        let groups = candidates.grown_from(&seeds, is_of_it);
        let mut points: Vec<usize> = groups.into_iter().flatten().collect();
        points.sort_unstable();
        self.around = widened(points.iter().map(|&point| &cycle[point].voxel));
        for point in points.into_iter().rev() {
            is_taken[point] = true;
            let in_map_m = cycle[point].in_map_m.cast();
            self.found.push(PointOfFound { in_map_m, cycles: 0 });
        }
    }
}

/// The mean; of no points the origin.
fn middle_of(points_m: impl Iterator<Item = Point2<f64>>) -> Point2<f64> {
    let sum = |(sum, count): (Point2<f64>, f64), point_m: Point2<f64>| {
        (sum + point_m.coords, count + 1.0)
    };
    let (sum, count) = points_m.fold((Point2::origin(), 0.0), sum);
    sum / count.max(1.0)
}

/// The voxels that something may have had a cycle before.
fn widened<'a>(voxels: impl Iterator<Item = &'a VoxelKey>) -> Voxels {
    voxels.flat_map(|voxel| voxel.within(STEPS_A_CYCLE)).collect()
}
