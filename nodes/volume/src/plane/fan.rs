//! Rays of one cycle, and the free space between neighbours.

use nalgebra::{Point2, Vector2};

use super::PlaneOccupancy;

/// Cells are sampled in steps of this share of their edge, in both directions: no cell's centre is then farther than half of
/// the cell's edge from a sample.
pub const SAMPLES_PER_CELL: f64 = 0.7;
/// Space is passed up to so many edges before what a ray ends at.
const MARGIN_IN_EDGES: f64 = 0.1;
/// A surface is in the cell of the body behind it: a ray hits the place so many edges behind its end. A surface between two cells is
/// then in the one that the body is in.
const INTO_BODY_IN_EDGES: f64 = 0.5;
/// Two rays show the space between them free, or the surface between their ends, only where they are no farther apart: about a
/// body's narrow side, so that no person fits between them. Rays of 1 degree are that far apart at 8.6 m.
pub const WIDEST_GAP_M: f64 = 0.15;
/// A ray is used no farther than so many cells: it bounds the time.
const MOST_CELLS_ALONG: f64 = 2000.0;

/// A ray in the plane, free up to its end.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PlaneRay {
    /// Where it starts.
    pub from_m: Point2<f64>,
    /// Where it ends.
    pub to_m: Point2<f64>,
    /// Whether something static is at its end; otherwise no more is known than that it is free so far.
    pub hits: bool,
    /// Whether the next ray of the cycle is the neighbour of this one, so that the space between them is seen, too.
    pub joins_next: bool,
}

impl PlaneRay {
    fn length_m(&self) -> f64 {
        (self.to_m - self.from_m).norm()
    }

    fn direction(&self) -> Vector2<f64> {
        let along = self.to_m - self.from_m;
        along / along.norm().max(f64::MIN_POSITIVE)
    }
}

impl PlaneOccupancy {
    /// Takes the rays of one cycle: where they end, where they pass, and the space between neighbours as far as both pass.
    pub fn take_rays(&mut self, rays: &[PlaneRay]) {
        let usable = |ray: &PlaneRay| ray.length_m().is_finite() && ray.length_m() > 0.0;
        let pairs = || {
            let next = rays.iter().skip(1).map(Some).chain(std::iter::once(None));
            rays.iter()
                .zip(next)
                .filter(|(ray, _)| usable(ray))
                .map(move |(ray, next)| (ray, next.filter(|next| ray.joins_next && usable(next))))
        };
        for (ray, next) in pairs().filter(|(ray, _)| ray.hits) {
            let into_m = INTO_BODY_IN_EDGES * self.config.edge_m;
            let body_m = |ray: &PlaneRay| ray.to_m + ray.direction() * into_m;
            self.hit(&body_m(ray));
            if let Some(next) = next.filter(|next| next.hits) {
                self.hit_between(&body_m(ray), &body_m(next));
            }
        }
        for (ray, next) in pairs() {
            self.pass_between(ray, next);
        }
    }

    /// A surface continues between two near ends.
    fn hit_between(&mut self, from_m: &Point2<f64>, to_m: &Point2<f64>) {
        let offset_m = to_m - from_m;
        let length_m = offset_m.norm();
        if length_m > WIDEST_GAP_M {
            return;
        }
        let samples = (length_m / (SAMPLES_PER_CELL * self.config.edge_m)).floor();
        for sample in 1..=samples as u32 {
            self.hit(&(from_m + offset_m * (f64::from(sample) / (samples + 1.0))));
        }
    }

    fn pass_between(&mut self, ray: &PlaneRay, next: Option<&PlaneRay>) {
        let edge_m = self.config.edge_m;
        let step_m = SAMPLES_PER_CELL * edge_m;
        let clear_m = |ray: &PlaneRay| {
            let margin_m = if ray.hits { MARGIN_IN_EDGES * edge_m } else { 0.0 };
            (ray.length_m() - margin_m).min(MOST_CELLS_ALONG * edge_m)
        };
        let (own_m, direction) = (clear_m(ray), ray.direction());
        // It begins at the surface that it hits: nothing was seen before that.
        if own_m <= 0.0 {
            return;
        }
        let beside = next.map(|next| (next.from_m, next.direction(), clear_m(next)));
        for ring in 0..=(own_m / step_m).max(0.0) as u32 {
            let along_m = f64::from(ring) * step_m;
            let place_m = ray.from_m + direction * along_m;
            if self.pass(&place_m) && self.config.ends_at_occupied {
                break;
            }
            let Some((from_m, direction, next_m)) = beside else { continue };
            let offset_m = from_m + direction * along_m - place_m;
            let width_m = offset_m.norm();
            if along_m > next_m || width_m > WIDEST_GAP_M {
                continue;
            }
            let samples = (width_m / step_m).floor();
            for sample in 1..=samples as u32 {
                self.pass(&(place_m + offset_m * (f64::from(sample) / (samples + 1.0))));
            }
        }
    }
}
