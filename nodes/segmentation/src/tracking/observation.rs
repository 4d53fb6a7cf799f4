//! What one cycle shows of an object.

use nalgebra::{Point3, Vector2, Vector3};

use super::footprint::Footprint;
use crate::cycle_points::{CyclePoints, MIN_SLOPE_DEPTH_M, slopes_of};
use crate::floor::Floor;
use crate::view::View;

/// What the camera sees in one cycle.
#[derive(Clone, Copy, Debug)]
pub struct CycleView<'a> {
    /// The points.
    pub points: &'a CyclePoints<'a>,
    /// How far it sees to the sides, and up.
    pub view: View,
    /// The floor, where it is known.
    pub floor: Option<Floor>,
    /// The edge of a voxel.
    pub cell_m: f64,
}

/// Something nearer by this hides what is behind it; less is the depth of the object itself.
const HIDING_M: f64 = 0.3;
/// The shoulders of a person who stands are higher: 1.2 m are those of the shortest twentieth of women (DIN 33402-2).
const LOW_M: f64 = 1.2;

/// The visible surface of an object.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Observation {
    /// Its points, by their indices.
    pub(super) points: Vec<usize>,
    /// The centre of the visible surface in the map, each pixel counting the same.
    pub(super) centre_m: Point3<f64>,
    /// Its edge lengths along the axes of the map, a voxel included.
    pub(super) extent_m: Vector3<f64>,
    /// From the centre to the least and to the largest coordinates along the axes of the map, a half of a voxel
    /// included. The centre is the mean of the pixels, not the middle of the box.
    pub(super) reach_m: Reach,
    /// The horizontal direction in the map from its right to its left, seen from the camera.
    pub(super) across: Vector3<f64>,
    /// Its ends along `across`.
    pub(super) left: End,
    pub(super) right: End,
    /// Its distance from the camera.
    pub(super) distance_m: f64,
    /// It from above.
    pub(super) footprint: Option<Footprint>,
    /// Whether all of it is lower than a person who stands.
    is_low: bool,
    /// Whether predictions cut it out of a larger group.
    pub(super) is_split: bool,
}

/// How far a surface reaches from its centre along the axes of the map.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Reach {
    /// To the least coordinates: none is positive.
    pub(super) down_m: Vector3<f64>,
    /// To the largest ones: none is negative.
    pub(super) up_m: Vector3<f64>,
}

/// One end of the visible surface.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct End {
    /// The coordinate along `across`.
    pub(super) along_m: f64,
    /// The sideways slope from the camera.
    slope: f64,
    /// It is not the object's own end: the view ends there, or something nearer hides the rest.
    pub(super) is_cut: bool,
}

impl Observation {
    /// What these points show; `None` where none lies before the camera.
    pub(super) fn of(cycle: &CycleView<'_>, points: Vec<usize>, is_split: bool) -> Option<Self> {
        let seen: Vec<Seen> = points.iter().filter_map(|&index| Seen::of(cycle, index)).collect();
        let centre_m = visible_centre_m(&seen)?;
        let towards = centre_m - cycle.points.camera_in_map;
        let across = Vector3::z().cross(&towards).try_normalize(f64::EPSILON)?;
        let (mut least, mut most) = (centre_m.coords, centre_m.coords);
        let mut right = End { along_m: f64::INFINITY, slope: f64::INFINITY, is_cut: false };
        let mut left = End { along_m: f64::NEG_INFINITY, slope: f64::NEG_INFINITY, is_cut: false };
        for Seen { slope, in_map_m: point, .. } in &seen {
            least = least.inf(&point.coords);
            most = most.sup(&point.coords);
            let along_m = across.dot(&point.coords);
            right.along_m = right.along_m.min(along_m);
            left.along_m = left.along_m.max(along_m);
            right.slope = right.slope.min(slope.x);
            left.slope = left.slope.max(slope.x);
        }
        // The outermost voxel of the view may hold no point of the object, so one is allowed for.
        let voxel_slope = cycle.cell_m / towards.norm().max(MIN_SLOPE_DEPTH_M);
        right.is_cut = right.slope <= cycle.view.right + voxel_slope;
        left.is_cut = left.slope >= cycle.view.left - voxel_slope;
        // What the upper border of the image cuts may be higher.
        let is_low = cycle.floor.is_some_and(|floor| {
            seen.iter().all(|Seen { slope, in_map_m, .. }| {
                floor.height_above_m(in_map_m) <= LOW_M && slope.y < cycle.view.top - voxel_slope
            })
        });
        let places_m: Vec<&Point3<f64>> = seen.iter().map(|one| &one.in_map_m).collect();
        let half_a_voxel_m = Vector3::repeat(0.5 * cycle.cell_m);
        Some(Self {
            points,
            centre_m,
            extent_m: most - least + Vector3::repeat(cycle.cell_m),
            reach_m: Reach {
                down_m: least - centre_m.coords - half_a_voxel_m,
                up_m: most - centre_m.coords + half_a_voxel_m,
            },
            across,
            left,
            right,
            distance_m: towards.norm(),
            footprint: Footprint::of(&places_m),
            is_low,
            is_split,
        })
    }

    /// Whether it has a shape that no person has who stands: low, or an upright plane.
    pub(super) fn is_no_person(&self) -> bool {
        self.is_low || self.footprint.is_some_and(|footprint| footprint.is_flat())
    }

    /// Marks the ends at which `other` hides this.
    pub(super) fn hide_behind(&mut self, other: &Self, cell_m: f64) {
        if other.distance_m > self.distance_m - HIDING_M {
            return;
        }
        let voxel_slope = cell_m / other.distance_m.max(MIN_SLOPE_DEPTH_M);
        let hidden = |end: &End| {
            (other.right.slope - voxel_slope..=other.left.slope + voxel_slope).contains(&end.slope)
        };
        self.left.is_cut |= hidden(&self.left);
        self.right.is_cut |= hidden(&self.right);
    }
}

/// One point of an object.
struct Seen {
    /// Its direction from the camera.
    slope: Vector2<f64>,
    in_map_m: Point3<f64>,
    /// The camera's points that it is the mean of.
    count: f64,
}

impl Seen {
    /// `None` beside or behind the camera.
    fn of(cycle: &CycleView<'_>, index: usize) -> Option<Self> {
        let points = cycle.points;
        Some(Self {
            slope: (*points.slopes.get(index)?)?,
            in_map_m: *points.in_map.get(index)?,
            count: f64::from(*points.cycle.voxel_points.get(index)?),
        })
    }
}

/// The centre of a surface as the camera sees it: each pixel counts once, however many voxels the surface is spread
/// over.
fn visible_centre_m(seen: &[Seen]) -> Option<Point3<f64>> {
    let count: f64 = seen.iter().map(|one| one.count).sum();
    let sum_m: Vector3<f64> = seen.iter().map(|one| one.in_map_m.coords * one.count).sum();
    (count > 0.0).then(|| Point3::from(sum_m / count))
}

/// Whether something hides a place of the map: points of the cycle, clearly nearer, in the same
/// direction to the width of a voxel.
pub(super) fn is_hidden(cycle: &CycleView<'_>, place_in_map: &Point3<f64>) -> bool {
    let points = cycle.points;
    let ray_m = points.ray_to_m(place_in_map);
    let Some(direction) = slopes_of(&ray_m) else { return false };
    let (nearer_m, width) = (ray_m.x - HIDING_M, cycle.cell_m / ray_m.x);
    points.slopes.iter().enumerate().any(|(point, slopes)| {
        slopes.is_some_and(|slopes| {
            (slopes - direction).amax() <= width
                && points.forward_m(point).is_some_and(|forward_m| forward_m < nearer_m)
        })
    })
}
