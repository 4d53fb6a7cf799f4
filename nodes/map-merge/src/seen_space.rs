//! What a map says of a place without points: that it is free, since the map was seen through it, or nothing.
//!
//! The map's points are rendered into the views that it was seen from. A place is free where the surface that a view shows in its
//! direction, and all around that, is clearly behind it. A pixel into which no point falls says nothing, and neither does one whose
//! surface was seen from its other side only: there is a hole in the map, in front of what the pixel shows.

use estimation::Executor;
use estimation::executor::map as each;
use geometry::MapView;
use nalgebra::{Isometry3, Point3, Vector3};
use volume::{DepthNoise, FARTHEST_SEEN_M, NEAREST_SEEN_M};

use crate::saved_map::{Piece, PreparedMap};

/// Views are rendered into images with no more pixels along a side than this: 0.7 degrees each, which are 5 cm at 4 m.
const MOST_ALONG_SIDE: usize = 80;
/// Points become squares of this many edges, so that the surfaces of maps have no holes: along a diagonal points are 1.4 edges apart.
const SPLAT_EDGES: f64 = 1.5;
/// The widest square, in pixels to either side: of what is nearer than some 0.3 m, where no camera measures.
const MOST_SPLAT_PX: f64 = 16.0;
/// So many edges before a surface nothing is free: points of one surface are in two maps up to an edge apart, and are seen at a slant.
const MARGIN_EDGES: f64 = 2.0;
/// The same for the noise of depth, in standard deviations.
const MARGIN_SIGMAS: f64 = 3.0;
/// A surface is measured up to this cosine of the angle between its normal and the ray: 78 degrees. At a flatter angle too little light of
/// structured light comes back.
const LEAST_COSINE: f64 = 0.2;
/// The corner of the widest image is so much farther from the camera than its depth: of 90 x 70 degrees.
const CORNER: f64 = 1.6;
/// Points are sorted into cubes of this edge, so that a view passes over those that it does not see.
const CUBE_M: f64 = 1.0;

/// How a map was seen through a place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Sight {
    NotThrough,
    /// From the side or from behind.
    Through,
    /// Where a surface of this normal would have been measured.
    ThroughFromItsFront,
}

/// The depths that the views of a map show.
#[derive(Clone, Debug, Default)]
pub(crate) struct SeenSpace {
    views: Vec<RenderedView>,
    edge_m: f64,
    /// At a larger depth the noise is more than an edge, so that what is there may be in the map elsewhere, or not at all.
    reach_m: f64,
}

/// One view.
#[derive(Clone, Debug)]
struct RenderedView {
    camera_from_map: Isometry3<f64>,
    camera_in_map_m: Point3<f64>,
    optics: Optics,
    /// Row by row: infinite where there is no point, negative where a surface says nothing of what is before it.
    depths_m: Vec<f32>,
}

/// A pinhole camera.
#[derive(Clone, Copy, Debug)]
struct Optics {
    width_px: usize,
    height_px: usize,
    fx_px: f64,
    fy_px: f64,
    cx_px: f64,
    cy_px: f64,
}

impl Optics {
    fn of(view: &MapView) -> Self {
        let camera = &view.camera;
        let longer_px = camera.width_px.max(camera.height_px);
        let scale = (MOST_ALONG_SIDE as f64 / longer_px as f64).min(1.0);
        let scaled = |pixels: usize| ((pixels as f64 * scale).round() as usize).max(1);
        // A pixel's centre has whole coordinates, so that the image begins half a pixel before 0.
        let middle = |middle_px: f64| (middle_px + 0.5) * scale - 0.5;
        Self {
            width_px: scaled(camera.width_px),
            height_px: scaled(camera.height_px),
            fx_px: camera.fx_px * scale,
            fy_px: camera.fy_px * scale,
            cx_px: middle(camera.cx_px),
            cy_px: middle(camera.cy_px),
        }
    }

    #[inline]
    fn project(&self, in_camera_m: &Point3<f64>) -> [f64; 2] {
        let per_depth = in_camera_m.z.recip();
        [
            self.cx_px + self.fx_px * in_camera_m.x * per_depth,
            self.cy_px + self.fy_px * in_camera_m.y * per_depth,
        ]
    }

    /// Whether nothing of a ball is in the image.
    fn misses(&self, middle_m: &Point3<f64>, radius_m: f64) -> bool {
        let Point3 { coords } = middle_m;
        let beside = |along_m: f64, focal_px: f64, edge_px: f64| {
            // The distance from the plane through the edge of the image and the optical centre.
            let slope = edge_px / focal_px;
            (along_m - slope * coords.z) / slope.hypot(1.0)
        };
        let right_m = beside(coords.x, self.fx_px, self.width_px as f64 - 0.5 - self.cx_px);
        let left_m = beside(-coords.x, self.fx_px, self.cx_px + 0.5);
        let below_m = beside(coords.y, self.fy_px, self.height_px as f64 - 0.5 - self.cy_px);
        let above_m = beside(-coords.y, self.fy_px, self.cy_px + 0.5);
        coords.z < -radius_m || right_m.max(left_m).max(below_m).max(above_m) > radius_m
    }
}

/// The pieces of a cube of space.
struct Cube<'a> {
    middle_m: Point3<f64>,
    pieces: Vec<&'a Piece>,
}

fn cubes(map: &PreparedMap) -> Vec<Cube<'_>> {
    let mut sorted: Vec<&Piece> = map.pieces.iter().collect();
    sorted.sort_by_key(|piece| cube_of(piece));
    sorted
        .chunk_by(|a, b| cube_of(a) == cube_of(b))
        .map(|pieces| Cube {
            middle_m: cube_of(pieces[0]).map(|cell| (f64::from(cell) + 0.5) * CUBE_M).into(),
            pieces: pieces.to_vec(),
        })
        .collect()
}

fn cube_of(piece: &Piece) -> [i32; 3] {
    piece.place_m.coords.map(|along_m| (along_m / CUBE_M).floor() as i32).into()
}

impl SeenSpace {
    /// What the views of a map show of its pieces, in its level frame.
    pub(crate) fn of(map: &PreparedMap, views: &[MapView], executor: &dyn Executor) -> Self {
        let cubes = cubes(map);
        let render = |view: &MapView| {
            let camera_from_map = (map.level_from_map * view.map_from_camera).inverse();
            let mut rendered = RenderedView::empty(camera_from_map, Optics::of(view));
            rendered.draw(map, &cubes);
            rendered
        };
        let noise = DepthNoise::default();
        let reach_m = (map.edge_m / f64::from(noise.quadratic_per_m)).sqrt().min(FARTHEST_SEEN_M);
        Self { views: each(executor, views.iter().collect(), render), edge_m: map.edge_m, reach_m }
    }

    /// Whether nothing is known of where the map looked.
    pub(crate) fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// How the map was seen through a place of its level frame. `normal` is that of the surface that may have been there, and zero where it is not
    /// known; `edge_m` is how large it is.
    pub(crate) fn sight(&self, place_m: &Point3<f64>, normal: &Vector3<f64>, edge_m: f64) -> Sight {
        let margin_m = MARGIN_EDGES * self.edge_m.max(edge_m);
        let range_m = NEAREST_SEEN_M..=CORNER * self.reach_m;
        let mut best = Sight::NotThrough;
        for view in &self.views {
            let to_camera_m = view.camera_in_map_m - place_m;
            let distance_m = to_camera_m.norm();
            if range_m.contains(&distance_m) && view.shows_free(place_m, margin_m, self.reach_m) {
                let cosine = normal.dot(&to_camera_m) / distance_m;
                if *normal == Vector3::zeros() || cosine > LEAST_COSINE {
                    return Sight::ThroughFromItsFront;
                }
                best = Sight::Through;
            }
        }
        best
    }

    /// Whether the map was seen through a place, by a view that would have shown its surface.
    pub(crate) fn is_free(
        &self,
        place_m: &Point3<f64>,
        normal: &Vector3<f64>,
        edge_m: f64,
    ) -> bool {
        self.sight(place_m, normal, edge_m) == Sight::ThroughFromItsFront
    }
}

impl RenderedView {
    fn empty(camera_from_map: Isometry3<f64>, optics: Optics) -> Self {
        let depths_m = vec![f32::INFINITY; optics.width_px * optics.height_px];
        let camera_in_map_m = camera_from_map.inverse() * Point3::origin();
        Self { camera_from_map, camera_in_map_m, optics, depths_m }
    }

    fn draw(&mut self, map: &PreparedMap, cubes: &[Cube<'_>]) {
        let radius_m = CUBE_M * 3.0_f64.sqrt() / 2.0;
        let is_in_reach =
            |middle_m: &Point3<f64>| middle_m.coords.norm() < FARTHEST_SEEN_M + radius_m;
        for Cube { middle_m, pieces } in cubes {
            let middle_m = self.camera_from_map * middle_m;
            if is_in_reach(&middle_m) && !self.optics.misses(&middle_m, radius_m) {
                for piece in pieces {
                    self.draw_piece(piece, SPLAT_EDGES * map.edge_m / 2.0, map.is_sided);
                }
            }
        }
    }

    fn draw_piece(&mut self, piece: &Piece, half_m: f64, is_sided: bool) {
        let in_camera_m = self.camera_from_map * piece.place_m;
        let depth_m = in_camera_m.z;
        if !(half_m..=FARTHEST_SEEN_M).contains(&depth_m) {
            return;
        }
        let normal: Vector3<f64> = self.camera_from_map.rotation * piece.normal;
        let says_nothing = is_sided && normal.dot(&in_camera_m.coords) > 0.0;
        let depth_m = depth_m as f32;
        let [column, row] = self.optics.project(&in_camera_m);
        let Optics { width_px, height_px, fx_px, fy_px, .. } = self.optics;
        let range = |middle_px: f64, focal_px: f64, size_px: usize| {
            let half_px = (focal_px * half_m / in_camera_m.z).clamp(0.5, MOST_SPLAT_PX);
            // The casts saturate.
            let first = (middle_px - half_px).ceil().max(0.0) as usize;
            first..((middle_px + half_px).floor() + 1.0).clamp(0.0, size_px as f64) as usize
        };
        let columns = range(column, fx_px, width_px);
        for row in range(row, fy_px, height_px) {
            let Some(pixels) = self.depths_m.get_mut(row * width_px..(row + 1) * width_px) else {
                continue;
            };
            let Some(pixels) = pixels.get_mut(columns.clone()) else { continue };
            for pixel in pixels.iter_mut().filter(|pixel| depth_m < pixel.abs()) {
                *pixel = if says_nothing { -depth_m } else { depth_m };
            }
        }
    }

    /// Whether what this view shows in the direction of a place, and in all pixels beside it, is behind it.
    fn shows_free(&self, place_m: &Point3<f64>, margin_m: f64, reach_m: f64) -> bool {
        let in_camera_m = self.camera_from_map * place_m;
        let depth_m = in_camera_m.z;
        if !(NEAREST_SEEN_M..=reach_m).contains(&depth_m) {
            return false;
        }
        let [column, row] = self.optics.project(&in_camera_m);
        let Optics { width_px, height_px, .. } = self.optics;
        let is_inside =
            |along_px: f64, size_px: usize| along_px >= 0.5 && along_px < size_px as f64 - 1.5;
        if !(is_inside(column, width_px) && is_inside(row, height_px)) {
            return false;
        }
        let (column, row) = (column.round() as usize, row.round() as usize);
        let depth_at = |column: usize, row: usize| {
            self.depths_m.get(row * width_px + column).copied().unwrap_or(f32::INFINITY)
        };
        let noise = DepthNoise::default();
        let is_behind = |shown_m: f32| {
            let sigma_m = f64::from(noise.sigma_m(shown_m));
            f64::from(shown_m) > depth_m + margin_m + MARGIN_SIGMAS * sigma_m
        };
        let around = (row - 1..=row + 1)
            .flat_map(|row| (column - 1..=column + 1).map(move |column| depth_at(column, row)));
        // Infinity is behind everything: beside a pixel with a point a hole matters nothing.
        depth_at(column, row).is_finite() && around.into_iter().all(is_behind)
    }
}

#[cfg(test)]
mod tests;
