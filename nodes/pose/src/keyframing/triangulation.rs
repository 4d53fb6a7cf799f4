//! Features that are too far for their depth become points when two keyframes see them.

use estimation::chi_square::quantile;
use nalgebra::{Isometry3, Matrix2, Point2, Point3, Vector2, Vector3};

use super::KeyframingConfig;
use crate::feature::points::Corner;
use crate::map::{Keyframe, KeyframeId, Map};
use crate::matching::points::match_all;
use crate::solve::PluckerLine;

/// This many of the right corners are to pass.
const INLIER_PROBABILITY: f64 = 0.95;

/// Makes points of corners that are none yet and that a neighbour of the keyframe sees, too. A pair must lie on each
/// other's epipolar line, be seen at an angle, in front of both cameras, where both saw it, and on levels that go with the
/// distances (Mur-Artal et al. 2015, section VI-C). Returns how many.
pub fn triangulate(map: &mut Map, keyframe: KeyframeId, config: &KeyframingConfig) -> usize {
    let mut made = 0;
    let near = map.neighbours(keyframe, config.least_shared);
    for (neighbour, _) in near.into_iter().take(config.neighbours) {
        let (one, other) = (map.keyframes().get(keyframe), map.keyframes().get(neighbour));
        let Some((one, other)) = one.zip(other) else { continue };
        for (place, corner, their_corner) in pairs(one, other, map.config().scale_factor, config) {
            if let Ok(point) = map.insert_point(keyframe, corner, &place) {
                made += usize::from(map.observe(neighbour, their_corner, point).is_ok());
                // Both see it now.
                map.refresh_point(point).ok();
            }
        }
    }
    made
}

/// The places of pairs of corners that pass all checks.
fn pairs(
    one: &Keyframe,
    other: &Keyframe,
    scale_factor: f64,
    config: &KeyframingConfig,
) -> Vec<(Point3<f64>, usize, usize)> {
    let other_from_one = other.camera_from_map() * one.camera_from_map().inverse();
    // Closer than the camera's own two eyes, its depth is better than any angle.
    if other_from_one.translation.vector.norm() < config.baseline_m {
        return Vec::new();
    }
    let (free, their_free) = (free_corners(one), free_corners(other));
    let corners = |keyframe: &Keyframe, free: &[usize]| -> Vec<Corner> {
        free.iter().map(|corner| keyframe.frame().corners[*corner]).collect()
    };
    let (sought, among) = (corners(one, &free), corners(other, &their_free));
    let map_from_one = one.camera_from_map().inverse();
    let pair = Pair { one, other, other_from_one, scale_factor, config };
    let places = match_all(&sought, &among, &config.matching).into_iter().filter_map(|found| {
        let place = pair.place(&sought[found.sought], &among[found.found])?;
        Some((map_from_one * place, free[found.sought], their_free[found.found]))
    });
    places.collect()
}

fn free_corners(keyframe: &Keyframe) -> Vec<usize> {
    (0..keyframe.points().len()).filter(|corner| keyframe.points()[*corner].is_none()).collect()
}

/// Two cameras.
struct Pair<'a> {
    one: &'a Keyframe,
    other: &'a Keyframe,
    other_from_one: Isometry3<f64>,
    scale_factor: f64,
    config: &'a KeyframingConfig,
}

impl Pair<'_> {
    /// The place in the frame of the one camera that two corners show.
    fn place(&self, corner: &Corner, their_corner: &Corner) -> Option<Point3<f64>> {
        let (pixel, their_pixel) = (corner.pixel.cast::<f64>(), their_corner.pixel.cast::<f64>());
        let ray = self.one.camera().ray(&pixel)?.push(1.0);
        let their_ray = self.other.camera().ray(&their_pixel)?.push(1.0);
        let std_dev_px = |corner: &Corner| {
            self.config.window.point_std_dev_px * self.scale_factor.powi(i32::from(corner.level))
        };
        let (std_dev, their_std_dev) = (std_dev_px(corner), std_dev_px(their_corner));
        // The epipolar line is the image of the ray.
        let seen_ray = PluckerLine::through(
            &(self.other_from_one * Point3::origin()),
            &(self.other_from_one * Point3::from(ray)),
        )?;
        let (off_px, _) = seen_ray.distance_px(self.other.camera(), &their_pixel)?;
        if (off_px / their_std_dev).powi(2) > quantile(1, INLIER_PROBABILITY) {
            return None;
        }
        let back = self.other_from_one.rotation.inverse() * their_ray;
        if ray.normalize().dot(&back.normalize()) >= self.config.max_parallax_cos {
            return None;
        }
        let place = between(&ray, &back, &self.other_from_one)?;
        let their_place = self.other_from_one * place;
        let limit = quantile(2, INLIER_PROBABILITY);
        let fits = |seen: Option<Point2<f64>>, pixel: Point2<f64>, std_dev: f64| {
            seen.is_some_and(|seen| (seen - pixel).norm_squared() < limit * std_dev * std_dev)
        };
        // What is behind a camera has no image.
        if !(fits(self.one.camera().project(&place), pixel, std_dev)
            && fits(self.other.camera().project(&their_place), their_pixel, their_std_dev))
        {
            return None;
        }
        let distances = their_place.coords.norm() / place.coords.norm();
        let levels = i32::from(corner.level) - i32::from(their_corner.level);
        let off = distances / self.scale_factor.powi(levels);
        let most = self.config.scale_consistency * self.scale_factor;
        (off < most && off > most.recip()).then_some(place)
    }
}

/// The point halfway between two rays where these are nearest to each other: the one from the origin, the other, turned
/// into the same frame, from the other camera.
fn between(
    ray: &Vector3<f64>,
    back: &Vector3<f64>,
    other_from_one: &Isometry3<f64>,
) -> Option<Point3<f64>> {
    let there = other_from_one.inverse().translation.vector;
    let mixed = ray.dot(back);
    let matrix = Matrix2::new(ray.norm_squared(), -mixed, -mixed, back.norm_squared());
    let lengths = matrix.try_inverse()? * Vector2::new(ray.dot(&there), -back.dot(&there));
    let halfway = 0.5 * (ray * lengths.x + there + back * lengths.y);
    (lengths.min() > 0.0 && halfway.norm().is_finite()).then_some(Point3::from(halfway))
}
