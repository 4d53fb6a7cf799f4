//! Points on a grid of pixels, of which the nearest to the eye is seen.

use nalgebra::Point3;

use super::eye::Projection;
use crate::pictures::canvas::{BACKGROUND, Canvas, Colour};

/// A point is drawn no larger than this: of a coarse map there are gaps between them, which is what is known of it.
const MOST_SIDE_PX: f64 = 40.0;
/// Edges are shaded by the pixels so far away ...
const SHADE_REACH_PX: i64 = 2;
/// ... which darken a pixel by so much for each pixel that they are nearer to the eye (eye-dome lighting: Boucheny, "Interactive
/// scientific visualization of large datasets", 2009, section 3.2) ...
const SHADE_PER_PX: f64 = 0.02;
/// ... to this share at most.
const DARKEST_SHARE: f64 = 0.45;

/// A picture in the making.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Raster {
    width_px: usize,
    height_px: usize,
    colours: Vec<Colour>,
    /// How near to the eye what a pixel shows is; none where it shows nothing.
    nearness_m: Vec<Option<f32>>,
}

impl Raster {
    /// An empty one.
    pub(super) fn new((width_px, height_px): (usize, usize)) -> Self {
        let pixels = width_px * height_px;
        let (colours, nearness_m) = (vec![BACKGROUND; pixels], vec![None; pixels]);
        Self { width_px, height_px, colours, nearness_m }
    }

    /// Draws a square around a point, of one pixel at least, where nothing is nearer to the eye.
    pub(super) fn splat(
        &mut self,
        view: &Projection,
        point_m: &Point3<f32>,
        side_px: f64,
        colour: Colour,
    ) {
        let point_m = point_m.cast::<f64>();
        let side_px = side_px.clamp(1.0, MOST_SIDE_PX).round();
        let first = view.place_px(&point_m).map(|px| (px - (side_px - 1.0) / 2.0).floor());
        let pixels = |first_px: f64, most_px: usize| {
            // The casts saturate, and bring what is not a number to an edge: the range is empty there.
            let end_px = (first_px + side_px).max(0.0) as usize;
            (first_px.max(0.0) as usize).min(most_px)..end_px.min(most_px)
        };
        let nearness_m = view.nearness_m(&point_m) as f32;
        for row in pixels(first[1], self.height_px) {
            for column in pixels(first[0], self.width_px) {
                let pixel = row * self.width_px + column;
                if self.nearness_m[pixel].is_none_or(|known_m| known_m < nearness_m) {
                    self.nearness_m[pixel] = Some(nearness_m);
                    self.colours[pixel] = colour;
                }
            }
        }
    }

    /// What each pixel shows, row by row from the upper left corner; none where it shows nothing.
    pub(super) fn pixels(&self) -> impl Iterator<Item = Option<(Colour, f32)>> {
        let both = self.colours.iter().zip(&self.nearness_m);
        both.map(|(colour, nearness_m)| nearness_m.map(|nearness_m| (*colour, nearness_m)))
    }

    /// The picture, its edges shaded.
    pub(super) fn shaded(&self, px_per_m: f64) -> Canvas {
        let shade = |pixel: usize, own_m: f32| {
            let (column, row) = ((pixel % self.width_px) as i64, (pixel / self.width_px) as i64);
            let nearer_px = |(right, down): (i64, i64)| {
                let other_m =
                    self.nearness_at(column + right * SHADE_REACH_PX, row + down * SHADE_REACH_PX);
                // `max` ignores what is not a number.
                other_m.map_or(0.0, |other_m| (f64::from(other_m - own_m) * px_per_m).max(0.0))
            };
            let sum: f64 = [(1, 0), (-1, 0), (0, 1), (0, -1)].into_iter().map(nearer_px).sum();
            (-SHADE_PER_PX * sum).exp().max(DARKEST_SHARE)
        };
        let pixels: Vec<Colour> = self
            .pixels()
            .enumerate()
            .map(|(pixel, shown)| match shown {
                Some((colour, own_m)) => {
                    let share = shade(pixel, own_m);
                    colour.map(|channel| (f64::from(channel) * share).round() as u8)
                }
                None => BACKGROUND,
            })
            .collect();
        Canvas::of_pixels((self.width_px, self.height_px), &pixels)
    }

    fn nearness_at(&self, column: i64, row: i64) -> Option<f32> {
        let inside = |at: i64, size: usize| usize::try_from(at).ok().filter(|at| *at < size);
        let (column, row) = (inside(column, self.width_px)?, inside(row, self.height_px)?);
        self.nearness_m.get(row * self.width_px + column).copied().flatten()
    }
}
