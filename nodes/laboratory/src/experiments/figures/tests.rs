use super::*;

/// An object 2 m ahead that is visible and found in a cycle.
pub(crate) fn sighting(cycle: usize) -> Sighting {
    Sighting {
        cycle,
        time_s: cycle as f64 / 7.0,
        in_camera: true,
        in_both: true,
        found: true,
        removed: true,
        points: 100,
        points_removed: 100,
        azimuth_deg: 0.0,
        true_m: Point3::new(2.0, 0.0, 0.0),
        mean_of_points_m: None,
        track_m: None,
    }
}

/// A cycle in which nothing is found.
pub(crate) fn quiet_cycle(index: usize) -> CycleFigures {
    CycleFigures {
        time_s: index as f64 / 7.0,
        zones: Vec::new(),
        points_in: 300_000,
        reduced: 3_000,
        in_zone: 0,
        dynamic: 0,
        map_points: 3_000,
        duration_ms: 4.0,
        correlation: None,
        rig_m: Point3::origin(),
    }
}

/// A run of this many cycles without detections, with these sightings of one object.
pub(crate) fn run(cycles: usize, sightings: Vec<Sighting>) -> RunFigures {
    let map = MapFigures {
        points: 3_000,
        points_without_removal: 3_100,
        correlation: None,
        correlation_with_measured: None,
        lost_of_measured: Some(0.0),
        undisturbed_correlation_with_measured: None,
        surface: None,
    };
    RunFigures {
        scenario: "B, robot on path A".to_owned(),
        seed: 1,
        method: Method::FreeSpace,
        map,
        labels: None,
        identity_switches: 0,
        dropped: 0,
        cycles: (0..cycles).map(quiet_cycle).collect(),
        objects: vec![ObjectFigures { sightings }],
        clouds: None,
    }
}

#[test]
fn only_cycles_in_both_views_count_for_found() {
    let missed = Sighting { found: false, ..sighting(3) };
    let camera_only = Sighting { in_both: false, found: false, ..sighting(2) };
    let run = run(9, vec![camera_only, missed, sighting(4), sighting(5), sighting(6)]);
    assert_eq!(run.object().unwrap().found_share(), Some(0.75));
    let unseen = ObjectFigures { sightings: vec![camera_only] };
    assert_eq!(unseen.found_share(), None);
}

#[test]
fn a_run_of_the_thesis_begins_when_the_object_comes_into_view() {
    let too_little = Sighting { in_camera: false, ..sighting(1) };
    let run = run(9, vec![too_little, sighting(3), sighting(4)]);
    let times = |cycles: &[CycleFigures]| cycles.iter().map(|c| c.time_s * 7.0).collect::<Vec<_>>();
    assert_eq!(times(run.cycles_from_entry(3)), [3.0, 4.0, 5.0]);
    assert_eq!(run.cycles_from_entry(25).len(), 6);
    assert_eq!(run.cycles_in_view().count(), 2);
}
