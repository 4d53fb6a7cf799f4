//! Topics of a LiDAR's driver in its own messages, which are not read: the driver makes clouds of them, which are.

use bag_player::BagInfo;

use crate::failure::Failure;

/// Parts of the names of the packages whose messages these are, and how their drivers publish clouds.
const DRIVERS: [(&str, &str); 7] = [
    ("livox", "livox_ros_driver2 with `xfer_format` 0"),
    ("ouster", "ouster_ros of packets in a bag (`ros2 launch ouster_ros replay.launch.xml`)"),
    ("nebula", "Nebula of packets that are played (`launch_hw:=false`)"),
    ("pandar", "Nebula or Hesai's driver of packets that are played"),
    ("hesai", "Hesai's driver of packets that are played"),
    ("rslidar", "rslidar_sdk of packets that are played (`msg_source: 2`)"),
    ("robosense", "Nebula or rslidar_sdk of packets that are played"),
];

/// Why the topic of a bag is not read, and what its driver does; `None` where it is no other driver's.
pub(super) fn refusal(info: &BagInfo, topic: &str) -> Option<Failure> {
    let known = info.topics.iter().find(|known| known.topic == topic)?;
    let package = known.type_name.split('/').next()?;
    let (_, clouds) = DRIVERS.iter().find(|(part, _)| package.contains(part))?;
    Some(
        Failure::new(format!(
            "topic {topic} has {}, the driver's own messages, which are not read",
            known.type_name
        ))
        .fix(format!(
            "record the clouds (sensor_msgs/PointCloud2) that the driver makes of them: {clouds}"
        )),
    )
}

/// The same of the topic with the most messages of those of other drivers.
pub(super) fn refusal_of_any(info: &BagInfo) -> Option<Failure> {
    let here = info.topics.iter().filter(|topic| topic.message_count > 0 && topic.is_playable());
    let refused =
        here.filter_map(|topic| Some((topic.message_count, refusal(info, &topic.topic)?)));
    refused.max_by_key(|(messages, _)| *messages).map(|(_, refusal)| refusal)
}

#[cfg(test)]
mod tests {
    use bag_player::{Bag, BagWriter, OfferedQos};
    use geometry::Stamp;
    use lidar_odometry::packets::DecoderConfig;
    use msgs::sensor_msgs::Imu;

    use super::super::LidarArgs;
    use super::super::bag::BagSource;

    /// Regression: such a bag had "no scans of a LiDAR", without a word on what it has and why it is not read.
    #[test]
    fn messages_of_another_driver_are_named_with_what_makes_clouds_of_them() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("livox.mcap");
        let mut writer = BagWriter::create(&path).unwrap();
        let channel = writer.channel::<Imu>("/front", OfferedQos::reliable(10)).unwrap();
        writer.write(channel, Stamp::from_nanos(5), &Imu::default()).unwrap();
        writer.finish().unwrap();
        let refusal = |type_name: &str, lidar: Option<&str>| {
            let bag = Bag::open(&path).unwrap();
            let mut info = bag.info().unwrap();
            type_name.clone_into(&mut info.topics[0].type_name);
            let args = LidarArgs { lidar: lidar.map(str::to_owned), ..LidarArgs::default() };
            let chosen = BagSource::choose(bag, &info, &args, DecoderConfig::default());
            chosen.err().unwrap().to_string()
        };
        for (type_name, fix) in [
            ("livox_ros_driver2/msg/CustomMsg", "xfer_format"),
            ("ouster_sensor_msgs/msg/PacketMsg", "replay.launch.xml"),
            ("nebula_msgs/msg/NebulaPackets", "launch_hw"),
        ] {
            for named in [None, Some("/front")] {
                let said = refusal(type_name, named);
                assert!(
                    ["/front", type_name, fix].iter().all(|part| said.contains(part)),
                    "{said}"
                );
            }
        }
        let said = refusal("sensor_msgs/msg/Imu", None);
        assert!(said.contains("the bag has no scans of a LiDAR"), "{said}");
    }
}
