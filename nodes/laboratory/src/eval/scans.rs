//! `stillmap eval scans`: detection on the scans of a bag alone, scored by labelled legs if there are any.

mod labels;

use std::fmt::Write;
use std::path::PathBuf;

use bag_player::{Bag, BagMessage, Selection};
use clap::{Args, ValueEnum};
use detection::{CycleInput, DetectionConfig, Detector, View};
use evaluation::{LabelledScan, ScanReturn, ScanZoneScore, score_scan_zones};
use geometry::{Cloud, PoseBuffer, Scan, Stamp, StampedPose, pose_from_vector};
use msgs::convert;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::LaserScan;
use nalgebra::{Isometry3, Point3};
use scan_odometry::{ScanOdometry, ScanOdometryConfig};
use serde::Serialize;

use labels::Labels;
use robot::console;
use robot::run::parameters::{ParameterArgs, PipelineParameters};
use robot::{Failure, Outcome, refuse_to_replace};

/// The frame of the poses that are not in the bag.
const ODOM_FRAME: &str = "odom";
/// The maximum number of poses of a bag: hours at a camera's rate.
const POSES_KEPT: usize = 1 << 20;

/// Arguments of `stillmap eval scans`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap eval scans people.mcap --scan /training_scan --labels /leg_cluster_positions --method free_space")]
pub struct ScansArgs {
    /// A bag (MCAP, sqlite3 or ROS 1, recognised by its content) or a rosbag2 folder
    bag: PathBuf,
    /// The LaserScan topic
    #[arg(long, value_name = "TOPIC")]
    scan: String,
    /// A PoseArray topic with the position of each leg, in the frame of the scan; a message without a stamp belongs to the
    /// scan that follows it in the bag
    #[arg(long, value_name = "TOPIC")]
    labels: Option<String>,
    /// Another bag with the labels, of the scan with the same stamp or, without a stamp, of the scan that follows
    #[arg(long, value_name = "BAG", requires = "labels")]
    labels_from: Option<PathBuf>,
    /// The source of the platform's pose
    #[arg(long, value_enum, default_value_t = Odometry::Still)]
    odometry: Odometry,
    /// Write the poses to this file, in the format of the TUM benchmark, for `stillmap eval trajectory`
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,
    /// The PoseStamped topic of `--odometry bag`
    #[arg(long, value_name = "TOPIC", default_value = "/pose")]
    pose: String,
    /// The used part of the scan, around its x axis
    #[arg(long, value_name = "DEGREES", default_value_t = 360.0)]
    aperture_deg: f64,
    #[command(flatten)]
    parameters: ParameterArgs,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// The source of the platform's pose.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
enum Odometry {
    /// The platform does not move
    Still,
    /// From a topic of the bag
    Bag,
    /// Scan odometry
    Scans,
}

/// The printed result.
#[derive(Serialize)]
struct Printed {
    method: &'static str,
    odometry: Odometry,
    #[serde(flatten)]
    score: ScanZoneScore,
    /// Scans that could not be used.
    unusable: usize,
    /// Messages of labels without a scan in the bag.
    labels_of_no_scan: usize,
}

pub(crate) fn run(args: &ScansArgs) -> Result<Outcome, Failure> {
    refuse_to_replace(args.poses.clone(), false, "--poses")?;
    let parameters = PipelineParameters::load(&args.parameters)?;
    let mut watch = Watch::new(args, &parameters)?;
    let bag = Bag::open(&args.bag).map_err(failure)?;
    let mut topics = vec![args.scan.clone()];
    topics.extend(args.labels.clone().filter(|_| args.labels_from.is_none()));
    if args.odometry == Odometry::Bag {
        topics.push(args.pose.clone());
    }
    let selection = Selection { topics: Some(topics), ..Selection::default() };
    for message in bag.messages(&selection).map_err(failure)? {
        watch.take(&message.map_err(failure)?)?;
    }
    watch.step_all();
    let labels_of_no_scan = watch.labels.left();
    let Watch { scans, unusable, trajectory, .. } = watch;
    if let Some(path) = &args.poses {
        std::fs::write(path, trajectory)
            .map_err(|error| Failure::new(format!("{}: {error}", path.display())))?;
    }
    if scans.is_empty() {
        return Err(Failure::new(format!("no scan on {} could be used", args.scan)));
    }
    let printed = Printed {
        method: parameters.pipeline().method.name(),
        odometry: args.odometry,
        score: score_scan_zones(&scans),
        unusable,
        labels_of_no_scan,
    };
    if args.json {
        console::print(serde_json::to_string_pretty(&printed).map_err(failure)?)?;
    } else {
        print(&printed)?;
    }
    Ok(if unusable == 0 && labels_of_no_scan == 0 {
        Outcome::Complete
    } else {
        Outcome::WithLosses
    })
}

/// Scan odometry with detection's configuration of the scanner.
fn scan_odometry(config: &DetectionConfig) -> Result<ScanOdometry, Failure> {
    let beam_order = config.free_space.beam_order;
    let config = ScanOdometryConfig { beam_order, ..ScanOdometryConfig::default() };
    ScanOdometry::new(config).map_err(failure)
}

fn failure(error: impl std::fmt::Display) -> Failure {
    Failure::new(error.to_string())
}

/// Detection on scans without clouds.
struct Watch<'a> {
    args: &'a ScansArgs,
    detector: Detector,
    rig_from_lidar: [f64; 6],
    poses: PoseBuffer,
    scan_odometry: ScanOdometry,
    /// Scans that wait for their pose.
    waiting: Vec<(Scan, Option<Vec<Point3<f64>>>)>,
    labels: Labels,
    scans: Vec<LabelledScan>,
    unusable: usize,
    first: Option<Stamp>,
    /// The poses, one line each.
    trajectory: String,
}

impl<'a> Watch<'a> {
    fn new(args: &'a ScansArgs, parameters: &PipelineParameters) -> Result<Self, Failure> {
        let mut config = parameters.detection().clone();
        config.aperture_rad = args.aperture_deg.to_radians();
        let rig_from_lidar = config.pipeline.rig.mounts().rig_from_lidar;
        let labels = match args.labels_from.as_deref().zip(args.labels.as_deref()) {
            Some((bag, topic)) => Labels::apart(rig_from_lidar, bag, topic)?,
            None => Labels::among(rig_from_lidar),
        };
        Ok(Self {
            args,
            rig_from_lidar: config.pipeline.rig.rig_from_lidar,
            poses: PoseBuffer::new(POSES_KEPT).with_max_gap_s(config.max_pose_gap_s),
            scan_odometry: scan_odometry(&config)?,
            detector: Detector::new(config).map_err(failure)?,
            waiting: Vec::new(),
            labels,
            scans: Vec::new(),
            unusable: 0,
            first: None,
            trajectory: String::new(),
        })
    }

    fn take(&mut self, message: &BagMessage) -> Result<(), Failure> {
        if message.is_on(&self.args.scan) {
            let scan = message.decode::<LaserScan>().map_err(failure)?;
            // The labels of an unusable scan are not those of the next one.
            let labels = self.labels.of(convert::stamp_from_time(scan.header.stamp));
            match convert::scan_from_message(&scan) {
                Ok(scan) => self.waiting.push((scan, labels)),
                Err(_) => self.unusable += 1,
            }
        } else if self.args.labels.as_deref().is_some_and(|topic| message.is_on(topic)) {
            // They belong to the scan that follows, whatever their stamps are.
            self.labels.take(message)?;
        } else {
            let pose = message.decode::<PoseStamped>().map_err(failure)?;
            // A pose out of order is not used.
            let _ = self.poses.push(convert::pose_from_message(&pose).map_err(failure)?);
        }
        if self.args.odometry != Odometry::Bag {
            self.step_all();
        }
        Ok(())
    }

    /// Processes the waiting scans.
    fn step_all(&mut self) {
        for (scan, labels) in std::mem::take(&mut self.waiting) {
            self.step(&scan, labels);
        }
    }

    /// The pose of the rig for a scan; `None` if it is not known.
    fn pose(&mut self, scan: &Scan) -> Option<StampedPose> {
        match self.args.odometry {
            Odometry::Still => Some(StampedPose {
                stamp: scan.stamp,
                frame_id: ODOM_FRAME.to_owned(),
                map_from_rig: Isometry3::identity(),
            }),
            Odometry::Bag => self.poses.at(scan.stamp).ok(),
            Odometry::Scans => {
                self.scan_odometry.step(scan).stamped_pose(&self.rig_from_lidar, ODOM_FRAME).ok()
            }
        }
    }

    fn step(&mut self, scan: &Scan, labels_in_rig_m: Option<Vec<Point3<f64>>>) {
        let Some(StampedPose { stamp, map_from_rig, .. }) = self.pose(scan) else {
            self.unusable += 1;
            return;
        };
        let ((secs, nanos), place) = (stamp.secs_nanos(), map_from_rig.translation.vector);
        let turn = map_from_rig.rotation.coords;
        // Writing to a string cannot fail.
        let _ = writeln!(
            self.trajectory,
            "{secs}.{nanos:09} {} {} {} {} {} {} {}",
            place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w
        );
        let nothing = Cloud { stamp, frame_id: String::new(), points_m: Vec::new() };
        let input = CycleInput {
            scan,
            view: View::PointsInCamera(&nothing),
            map_from_rig: &map_from_rig,
            map_frame_id: ODOM_FRAME,
        };
        let Ok(detected) = self.detector.step(&input, |_| ()) else {
            self.unusable += 1;
            return;
        };
        let rig_from_lidar = pose_from_vector(&self.rig_from_lidar);
        let moving = &detected.cycle.moving_beams;
        let returns = (0..scan.ranges_m.len()).filter_map(|index| {
            let range_m = f64::from(scan.measured_range_m(index)?);
            Some(ScanReturn {
                beam: index,
                range_m,
                in_rig_m: rig_from_lidar * scan.hit_m(index)?,
                is_removed: moving.binary_search_by_key(&(index as u32), |beam| beam.index).is_ok(),
            })
        });
        let returns = returns.collect();
        let first = *self.first.get_or_insert(scan.stamp);
        self.scans.push(LabelledScan {
            time_s: scan.stamp.seconds_since(first),
            map_from_rig,
            zones: detected.cycle.zones,
            labels_in_rig_m,
            returns,
        });
    }
}

fn print(printed: &Printed) -> Result<(), Failure> {
    let Printed { method, score, unusable, labels_of_no_scan, .. } = printed;
    let percent = |share: Option<f64>| {
        share.map_or("-".to_owned(), |share| format!("{:.1} %", 100.0 * share))
    };
    console::print(format_args!("method {method}: {} scans, {unusable} unusable", score.scans))?;
    console::print(format_args!(
        "{} of them with a zone ({}), {} zones",
        score.scans_with_zone,
        percent(score.zone_share()),
        score.zones
    ))?;
    if score.labels + score.empty_scans > 0 {
        console::print(format_args!(
            "{} labels, {} of them moving, {} of these in a zone ({}); {} zones in {} scans without \
             anybody",
            score.labels,
            score.moving_labels,
            score.moving_labels_in_zone,
            percent(score.found_share()),
            score.zones_in_empty_scans,
            score.empty_scans
        ))?;
        console::print(format_args!(
            "static_scan: {} moving legs, {} of them gone ({}); {} returns of the background, {} of them kept",
            score.moving_legs,
            score.moving_legs_removed,
            percent(score.removed_share()),
            score.background_returns,
            score
                .background_share()
                .map_or("-".to_owned(), |share| format!("{:.2} %", 100.0 * share))
        ))?;
    }
    if *labels_of_no_scan > 0 {
        console::print(format_args!(
            "{labels_of_no_scan} messages of labels belong to no scan of the bag"
        ))?;
    }
    Ok(())
}
