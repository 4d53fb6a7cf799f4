//! The tables of the road thesis, with ours beside them.

use super::StageMs;
use super::score::Figures;
use super::table::number;

/// A row of a published table and the variant that it is compared with.
struct Row {
    what: &'static str,
    variant: &'static str,
    milliseconds: Option<f64>,
    rms_2d_m: Option<f64>,
    rms_3d_m: Option<f64>,
    precision_percent: Option<f64>,
}

const fn row(
    what: &'static str,
    variant: &'static str,
    milliseconds: Option<f64>,
    [rms_2d_m, rms_3d_m, precision_percent]: [Option<f64>; 3],
) -> Row {
    Row { what, variant, milliseconds, rms_2d_m, rms_3d_m, precision_percent }
}

const NOTHING: [Option<f64>; 3] = [None; 3];

/// Tables 4.1 and 4.3 to 4.6; 4.2 is that of the stages. Those before 4.5 are of an HDL-32E on another drive, whose reference is the thesis' own estimate; 4.5
/// and 4.6 are of KITTI 07.
const TABLES: [(&str, &[Row]); 5] = [
    (
        "4.1, times of the algorithms (HDL-32E)",
        &[
            row("ICP", "icp", Some(35_107.0), NOTHING),
            row("JICP (of two clouds the same)", "icp", Some(36_811.0), NOTHING),
            row("GICP", "gicp-standing", Some(59_046.0), NOTHING),
        ],
    ),
    (
        "4.3, the guess (HDL-32E)",
        &[
            row("without", "gicp-standing", Some(59_046.0), NOTHING),
            row("with the previous motion", "gicp", Some(24_752.0), NOTHING),
        ],
    ),
    (
        "4.4, the filters (HDL-32E)",
        &[
            row(
                "22 of 32 rays",
                "gicp-rays-22",
                Some(38_608.96),
                [Some(4.46862), Some(39.0856), None],
            ),
            row(
                "18 of 32 rays",
                "gicp-rays-18",
                Some(32_032.61),
                [Some(5.37353), Some(43.7688), None],
            ),
            row(
                "14 of 32 rays",
                "gicp-rays-14",
                Some(24_825.81),
                [Some(2.01295), Some(29.9384), None],
            ),
            row(
                "10 of 32 rays",
                "gicp-rays-10",
                Some(18_135.29),
                [Some(2.20572), Some(4.07127), None],
            ),
            row(
                "6 of 32 rays",
                "gicp-rays-6",
                Some(11_192.09),
                [Some(3.54622), Some(23.2235), None],
            ),
            row(
                "intensity, mean +- sigma",
                "gicp-intensity-1",
                Some(18_950.43),
                [Some(1.23975), Some(19.2659), None],
            ),
            row("intensity, mean +- 1.5 sigma", "gicp-intensity-1.5", Some(12_402.23), NOTHING),
        ],
    ),
    (
        "4.5, KITTI 07",
        &[
            row(
                "GICP, intensity filter",
                "gicp-intensity",
                Some(35_426.0),
                [Some(1.756), Some(1.940), None],
            ),
            row("the same, ours", "ours", Some(35_426.0), [Some(1.756), Some(1.940), None]),
        ],
    ),
    (
        "4.6, KITTI 07",
        &[
            row("GICP, no filter", "gicp", Some(117_796.0), [None, Some(4.3059), Some(97.25)]),
            row(
                "GICP, intensity filter",
                "gicp-intensity",
                Some(35_426.0),
                [None, Some(1.9448), Some(99.09)],
            ),
        ],
    ),
];

/// Table 4.2: what a scan takes, stage by stage; and ours.
fn stages(of_ours: &StageMs, transform: Option<f64>) -> [(&'static str, f64, Option<f64>); 7] {
    [
        ("read, organise, keep", 106.89, of_ours.read),
        ("make the cloud", 6.11, of_ours.cloud),
        ("transform (GICP)", 59_046.28, transform),
        ("map", 66.70, of_ours.map),
        ("odometry (its drawing)", 2.15, of_ours.odometry),
        ("panoramas", 13.55, of_ours.panoramas),
        // Nothing waits for a viewer here.
        ("view", 82.08, None),
    ]
}

/// The lines of the tables: the thesis' figure, and ours of the variant.
pub(super) fn beside(figures: &[Figures], of_stages: &StageMs) -> Vec<String> {
    let mut lines = vec![
        "The thesis' tables, and ours on this recording (thesis -> ours); its times are of PCL, full clouds, one thread of 2018"
            .to_owned(),
    ];
    for (number_of_table, (title, rows)) in TABLES.into_iter().enumerate() {
        if number_of_table == 1 {
            lines.push("Table 4.2, times of the stages (HDL-32E)".to_owned());
            let ours = figures.iter().find(|one| one.name == "ours");
            let transform = ours.and_then(|one| one.milliseconds_mean);
            for (name, of_thesis, of_ours) in stages(of_stages, transform) {
                let ours = number(of_ours, 2);
                lines.push(format!("  {name:<30}{:<20}ms {of_thesis} -> {ours}", "ours"));
            }
        }
        lines.push(format!("Table {title}"));
        for row in rows {
            let ours = figures.iter().find(|one| one.name == row.variant);
            let pair = |of_thesis: Option<f64>, of_ours: Option<f64>, digits: usize| {
                format!("{} -> {}", number(of_thesis, digits), number(of_ours, digits))
            };
            let mut line = format!("  {:<30}{:<20}", row.what, row.variant);
            line += &format!(
                "ms {:<22}",
                pair(row.milliseconds, ours.and_then(|one| one.milliseconds_mean), 1)
            );
            for (name, of_thesis, of_ours) in [
                ("RMS 2D m", row.rms_2d_m, ours.and_then(|one| one.rms_2d_m)),
                ("RMS 3D m", row.rms_3d_m, ours.and_then(|one| one.rms_3d_m)),
                ("precision %", row.precision_percent, ours.and_then(|one| one.precision_percent)),
            ] {
                if of_thesis.is_some() {
                    line += &format!("  {name} {}", pair(of_thesis, of_ours, 3));
                }
            }
            lines.push(line);
        }
    }
    lines
}
