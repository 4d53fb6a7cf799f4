//! The sources of scans: a bag, a capture of packets, or a folder of KITTI's scans. All yield clouds as a driver publishes them.

mod bag;
mod other_drivers;

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use bag_player::{Bag, BagError};
use clap::Args;
use lidar_odometry::capture::CaptureReader;
use lidar_odometry::packets::{Calibration, DATA_PORT, DecodeError, DecoderConfig};
use lidar_odometry::revolution::{BuiltRevolution, RevolutionAssembly, RevolutionConfig};
use msgs::convert::message_from_revolution;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{Imu, PointCloud2};
use nalgebra::Isometry3;

use self::bag::BagSource;
use crate::failure::Failure;
use crate::import::kitti::Sequence;
use crate::interrupt::Interrupt;

/// The options of a LiDAR's recording.
#[derive(Args, Clone, Debug, Default)]
pub struct LidarArgs {
    /// The LiDAR's topic (PointCloud2 or VelodyneScan), where the bag has several
    #[arg(long, value_name = "TOPIC")]
    lidar: Option<String>,
    /// The calibration of the scanner whose packets are read: YAML of velodyne_pointcloud
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
}

impl LidarArgs {
    /// Whether no option is given.
    pub fn is_empty(&self) -> bool {
        self.lidar.is_none() && self.calibration.is_none()
    }
}

/// A recorded message.
pub enum Sensed {
    /// A scan.
    Cloud(PointCloud2),
    /// A reading of the inertial unit.
    Imu(Box<Imu>),
    /// The odometry of the wheels.
    Wheels(Box<Odometry>),
    /// The true pose of the vehicle.
    Truth(geometry::Stamp, Isometry3<f64>),
}

/// A recording of a LiDAR.
pub enum LidarSource {
    /// A bag.
    Bag(Box<BagSource>),
    /// A capture of packets.
    Capture(PathBuf, Box<DecoderConfig>),
    /// Scans of KITTI or KITTI-360.
    Sequence(Box<Sequence>),
}

/// Parts of a recording that could not be read.
pub(crate) type Losses = Vec<String>;

/// The first bytes of pcap files (both orders, both units) and of pcapng.
const CAPTURE_MAGICS: [[u8; 4]; 5] = [
    [0xd4, 0xc3, 0xb2, 0xa1],
    [0xa1, 0xb2, 0xc3, 0xd4],
    [0x4d, 0x3c, 0xb2, 0xa1],
    [0xa1, 0xb2, 0x3c, 0x4d],
    [0x0a, 0x0d, 0x0d, 0x0a],
];

impl LidarSource {
    /// Opens the recording at a path, of whatever kind it is.
    pub fn open(path: &Path, args: &LidarArgs) -> Result<Self, Failure> {
        Self::open_while(path, args, &Interrupt::default())
    }

    /// The same, unless a signal comes while a bag is unpacked or converted.
    pub(crate) fn open_while(
        path: &Path,
        args: &LidarArgs,
        interrupt: &Interrupt,
    ) -> Result<Self, Failure> {
        let decoder = decoder(args)?;
        if is_capture(path) {
            return Ok(Self::Capture(path.to_owned(), Box::new(decoder)));
        }
        if Sequence::is_one(path) {
            return Ok(Self::Sequence(Box::new(Sequence::open(path, None, None)?)));
        }
        let bag = Bag::open_while(path, &|| !interrupt.has_come()).map_err(|error| match error {
            BagError::Interrupted { .. } => Failure::interruption(error.to_string()),
            error => Failure::new(error.to_string()).fix(
                "a LiDAR is read from a bag, a capture (pcap, pcapng), or a folder of KITTI's scans",
            ),
        })?;
        let info = bag.info().map_err(|error| Failure::new(error.to_string()))?;
        Ok(Self::Bag(Box::new(BagSource::choose(bag, &info, args, decoder)?)))
    }

    /// Whether the recording at a path is not a bag, so that it is a LiDAR's.
    pub fn is_no_bag(path: &Path) -> bool {
        is_capture(path) || Sequence::is_one(path)
    }

    /// Whether it has true poses.
    pub fn has_truth(&self) -> bool {
        match self {
            Self::Bag(source) => source.has_truth(),
            Self::Capture(..) => false,
            Self::Sequence(sequence) => {
                (0..sequence.len()).any(|index| sequence.true_pose(index).is_some())
            }
        }
    }

    /// About how many messages there are, for the progress bar.
    pub fn steps(&self) -> u64 {
        match self {
            Self::Bag(source) => source.messages,
            Self::Capture(..) => 0,
            Self::Sequence(sequence) => sequence.len() as u64,
        }
    }

    /// The name of the input, for messages.
    pub fn name(&self) -> String {
        match self {
            Self::Bag(source) => format!("topic {}", source.topic),
            Self::Capture(..) => "packets of a Velodyne".to_owned(),
            Self::Sequence(_) => "scans of KITTI".to_owned(),
        }
    }

    /// Calls `take` with all recorded messages in their order, until it is interrupted.
    pub fn each(
        &self,
        interrupt: &Interrupt,
        mut take: impl FnMut(Sensed) -> Result<(), Failure>,
    ) -> Result<Losses, Failure> {
        match self {
            Self::Bag(source) => source.each(interrupt, &mut take),
            Self::Capture(path, decoder) => capture(path, decoder, interrupt, &mut take),
            Self::Sequence(sequence) => {
                for index in 0..sequence.len() {
                    if interrupt.has_come() {
                        break;
                    }
                    let revolution = sequence.revolution(index)?;
                    if let Some(pose) = sequence.true_pose(index) {
                        take(Sensed::Truth(revolution.stamp, pose))?;
                    }
                    take(Sensed::Cloud(message_from_revolution(&revolution)))?;
                }
                Ok(Losses::new())
            }
        }
    }
}

fn is_capture(path: &Path) -> bool {
    // Opening a pipe waits for who writes into it.
    if !path.is_file() {
        return false;
    }
    let mut magic = [0; 4];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut magic));
    read.is_ok() && CAPTURE_MAGICS.contains(&magic)
}

fn decoder(args: &LidarArgs) -> Result<DecoderConfig, Failure> {
    let Some(path) = &args.calibration else { return Ok(DecoderConfig::default()) };
    let text = std::fs::read_to_string(path)
        .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))?;
    let calibration = Calibration::from_yaml(&text)
        .map_err(|error| Failure::new(error.to_string()).within(path.display()))?;
    Ok(DecoderConfig { calibration: Some(calibration), ..DecoderConfig::default() })
}

fn assembly(decoder: &DecoderConfig) -> Result<RevolutionAssembly, Failure> {
    RevolutionAssembly::new(decoder.clone(), RevolutionConfig::default())
        .map_err(|error| Failure::new(error.to_string()))
}

/// A cloud of a whole revolution; incomplete ones are left out.
fn cloud_of(built: Option<BuiltRevolution>) -> Option<Sensed> {
    let built = built.filter(BuiltRevolution::is_whole)?;
    Some(Sensed::Cloud(message_from_revolution(&built.revolution)))
}

fn packet_losses(assembly: &RevolutionAssembly) -> Losses {
    let counts = assembly.counts();
    let mut losses = Losses::new();
    if counts.losses.lost > 0 {
        losses.push(format!("{} packets are missing by the scanner's clock", counts.losses.lost));
    }
    if let Some(error) = counts.last_refusal {
        losses.push(format!("{} packets could not be decoded: {error}", counts.refused));
    }
    losses
}

/// Why a capture has no scan: none of its packets could be decoded.
pub(crate) fn nothing_decoded(
    refusal: Option<DecodeError>,
    broken: Option<String>,
    (data_port, other_port): (u16, Option<u16>),
) -> Failure {
    let none = || Failure::new(format!("no data packet of a Velodyne on UDP port {data_port}"));
    match (refusal, broken, other_port) {
        (Some(refusal), ..) => {
            Failure::new(format!("no data packet could be decoded: {refusal}")).fix(
                "`stillmap import velodyne` has --model, --calibration and --data-port; the driver of another LiDAR makes clouds of it, \
                 which are read from a bag",
            )
        }
        (None, Some(broken), _) => Failure::new(broken),
        (None, None, Some(port)) => none().fix(format!(
            "there are datagrams to port {port}: `stillmap import velodyne CAPTURE --data-port {port} -o BAG` if they are a Velodyne's; the \
             driver of another LiDAR makes clouds of them, which are read from a bag"
        )),
        (None, None, None) => none().fix("is it a capture of a Velodyne?"),
    }
}

fn capture(
    path: &Path,
    decoder: &DecoderConfig,
    interrupt: &Interrupt,
    take: &mut impl FnMut(Sensed) -> Result<(), Failure>,
) -> Result<Losses, Failure> {
    let mut assembly = assembly(decoder)?;
    let file = File::open(path)
        .map_err(|error| Failure::new(format!("cannot open {}: {error}", path.display())))?;
    let mut reader = CaptureReader::new(file)
        .map_err(|error| Failure::new(error.to_string()).within(path.display()))?;
    let (mut broken, mut other_port) = (None, None);
    for next in reader.by_ref() {
        if interrupt.has_come() {
            break;
        }
        match next {
            Ok(datagram) if datagram.port == DATA_PORT => {
                let ended = assembly.push(&datagram.payload, datagram.arrival);
                cloud_of(ended).map_or(Ok(()), &mut *take)?;
            }
            Ok(datagram) => {
                other_port.get_or_insert(datagram.port);
            }
            Err(error) => {
                broken = Some(error.to_string());
                break;
            }
        }
    }
    cloud_of(assembly.finish()).map_or(Ok(()), &mut *take)?;
    if assembly.counts().losses.packets == 0 && !interrupt.has_come() {
        let refusal = assembly.counts().last_refusal;
        let failure = nothing_decoded(refusal, broken, (DATA_PORT, other_port));
        return Err(failure.within(path.display()));
    }
    let mut losses = packet_losses(&assembly);
    losses.extend(broken);
    if reader.counts().cut_off {
        losses.push("the capture ends within a frame".to_owned());
    }
    Ok(losses)
}
