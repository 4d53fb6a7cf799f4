//! The report page of a drive.

use std::path::Path;

use report::{CellTone, Page, PageCell, PagePart, PageRow, PageSection, PageTable, page_html};

use super::findings::without_times;
use super::pictures::NamedPicture;
use super::road::RoadSummary;

/// The page.
pub(super) fn page(summary: &RoadSummary, pictures: Vec<NamedPicture>, recording: &Path) -> String {
    let odometry = &summary.odometry;
    let name =
        recording.file_name().unwrap_or(recording.as_os_str()).to_string_lossy().into_owned();
    let rate_hz = 1e3 / odometry.milliseconds_median.max(f64::MIN_POSITIVE);
    let mut lead = vec![
        format!(
            "{} of {} scans have a pose; the trajectory is {:.1} m long.",
            odometry.poses, odometry.scans, odometry.path_m
        ),
        format!(
            "The map has {} points, one in each cube of {} m.",
            summary.map_points, summary.map_voxel_edge_m
        ),
        format!(
            "A scan of {} points takes {:.1} ms: {rate_hz:.0} a second (the road thesis: 0.03).",
            odometry.points_median, odometry.milliseconds_median
        ),
    ];
    if odometry.closed_loops > 0 {
        lead.push(format!(
            "Loops closed: {}. The trajectory and the map are corrected for the drift.",
            odometry.closed_loops
        ));
    }
    if odometry.predicted > 0 {
        lead.push(format!(
            "{} poses are predictions, since their scans could not be registered; these scans are not in the map.",
            odometry.predicted
        ));
    }
    if odometry.after_a_gap > 0 {
        lead.push(format!(
            "Gaps in the scans: {}. The motion in them is not known, and the poses after them are where the scans fit the map best.",
            odometry.after_a_gap
        ));
    }
    lead.extend(
        odometry
            .last_trouble
            .iter()
            .map(|trouble| format!("Doubtful poses: {}; the last: {trouble}.", odometry.doubtful)),
    );
    if odometry.other_sectors > 0 {
        lead.push(format!(
            "Clouds that see another sector than the one before: {}. They are parts of turns, and the odometry needs whole ones.",
            odometry.other_sectors
        ));
    }
    if odometry.without_times > 0 {
        lead.push(format!("{}.", without_times(odometry)));
    }
    lead.extend(summary.losses.iter().map(|loss| format!("Lost: {loss}.")));
    let row = |name: &str, texts: Vec<String>| {
        let cell = |text| PageCell { text, tone: CellTone::Plain };
        PageRow { name: name.to_owned(), cells: texts.into_iter().map(cell).collect() }
    };
    let steps = odometry.steps_ms.iter().map(|(name, ms)| {
        let slow_ms = odometry.steps_p99_ms.get(name).copied().unwrap_or(*ms);
        row(name, vec![format!("{ms:.2}"), format!("{slow_ms:.2}")])
    });
    let table = |caption: &str, head: &[&str], rows| PageTable {
        caption: caption.to_owned(),
        columns: head.iter().map(|name| (*name).to_owned()).collect(),
        rows,
    };
    let causes = odometry.without_a_pose.iter();
    let causes = causes.map(|(cause, count)| row(cause, vec![count.to_string()]));
    let causes: Vec<PageRow> = causes.collect();
    let head = ["step", "median, ms", "99 of 100, ms"];
    let mut tables = vec![table("Times of a scan", &head, steps.collect())];
    if !causes.is_empty() {
        tables.push(table("Without a pose", &["cause", "scans"], causes));
    }
    let (mut trajectory, mut map, mut around) = (Vec::new(), Vec::new(), Vec::new());
    for NamedPicture { name, picture } in pictures {
        if name.starts_with("panorama") {
            around.push(PagePart::Pictures(vec![picture]));
        } else if name.starts_with("map") {
            map.push(PagePart::Pictures(vec![picture]));
        } else {
            trajectory.push(picture);
        }
    }
    let section = |id: &str, title: &str, parts| PageSection {
        id: id.to_owned(),
        title: title.to_owned(),
        parts,
    };
    page_html(&Page {
        kicker: "LiDAR odometry".to_owned(),
        title: format!("The drive of {name}"),
        facts: vec![
            ("recording".to_owned(), name),
            ("scans".to_owned(), odometry.scans.to_string()),
            (
                "times of points".to_owned(),
                odometry.point_times.clone().unwrap_or_else(|| "unknown".to_owned()),
            ),
            ("tiles kept in files".to_owned(), summary.map.spilled_tiles.to_string()),
        ],
        lead,
        sections: vec![
            section("trajectory", "The trajectory", vec![PagePart::Pictures(trajectory)]),
            section("map", "The map", map),
            section("around", "Panoramas", around),
            section("time", "Time", vec![PagePart::Tables(tables)]),
        ],
    })
}
