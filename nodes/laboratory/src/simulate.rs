//! `stillmap simulate`: a simulated scene as a bag, with its ground truth.

pub(crate) mod choice;
mod mesh_file;
mod messages;
mod scenario_name;
mod scenario_source;
mod sensors;
mod true_tracks;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use clap::Args;
use estimation::ScopedThreads;
use simulator::{Sample, Scenario};

use choice::ChoiceArgs;
use robot::sensor_bag::SensorBag;
use robot::{BagOutput, Failure, Interrupt, Outcome, Progress, console};
use sensors::SensorArgs;
use true_tracks::TrueTracks;

pub use mesh_file::read as read_mesh;

/// Arguments of `stillmap simulate`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap simulate demo --seed 7 -o room.mcap
  stillmap simulate --scene F --object three -o three.mcap
  stillmap simulate --scene B --pause 10 --platform sway --seed 3 -o pause.mcap
  stillmap simulate office --seed 2 -o office.mcap
  stillmap simulate walking-xyz -o walking-xyz.mcap
  stillmap simulate road --velodyne hdl64e -o road.mcap
  stillmap simulate --scene B --path D --colour --imu --wheels -o rail.mcap
  stillmap simulate scene.yaml -o scene.mcap

A scenario of one's own: nodes/laboratory/simulator/scenes/example.yaml shows all that one can say, and explains it; copy and change it.

Scenes (Table 2 of Rec-HV): A empty, B reflecting, C poorly reflecting, D open spaces to 6 m, E open and
bright with glass to 5 m, F clutter to 8 m, G glass to 6 m, H dark. With a scene of A to H the seed
varies side, moment, speed (5 %) and way of what crosses too, not only the noise.

Scenarios for odometry (office to rail) and for mapping (desk-xyz to dark) have a colour camera registered to the depth
camera and an inertial unit; every scene has them when asked. /truth/pose is the true pose of every colour image, and of the start
of every turn of the 3D scanner.")]
pub struct SimulateArgs {
    #[command(flatten)]
    choice: ChoiceArgs,
    #[command(flatten)]
    sensors: SensorArgs,
    /// Length of the recording; the times of the paths stay the same
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Offset of the depth camera's clock, ahead of the scanner's and the pose's
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    clock_skew_ms: Option<f64>,
    /// Standard deviation of the sensors' stamps
    #[arg(long, value_name = "MS")]
    jitter_ms: Option<f64>,
    /// Error of the scanner's published mount: standard deviations of its position and of its rotation
    #[arg(long, num_args = 2, value_names = ["M", "RAD"])]
    extrinsic_error: Option<Vec<f64>>,
    /// Noise of the published pose: standard deviations of its position and of its rotation
    #[arg(long, num_args = 2, value_names = ["M", "RAD"])]
    pose_noise: Option<Vec<f64>>,
    /// Columns and rows of the depth image, over the same field of view; fewer are faster
    #[arg(long, num_args = 2, value_names = ["COLUMNS", "ROWS"])]
    depth_size: Option<Vec<usize>>,
    #[command(flatten)]
    output: BagOutput,
}

pub(crate) fn run(args: &SimulateArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    args.output.check()?;
    write_bag(&scenario(args)?, args.output.path(), interrupt)
}

/// The chosen scenario, with these arguments applied.
fn scenario(args: &SimulateArgs) -> Result<Scenario, Failure> {
    let mut scenario = args.sensors.added_to(args.choice.scenario()?);
    if let Some([columns, rows]) = args.depth_size.as_deref() {
        scenario = scenario.with_depth_size(*columns, *rows);
    }
    if let Some(seconds) = args.seconds {
        scenario = scenario.with_duration_s(seconds);
    }
    if let Some([position_m, rotation_rad]) = args.pose_noise.as_deref() {
        scenario = scenario.with_pose_noise(*position_m, *rotation_rad);
    }
    if let Some([position_m, rotation_rad]) = args.extrinsic_error.as_deref() {
        scenario = scenario.with_mounting_error(*position_m, *rotation_rad);
    }
    if args.clock_skew_ms.is_some() || args.jitter_ms.is_some() {
        let seconds = |milliseconds: Option<f64>| milliseconds.unwrap_or_default() * 1e-3;
        scenario = scenario.with_stamp_errors(seconds(args.clock_skew_ms), seconds(args.jitter_ms));
    }
    Ok(scenario)
}

/// Simulates a scenario into a bag, until it is interrupted, which is reported.
pub fn write_bag(
    scenario: &Scenario,
    path: &Path,
    interrupt: &Interrupt,
) -> Result<Outcome, Failure> {
    let wrong = |error: simulator::ScenarioError| Failure::new(error.to_string());
    let samples = scenario.samples().map_err(wrong)?;
    let mut bag = SensorBag::create(path)?;
    bag.object_names(scenario.start, &object_names(scenario))?;
    bag.empty_scene(&scenario.static_scene_cloud().map_err(wrong)?)?;
    // The bar counts simulated milliseconds: the number of samples is not known beforehand.
    let progress = Progress::new("simulating", (scenario.duration_s * 1e3) as u64);
    let mut tracks = TrueTracks::default();
    for sample in samples.with_executor(Arc::new(ScopedThreads::of_machine())) {
        let at_s = sample.stamp().seconds_since(scenario.start);
        if interrupt.has_come() {
            bag.finish()?;
            progress.finish();
            console::note(format_args!(
                "interrupted: {} has {at_s:.1} s of {:.1} s",
                path.display(),
                scenario.duration_s
            ));
            return Ok(Outcome::Interrupted);
        }
        progress.set((at_s * 1e3) as u64);
        write_sample(&mut bag, &mut tracks, &sample)?;
    }
    bag.finish()?;
    progress.finish();
    Ok(Outcome::Complete)
}

fn write_sample(
    bag: &mut SensorBag,
    tracks: &mut TrueTracks,
    sample: &Sample,
) -> Result<(), Failure> {
    match sample {
        Sample::Pose(pose) => bag.pose(pose),
        Sample::CameraInfo { stamp, camera, .. } => bag.camera(camera, *stamp),
        Sample::Depth { image, labels } => {
            bag.depth(image)?;
            bag.labels(labels)
        }
        Sample::Scan { scan, labels } => {
            bag.scan(scan)?;
            bag.scan_labels(scan, labels)
        }
        Sample::TruePose(pose) => bag.true_pose(pose),
        Sample::ColourCameraInfo { stamp, frame_id, camera } => {
            bag.colour_camera(camera, *stamp, frame_id)
        }
        Sample::Colour(image) => bag.colour_image(image.stamp, &messages::image(image)),
        Sample::Imu(reading) => bag.imu(reading.stamp, &messages::imu(reading)),
        Sample::Wheels(reading) => bag.wheels(reading.stamp, &messages::odometry(reading)),
        Sample::Velodyne(turn) => {
            bag.velodyne(turn.stamp, &messages::velodyne(turn))?;
            messages::velodyne_labels(turn).map_or(Ok(()), |labels| bag.velodyne_labels(&labels))
        }
        Sample::ObjectPoses(poses) => bag.objects(poses.stamp, &tracks.of(poses)),
    }
}

fn object_names(scenario: &Scenario) -> BTreeMap<u16, String> {
    scenario.scene.objects.iter().map(|object| (object.id, object.name.clone())).collect()
}

#[cfg(test)]
mod tests;
