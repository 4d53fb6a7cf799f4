//! The visible solids of one moment, and the light from them.

use std::ops::Range;

use geometry::CameraModel;

use super::{CHANNELS, Moment};
use crate::Ray;
use crate::lighting::{Lighting, LocalLighting};
use crate::paint::SurfacePoint;
use crate::projection::Projection;
use crate::solid::Solid;
use crate::surface::place;

/// The solids of a moment that are visible in the image, with the light on them.
pub(super) struct View<'a> {
    shown: Vec<Shown<'a>>,
    /// Rays per pixel along each axis.
    side: usize,
    /// The distance of neighbouring pixels at 1 m.
    pixel_rad: f64,
}

struct Shown<'a> {
    /// One ray through the centre of each pixel.
    coarse: Projection<'a>,
    /// All rays of each pixel.
    fine: Projection<'a>,
    lighting: LocalLighting,
}

/// Red, green and blue.
type Colour = [f32; CHANNELS];
const BLACK: Colour = [0.0; CHANNELS];

/// The values shared by the rays of a pixel that hit one side of a solid: the light, and the smooth part of the
/// pattern.
#[derive(Clone, Copy)]
struct Smooth {
    seen: u32,
    side: u32,
    light: f32,
}

impl<'a> View<'a> {
    pub(super) fn of(
        statics: &'a [Solid],
        moment: &'a Moment,
        camera: &CameraModel,
        side: usize,
        lighting: &Lighting,
    ) -> Self {
        let magnified = magnified(camera, side);
        let solids = statics.iter().chain(&moment.moving).filter(|solid| !solid.is_pane());
        let shown = solids
            .filter_map(|solid| {
                Some(Shown {
                    coarse: Projection::of(solid, &moment.room_from_camera, camera)?,
                    fine: Projection::of(solid, &moment.room_from_camera, &magnified)?,
                    lighting: lighting.in_frame(&solid.solid_from_room),
                })
            })
            .collect();
        Self { shown, side, pixel_rad: 1.0 / camera.fx_px }
    }

    fn is_convex(&self, seen: u32) -> bool {
        self.shown.get(seen as usize).is_none_or(|shown| shown.coarse.solid.shape.is_convex())
    }

    /// The nearest solid along one of the fine rays.
    fn nearest(&self, row: usize, column: usize) -> u32 {
        let mut nearest = (f64::INFINITY, NOTHING);
        for (index, shown) in (0..).zip(&self.shown) {
            if shown.fine.covers(row, column)
                && let Some(hit) = shown.fine.solid.shape.intersect(&shown.fine.ray(row, column))
                && hit.parameter < nearest.0
            {
                nearest = (hit.parameter, index);
            }
        }
        nearest.1
    }

    /// The light from the surface that one of the fine rays hits; black if there is none.
    fn fine(&self, seen: u32, row: usize, column: usize, known: &mut Option<Smooth>) -> Colour {
        let Some(shown) = self.shown.get(seen as usize) else { return BLACK };
        self.colour(shown, &shown.fine.ray(row, column), seen, known)
    }

    /// The same for the centre of a pixel.
    fn coarse(&self, seen: u32, row: usize, column: usize, known: &mut Option<Smooth>) -> Colour {
        let Some(shown) = self.shown.get(seen as usize) else { return BLACK };
        self.colour(shown, &shown.coarse.ray(row, column), seen, known)
    }

    fn colour(
        &self,
        shown: &Shown<'_>,
        ray: &Ray,
        seen: u32,
        known: &mut Option<Smooth>,
    ) -> Colour {
        let solid = shown.fine.solid;
        let Some(hit) = solid.shape.intersect(ray) else { return BLACK };
        let point = ray.at(hit.parameter);
        let place = place(&solid.shape, &point, &hit.normal);
        // On an oblique surface pixels are farther apart along one direction; the mean of both is used.
        let cos = hit.cos_incidence(&ray.direction).max(0.05);
        let surface_point = SurfacePoint {
            uv_m: place.uv_m.map(|m| m as f32),
            seed: solid.pattern_seed.wrapping_add(place.side.wrapping_mul(0x9e37_79b9)),
            footprint_m: (hit.parameter * self.pixel_rad / cos.sqrt()) as f32,
        };
        let light = match *known {
            Some(Smooth { seen: same, side, light }) if same == seen && side == place.side => light,
            _ => {
                // From inside a body its inner side is visible.
                let outwards = hit.normal.dot(&ray.direction) < 0.0;
                let normal = if outwards { hit.normal } else { -hit.normal };
                let light = shown.lighting.on(&point, &normal) as f32;
                let light = light * solid.paint.shade(&surface_point);
                *known = Some(Smooth { seen, side: place.side, light });
                light
            }
        };
        solid.paint.ground(&surface_point).map(|share| share * light)
    }
}

/// The camera with `side` x `side` pixels for each.
fn magnified(camera: &CameraModel, side: usize) -> CameraModel {
    let side = side.max(1);
    let times = side as f64;
    CameraModel {
        width_px: camera.width_px * side,
        height_px: camera.height_px * side,
        fx_px: camera.fx_px * times,
        fy_px: camera.fy_px * times,
        // A pixel's centre has whole coordinates, so the image begins half a pixel before 0.
        cx_px: (camera.cx_px + 0.5) * times - 0.5,
        cy_px: (camera.cy_px + 0.5) * times - 0.5,
        distortion: camera.distortion,
    }
}

/// No solid is visible.
const NOTHING: u32 = u32::MAX;

/// The nearest solid at each pixel of some rows and of the rows around them.
pub(super) struct Visible {
    first_row: usize,
    width_px: usize,
    /// Its index in the view, or [`NOTHING`].
    solid: Vec<u32>,
}

impl Visible {
    pub(super) fn draw(view: &View<'_>, camera: &CameraModel, rows: Range<usize>) -> Self {
        let rows = rows.start.saturating_sub(1)..(rows.end + 1).min(camera.height_px);
        let pixels = rows.len() * camera.width_px;
        let (mut depth_m, mut solid) = (vec![f32::INFINITY; pixels], vec![NOTHING; pixels]);
        for (index, shown) in (0..).zip(&view.shown) {
            shown.coarse.for_each_hit(&rows, |at, _, hit| {
                if let (Some(depth_m), Some(solid)) = (depth_m.get_mut(at), solid.get_mut(at))
                    && (hit.parameter as f32) < *depth_m
                {
                    *depth_m = hit.parameter as f32;
                    *solid = index;
                }
            });
        }
        Self { first_row: rows.start, width_px: camera.width_px, solid }
    }

    /// Adds the light of all rays of a pixel.
    pub(super) fn add_pixel(
        &self,
        view: &View<'_>,
        row_px: usize,
        column_px: usize,
        sum: &mut Colour,
    ) {
        let seen = self.at(row_px, column_px).unwrap_or(NOTHING);
        let side = view.side;
        let within = side == 1 || (view.is_convex(seen) && self.is_within(seen, row_px, column_px));
        let mut known = None;
        let mut add = |colour: Colour, times: f32| {
            sum.iter_mut().zip(colour).for_each(|(sum, channel)| *sum += times * channel);
        };
        let even = view.shown.get(seen as usize).is_none_or(|s| s.coarse.solid.paint.is_even());
        if within {
            // The smooth part is that of the centre; without any other part one ray is enough.
            let middle = view.coarse(seen, row_px, column_px, &mut known);
            if even || side == 1 {
                add(middle, (side * side) as f32);
                return;
            }
        }
        for row in row_px * side..(row_px + 1) * side {
            for column in column_px * side..(column_px + 1) * side {
                let seen = if within { seen } else { view.nearest(row, column) };
                add(view.fine(seen, row, column, &mut known), 1.0);
            }
        }
    }

    fn at(&self, row_px: usize, column_px: usize) -> Option<u32> {
        let row = row_px.checked_sub(self.first_row)?;
        self.solid.get(row * self.width_px + column_px).copied()
    }

    /// Whether all neighbouring pixels show the same side of the same solid.
    fn is_within(&self, seen: u32, row_px: usize, column_px: usize) -> bool {
        let columns = column_px.saturating_sub(1)..(column_px + 2).min(self.width_px);
        (row_px.saturating_sub(1)..row_px + 2).all(|row| {
            columns.clone().all(|column| self.at(row, column).is_none_or(|other| other == seen))
        })
    }
}
