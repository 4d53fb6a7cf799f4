//! `stillmap bench tour`: an hour through a simulated building, with a bounded map: the time of a cycle
//! in each minute, and the memory of the cores.

pub(super) mod building;
mod drive;
mod minute;

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use reconstruction::shell::ReconstructionParameters;
use reconstruction::{AtMaxVoxels, Map, ReconstructionConfig};
use serde::Serialize;

use self::minute::MinuteRow;
use super::figures::FigureArgs;
use super::transport::machine::Machine;
use super::transport::table;
use geometry::{Method, PipelineConfig};
use robot::Progress;
use robot::run::parameters::method_parser;
use robot::{Failure, Outcome};

/// The longest accepted tour: a day.
const LONGEST_MINUTES: f64 = 1440.0;
/// The accepted relative difference between the cycle times of the last and the first minute.
const FLAT_WITHIN: f64 = 0.2;
/// A sixteenth of the pixels of a Kinect's 640 x 480 over the same field of view: the reduced clouds are about as large, and
/// an hour is simulated in some minutes.
const SIZE_PX: (usize, usize) = (160, 120);

/// Arguments of `stillmap bench tour`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap bench tour
  stillmap bench tour --at-max-voxels spill -o figures.json
  stillmap bench tour --minutes 5 --method free_space --map-edge 0.05 --max-map-blocks 5000 --json

The building is a corridor round a square of 28 m. A side takes a minute, and all sides look alike, so that one
minute may be compared with another. A cycle's cost is that of matching, detection, segmentation, the map and what a
listener to the map is told; the time in which the readings are simulated is not in it.")]
pub struct TourArgs {
    /// The duration of the tour
    #[arg(long, default_value_t = 60.0, value_parser = minutes)]
    minutes: f64,
    /// The methods, one after the other
    #[arg(long, value_parser = method_parser(), num_args = 1.., default_values = ["rec_hv", "free_space"])]
    method: Vec<Method>,
    /// With rec_hv: the maximum number of the map's voxels; more are refused
    #[arg(long, default_value_t = ReconstructionConfig::default().max_voxels)]
    max_voxels: usize,
    /// With free_space: edge of the map's voxels in metres
    #[arg(long, default_value_t = PipelineConfig::default().map_edge_m, value_name = "METRES")]
    map_edge: f64,
    /// With free_space: the maximum number of the map's blocks of 8 voxels an axis; at 2 cm the building has some three times as
    /// many
    #[arg(long, default_value_t = 20_000)]
    max_map_blocks: usize,
    /// With free_space: what happens at that number
    #[arg(long, value_enum, default_value_t = AtMaxVoxelsName::DropOldest)]
    at_max_voxels: AtMaxVoxelsName,
    /// With spill: the folder of the tiles, in which a temporary one is created and removed at the end [default: the system's for
    /// temporary files]
    #[arg(long, value_name = "DIR")]
    spill_folder: Option<PathBuf>,
    /// With spill: the edge of a tile in metres
    #[arg(long, default_value_t = 2.0)]
    spill_tile_edge: f64,
    /// Use depth images of the full 640 x 480 pixels
    #[arg(long)]
    full_images: bool,
    #[command(flatten)]
    figures: FigureArgs,
}

/// The action at a full map, as an argument.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum, Serialize)]
#[value(rename_all = "snake_case")]
#[serde(rename_all = "snake_case")]
enum AtMaxVoxelsName {
    /// New blocks are refused
    Refuse,
    /// Blocks not seen for the longest time are dropped
    DropOldest,
    /// Tiles out of view for the longest time are written to files, and read back
    Spill,
}

impl TourArgs {
    fn size_px(&self) -> (usize, usize) {
        if self.full_images { (640, 480) } else { SIZE_PX }
    }

    /// The configuration of the map; the other parameters are those of `config`.
    fn map(&self, mut config: ReconstructionConfig) -> Result<Map, Failure> {
        let at_max_voxels = match (config.pipeline.method, self.at_max_voxels) {
            (Method::RecHv, _) | (_, AtMaxVoxelsName::Refuse) => AtMaxVoxels::Refuse,
            (_, AtMaxVoxelsName::DropOldest) => AtMaxVoxels::DropOldest,
            (_, AtMaxVoxelsName::Spill) => AtMaxVoxels::Spill,
        };
        config.pipeline.map_edge_m = self.map_edge;
        let parameters = ReconstructionParameters {
            spill_folder: self.spill_folder(),
            config: ReconstructionConfig {
                max_voxels: self.max_voxels,
                max_map_blocks: self.max_map_blocks,
                at_max_voxels,
                spill_tile_edge_m: self.spill_tile_edge,
                ..config
            },
            ..ReconstructionParameters::default()
        };
        reconstruction::shell::empty_map(&parameters).map_err(failure)
    }

    fn spill_folder(&self) -> String {
        let folder = self.spill_folder.clone().unwrap_or_else(std::env::temp_dir);
        folder.to_string_lossy().into_owned()
    }
}

/// The report.
#[derive(Debug, Serialize)]
struct Report {
    machine: Machine,
    max_voxels: usize,
    map_edge_m: f64,
    max_map_blocks: usize,
    at_max_voxels: AtMaxVoxelsName,
    methods: Vec<MethodReport>,
}

/// The results of one method.
#[derive(Debug, Serialize)]
struct MethodReport {
    method: Method,
    /// Absent for less than two minutes.
    flatness: Option<Flatness>,
    minutes: Vec<MinuteRow>,
}

/// The last whole minute compared with the first one: medians of the cycle times.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Flatness {
    wall_ratio: f64,
    cpu_ratio: f64,
    /// Whether the CPU time is within 20 %. Wall time depends on the load of the machine.
    is_flat: bool,
}

pub(crate) fn run(args: &TourArgs) -> Result<Outcome, Failure> {
    args.figures.check()?;
    let mut methods = Vec::new();
    for &method in &args.method {
        let progress = Progress::new(method.name(), args.minutes.ceil() as u64);
        let minutes = drive::drive(args, method, &progress)?;
        progress.finish();
        methods.push(MethodReport { method, flatness: flatness(&minutes), minutes });
    }
    let report = Report {
        machine: Machine::here(),
        max_voxels: args.max_voxels,
        map_edge_m: args.map_edge,
        max_map_blocks: args.max_map_blocks,
        at_max_voxels: args.at_max_voxels,
        methods,
    };
    args.figures.tell(&report, &report.machine, report.methods.iter().map(text))?;
    Ok(Outcome::Complete)
}

fn flatness(minutes: &[MinuteRow]) -> Option<Flatness> {
    let [first, .., last] = minutes else { return None };
    let cpu_ratio = last.cpu_median_ms / first.cpu_median_ms;
    Some(Flatness {
        wall_ratio: last.wall_median_ms / first.wall_median_ms,
        cpu_ratio,
        is_flat: (cpu_ratio - 1.0).abs() <= FLAT_WITHIN,
    })
}

/// The table of a method, and its summary line.
fn text(report: &MethodReport) -> String {
    let mut lines = vec![
        [
            "minute",
            "cycles",
            "median ms",
            "p99 ms",
            "max ms",
            "CPU ms",
            "detection",
            "segmentation",
            "map",
            "voxels",
            "dropped",
            "tiles read",
            "map MB",
            "evidence",
            "tracks",
            "RSS MB",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    lines.extend(report.minutes.iter().map(line));
    let sum = match report.flatness {
        None => "a tour of less than two minutes is too short to compare the times".to_owned(),
        Some(Flatness { wall_ratio, cpu_ratio, is_flat }) => format!(
            "last minute against the first: {cpu_ratio:.2} by the processor's time, {wall_ratio:.2} by the wall's; \
             {} within 20 %",
            if is_flat { "flat" } else { "NOT flat" }
        ),
    };
    format!("{}\n{}{sum}", report.method.name(), table::render(&lines))
}

fn line(row: &MinuteRow) -> Vec<String> {
    let megabytes = |bytes: f64| format!("{:.1}", bytes / 1e6);
    let counts = &row.counts;
    vec![
        row.minute.to_string(),
        row.cycles.to_string(),
        format!("{:.2}", row.wall_median_ms),
        format!("{:.2}", row.wall_p99_ms),
        format!("{:.2}", row.wall_max_ms),
        format!("{:.2}", row.cpu_median_ms),
        format!("{:.2}", row.detection_median_ms),
        format!("{:.2}", row.segmentation_median_ms),
        format!("{:.2}", row.map_median_ms),
        counts.voxels.to_string(),
        row.dropped_voxels.to_string(),
        counts.spill.map_or_else(|| "-".to_owned(), |spill| spill.read.to_string()),
        megabytes(counts.map_bytes as f64),
        counts.evidence_blocks.to_string(),
        row.most_tracks.to_string(),
        counts.rss_bytes.map_or_else(|| "-".to_owned(), |bytes| megabytes(bytes as f64)),
    ]
}

pub(super) fn minutes(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(minutes) if minutes > 0.0 && minutes <= LONGEST_MINUTES => Ok(minutes),
        _ => Err(format!("accepted are minutes above 0, up to {LONGEST_MINUTES}")),
    }
}

fn failure(error: impl std::fmt::Display) -> Failure {
    Failure::new(error.to_string())
}

#[cfg(test)]
mod tests {
    use super::minute::tests::a_minute;
    use super::*;

    #[test]
    fn the_cost_is_flat_within_a_fifth() {
        for (last_ms, is_flat) in [(11.9, true), (12.1, false), (8.1, true), (7.9, false)] {
            let minutes = [a_minute(1, 10.0), a_minute(2, 99.0), a_minute(3, last_ms)];
            assert_eq!(flatness(&minutes).unwrap().is_flat, is_flat, "{last_ms}");
        }
        assert_eq!(flatness(&[a_minute(1, 10.0)]), None);
    }

    #[test]
    fn a_short_tour_counts_every_cycle_and_keeps_the_bound() {
        let args = TourArgs {
            minutes: 0.04,
            method: vec![Method::FreeSpace],
            max_voxels: 500,
            map_edge: 0.1,
            max_map_blocks: 50,
            at_max_voxels: AtMaxVoxelsName::DropOldest,
            spill_folder: None,
            spill_tile_edge: 2.0,
            full_images: false,
            figures: FigureArgs::default(),
        };
        let progress = Progress::new("tour", 1);
        let rows = drive::drive(&args, Method::FreeSpace, &progress).unwrap();
        let [row] = &rows[..] else { panic!("{} minutes", rows.len()) };
        // 2.4 s at 7 Hz, without those at the end whose image or pose would be later.
        assert!((14..=16).contains(&row.cycles), "{row:?}");
        assert_eq!(row.scans_dropped, 0);
        // No more points than the voxels at the faces of the blocks.
        assert!((100..50 * 128).contains(&row.counts.voxels), "{row:?}");
        assert!(row.dropped_voxels > 0 && row.counts.evidence_blocks > 100, "{row:?}");
        let report = MethodReport { method: Method::FreeSpace, flatness: None, minutes: rows };
        assert!(text(&report).contains("too short to compare"));
    }

    #[test]
    fn a_tour_has_a_length() {
        assert_eq!(minutes("0.5"), Ok(0.5));
        for bad in ["0", "-1", "nan", "1441", "long"] {
            assert!(minutes(bad).is_err(), "{bad}");
        }
    }
}
