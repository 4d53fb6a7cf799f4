//! The figures of a trial, with the ground truth of its scenario.

use std::collections::BTreeMap;

use evaluation::{IdentityCycle, ReducedClouds, correlation, score_identities};
use geometry::{Track, ZoneSource};
use nalgebra::Point3;
use report::{CycleRecord, DynamicScore, ObjectCycleScore};
use simulator::{ObjectPose, Scenario};

use super::{
    BeamsOnObjects, Clouds, CycleFigures, LabelFigures, MapFigures, ObjectFigures, RunFigures,
    Sighting, ZoneFigures,
};
use crate::trial::{Trial, TrialCycle};

impl RunFigures {
    /// The figures of `trial`; its clouds are kept only for images.
    pub(crate) fn of(
        trial: Trial,
        scenario: &Scenario,
        beams: &BeamsOnObjects,
        reference_m: Option<&[Point3<f32>]>,
        keeps_clouds: bool,
    ) -> Self {
        let score = trial.score.as_ref();
        let record = &trial.record;
        let cycles = || record.cycles.iter().zip(&trial.cycles);
        let objects = scenario
            .scene
            .objects
            .iter()
            .map(|object| ObjectFigures {
                sightings: sightings(&trial, scenario, beams, object.id),
            })
            .collect();
        let edge_m = record.voxel_edge_m;
        let with_measured = |map_m| correlation(reference_m?, map_m, edge_m).ok();
        let in_view = in_view(score);
        let identities = cycles().map(|(record, cycle)| identity_cycle(record, cycle, &in_view));
        Self {
            scenario: trial.scenario_name.clone(),
            seed: trial.seed,
            method: trial.method,
            map: MapFigures {
                points: record.static_map.len(),
                points_without_removal: record.unfiltered_map.len(),
                correlation: trial.correlation,
                correlation_with_measured: with_measured(&record.static_map),
                lost_of_measured: reference_m
                    .and_then(|reference_m| lost(reference_m, &record.static_map, edge_m)),
                undisturbed_correlation_with_measured: with_measured(trial.undisturbed_map()),
                surface: score.and_then(|score| score.map.surface),
            },
            labels: score.map(LabelFigures::of),
            identity_switches: score_identities(identities).switches,
            dropped: record.drops.iter().map(|drop| drop.count).sum(),
            cycles: cycles()
                .map(|(record, cycle)| CycleFigures::of(record, cycle, scenario))
                .collect(),
            objects,
            clouds: keeps_clouds.then(|| Clouds::of(trial)),
        }
    }
}

/// The share of a reference's points from which a map has none within `edge_m`.
fn lost(reference_m: &[Point3<f32>], map_m: &[Point3<f32>], edge_m: f64) -> Option<f64> {
    let clouds = ReducedClouds { reference_m: reference_m.to_vec(), map_m: map_m.to_vec() };
    Some(1.0 - clouds.distance(edge_m).ok()?.recall)
}

impl LabelFigures {
    fn of(score: &DynamicScore) -> Self {
        Self {
            recall: score.labels.recall,
            precision: score.labels.precision,
            precision_with_borders: score.labels.precision_with_borders,
            static_points_removed: score.static_points.share,
            ghost_voxels: score.map.object_only_left,
        }
    }
}

impl CycleFigures {
    fn of(record: &CycleRecord, cycle: &TrialCycle, scenario: &Scenario) -> Self {
        Self {
            time_s: record.scan_stamp.seconds_since(scenario.start),
            zones: record
                .zones
                .iter()
                .map(|zone| ZoneFigures {
                    right_deg: zone.azimuth_min_rad.to_degrees(),
                    left_deg: zone.azimuth_max_rad.to_degrees(),
                    is_measured: zone.source == ZoneSource::Measured,
                })
                .collect(),
            points_in: record.points_in,
            reduced: record.counts.reduced,
            in_zone: record.counts.in_zone,
            dynamic: record.counts.dynamic,
            map_points: record.map_points,
            duration_ms: 1e3
                * record.step_durations_s.iter().map(|(_, time_s)| time_s).sum::<f64>(),
            correlation: cycle.correlation,
            rig_m: record.map_from_rig.translation.vector.into(),
        }
    }
}

impl Clouds {
    fn of(trial: Trial) -> Self {
        let position =
            |cycle: &CycleRecord| cycle.map_from_rig.translation.vector.cast::<f32>().into();
        Self {
            edge_m: trial.record.voxel_edge_m,
            path: trial.record.cycles.iter().map(position).collect(),
            map: trial.record.static_map,
            without_removal: trial.record.unfiltered_map,
            empty_scene: trial.empty_scene_m,
        }
    }
}

/// The scores of each object in each cycle, by the cycle's number and the object's label.
fn object_scores(score: Option<&DynamicScore>) -> BTreeMap<(u32, u16), ObjectCycleScore> {
    let objects = score.into_iter().flat_map(|score| &score.objects);
    objects
        .flat_map(|object| {
            object.per_cycle.iter().map(|cycle| ((cycle.index, object.object_id), *cycle))
        })
        .collect()
}

fn in_view(score: Option<&DynamicScore>) -> BTreeMap<(u32, u16), bool> {
    object_scores(score).into_iter().map(|(key, score)| (key, score.in_view)).collect()
}

fn sightings(trial: &Trial, scenario: &Scenario, beams: &BeamsOnObjects, id: u16) -> Vec<Sighting> {
    let scores = object_scores(trial.score.as_ref());
    trial
        .record
        .cycles
        .iter()
        .zip(&trial.cycles)
        .enumerate()
        .filter_map(|(index, (record, cycle))| {
            let score = scores.get(&(record.index, id))?;
            let pose = cycle.truth.objects.iter().find(|object| object.id == id)?;
            let true_m = pose.visible_centroid_m?;
            let beams = beams.get(&record.scan_stamp).and_then(|beams| beams.get(&id));
            Some(Sighting {
                cycle: index,
                time_s: record.scan_stamp.seconds_since(scenario.start),
                in_camera: score.in_view,
                in_both: score.in_view && beams.is_some_and(|beams| *beams > 0),
                found: score.found,
                removed: score.removed,
                points: score.points.points,
                points_removed: score.points.removed,
                azimuth_deg: score.azimuth_rad.to_degrees(),
                true_m,
                mean_of_points_m: mean_of_points_m(record),
                track_m: nearest_track(&cycle.tracks, &true_m).map(|track| track.position_m),
            })
        })
        .collect()
}

/// The mean of the points classified as dynamic, in the map frame.
fn mean_of_points_m(record: &CycleRecord) -> Option<Point3<f64>> {
    let points = &record.dynamic_points_m;
    let sum = points.iter().map(|point| point.coords.cast::<f64>()).sum::<nalgebra::Vector3<f64>>();
    (!points.is_empty()).then(|| record.map_from_rig * Point3::from(sum / points.len() as f64))
}

fn nearest_track<'t>(tracks: &'t [Track], to_m: &Point3<f64>) -> Option<&'t Track> {
    let apart_m = |track: &Track| (track.position_m - to_m).xy().norm();
    tracks.iter().min_by(|a, b| apart_m(a).total_cmp(&apart_m(b)))
}

fn identity_cycle(
    record: &CycleRecord,
    cycle: &TrialCycle,
    in_view: &BTreeMap<(u32, u16), bool>,
) -> IdentityCycle {
    let is_in_view =
        |object: &&ObjectPose| in_view.get(&(record.index, object.id)).is_some_and(|seen| *seen);
    let objects = cycle.truth.objects.iter().filter(is_in_view);
    IdentityCycle {
        objects: objects
            .filter_map(|object| Some((object.id, object.visible_centroid_m?)))
            .collect(),
        tracks: cycle.tracks.iter().map(|track| (track.id, track.position_m)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_of_the_map_is_lost_and_what_is_beside_the_reference_is_not() {
        let wall = |columns: std::ops::Range<i16>, off_m: f32| -> Vec<Point3<f32>> {
            let point = |column: i16, row: i16| {
                Point3::new(2.0 + off_m, 0.02 * f32::from(column), 0.02 * f32::from(row))
            };
            columns.flat_map(|column| (0..50).map(move |row| point(column, row))).collect()
        };
        let reference = wall(0..100, 0.0);
        assert_eq!(lost(&reference, &wall(0..100, 0.05), 0.08), Some(0.0));
        // 20 columns are missing, of which 4 on each side have a point within an edge.
        let holed = [wall(0..40, 0.0), wall(60..100, 0.0)].concat();
        let share = lost(&reference, &holed, 0.08).unwrap();
        assert!((share - 0.12).abs() < 0.011, "{share}");
        assert_eq!(lost(&reference, &[], 0.08), None);
    }

    #[test]
    fn the_nearest_track_is_that_in_the_plane() {
        let track = |id, x_m, z_m| Track {
            id,
            position_m: Point3::new(x_m, 0.0, z_m),
            velocity_m_per_s: nalgebra::Vector3::zeros(),
            extent_m: nalgebra::Vector3::zeros(),
            covariance: nalgebra::Matrix6::identity(),
            age_s: 0.0,
            unseen_cycles: 0,
        };
        let tracks = [track(1, 3.0, 0.0), track(2, 2.1, 5.0)];
        assert_eq!(nearest_track(&tracks, &Point3::new(2.0, 0.0, 0.0)).unwrap().id, 2);
        assert!(nearest_track(&[], &Point3::origin()).is_none());
    }
}
