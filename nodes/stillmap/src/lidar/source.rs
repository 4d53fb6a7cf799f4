//! Where scans come from: a bag, a capture of packets, or a folder of KITTI's scans. All become clouds as a driver publishes them.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use bag_player::{Bag, BagInfo, Selection};
use clap::Args;
use lidar_odometry::capture::CaptureReader;
use lidar_odometry::packets::{Calibration, DATA_PORT, DecoderConfig};
use lidar_odometry::revolution::{BuiltRevolution, RevolutionAssembly, RevolutionConfig};
use msgs::convert::{self, message_from_revolution, stamp_from_time};
use msgs::geometry_msgs::PoseStamped;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{Imu, PointCloud2};
use msgs::velodyne_msgs::VelodyneScan;
use msgs::{RosMessage, std_msgs};
use nalgebra::Isometry3;

use crate::failure::Failure;
use crate::import::kitti::Sequence;
use crate::sensor_bag;

/// What of a LiDAR's recording the user names.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct LidarArgs {
    /// The LiDAR's topic (PointCloud2 or VelodyneScan), where the bag has several
    #[arg(long, value_name = "TOPIC")]
    lidar: Option<String>,
    /// The calibration of the scanner whose packets are read: YAML of velodyne_pointcloud
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
}

impl LidarArgs {
    /// Whether the user names none.
    pub(crate) fn is_empty(&self) -> bool {
        self.lidar.is_none() && self.calibration.is_none()
    }
}

/// What was recorded.
pub(crate) enum Sensed {
    /// A scan.
    Cloud(PointCloud2),
    /// A reading of the inertial unit.
    Imu(Box<Imu>),
    /// What the wheels tell.
    Wheels(Box<Odometry>),
    /// Where the vehicle truly was.
    Truth(geometry::Stamp, Isometry3<f64>),
}

/// A recording of a LiDAR.
pub(crate) enum LidarSource {
    /// A bag.
    Bag(Box<BagSource>),
    /// A capture of packets.
    Capture(PathBuf, Box<DecoderConfig>),
    /// Scans of KITTI or KITTI-360.
    Sequence(Box<Sequence>),
}

/// The topics of a bag.
pub(crate) struct BagSource {
    bag: Bag,
    topic: String,
    messages: u64,
    is_packets: bool,
    imu: Option<String>,
    wheels: Option<String>,
    truth: Option<String>,
    decoder: DecoderConfig,
}

/// What of a recording could not be read.
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
    /// Finds out what a path holds.
    pub(crate) fn open(path: &Path, args: &LidarArgs) -> Result<Self, Failure> {
        let decoder = decoder(args)?;
        if is_capture(path) {
            return Ok(Self::Capture(path.to_owned(), Box::new(decoder)));
        }
        if Sequence::is_one(path) {
            return Ok(Self::Sequence(Box::new(Sequence::open(path, None, None)?)));
        }
        let bag = Bag::open(path).map_err(|error| {
            Failure::new(error.to_string()).mend(
                "a LiDAR is read from a bag (MCAP or rosbag2), a capture (pcap, pcapng), or a folder of KITTI's scans",
            )
        })?;
        let info = bag.info().map_err(|error| Failure::new(error.to_string()))?;
        Ok(Self::Bag(Box::new(BagSource::choose(bag, &info, args, decoder)?)))
    }

    /// Whether a path can only be a LiDAR's: no bag.
    pub(crate) fn is_no_bag(path: &Path) -> bool {
        is_capture(path) || Sequence::is_one(path)
    }

    /// About how many messages there are, for somebody who waits.
    pub(crate) fn steps(&self) -> u64 {
        match self {
            Self::Bag(source) => source.messages,
            Self::Capture(..) => 0,
            Self::Sequence(sequence) => sequence.len() as u64,
        }
    }

    /// What is read, in words.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Bag(source) => format!("topic {}", source.topic),
            Self::Capture(..) => "packets of a Velodyne".to_owned(),
            Self::Sequence(_) => "scans of KITTI".to_owned(),
        }
    }

    /// Hands on all that was recorded, in its order.
    pub(crate) fn each(
        &self,
        mut take: impl FnMut(Sensed) -> Result<(), Failure>,
    ) -> Result<Losses, Failure> {
        match self {
            Self::Bag(source) => source.each(&mut take),
            Self::Capture(path, decoder) => capture(path, decoder, &mut take),
            Self::Sequence(sequence) => {
                for index in 0..sequence.len() {
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

/// Parts of a turn are none.
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

fn capture(
    path: &Path,
    decoder: &DecoderConfig,
    take: &mut impl FnMut(Sensed) -> Result<(), Failure>,
) -> Result<Losses, Failure> {
    let mut assembly = assembly(decoder)?;
    let file = File::open(path)
        .map_err(|error| Failure::new(format!("cannot open {}: {error}", path.display())))?;
    let mut reader = CaptureReader::new(file)
        .map_err(|error| Failure::new(error.to_string()).within(path.display()))?;
    let mut broken = None;
    for next in reader.by_ref() {
        match next {
            Ok(datagram) if datagram.port == DATA_PORT => {
                let ended = assembly.push(&datagram.payload, datagram.arrival);
                cloud_of(ended).map_or(Ok(()), &mut *take)?;
            }
            Ok(_) => {}
            Err(error) => {
                broken = Some(error.to_string());
                break;
            }
        }
    }
    cloud_of(assembly.finish()).map_or(Ok(()), &mut *take)?;
    let mut losses = packet_losses(&assembly);
    losses.extend(broken);
    if reader.counts().cut_off {
        losses.push("the capture ends within a frame".to_owned());
    }
    Ok(losses)
}

impl BagSource {
    fn choose(
        bag: Bag,
        info: &BagInfo,
        args: &LidarArgs,
        decoder: DecoderConfig,
    ) -> Result<Self, Failure> {
        let of_type = |type_name: &str| {
            let topics = info.topics.iter();
            let fits =
                topics.filter(|topic| topic.type_name == type_name && topic.message_count > 0);
            fits.map(|topic| topic.topic.clone())
                .filter(|topic| !topic.starts_with("/truth/"))
                .collect::<Vec<String>>()
        };
        let clouds = of_type(PointCloud2::TYPE_NAME);
        let packets = of_type(VelodyneScan::TYPE_NAME);
        let usual = |topic: &&String| {
            let name = topic.to_lowercase();
            ["velodyne", "lidar", "ouster", "hesai", "livox", "rslidar"]
                .iter()
                .any(|it| name.contains(it))
        };
        let topic = match (&args.lidar, clouds.as_slice(), packets.as_slice()) {
            (Some(named), ..) if clouds.contains(named) || packets.contains(named) => named.clone(),
            (Some(named), ..) => {
                return Err(Failure::new(format!("topic {named} has no scans of a LiDAR")).mend(
                    "--lidar names a topic of sensor_msgs/PointCloud2 or velodyne_msgs/VelodyneScan",
                ));
            }
            (None, [only], _) => only.clone(),
            (None, [], [only]) => only.clone(),
            (None, [], []) => {
                return Err(Failure::new("the bag has no scans of a LiDAR").mend(
                    "it takes sensor_msgs/PointCloud2 or velodyne_msgs/VelodyneScan; `stillmap info` lists what there is",
                ));
            }
            (None, several, others) => {
                let mut fits = several.iter().filter(usual);
                match (fits.next(), fits.next()) {
                    (Some(only), None) => only.clone(),
                    _ => {
                        let names: Vec<&str> =
                            several.iter().chain(others).map(String::as_str).collect();
                        return Err(Failure::new("the bag has several topics of scans")
                            .mend(format!("choose with --lidar: {}", names.join(", "))));
                    }
                }
            }
        };
        let count = info.topics.iter().filter(|known| known.topic == topic);
        let has_truth = of_type_named(info, PoseStamped::TYPE_NAME, sensor_bag::TRUE_POSE);
        Ok(Self {
            messages: count.map(|known| known.message_count).sum(),
            is_packets: packets.contains(&topic),
            imu: of_type(Imu::TYPE_NAME).into_iter().next(),
            wheels: of_type(Odometry::TYPE_NAME).into_iter().next(),
            truth: has_truth.then(|| sensor_bag::TRUE_POSE.to_owned()),
            bag,
            topic,
            decoder,
        })
    }

    fn each(
        &self,
        take: &mut impl FnMut(Sensed) -> Result<(), Failure>,
    ) -> Result<Losses, Failure> {
        let mut assembly = assembly(&self.decoder)?;
        let others = [&self.imu, &self.wheels, &self.truth].into_iter().flatten().cloned();
        let topics = others.chain([self.topic.clone()]).collect();
        let selection = Selection { topics: Some(topics), ..Selection::default() };
        let failed = |error: bag_player::BagError| Failure::new(error.to_string());
        let mut messages = self.bag.messages(&selection).map_err(failed)?;
        for message in &mut messages {
            let message = message.map_err(failed)?;
            let topic = &*message.topic;
            if topic == self.topic && self.is_packets {
                let scan = message.decode::<VelodyneScan>().map_err(failed)?;
                for packet in &scan.packets {
                    let mut ended = assembly.push(&packet.data, stamp_from_time(packet.stamp));
                    if let Some(built) = &mut ended {
                        built.revolution.frame_id.clone_from(&scan.header.frame_id);
                    }
                    cloud_of(ended).map_or(Ok(()), &mut *take)?;
                }
            } else if topic == self.topic {
                take(Sensed::Cloud(message.decode().map_err(failed)?))?;
            } else if self.imu.as_deref() == Some(topic) {
                take(Sensed::Imu(Box::new(message.decode().map_err(failed)?)))?;
            } else if self.wheels.as_deref() == Some(topic) {
                take(Sensed::Wheels(Box::new(message.decode().map_err(failed)?)))?;
            } else {
                let pose = message.decode::<PoseStamped>().map_err(failed)?;
                if let Ok(place) = convert::isometry_from_pose(&pose.pose) {
                    let std_msgs::Header { stamp, .. } = pose.header;
                    take(Sensed::Truth(stamp_from_time(stamp), place))?;
                }
            }
        }
        cloud_of(assembly.finish()).map_or(Ok(()), &mut *take)?;
        let mut losses = packet_losses(&assembly);
        losses.extend(messages.losses().iter().map(ToString::to_string));
        Ok(losses)
    }
}

fn of_type_named(info: &BagInfo, type_name: &str, name: &str) -> bool {
    info.topics.iter().any(|topic| topic.type_name == type_name && topic.topic == name)
}
