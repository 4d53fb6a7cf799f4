//! Experiment 3: the deviation of each beam, with and without the robot (Rec-HV 3.1.3, 4.3).

use detection::DetectionConfig;
use detection::variability::VariabilityWindow;
use report::{Chart, Marks};
use simulator::{CrossingObject, PathName, Scenario, SceneName};

use super::charts::{Caption, chart, series};
use super::published::{CYCLES_OF_A_TEST, deviations as published};
use super::scans::{ForwardScan, for_scans, forward_scans};
use super::section::{Section, Shown, Words};
use super::settings::Settings;
use super::table::{Cell, Row, Table, Unit};
use robot::Failure;

/// The deviations of the beams of each cycle of a test.
struct Test {
    azimuths_deg: Vec<f64>,
    cycles_m: Vec<Vec<f32>>,
}

pub(crate) fn present(settings: &Settings) -> Result<Section, Failure> {
    let tests = |of: &dyn Fn(u64) -> Scenario| {
        settings.seeds().map(|seed| Test::of(&of(seed))).collect::<Result<Vec<_>, _>>()
    };
    let empty = |scene| {
        tests(&|seed| for_scans(Scenario::empty(scene, seed), CYCLES_OF_A_TEST + Test::WINDOW))
    };
    let robot =
        |scene| tests(&|seed| Scenario::crossing(scene, CrossingObject::Robot, PathName::A, seed));
    let (a_empty, a_robot) = (empty(SceneName::A)?, robot(SceneName::A)?);
    let (b_empty, b_robot) = (empty(SceneName::B)?, robot(SceneName::B)?);
    let metres = |value: f64| Cell::published(Unit::Metres, value);
    let ours =
        |tests: &[Test], of: fn(&Test) -> f64| Cell::median(Unit::Metres, tests.iter().map(of));
    let row = |name: &str, least: Cell, most: f64, tests: &[Test]| {
        let cells = [
            least,
            ours(tests, Test::least_m),
            metres(most),
            ours(tests, Test::largest_m),
            ours(tests, Test::largest_off_doorways_m),
        ];
        Row::new(name, cells)
    };
    let table = Table::new(
        "Least and largest deviation of a beam, n = 3",
        [
            "least published",
            "least here",
            "largest published",
            "largest here",
            "largest here, doorways left out",
        ],
        vec![
            row("A, empty", metres(published::A_EMPTY_M.0), published::A_EMPTY_M.1, &a_empty),
            row("A, robot crosses", Cell::Absent, published::A_ROBOT_MAX_M, &a_robot),
            row("B, empty", metres(published::B_EMPTY_M.0), published::B_EMPTY_M.1, &b_empty),
            row("B, robot crosses", Cell::Absent, published::B_ROBOT_MAX_M, &b_robot),
        ],
    );
    let charts = vec![
        envelope_chart("e03-a", "Scene A (as Figure 34 A and B)", &a_empty, &a_robot),
        envelope_chart("e03-b", "Scene B (as Figure 34 C and D)", &b_empty, &b_robot),
    ];
    let shown = Shown { tables: vec![table], charts, ..Shown::default() };
    Ok(Section::new(words(settings), shown))
}

fn words(settings: &Settings) -> Words {
    Words {
        key: "3",
        title: "3. Deviations of a still scene and of one with the robot",
        thesis: "The deviation of each beam over 3 scans in 25 cycles of scenes A and B, empty and with the robot \
                 on path A: its edges stand out, and from this comes the threshold of 0.4 m.",
        here: format!(
            "The same four tests in the simulator's scenes A and B, 25 cycles each (with the robot from its \
             first beam on), gaps filled as published, {}.",
            settings.seeds_text()
        ),
        comparability: "The largest deviation is that of a single beam, so it hangs on the distance of the walls, on \
                        the robot's depth and, in scene B, on beams that come and go on mirroring surfaces: only \
                        the order (empty below with the robot) can be compared. The simulator's rooms have \
                        doorways in their side walls, for what crosses, whose edges stand in the outermost beams \
                        of the aperture: a beam that meets now the edge and now the corridor behind it deviates \
                        in an empty room too, which the last column leaves out. free_space takes no deviation for \
                        motion.",
    }
}

impl Test {
    /// The thesis' n.
    const WINDOW: usize = 3;
    /// The simulator's scenes have doorways in their side walls, from 42 degrees outwards.
    const DOORWAYS_DEG: f64 = 40.0;

    /// The deviations of the first 25 cycles; where something moves, from the first beam that meets it.
    fn of(scenario: &Scenario) -> Result<Self, Failure> {
        let scans = forward_scans(scenario)?;
        let mut window = VariabilityWindow::new(Self::WINDOW);
        let has_object = !scenario.scene.objects.is_empty();
        let mut has_come = !has_object;
        let mut cycles_m = Vec::new();
        for scan in &scans {
            let Some(filled_m) = scan.filled_m() else { continue };
            window.push(filled_m);
            has_come |= scan.beams_on_objects() > 0;
            if let Some(statistics) = window.statistics().filter(|_| has_come) {
                cycles_m.push(statistics.std_dev_m);
            }
        }
        cycles_m.truncate(CYCLES_OF_A_TEST);
        let azimuths_deg =
            scans.first().map(|scan| ForwardScan::azimuths_deg(scan).collect()).unwrap_or_default();
        Ok(Self { azimuths_deg, cycles_m })
    }

    /// All deviations, each with its beam's azimuth.
    fn values(&self) -> impl Iterator<Item = (f64, f64)> {
        let of_cycle = |cycle| self.azimuths_deg.iter().copied().zip(cycle);
        let values = self.cycles_m.iter().flat_map(of_cycle);
        values.map(|(azimuth_deg, value_m): (f64, &f32)| (azimuth_deg, f64::from(*value_m)))
    }

    fn least_m(&self) -> f64 {
        self.values().map(|(_, value_m)| value_m).reduce(f64::min).unwrap_or(f64::NAN)
    }

    fn largest_m(&self) -> f64 {
        self.values().map(|(_, value_m)| value_m).reduce(f64::max).unwrap_or(f64::NAN)
    }

    /// The largest of the beams that do not pass the doorways in the side walls.
    fn largest_off_doorways_m(&self) -> f64 {
        let ahead = self.values().filter(|(azimuth_deg, _)| azimuth_deg.abs() < Self::DOORWAYS_DEG);
        ahead.map(|(_, value_m)| value_m).reduce(f64::max).unwrap_or(f64::NAN)
    }

    /// The largest of each beam.
    fn envelope(&self) -> Marks {
        let largest = |beam: usize| {
            let of_beam = self.cycles_m.iter().filter_map(|cycle| cycle.get(beam));
            f64::from(of_beam.copied().fold(0.0, f32::max))
        };
        let places = self.azimuths_deg.iter().enumerate();
        Marks::Line(places.map(|(beam, azimuth)| (*azimuth, largest(beam))).collect())
    }
}

/// Figure 34: 25 cycles in one line, that of the largest deviation of each beam.
fn envelope_chart(id: &str, title: &str, empty: &[Test], robot: &[Test]) -> Chart {
    let line = |tests: &[Test]| tests.first().map_or(Marks::Line(Vec::new()), Test::envelope);
    let threshold_m = DetectionConfig::default().min_std_dev_m;
    let azimuths = empty.first().map(|test| test.azimuths_deg.clone()).unwrap_or_default();
    let threshold = azimuths.iter().map(|azimuth| (*azimuth, threshold_m)).collect();
    chart(
        Caption {
            id,
            title,
            description: "The largest deviation of each beam in 25 cycles, seed 1, empty and while the robot \
                          crosses, and the threshold of 0.4 m.",
            x: "azimuth (degrees, left is positive)",
            y: "deviation (m)",
        },
        vec![
            series("threshold", "published", Marks::Line(threshold)),
            series("empty", "truth", line(empty)),
            series("robot crosses", "rec-hv", line(robot)),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_robot_stands_out_above_the_empty_scene_and_the_threshold() {
        let section = present(&Settings::quick()).unwrap();
        let off_doorways: Vec<f64> = section.tables[0]
            .rows
            .iter()
            .map(|row| match row.cells.last() {
                Some(Cell::Figure(figure)) => figure.median,
                other => panic!("{other:?}"),
            })
            .collect();
        let [a_empty, a_robot, b_empty, b_robot] = off_doorways[..] else {
            panic!("{off_doorways:?}")
        };
        assert!(a_empty < 0.1 && a_robot > 0.4 && b_robot > 0.4, "{off_doorways:?}");
        assert!(a_empty < b_empty && b_empty < b_robot, "{off_doorways:?}");
    }

    #[test]
    fn a_test_has_the_cycles_of_the_thesis() {
        let empty = for_scans(Scenario::empty(SceneName::A, 1), CYCLES_OF_A_TEST + Test::WINDOW);
        let test = Test::of(&empty).unwrap();
        assert_eq!((test.cycles_m.len(), test.azimuths_deg.len()), (CYCLES_OF_A_TEST, 90));
    }
}
