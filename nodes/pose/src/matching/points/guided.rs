//! Each corner where it should appear.

use geometry::{ParameterError, parameter};
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use super::{CornerGrid, MatchConfig, PointMatch, rotation};
use crate::feature::points::Descriptor;

/// A corner that should be in an image.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PredictedCorner {
    /// Where it should be, column and row.
    pub pixel: Point2<f32>,
    /// The level of the pyramid that it should be found on.
    pub level: u8,
    /// Its angle in the image that it was last seen in, if the check of turns is to consider it.
    pub angle_rad: Option<f32>,
    /// The descriptor of its surroundings.
    pub descriptor: Descriptor,
}

/// The parameters of guided matching. Every default is in [`GuidedConfig::default`] and nowhere else.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct GuidedConfig {
    /// When two descriptors are taken for the same. The ratio is tested between corners of the same level only.
    pub matching: MatchConfig,
    /// How far from its prediction a corner of level 0 may be found, in pixels.
    pub radius_px: f32,
    /// How much farther on each further level: the factor between the levels of the pyramid.
    pub scale_factor: f32,
    /// It may be found this many levels above or below the predicted one.
    pub level_tolerance: u8,
}

impl Default for GuidedConfig {
    fn default() -> Self {
        Self {
            matching: MatchConfig {
                // Mur-Artal et al. 2015 search for projected points with twice the tolerance of a blind search.
                max_distance: 100,
                // Near by there are few that could be mistaken: 0.9, as they have it.
                max_ratio: 0.9,
                ..MatchConfig::default()
            },
            // The same: 15 pixels about what the motion model predicts.
            radius_px: 15.0,
            // As the pyramid's.
            scale_factor: 1.2,
            // A step nearer or farther by a fifth moves a corner one level.
            level_tolerance: 1,
        }
    }
}

impl GuidedConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        self.matching.validate()?;
        let radius = f64::from(self.radius_px);
        parameter::check(
            "radius_px",
            "a positive number",
            radius,
            radius.is_finite() && radius > 0.0,
        )?;
        let factor = f64::from(self.scale_factor);
        parameter::check("scale_factor", "in [1, 2]", factor, (1.0..=2.0).contains(&factor))
    }
}

/// The corner that each prediction is taken for: the nearest in descriptor of those within the radius and the level
/// tolerance, if it is clearly nearer than the next. Two predictions do not share a corner: the nearer has it, of
/// equally near ones the first. In the order of the predictions.
#[must_use]
pub fn match_guided(
    predictions: &[PredictedCorner],
    grid: &CornerGrid<'_>,
    config: &GuidedConfig,
) -> Vec<PointMatch> {
    let mut owners: Vec<Option<PointMatch>> = vec![None; grid.corners().len()];
    for (index, prediction) in predictions.iter().enumerate() {
        let Some(found) = find(index, prediction, grid, config) else { continue };
        let Some(owner) = owners.get_mut(found.found) else { continue };
        if owner.is_none_or(|owner| found.distance < owner.distance) {
            *owner = Some(found);
        }
    }
    let mut matches: Vec<PointMatch> = owners.into_iter().flatten().collect();
    matches.sort_unstable_by_key(|pair| pair.sought);
    drop_other_turns(
        &mut matches,
        predictions,
        grid,
        config.matching.rotation_tolerance_rad as f32,
    );
    matches
}

/// The nearest corner near a prediction, if it is clearly the nearest.
fn find(
    sought: usize,
    prediction: &PredictedCorner,
    grid: &CornerGrid<'_>,
    config: &GuidedConfig,
) -> Option<PointMatch> {
    let radius_px = config.radius_px * config.scale_factor.powi(i32::from(prediction.level));
    let mut nearest: Option<(u32, u8, usize)> = None;
    let mut next: Option<(u32, u8)> = None;
    for (index, corner) in grid.near(prediction.pixel, radius_px) {
        if corner.level.abs_diff(prediction.level) > config.level_tolerance {
            continue;
        }
        let distance = prediction.descriptor.distance(&corner.descriptor);
        if nearest.is_none_or(|nearest| (distance, index) < (nearest.0, nearest.2)) {
            next = nearest.map(|(distance, level, _)| (distance, level));
            nearest = Some((distance, corner.level, index));
        } else if next.is_none_or(|next| distance < next.0) {
            next = Some((distance, corner.level));
        }
    }
    let (distance, level, found) = nearest?;
    // The same corner is often found on two levels, and both are right.
    let rival = next.filter(|next| next.1 == level).map(|next| next.0);
    let accepted = config.matching.accepts(distance, rival);
    accepted.then_some(PointMatch { sought, found, distance })
}

/// Drops the matches that do not turn as most do; those without an angle stay.
fn drop_other_turns(
    matches: &mut Vec<PointMatch>,
    predictions: &[PredictedCorner],
    grid: &CornerGrid<'_>,
    tolerance_rad: f32,
) {
    let turn_rad = |pair: &PointMatch| {
        let corner = grid.corners().get(pair.found)?;
        Some(corner.angle_rad - predictions.get(pair.sought)?.angle_rad?)
    };
    let turns_rad: Vec<Option<f32>> = matches.iter().map(turn_rad).collect();
    let known_rad: Vec<f32> = turns_rad.iter().copied().flatten().collect();
    let mut kept = rotation::consistent(&known_rad, tolerance_rad).into_iter();
    let mut turns_rad = turns_rad.into_iter();
    matches.retain(|_| match turns_rad.next().flatten() {
        Some(_) => kept.next().unwrap_or(true),
        None => true,
    });
}
