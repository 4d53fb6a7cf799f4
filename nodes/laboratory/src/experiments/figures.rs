//! The figures of a trial: a few numbers per cycle instead of its clouds and labels.

mod of_trial;

use std::collections::BTreeMap;

use evaluation::Correlation;
use geometry::Stamp;
use nalgebra::Point3;
use report::CloudDistance;
use serde::Serialize;

use geometry::Method;

/// The results of one method on one scenario.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct RunFigures {
    pub(crate) scenario: String,
    pub(crate) seed: u64,
    pub(crate) method: Method,
    pub(crate) map: MapFigures,
    /// The classification of each point; `None` without labels.
    pub(crate) labels: Option<LabelFigures>,
    /// All objects together.
    pub(crate) identity_switches: usize,
    /// Inputs that were dropped in transit.
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
    /// The map of the same clouds without removal.
    pub(crate) points_without_removal: usize,
    /// The correlation with the true surface of the empty scene.
    pub(crate) correlation: Option<Correlation>,
    /// The correlation with the map that the same method measures of the empty scene, if the run has one to compare with.
    pub(crate) correlation_with_measured: Option<Correlation>,
    /// The share of that map's points that have no point of this map within one edge of the reduction's voxels.
    pub(crate) lost_of_measured: Option<f64>,
    /// The same for the map that the method measures of a scene without moving objects: these are two measurements of one
    /// scene, and so the most that any map can be expected to reach.
    pub(crate) undisturbed_correlation_with_measured: Option<Correlation>,
    /// The distance from the true surface, as in `stillmap run`.
    pub(crate) surface: Option<CloudDistance>,
}

/// The classification of the points as dynamic, and the dynamic points left in the map.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(crate) struct LabelFigures {
    pub(crate) recall: Option<f64>,
    /// Without the borders of one voxel.
    pub(crate) precision: Option<f64>,
    pub(crate) precision_with_borders: Option<f64>,
    /// The share of all static points that was removed.
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
    /// Points of the input, reduced, in a zone (PCL_ZD), classified as dynamic (PCL_Din).
    pub(crate) points_in: usize,
    pub(crate) reduced: usize,
    pub(crate) in_zone: usize,
    pub(crate) dynamic: usize,
    pub(crate) map_points: usize,
    /// The total time of its steps.
    pub(crate) duration_ms: f64,
    /// The correlation of the map so far with the empty scene.
    pub(crate) correlation: Option<Correlation>,
    /// The position of the rig.
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
    /// The cycles whose image shows a part of it.
    pub(crate) sightings: Vec<Sighting>,
}

/// An object in a cycle whose image shows a part of it. Positions in the map.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Sighting {
    /// The index of the cycle.
    pub(crate) cycle: usize,
    pub(crate) time_s: f64,
    /// Whether enough of it is in the image, by the rule of [`report::DynamicScoreRules`].
    pub(crate) in_camera: bool,
    /// Whether also a beam of the scanner's aperture hit it.
    pub(crate) in_both: bool,
    pub(crate) found: bool,
    pub(crate) removed: bool,
    /// The number of its points, and of those that were removed.
    pub(crate) points: u64,
    pub(crate) points_removed: u64,
    pub(crate) azimuth_deg: f64,
    /// The mean of its visible surface.
    pub(crate) true_m: Point3<f64>,
    /// The mean of all points classified as dynamic: the object's position by Rec-HV.
    pub(crate) mean_of_points_m: Option<Point3<f64>>,
    /// The position of the nearest track.
    pub(crate) track_m: Option<Point3<f64>>,
}

/// The clouds of a run in the map frame, for images.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Clouds {
    pub(crate) edge_m: f64,
    pub(crate) map: Vec<Point3<f32>>,
    pub(crate) without_removal: Vec<Point3<f32>>,
    pub(crate) empty_scene: Vec<Point3<f32>>,
    pub(crate) path: Vec<Point3<f32>>,
}

/// For each scan, the number of beams on each object.
pub(crate) type BeamsOnObjects = BTreeMap<Stamp, BTreeMap<u16, usize>>;

impl RunFigures {
    /// The first object, if the scenario has one.
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

    /// This many cycles from the first one with an object in view: a run in the thesis.
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
    /// The share of the cycles with it in both sensors in which it was found; `None` without such cycles.
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
