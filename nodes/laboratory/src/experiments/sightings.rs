//! All objects in all cycles that show them, as a CSV table: the data behind the figures of a run.

use nalgebra::Point3;

use super::figures::{RunFigures, Sighting};
use super::runs::Runs;

const COLUMNS: &str = "scenario,seed,method,object,cycle,time_s,in_camera,in_both,found,removed,points,\
                       points_removed,azimuth_deg,true_x_m,true_y_m,true_z_m,track_x_m,track_y_m,track_z_m,\
                       zones_deg";

/// A line for each sighting, after a header line. `object` is the index of the scene's object; a zone is its right and
/// left end; missing values are empty.
pub(crate) fn csv(runs: &Runs) -> String {
    let mut csv = COLUMNS.to_owned();
    csv.push('\n');
    for run in runs.figures() {
        for (object, figures) in run.objects.iter().enumerate() {
            for sighting in &figures.sightings {
                csv.push_str(&line(run, object, sighting));
            }
        }
    }
    csv
}

fn line(run: &RunFigures, object: usize, sighting: &Sighting) -> String {
    let zones = run.cycles.get(sighting.cycle).map(|cycle| {
        let zone =
            cycle.zones.iter().map(|zone| format!("{:.1}..{:.1}", zone.right_deg, zone.left_deg));
        zone.collect::<Vec<_>>().join(" ")
    });
    format!(
        "\"{}\",{},{},{object},{},{:.3},{},{},{},{},{},{},{:.2},{},{},{}\n",
        run.scenario.replace('"', "\"\""),
        run.seed,
        run.method.name(),
        sighting.cycle,
        sighting.time_s,
        sighting.in_camera,
        sighting.in_both,
        sighting.found,
        sighting.removed,
        sighting.points,
        sighting.points_removed,
        sighting.azimuth_deg,
        place(Some(&sighting.true_m)),
        place(sighting.track_m.as_ref()),
        zones.unwrap_or_default(),
    )
}

fn place(place_m: Option<&Point3<f64>>) -> String {
    place_m.map_or_else(
        || ",,".to_owned(),
        |place_m| format!("{:.3},{:.3},{:.3}", place_m.x, place_m.y, place_m.z),
    )
}

#[cfg(test)]
mod tests {
    use simulator::{Scenario, SceneName};

    use super::super::figures::tests::{run, sighting};
    use super::super::runs::Run;
    use super::*;

    #[test]
    fn each_sighting_is_a_line_with_every_column() {
        let figures = run(9, (3..7).map(sighting).collect());
        let runs = Runs::given([(Run::new(Scenario::empty(SceneName::A, 1)), vec![figures])]);
        let csv = csv(&runs);
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines.len(), 5);
        let columns = COLUMNS.split(',').count();
        for line in &lines[1..] {
            // The scenario's name may contain commas, so it is quoted.
            let (_, rest) = line.rsplit_once('"').unwrap();
            assert_eq!(rest.split(',').count(), columns, "{line}");
        }
        assert!(lines[1].contains(",,"), "a position that is not given is empty: {}", lines[1]);
    }
}
