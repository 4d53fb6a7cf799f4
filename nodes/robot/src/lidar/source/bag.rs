//! The LiDAR's topics of a bag.

use std::collections::BTreeMap;

use bag_player::{Bag, BagError, BagInfo, BagMessage, Selection};
use lidar_odometry::packets::DecoderConfig;
use lidar_odometry::revolution::RevolutionAssembly;
use msgs::convert::{self, stamp_from_time};
use msgs::geometry_msgs::PoseStamped;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{Imu, PointCloud2};
use msgs::velodyne_msgs::VelodyneScan;
use msgs::{RosMessage, std_msgs};

use super::{LidarArgs, Losses, Sensed, assembly, cloud_of, other_drivers, packet_losses};
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use crate::offer::Offer;
use crate::sensor_bag;

/// The topics of a bag.
pub struct BagSource {
    bag: Bag,
    pub(super) topic: String,
    pub(super) messages: u64,
    is_packets: bool,
    imu: Option<String>,
    wheels: Option<String>,
    truth: Option<String>,
    decoder: DecoderConfig,
}

impl BagSource {
    pub(super) fn has_truth(&self) -> bool {
        self.truth.is_some()
    }

    pub(super) fn choose(
        bag: Bag,
        info: &BagInfo,
        args: &LidarArgs,
        decoder: DecoderConfig,
    ) -> Result<Self, Failure> {
        let offer = Offer::of_bag(info);
        let of_type =
            |type_name: &str| offer.of_type(type_name).map(str::to_owned).collect::<Vec<String>>();
        let clouds = of_type(PointCloud2::TYPE_NAME);
        let packets = of_type(VelodyneScan::TYPE_NAME);
        let usual = |topic: &&String| {
            let name = topic.to_lowercase();
            ["velodyne", "lidar", "ouster", "hesai", "livox", "rslidar"]
                .iter()
                .any(|it| name.contains(it))
        };
        let named = args.lidar.as_deref().map(|named| info.recorded_name(named));
        let topic = match (named, clouds.as_slice(), packets.as_slice()) {
            (Some(named), ..) if clouds.iter().chain(&packets).any(|topic| topic == named) => {
                named.to_owned()
            }
            (Some(named), ..) => {
                return Err(other_drivers::refusal(info, named).unwrap_or_else(|| {
                    Failure::new(format!("topic {named} has no scans of a LiDAR")).fix(
                        "--lidar names a topic of sensor_msgs/PointCloud2 or velodyne_msgs/VelodyneScan",
                    )
                }));
            }
            // Beside packets a cloud without a scanner's name is a depth camera's.
            (None, [cloud], [only]) if !usual(&cloud) => only.clone(),
            (None, [only], _) => only.clone(),
            (None, [], [only]) => only.clone(),
            (None, [], []) => {
                return Err(other_drivers::refusal_of_any(info).unwrap_or_else(|| {
                    Failure::new(format!("the bag has no scans of a LiDAR{}", offer.unread())).fix(
                        "it takes sensor_msgs/PointCloud2 or velodyne_msgs/VelodyneScan; `stillmap info` lists what there is",
                    )
                }));
            }
            (None, several, others) => {
                let mut fits = several.iter().filter(usual);
                match (fits.next(), fits.next()) {
                    (Some(only), None) => only.clone(),
                    _ => {
                        let names: Vec<&str> =
                            several.iter().chain(others).map(String::as_str).collect();
                        return Err(Failure::new("the bag has several topics of scans")
                            .fix(format!("choose with --lidar: {}", names.join(", "))));
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

    pub(super) fn each(
        &self,
        interrupt: &Interrupt,
        take: &mut impl FnMut(Sensed) -> Result<(), Failure>,
    ) -> Result<Losses, Failure> {
        let mut assembly = assembly(&self.decoder)?;
        let others = [&self.imu, &self.wheels, &self.truth].into_iter().flatten().cloned();
        let topics = others.chain([self.topic.clone()]).collect();
        let selection = Selection { topics: Some(topics), ..Selection::default() };
        let failed = |error: BagError| Failure::new(error.to_string());
        let mut messages = self.bag.messages(&selection).map_err(failed)?;
        let mut damaged: BTreeMap<String, (u64, String)> = BTreeMap::new();
        for message in &mut messages {
            if interrupt.has_come() {
                break;
            }
            let message = message.map_err(failed)?;
            match self.sensed(&message, &mut assembly) {
                Ok(sensed) => sensed.into_iter().try_for_each(&mut *take)?,
                Err(error) => {
                    let (count, _) = damaged
                        .entry(message.topic.to_string())
                        .or_insert((0_u64, error.to_string()));
                    *count += 1;
                }
            }
        }
        cloud_of(assembly.finish()).map_or(Ok(()), &mut *take)?;
        let mut losses = packet_losses(&assembly);
        losses.extend(damaged.into_iter().map(|(topic, (count, first))| {
            format!("{topic}: {count} messages are damaged; the first: {first}")
        }));
        losses.extend(messages.losses().iter().map(ToString::to_string));
        Ok(losses)
    }

    /// What a message has: several scans where it has the packets of more than one revolution.
    fn sensed(
        &self,
        message: &BagMessage,
        assembly: &mut RevolutionAssembly,
    ) -> Result<Vec<Sensed>, BagError> {
        let topic = &*message.topic;
        Ok(if topic == self.topic && self.is_packets {
            let scan = message.decode::<VelodyneScan>()?;
            let mut clouds = Vec::new();
            for packet in &scan.packets {
                let mut ended = assembly.push(&packet.data, stamp_from_time(packet.stamp));
                if let Some(built) = &mut ended {
                    built.revolution.frame_id.clone_from(&scan.header.frame_id);
                }
                clouds.extend(cloud_of(ended));
            }
            clouds
        } else if topic == self.topic {
            vec![Sensed::Cloud(message.decode()?)]
        } else if self.imu.as_deref() == Some(topic) {
            vec![Sensed::Imu(Box::new(message.decode()?))]
        } else if self.wheels.as_deref() == Some(topic) {
            vec![Sensed::Wheels(Box::new(message.decode()?))]
        } else {
            let PoseStamped { header: std_msgs::Header { stamp, .. }, pose } = message.decode()?;
            let place = convert::isometry_from_pose(&pose).ok();
            place.map(|place| Sensed::Truth(stamp_from_time(stamp), place)).into_iter().collect()
        })
    }
}

fn of_type_named(info: &BagInfo, type_name: &str, name: &str) -> bool {
    info.topics.iter().any(|topic| topic.type_name == type_name && topic.topic == name)
}
