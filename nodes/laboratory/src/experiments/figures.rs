//! What is kept of a trial: a few numbers a cycle instead of its clouds and labels.

mod of_trial;

use std::collections::BTreeMap;

use evaluation::Correlation;
use geometry::Stamp;
use nalgebra::Point3;
use report::CloudDistance;
use serde::Serialize;

use geometry::Method;

/// What one method made of one scenario.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct RunFigures {
    pub(crate) scenario: String,
    pub(crate) seed: u64,
    pub(crate) method: Method,
    pub(crate) map: MapFigures,
    /// Of each point, whether it was rightly taken for moving; none where nothing was labelled.
    pub(crate) labels: Option<LabelFigures>,
    /// Of all objects together.
    pub(crate) identity_switches: usize,
    /// Inputs that were lost on the way.
    pub(crate) dropped: u64,
    /// The rest is too long for the JSON file.
    #[serde(skip)]
    pub(crate) cycles: Vec<CycleFigures>,
    #[serde(skip)]
    pub(crate) objects: Vec<ObjectFigures>,
    #[serde(skip)]
    pub(crate) clouds: Option<Clouds>,
}

/// The final map.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(crate) struct MapFigures {
    pub(crate) points: usize,
    /// Of the map that the same clouds give when nothing is removed.
    pub(crate) points_without_removal: usize,
    /// With the true surface of the empty scene.
    pub(crate) correlation: Option<Correlation>,
    /// With the map that the same method measures of the empty scene, as far as the run has one to compare with.
    pub(crate) correlation_with_measured: Option<Correlation>,
    /// Of that map, the points that have none of this one within an edge of the voxels of the question what moves, as a share.
    pub(crate) lost_of_measured: Option<f64>,
    /// The correlation of what the method measures where nothing moves: then of two measurements of one thing, and so the
    /// most that any map can be expected to reach.
    pub(crate) undisturbed_correlation_with_measured: Option<Correlation>,
    /// From the true surface, as `stillmap run` has it.
    pub(crate) surface: Option<CloudDistance>,
}

/// The dynamic label of the points, and what it left in the map.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(crate) struct LabelFigures {
    pub(crate) recall: Option<f64>,
    /// Without the borders of one voxel.
    pub(crate) precision: Option<f64>,
    pub(crate) precision_with_borders: Option<f64>,
    /// Static points that were removed, of all that were seen.
    pub(crate) static_points_removed: Option<f64>,
    /// Voxels of the final map that only objects ever touched.
    pub(crate) ghost_voxels: usize,
}

/// A cycle.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct CycleFigures {
    /// Since the start of the scenario.
    pub(crate) time_s: f64,
    pub(crate) zones: Vec<ZoneFigures>,
    /// Points as they came, reduced, in a zone (PCL_ZD), taken for moving (PCL_Din).
    pub(crate) points_in: usize,
    pub(crate) reduced: usize,
    pub(crate) in_zone: usize,
    pub(crate) dynamic: usize,
    pub(crate) map_points: usize,
    /// How long its steps took together.
    pub(crate) duration_ms: f64,
    /// The map so far against the empty scene.
    pub(crate) correlation: Option<Correlation>,
    /// Where the rig was.
    pub(crate) rig_m: Point3<f64>,
}

/// A zone, in degrees left of forward.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct ZoneFigures {
    pub(crate) right_deg: f64,
    pub(crate) left_deg: f64,
    pub(crate) is_measured: bool,
}

/// An object of the scene.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct ObjectFigures {
    /// Each cycle whose image shows a part of it.
    pub(crate) sightings: Vec<Sighting>,
}

/// An object in a cycle whose image shows a part of it. Positions in the map.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Sighting {
    /// Which of the run's cycles.
    pub(crate) cycle: usize,
    pub(crate) time_s: f64,
    /// Whether enough of it is in the image to count: the rule of [`report::DynamicScoreRules`].
    pub(crate) in_camera: bool,
    /// Whether, besides, a beam of the scanner's aperture met it.
    pub(crate) in_both: bool,
    pub(crate) found: bool,
    pub(crate) removed: bool,
    /// Its points, and how many of them were removed.
    pub(crate) points: u64,
    pub(crate) points_removed: u64,
    pub(crate) azimuth_deg: f64,
    /// The mean of its surface that the image shows.
    pub(crate) true_m: Point3<f64>,
    /// The mean of all points that were taken for moving: what Rec-HV takes for the object's position.
    pub(crate) mean_of_points_m: Option<Point3<f64>>,
    /// The position of the nearest track.
    pub(crate) track_m: Option<Point3<f64>>,
}

/// The clouds of a run, for pictures; in the map.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Clouds {
    pub(crate) edge_m: f64,
    pub(crate) map: Vec<Point3<f32>>,
    pub(crate) without_removal: Vec<Point3<f32>>,
    pub(crate) empty_scene: Vec<Point3<f32>>,
    pub(crate) path: Vec<Point3<f32>>,
}

/// For each scan, how many beams met each object.
pub(crate) type BeamsOnObjects = BTreeMap<Stamp, BTreeMap<u16, usize>>;

impl RunFigures {
    /// The first object, of scenarios that have one.
    pub(crate) fn object(&self) -> Option<&ObjectFigures> {
        self.objects.first()
    }

    /// The cycles in which the image shows enough of any object.
    pub(crate) fn cycles_in_view(&self) -> impl Iterator<Item = &CycleFigures> {
        self.cycles.iter().enumerate().filter_map(|(index, cycle)| {
            let shows = |sighting: &Sighting| sighting.cycle == index && sighting.in_camera;
            self.objects.iter().any(|o| o.sightings.iter().any(shows)).then_some(cycle)
        })
    }

    /// So many cycles from the first one in which an object is in view: what the thesis takes for a run.
    pub(crate) fn cycles_from_entry(&self, count: usize) -> &[CycleFigures] {
        let in_view = |object: &ObjectFigures| {
            object.sightings.iter().find(|sighting| sighting.in_camera).map(|s| s.cycle)
        };
        let first = self.objects.iter().filter_map(in_view).min().unwrap_or(0);
        let end = (first + count).min(self.cycles.len());
        self.cycles.get(first..end).unwrap_or_default()
    }
}

impl ObjectFigures {
    /// Of the cycles in which both sensors have it, the share in which it was found; none without such a cycle.
    pub(crate) fn found_share(&self) -> Option<f64> {
        self.share_in_both(|sighting| sighting.found)
    }

    /// Of the same cycles, the share in which a zone held it or at least half of its pixels were removed. A zone
    /// is as wide as what the scanner meets; an object that goes out of the camera's view feet last is found by
    /// its track.
    pub(crate) fn found_or_removed_share(&self) -> Option<f64> {
        self.share_in_both(|sighting| sighting.found || sighting.removed)
    }

    /// Of the same cycles, the share in which at least half of its pixels were removed.
    pub(crate) fn removed_share(&self) -> Option<f64> {
        self.share_in_both(|sighting| sighting.removed)
    }

    fn share_in_both(&self, is: fn(&Sighting) -> bool) -> Option<f64> {
        let in_both = self.sightings.iter().filter(|sighting| sighting.in_both);
        let (found, all) = in_both.fold((0_usize, 0_usize), |(found, all), sighting| {
            (found + usize::from(is(sighting)), all + 1)
        });
        (all > 0).then(|| found as f64 / all as f64)
    }
}

impl CycleFigures {
    pub(crate) fn has_measured_zone(&self) -> bool {
        self.zones.iter().any(|zone| zone.is_measured)
    }
}

#[cfg(test)]
pub(crate) mod tests;
