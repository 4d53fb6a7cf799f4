//! What each point of a cycle is, by what is known of its place.

use nalgebra::{Point3, UnitQuaternion};
use volume::{AS_NEAR, Place, is_missed_long_enough};

use super::FreeSpaceSegmenter;
use super::alignment::turn_onto_known;
use crate::cycle_points::CyclePoints;
use crate::floor::Floor;
use crate::growth::{Candidates, PointClass};
use crate::moving_in_place::{Parts, is_of_a_body};

/// A surface that comes into range continues what was seen of it before. A camera at 0.5 m/s and 7 Hz comes a voxel of the
/// thesis closer in a cycle, and a surface is known after two.
const BORDER_VOXELS: i32 = 3;

/// What is known of the place of a point.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Known {
    /// Nothing, or not enough.
    Unknown,
    /// It was seen free, cycle after cycle.
    Free,
    /// Something has been there for long.
    Background,
}

impl FreeSpaceSegmenter {
    /// Whether a point is so near to the camera that there is evidence of its place.
    pub(super) fn is_in_reach(&self, points: &CyclePoints<'_>, point: usize) -> bool {
        points.distances_m[point] <= self.config.evidence_reach_m
    }

    /// The floor that this cycle shows, or else the one known, unless things lie below that.
    pub(super) fn floor_under(&self, points: &CyclePoints<'_>) -> Option<Floor> {
        let near = (0..points.count()).filter(|&point| self.is_in_reach(points, point));
        let near: Vec<Point3<f64>> = near.map(|point| points.in_map[point]).collect();
        Floor::of(&near).or(self.floor.filter(|known| known.is_under(&near)))
    }

    /// What is known of the place of each point.
    ///
    /// Stale background is cleared where no return lies behind it: someone was there before a doorway or a hall, and left. What is
    /// there now is another object.
    pub(super) fn known_places(&mut self, points: &CyclePoints<'_>) -> Vec<Known> {
        let mut has_cleared = false;
        let mut known = Vec::with_capacity(points.count());
        for (point, &voxel) in points.in_map.iter().zip(&points.voxels) {
            let place = self.occupancy.place(voxel);
            let is_gone = matches!(place, Place::Occupied { since, last }
                if self.is_long_ago(since)
                    && self.last.is_some_and(|now| {
                        is_missed_long_enough(now.seconds_since(last), last.seconds_since(since))
                    })
                    && self.recent_views.has_gone(point, last, &points.camera_in_map));
            if is_gone {
                self.occupancy.forget(voxel);
                has_cleared = true;
            }
            known.push(self.known(place));
        }
        if has_cleared {
            // Other points may be in the same voxels.
            known.clear();
            known
                .extend(points.voxels.iter().map(|&voxel| self.known(self.occupancy.place(voxel))));
        }
        known
    }

    pub(super) fn known(&self, place: Place) -> Known {
        match place {
            Place::Free => Known::Free,
            Place::Occupied { since, .. } if self.is_long_ago(since) => Known::Background,
            Place::Occupied { .. } | Place::Unknown => Known::Unknown,
        }
    }

    fn is_long_ago(&self, since: geometry::Stamp) -> bool {
        self.last.is_some_and(|now| now.seconds_since(since) >= self.config.min_background_s)
    }

    /// What each point is, by what is known of its place.
    pub(super) fn classes(&self, points: &CyclePoints<'_>, known: &[Known]) -> Vec<PointClass> {
        let class = |(point, &known): (usize, &Known)| self.class_of_one(points, point, known);
        let mut classes: Vec<PointClass> = known.iter().enumerate().map(class).collect();
        self.leave_what_is_no_body(points, &mut classes);
        classes
    }

    /// What a point is by its own place, whatever is around it.
    fn class_of_one(&self, points: &CyclePoints<'_>, point: usize, known: Known) -> PointClass {
        if !self.is_in_reach(points, point) {
            return PointClass::Background;
        }
        if self.is_of_floor(&points.in_map[point]) {
            // Where the floor itself is too dark to be seen, all of that voxel is the foot's: no floor was hit
            // there or beside, whether or not rays to what is behind have passed over it.
            let is_foot = known != Known::Background && self.was_seen_empty(points, point);
            return if is_foot { PointClass::SeenEmpty } else { PointClass::Background };
        }
        match known {
            Known::Background => PointClass::Background,
            Known::Unknown if self.was_seen_empty(points, point) => PointClass::SeenEmpty,
            Known::Unknown => PointClass::Unknown,
            Known::Free if self.occupancy.is_near_surface(points.voxels[point], 1) => {
                PointClass::InFreeSpaceBesideSurface
            }
            Known::Free => PointClass::InFreeSpace,
        }
    }

    /// Takes what is newly occupied for what it is when the image is turned onto the surfaces known, where there is such a turn
    /// ([`super::alignment`]): where the pose is wrong, the rims of what stands are beside it.
    pub(super) fn leave_what_a_turn_explains(
        &self,
        points: &CyclePoints<'_>,
        classes: &mut [PointClass],
    ) {
        if !classes.iter().any(|class| class.is_newly_occupied()) {
            return;
        }
        let in_reach = (0..points.count()).filter(|&point| self.is_in_reach(points, point));
        let in_reach: Vec<&Point3<f64>> = in_reach.map(|point| &points.in_map[point]).collect();
        let turn = turn_onto_known(&self.occupancy, &points.camera_in_map, in_reach.into_iter());
        let Some(turn) = turn else { return };
        for (point, class) in self.newly_occupied_if_turned(points, classes, &turn) {
            if !class.is_newly_occupied() {
                classes[point] = class;
            }
        }
    }

    /// The points that are newly occupied, each with what it is when the image is turned.
    pub(super) fn newly_occupied_if_turned(
        &self,
        points: &CyclePoints<'_>,
        classes: &[PointClass],
        turn: &UnitQuaternion<f64>,
    ) -> Vec<(usize, PointClass)> {
        let turned = CyclePoints::turned(points.cycle, &self.grid, turn);
        let known = |point: usize| self.known(self.occupancy.place(turned.voxels[point]));
        let asked = (0..classes.len()).filter(|&point| classes[point].is_newly_occupied());
        let mut explained: Vec<(usize, PointClass)> =
            asked.map(|point| (point, self.class_of_one(&turned, point, known(point)))).collect();
        if explained.iter().any(|&(point, class)| self.shows_no_return(&turned, point, class)) {
            // These may be of a surface: the points around them decide.
            let known: Vec<Known> = (0..turned.count()).map(known).collect();
            let all = self.classes(&turned, &known);
            explained.iter_mut().for_each(|(point, class)| *class = all[*point]);
        }
        explained
    }

    /// Whether a point came into view where nothing had returned, without being seen before.
    fn shows_no_return(&self, points: &CyclePoints<'_>, point: usize, class: PointClass) -> bool {
        class == PointClass::SeenEmpty
            && !self.recent_views.was_empty(&points.in_map[point], 0.0).from_near
    }

    /// Takes what came into view without being seen before, where nothing had returned, for what it may be: a surface, unless it is no
    /// larger than a body. A person right before the lens, nearer than the camera can measure, leaves no return in half of the image,
    /// and what is behind appears when she has passed.
    fn leave_what_is_no_body(&self, points: &CyclePoints<'_>, classes: &mut [PointClass]) {
        let no_return = |&point: &usize| self.shows_no_return(points, point, classes[point]);
        let seeds: Vec<usize> = (0..points.count()).filter(no_return).collect();
        if seeds.is_empty() {
            return;
        }
        // The images of a far surface leave more than a voxel empty here and there: linked as in free space, it is in one piece.
        let linked = |class: &PointClass| match class {
            PointClass::SeenEmpty | PointClass::Unknown => PointClass::InFreeSpace,
            _ => PointClass::Background,
        };
        let linked: Vec<PointClass> = classes.iter().map(linked).collect();
        for group in Candidates::new(&linked, &points.voxels).grown_from(&seeds, |_| true) {
            if is_of_a_body(&self.config, &points.in_map, &group) {
                continue;
            }
            for point in group.into_iter().filter(|point| seeds.binary_search(point).is_ok()) {
                let is_of_floor = self.is_of_floor(&points.in_map[point]);
                classes[point] =
                    if is_of_floor { PointClass::Background } else { PointClass::Unknown };
            }
        }
    }

    /// Whether the voxel of a point holds more of the floor than of a foot.
    fn is_of_floor(&self, point: &Point3<f64>) -> bool {
        let sole_m = self.grid.edge_m() / 2.0;
        self.floor.is_some_and(|floor| floor.height_above_m(point).abs() <= sole_m)
    }

    /// Whether the camera would have seen in earlier cycles what is there now.
    fn was_seen_empty(&self, points: &CyclePoints<'_>, point: usize) -> bool {
        let voxel = points.voxels[point];
        if !self.occupancy.is_untouched(voxel) {
            return false;
        }
        let near_m = AS_NEAR * points.distances_m[point];
        let was_empty = self.recent_views.was_empty(&points.in_map[point], near_m);
        was_empty.from_near
            || (was_empty.from_anywhere && !self.occupancy.is_near_surface(voxel, BORDER_VOXELS))
    }

    /// The points of bodies that move in their place.
    pub(super) fn find_moving_in_place(&self, points: &CyclePoints<'_>) -> Vec<usize> {
        let edge_m = self.grid.edge_m();
        // What is a voxel above the floor may be noise of it, and would join all that stands there.
        let is_floor = |point: usize| {
            self.floor.is_some_and(|floor| floor.height_above_m(&points.in_map[point]) <= edge_m)
        };
        let may_be_body: Vec<bool> = (0..points.count())
            .map(|point| self.is_in_reach(points, point) && !is_floor(point))
            .collect();
        let comes_and_goes: Vec<bool> = (0..points.count())
            .map(|point| {
                may_be_body[point] && self.occupancy.cell(points.voxels[point]).comes_and_goes()
            })
            .collect();
        let view = self.view;
        let is_at_border =
            |point: usize| view.is_at_border(points, point, edge_m / points.distances_m[point]);
        let parts = Parts {
            in_map: &points.in_map,
            voxels: &points.voxels,
            may_be_body: &may_be_body,
            comes_and_goes: &comes_and_goes,
            is_at_border: &is_at_border,
        };
        parts.bodies(&self.config)
    }
}
