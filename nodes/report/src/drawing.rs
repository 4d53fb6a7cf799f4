//! Drawings of the map in space, without a browser: pictures from obliquely above, a picture that moves while the map forms, and a
//! small one of characters for a terminal.
//!
//! Surfaces are seen from the side from which the rig saw them, so that neither the ceiling nor the near walls hide a room. Points
//! have the colours of the map; of a map without colours they have those of their heights.

mod animation;
mod eye;
mod raster;
#[cfg(test)]
mod tests;
mod thumbnail;

use geometry::is_finite;
use nalgebra::{Isometry3, Point3, Vector3};

use self::eye::{Eye, Projection};
use self::raster::Raster;
pub use self::thumbnail::{TerminalColours, thumbnail};
use crate::payload::drawn_colour;
use crate::pictures::canvas::{Canvas, Colour, height_colour};
use crate::pictures::{PATH, REMOVED};
use crate::scene::moments::{self, Moments};
use crate::scene::{bounds_m, range_without_outliers};
use crate::{PictureError, RunRecord};

/// The longer side of the picture of a map is at most this ...
const PICTURE_PX: (usize, usize) = (1200, 900);
/// ... and of each of two beside each other: together they are as wide as a page.
const HALF_PICTURE_PX: (usize, usize) = (596, 520);
/// Between two pictures beside each other, and its colour.
const GAP_PX: usize = 8;
const GAP: Colour = [0x2a, 0x34, 0x40];
/// A point is drawn so much larger than the distance to the next: surfaces seen aslant have no holes.
const SIZE_IN_SPACINGS: f64 = 1.5;
/// Removed points are drawn so large, in edges of their voxels: a body is one shape.
const REMOVED_SIZE_IN_EDGES: f64 = 0.9;
/// A surface is left out where the cosine between its normal, on the side of the rig, and the direction to the eye is less: one that
/// is seen edgewise stays, since its normal is not that exact.
const LEAST_COSINE: f64 = -0.2;
/// The light comes from the eye's left shoulder. A surface that faces away from it has this share of its colour.
const SHADE: f64 = 0.62;

/// The colours of a dark map are made lighter until this share of its points is ...
const LIGHT_SHARE: f64 = 0.9;
/// ... as light as this in their lightest channel, by this factor at most.
const LIGHT: f64 = 225.0;
const MOST_GAIN: f64 = 2.0;

/// What a map's drawings show.
#[derive(Clone, PartialEq, Debug)]
pub struct MapDrawing {
    /// In the order in which they were seen first.
    points: Vec<DrawnPoint>,
    /// The points that were classified as moving, in the order of the cycles.
    removed: Vec<DrawnPoint>,
    path: Vec<PathPoint>,
    /// The direction in which the rig looks most, level, or of a map in which it looks around a diagonal.
    heading: Vector3<f64>,
    spacing_m: f64,
    removed_edge_m: f64,
}

/// A point with its colour.
#[derive(Clone, Copy, PartialEq, Debug)]
struct DrawnPoint {
    point_m: Point3<f32>,
    colour: Colour,
    /// The cycle from which on it is shown.
    moment: u16,
    /// Of length 1 on the side of the rig; none where it is not known.
    normal: Option<Vector3<f64>>,
}

/// Where the rig was in a cycle.
#[derive(Clone, Copy, PartialEq, Debug)]
struct PathPoint {
    /// The place on the floor below it.
    on_floor_m: Point3<f64>,
    /// Seconds since the first cycle.
    time_s: f64,
}

/// What of the removed points a picture shows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Removed {
    None,
    All,
}

impl MapDrawing {
    /// Of a run. `normals` are those of the points of its map, on either side: of a point without one, or with one of length 0, it is
    /// not known from which side it is to be seen, and it is always drawn.
    ///
    /// # Errors
    /// When the run's voxel edge is not a positive number.
    pub fn of(run: &RunRecord, normals: &[Vector3<f32>]) -> Result<Self, PictureError> {
        let moments = Moments::of(run)?;
        let (_, heights_m) = bounds_m(run);
        let has_colours = run.map_colours.len() == run.static_map.len();
        let gain = gain(&run.map_colours);
        let eyes = rig_eyes(run);
        let colour = |index: usize, point_m: &Point3<f32>| match run.map_colours.get(index) {
            Some(colour) if has_colours => {
                drawn_colour(*colour).map(|channel| (f64::from(channel) * gain).round() as u8)
            }
            _ => height_colour(relative(point_m.z.into(), heights_m)),
        };
        let drawn = |(index, point_m): (usize, &Point3<f32>)| {
            let seen_in = moments.known_first_seen(point_m);
            let seen_from = seen_in.and_then(|moment| eyes.get(usize::from(moment)));
            let normal = normals.get(index).and_then(|normal| {
                let normal = normal.cast::<f64>().try_normalize(f64::EPSILON)?;
                let to_rig = seen_from? - point_m.cast::<f64>();
                Some(if normal.dot(&to_rig) < 0.0 { -normal } else { normal })
            });
            let moment = moments.first_seen(point_m);
            DrawnPoint { point_m: *point_m, colour: colour(index, point_m), moment, normal }
        };
        let finite = run.static_map.iter().enumerate().filter(|(_, point_m)| is_finite(point_m));
        let mut points: Vec<DrawnPoint> = finite.map(drawn).collect();
        points.sort_by_key(|point| point.moment);
        let start = run.cycles.first().map(|cycle| cycle.scan_stamp).unwrap_or_default();
        let down_m = height_above_floor(run, heights_m) * Vector3::z();
        let path = run.cycles.iter().map(|cycle| PathPoint {
            on_floor_m: (cycle.map_from_rig.translation.vector - down_m).into(),
            time_s: cycle.scan_stamp.seconds_since(start),
        });
        Ok(Self {
            points,
            removed: removed_points(run),
            path: path.collect(),
            heading: heading(run),
            spacing_m: run.map_spacing_m(),
            removed_edge_m: run.voxel_edge_m,
        })
    }

    /// The map from obliquely above, and in orange what was removed from it: the bytes of a PNG file.
    ///
    /// # Errors
    /// When it cannot be encoded.
    pub fn map_png(&self) -> Result<Vec<u8>, PictureError> {
        let view = self.projection(Eye::Oblique, &self.path, PICTURE_PX);
        Ok(self.picture(&view, Removed::All).into_shaded_png()?)
    }

    /// To the left the map with all that was removed, in orange; to the right the map. The bytes of a PNG file.
    ///
    /// # Errors
    /// When it cannot be encoded.
    pub fn before_after_png(&self) -> Result<Vec<u8>, PictureError> {
        Ok(self.before_after(HALF_PICTURE_PX).into_shaded_png()?)
    }

    fn before_after(&self, half_px: (usize, usize)) -> Canvas {
        let view = self.projection(Eye::Oblique, &self.path, half_px);
        let [before, after] = [Removed::All, Removed::None].map(|which| self.picture(&view, which));
        before.beside(&after, GAP_PX, GAP)
    }

    /// The eye that has all of the map and a path in view, within a size.
    fn projection(&self, eye: Eye, path: &[PathPoint], within_px: (usize, usize)) -> Projection {
        let view = Projection::towards(eye, &self.heading);
        let range = |axis: fn(&Projection, &Point3<f64>) -> f64| {
            let in_view = self.points.iter().filter(|point| point.is_seen_by(&view));
            let values = in_view.map(|point| axis(&view, &point.point_m.cast()) as f32);
            let of_points = range_without_outliers(values.collect());
            let path = path.iter().map(|at| axis(&view, &at.on_floor_m));
            path.filter(|at| at.is_finite())
                .fold(of_points.map(|ends| ends.map(f64::from)), |ends, at| {
                    Some(ends.map_or([at; 2], |[low, high]| [low.min(at), high.max(at)]))
                })
        };
        view.fitted([range(Projection::across), range(Projection::upwards)], within_px)
    }

    fn picture(&self, view: &Projection, which: Removed) -> Canvas {
        let mut raster = Raster::new(view.size_px());
        self.points.iter().for_each(|point| self.splat(&mut raster, view, point));
        if which == Removed::All {
            self.removed.iter().for_each(|point| self.splat_removed(&mut raster, view, point));
        }
        let mut canvas = raster.shaded(view.px_per_m());
        canvas.paint_path(self.path.iter().map(|at| view.pixel_of(&at.on_floor_m)), PATH);
        canvas
    }

    fn splat(&self, raster: &mut Raster, view: &Projection, point: &DrawnPoint) {
        if point.is_seen_by(view) {
            let side_px = SIZE_IN_SPACINGS * self.spacing_m * view.px_per_m();
            raster.splat(view, &point.point_m, side_px, point.lit_colour(view));
        }
    }

    fn splat_removed(&self, raster: &mut Raster, view: &Projection, point: &DrawnPoint) {
        let side_px = REMOVED_SIZE_IN_EDGES * self.removed_edge_m * view.px_per_m();
        raster.splat(view, &point.point_m, side_px, point.colour);
    }
}

impl DrawnPoint {
    fn is_seen_by(&self, view: &Projection) -> bool {
        self.normal.is_none_or(|normal| normal.dot(&view.eye_direction()) >= LEAST_COSINE)
    }

    fn lit_colour(&self, view: &Projection) -> Colour {
        let Some(normal) = self.normal else { return self.colour };
        let share = SHADE + (1.0 - SHADE) * normal.dot(&view.light_direction()).max(0.0);
        self.colour.map(|channel| (f64::from(channel) * share).round() as u8)
    }
}

/// How much lighter the colours of a map are drawn than they are.
fn gain(colours: &[Colour]) -> f64 {
    let seen = colours.iter().filter(|colour| **colour != geometry::NO_COLOUR);
    let mut lightest: Vec<u8> = seen.filter_map(|colour| colour.iter().max().copied()).collect();
    let index = (lightest.len() as f64 * LIGHT_SHARE) as usize;
    if index >= lightest.len() {
        return 1.0;
    }
    let light = *lightest.select_nth_unstable(index).1;
    (LIGHT / f64::from(light)).clamp(1.0, MOST_GAIN)
}

/// Where a value lies in a range, from 0 to 1.
fn relative(value: f64, [low, high]: [f32; 2]) -> f64 {
    let (low, high) = (f64::from(low), f64::from(high));
    if high > low { ((value - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 }
}

/// How high the lowest place of the rig is above the lowest of the map, from whose heights outliers are left out; 0 without a map.
fn height_above_floor(run: &RunRecord, [floor_m, _]: [f32; 2]) -> f64 {
    let heights_m = run.cycles.iter().map(|cycle| cycle.map_from_rig.translation.z);
    let lowest_m = heights_m.fold(f64::INFINITY, f64::min);
    let height_m = lowest_m - f64::from(floor_m);
    if run.static_map.is_empty() || !height_m.is_finite() { 0.0 } else { height_m.max(0.0) }
}

/// From where the rig saw in each cycle: its camera, where it has one.
fn rig_eyes(run: &RunRecord) -> Vec<Point3<f64>> {
    let rig_from_camera =
        run.rig_camera().map_or_else(Isometry3::identity, |camera| camera.rig_from_camera);
    let at = |map_from_rig: &Isometry3<f64>| (map_from_rig * rig_from_camera).translation.vector;
    run.cycles.iter().map(|cycle| at(&cycle.map_from_rig).into()).collect()
}

/// The points that were classified as moving, in the map frame.
fn removed_points(run: &RunRecord) -> Vec<DrawnPoint> {
    let mut points = Vec::new();
    for (ordinal, cycle) in run.cycles.iter().enumerate() {
        let map_from_rig: Isometry3<f32> = cycle.map_from_rig.cast();
        let moment = moments::moment(ordinal);
        let in_map = cycle.dynamic_points_m.iter().map(|point_m| map_from_rig * point_m);
        points.extend(in_map.filter(is_finite).map(|point_m| DrawnPoint {
            point_m,
            colour: REMOVED,
            moment,
            normal: None,
        }));
    }
    points
}

/// The direction in which the rig looks most, level; a diagonal where it looks around.
fn heading(run: &RunRecord) -> Vector3<f64> {
    /// Below this share of the cycles the mean of the directions tells nothing.
    const LOOKS_ALIKE: f64 = 0.4;
    const DIAGONAL: Vector3<f64> = Vector3::new(0.6, 0.8, 0.0);
    let sum: Vector3<f64> =
        run.cycles.iter().map(|cycle| cycle.map_from_rig.rotation * Vector3::x()).sum();
    let level = Vector3::new(sum.x, sum.y, 0.0);
    let is_told = level.norm() >= LOOKS_ALIKE * run.cycles.len() as f64;
    level.try_normalize(f64::EPSILON).filter(|_| is_told).unwrap_or(DIAGONAL)
}
