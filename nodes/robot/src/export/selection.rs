//! Which points of a map are exported, and where they are then.

use clap::Args;
use geometry::{MapView, OrientedPoints, VoxelGrid};
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use reconstruction::one_a_voxel;

use crate::failure::Failure;
use crate::pose_numbers::pose_of_numbers;

/// The part of the map, and its place. Each is applied to what the ones before it leave.
#[derive(Args, Clone, PartialEq, Debug, Default)]
#[command(next_help_heading = "Selection, in this order")]
pub(super) struct Selection {
    /// Keep what is in this box of the map, in metres: -inf and inf leave a side open
    #[arg(long, num_args = 6, value_names = ["X", "Y", "Z", "X", "Y", "Z"], allow_hyphen_values = true)]
    crop: Option<Vec<f64>>,
    /// Keep what is in this polygon of the map, seen from above: its corners, in metres
    #[arg(long, num_args = 6.., value_names = ["X", "Y"], allow_negative_numbers = true)]
    polygon: Option<Vec<f64>>,
    /// Keep one point for each voxel of this edge: the mean of its points, normals and colours
    #[arg(long, value_name = "METRES")]
    thin: Option<f64>,
    /// Move the map: metres and radians, as static_transform_publisher has them
    #[arg(long, num_args = 6, value_names = ["X", "Y", "Z", "ROLL", "PITCH", "YAW"], allow_negative_numbers = true)]
    transform: Option<Vec<f64>>,
}

impl Selection {
    /// What is left of the points, and where.
    ///
    /// # Errors
    /// When an option means nothing, or no point is left.
    pub(super) fn of(&self, points: OrientedPoints) -> Result<OrientedPoints, Failure> {
        let (before, mut points) = (points.points_m.len(), points);
        if before == 0 {
            return Err(Failure::new("the map is empty: it has no points"));
        }
        if let Some(corners_m) = &self.crop {
            let area = Box3::of(corners_m)?;
            points = kept(points, |point_m| area.contains(point_m));
        }
        if let Some(corners_m) = &self.polygon {
            let polygon = Polygon::of(corners_m)?;
            points = kept(points, |point_m| polygon.contains(&point_m.xy()));
        }
        if let Some(edge_m) = self.thin {
            let grid = VoxelGrid::new(edge_m)
                .map_err(|error| Failure::unusable(format!("--thin: {error}")))?;
            points = thinned(&points, &grid);
        }
        if let Some(numbers) = &self.transform {
            points = moved(points, &pose_of_numbers("--transform", numbers)?);
        }
        if points.points_m.is_empty() {
            return Err(Failure::new(format!(
                "none of the map's {before} points is in --crop and --polygon"
            )));
        }
        Ok(points)
    }

    /// The views that the map was seen from, where it is then. A part of a map has none: they would show what was cut off as free.
    ///
    /// # Errors
    /// When `--transform` means nothing.
    pub(super) fn views_of(&self, mut views: Vec<MapView>) -> Result<Vec<MapView>, Failure> {
        if self.crop.is_some() || self.polygon.is_some() {
            return Ok(Vec::new());
        }
        if let Some(numbers) = &self.transform {
            let new_from_map = pose_of_numbers("--transform", numbers)?;
            for view in &mut views {
                view.map_from_camera = new_from_map * view.map_from_camera;
            }
        }
        Ok(views)
    }
}

/// The points of which `is_kept` is true, in order.
fn kept(points: OrientedPoints, is_kept: impl Fn(&Point3<f64>) -> bool) -> OrientedPoints {
    let is_kept: Vec<bool> = points.points_m.iter().map(|point| is_kept(&point.cast())).collect();
    fn of<T>(values: Vec<T>, is_kept: &[bool]) -> Vec<T> {
        values.into_iter().zip(is_kept).filter_map(|(value, kept)| kept.then_some(value)).collect()
    }
    OrientedPoints {
        points_m: of(points.points_m, &is_kept),
        normals: of(points.normals, &is_kept),
        colours: of(points.colours, &is_kept),
    }
}

/// A box along the axes of the map.
struct Box3 {
    least_m: [f64; 3],
    most_m: [f64; 3],
}

impl Box3 {
    fn of(corners_m: &[f64]) -> Result<Self, Failure> {
        let &[x0, y0, z0, x1, y1, z1] = corners_m else {
            return Err(Failure::unusable("--crop takes six numbers"));
        };
        let (least_m, most_m) = ([x0, y0, z0], [x1, y1, z1]);
        // Also false for what is no number.
        if least_m.iter().zip(&most_m).all(|(least_m, most_m)| least_m < most_m) {
            return Ok(Self { least_m, most_m });
        }
        Err(Failure::unusable(format!(
            "--crop: {least_m:?} is not below {most_m:?} along all axes"
        ))
        .fix("the lower corner comes first: X Y Z of it, and then X Y Z of the upper one"))
    }

    fn contains(&self, point_m: &Point3<f64>) -> bool {
        let sides = self.least_m.iter().zip(&self.most_m).zip(point_m.iter());
        sides.into_iter().all(|((least_m, most_m), along_m)| (least_m..most_m).contains(&along_m))
    }
}

/// A polygon in the plane of the map; its sides may cross (even-odd rule).
struct Polygon {
    corners_m: Vec<Point2<f64>>,
}

impl Polygon {
    fn of(coordinates_m: &[f64]) -> Result<Self, Failure> {
        let pairs = coordinates_m.chunks_exact(2);
        if !pairs.remainder().is_empty() || coordinates_m.iter().any(|along_m| !along_m.is_finite())
        {
            return Err(Failure::unusable(
                "--polygon takes pairs of finite numbers: X Y X Y X Y ...",
            ));
        }
        let corner = |pair: &[f64]| match *pair {
            [x, y] => Some(Point2::new(x, y)),
            _ => None,
        };
        Ok(Self { corners_m: pairs.filter_map(corner).collect() })
    }

    /// Whether a ray along x from the point crosses an odd number of sides. A side has its lower end and not its upper one, so that
    /// a ray through a corner crosses one of two.
    fn contains(&self, point_m: &Point2<f64>) -> bool {
        let ends = self.corners_m.iter().zip(self.corners_m.iter().cycle().skip(1));
        let is_crossed = |(a, b): &(&Point2<f64>, &Point2<f64>)| {
            (a.y <= point_m.y) != (b.y <= point_m.y)
                && point_m.x < a.x + (point_m.y - a.y) / (b.y - a.y) * (b.x - a.x)
        };
        ends.filter(is_crossed).count() % 2 == 1
    }
}

/// A point for each voxel, with a normal of length 1 where it has one.
fn thinned(points: &OrientedPoints, grid: &VoxelGrid) -> OrientedPoints {
    let mut thinned = one_a_voxel(points, grid);
    for normal in &mut thinned.normals {
        *normal = normal.try_normalize(f32::EPSILON).unwrap_or_else(Vector3::zeros);
    }
    thinned
}

fn moved(mut points: OrientedPoints, new_from_map: &Isometry3<f64>) -> OrientedPoints {
    for point_m in &mut points.points_m {
        *point_m = (new_from_map * point_m.cast::<f64>()).cast();
    }
    for normal in &mut points.normals {
        *normal = (new_from_map * normal.cast::<f64>()).cast();
    }
    points
}

#[cfg(test)]
mod tests;
