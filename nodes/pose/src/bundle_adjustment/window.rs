//! Which part of a map is adjusted, and how the result is taken into it.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point2, Point3, Vector2};

use super::legs::{beside, motions};
use super::{Adjusted, Bundle, BundlePose, Sighting, WindowConfig};
use crate::feature::lines::SegmentInSpace;
use crate::frame::Frame;
use crate::map::{Id, Keyframe, KeyframeId, Landmark, LineId, Map, PointId};
use crate::solve::{LineObservation, PointObservation, Verdict};

/// A part of a map as a bundle, and what its indices are in the map.
#[derive(Clone, Debug)]
pub struct Window {
    /// The bundle.
    pub bundle: Bundle,
    keyframes: Vec<KeyframeId>,
    points: Vec<PointId>,
    lines: Vec<LineId>,
}

/// The effect on the map.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Applied {
    /// Keyframes that were put elsewhere.
    pub keyframes: usize,
    /// Points and lines that were put elsewhere.
    pub landmarks: usize,
    /// Sightings that are none.
    pub outliers: usize,
    /// Landmarks without a valid sighting.
    pub dropped: usize,
}

/// The map was corrected meanwhile: the result is of no use.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("keyframe {0:?} was moved while the bundle was adjusted")]
pub struct StaleWindow(pub KeyframeId);

impl Window {
    /// A keyframe, those that see most of the same landmarks, and all that these see. The keyframes that see some of that,
    /// too, are held where they are, and so is the root; where there would be none, the oldest of all is.
    ///
    /// `None` when the keyframe is not there.
    #[must_use]
    pub fn local(map: &Map, keyframe: KeyframeId, config: &WindowConfig) -> Option<Self> {
        map.keyframes().get(keyframe)?;
        let near = map.neighbours(keyframe, config.least_shared);
        let near = near.into_iter().map(|(id, _)| id).take(config.max_keyframes.saturating_sub(1));
        let adjusted: BTreeSet<KeyframeId> = near.chain([keyframe]).collect();
        let (points, lines) = map.landmarks_of(adjusted.iter().copied());
        let mut counts = BTreeMap::<KeyframeId, u32>::new();
        let of_points = points.iter().filter_map(|id| map.points().get(*id));
        let of_lines = lines.iter().filter_map(|id| map.lines().get(*id));
        let sightings = of_points.map(|point| point.sightings());
        for sightings in sightings.chain(of_lines.map(|line| line.sightings())) {
            for (keyframe, _) in sightings.iter().filter(|(id, _)| !adjusted.contains(id)) {
                *counts.entry(keyframe).or_default() += 1;
            }
        }
        let mut fixed: Vec<(u32, KeyframeId)> =
            counts.into_iter().map(|(id, count)| (count, id)).collect();
        fixed.sort_by_key(|(count, id)| (std::cmp::Reverse(*count), *id));
        fixed.truncate(config.max_fixed);
        let mut fixed: BTreeSet<KeyframeId> = fixed.into_iter().map(|(_, id)| id).collect();
        fixed.extend(beside(map, &adjusted));
        fixed.extend(map.root().filter(|root| adjusted.contains(root)));
        if fixed.is_empty() {
            let number = |id: &&KeyframeId| map.keyframes().get(**id).map(Keyframe::number);
            fixed.extend(adjusted.iter().min_by_key(number));
        }
        Some(Self::of(map, &adjusted, &fixed, (points, lines), config))
    }

    /// The whole map, with the root where it is.
    #[must_use]
    pub fn full(map: &Map, config: &WindowConfig) -> Self {
        let all: BTreeSet<KeyframeId> = map.keyframes().ids().collect();
        let fixed: BTreeSet<KeyframeId> = map.root().into_iter().collect();
        let landmarks = (map.points().ids().collect(), map.lines().ids().collect());
        Self::of(map, &all, &fixed, landmarks, config)
    }

    fn of(
        map: &Map,
        adjusted: &BTreeSet<KeyframeId>,
        fixed: &BTreeSet<KeyframeId>,
        (points, lines): (Vec<PointId>, Vec<LineId>),
        config: &WindowConfig,
    ) -> Self {
        let keyframes: Vec<KeyframeId> = adjusted.union(fixed).copied().collect();
        let mut bundle = Bundle::default();
        let place: BTreeMap<KeyframeId, usize> =
            keyframes.iter().enumerate().map(|(place, id)| (*id, place)).collect();
        for id in &keyframes {
            if let Some(keyframe) = map.keyframes().get(*id) {
                bundle.poses.push(BundlePose {
                    camera: *keyframe.camera(),
                    camera_from_map: *keyframe.camera_from_map(),
                    is_fixed: fixed.contains(id),
                });
            }
        }
        for (landmark, id) in points.iter().enumerate() {
            let Some(point) = map.points().get(*id) else { continue };
            bundle.points_m.push(*point.position_m());
            for (keyframe, corner) in point.sightings().iter() {
                let seen = map.keyframes().get(keyframe).and_then(|keyframe| {
                    point_seen(keyframe, corner, config, map.config().scale_factor)
                });
                if let Some((seen, pose)) = seen.zip(place.get(&keyframe)) {
                    bundle.point_sightings.push(Sighting { pose: *pose, landmark, seen });
                }
            }
        }
        for (landmark, id) in lines.iter().enumerate() {
            let Some(line) = map.lines().get(*id) else { continue };
            bundle.lines_m.push(line.ends_m());
            for (keyframe, segment) in line.sightings().iter() {
                let seen = map.keyframes().get(keyframe);
                let seen = seen.and_then(|keyframe| line_seen(keyframe, segment, config));
                if let Some((seen, pose)) = seen.zip(place.get(&keyframe)) {
                    bundle.line_sightings.push(Sighting { pose: *pose, landmark, seen });
                }
            }
        }
        bundle.motions = motions(map, &keyframes, &config.motions);
        Self { bundle, keyframes, points, lines }
    }

    /// The keyframes that the poses of the bundle are of, in their order.
    #[must_use]
    pub fn keyframes(&self) -> &[KeyframeId] {
        &self.keyframes
    }

    /// Applies a result to the map, as far as its keyframes and landmarks still exist: others may have been added and
    /// removed meanwhile. Sightings that are outliers are removed.
    ///
    /// # Errors
    /// When a keyframe was put elsewhere meanwhile, by a loop closing; the map is as it was.
    pub fn apply(&self, adjusted: &Adjusted, map: &mut Map) -> Result<Applied, StaleWindow> {
        for (id, before) in self.keyframes.iter().zip(&self.bundle.poses) {
            let is_elsewhere =
                |keyframe: &Keyframe| *keyframe.camera_from_map() != before.camera_from_map;
            if map.keyframes().get(*id).is_some_and(is_elsewhere) {
                return Err(StaleWindow(*id));
            }
        }
        let mut applied = Applied::default();
        let poses = self.keyframes.iter().zip(&adjusted.poses).zip(&self.bundle.poses);
        for ((id, pose), before) in poses {
            let is_moved = *pose != before.camera_from_map && map.set_pose(*id, pose).is_ok();
            applied.keyframes += usize::from(is_moved);
        }
        for (id, place) in self.points.iter().zip(&adjusted.points_m) {
            applied.landmarks += usize::from(map.set_point(*id, place).is_ok());
        }
        for (id, ends) in self.lines.iter().zip(&adjusted.lines_m) {
            applied.landmarks += usize::from(map.set_line(*id, ends).is_ok());
        }
        let of_points = self.bundle.point_sightings.iter().zip(&adjusted.point_verdicts);
        let of_points = of_points.map(|(sighting, verdict)| {
            (self.keyframes.get(sighting.pose), self.points.get(sighting.landmark), verdict)
        });
        drop_outliers(of_points, map, &mut applied);
        let of_lines = self.bundle.line_sightings.iter().zip(&adjusted.line_verdicts);
        let of_lines = of_lines.map(|(sighting, verdict)| {
            (self.keyframes.get(sighting.pose), self.lines.get(sighting.landmark), verdict)
        });
        drop_outliers(of_lines, map, &mut applied);
        for id in &self.points {
            // Those that are gone have no look.
            map.refresh_point(*id).ok();
        }
        Ok(applied)
    }
}

fn drop_outliers<'a, L: Landmark + 'a>(
    sightings: impl Iterator<Item = (Option<&'a KeyframeId>, Option<&'a Id<L>>, &'a Verdict)>,
    map: &mut Map,
    applied: &mut Applied,
) {
    for (keyframe, landmark, verdict) in sightings {
        let Some((keyframe, landmark)) = keyframe.zip(landmark) else { continue };
        if *verdict == Verdict::Outlier
            && let Ok(is_gone) = map.unobserve(*keyframe, *landmark)
        {
            applied.outliers += 1;
            applied.dropped += usize::from(is_gone);
        }
    }
}

/// The observation of a corner, were the place of its point known.
fn point_seen(
    keyframe: &Keyframe,
    corner: usize,
    config: &WindowConfig,
    scale_factor: f64,
) -> Option<PointObservation> {
    point_observation(keyframe.frame(), corner, &Point3::origin(), scale_factor, config)
}

/// The observation of a point at this place by a corner.
pub(crate) fn point_observation(
    frame: &Frame,
    corner: usize,
    place_m: &Point3<f64>,
    scale_factor: f64,
    config: &WindowConfig,
) -> Option<PointObservation> {
    let depth = frame.corner_depths.get(corner).copied().flatten();
    let corner = frame.corners.get(corner)?;
    Some(PointObservation {
        point_in_map_m: *place_m,
        pixel_px: corner.pixel.cast(),
        depth_m: depth.map(|depth| depth.depth_m),
        pixel_std_dev_px: config.point_std_dev_px * scale_factor.powi(i32::from(corner.level)),
        spread_px: Vector2::zeros(),
        depth_std_dev_m: depth.map_or(0.0, |depth| depth.std_dev_m) * config.depths_alike.sqrt(),
    })
}

/// The observation of a segment, were the place of its line known.
fn line_seen(
    keyframe: &Keyframe,
    segment: usize,
    config: &WindowConfig,
) -> Option<LineObservation> {
    line_observation(keyframe.frame(), segment, &[Point3::origin(); 2], config)
}

/// The observation of a line with these ends by a segment.
pub(crate) fn line_observation(
    frame: &Frame,
    segment: usize,
    ends_m: &[Point3<f64>; 2],
    config: &WindowConfig,
) -> Option<LineObservation> {
    let in_space = frame.lines_in_space.get(segment).and_then(Option::as_ref);
    let segment = frame.lines.get(segment)?.segment;
    let [start_px, end_px] =
        [segment.start_px, segment.end_px].map(|pixel| Point2::from(pixel.map(f64::from)));
    let variance =
        |line: &SegmentInSpace| 0.5 * (line.start_std_dev_m.powi(2) + line.end_std_dev_m.powi(2));
    let [start_in_map_m, end_in_map_m] = *ends_m;
    Some(LineObservation {
        start_in_map_m,
        end_in_map_m,
        start_px,
        end_px,
        pixel_std_dev_px: config.line_std_dev_px,
        start_depth_m: in_space.map(|line| line.start_m.z),
        end_depth_m: in_space.map(|line| line.end_m.z),
        depth_std_dev_m: (in_space.map_or(0.0, variance) * config.depths_alike).sqrt(),
    })
}
