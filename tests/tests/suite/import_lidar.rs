//! Captures of a Velodyne and laser scans of KITTI become bags.

use std::path::{Path, PathBuf};

use bag_player::{Bag, Selection};
use geometry::Stamp;
use lidar_odometry::packets::{Calibration, DecoderConfig, Model, PacketDecoder, ReturnMode};
use msgs::convert;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::PointCloud2;
use msgs::velodyne_msgs::VelodyneScan;

use crate::program::{stillmap, succeed};

fn messages<M: msgs::RosMessage>(bag: &Path, topic: &str) -> Vec<M> {
    let selection = Selection { topics: Some(vec![topic.to_owned()]), ..Selection::default() };
    let bag = Bag::open(bag).unwrap();
    bag.messages(&selection).unwrap().map(|message| message.unwrap().decode().unwrap()).collect()
}

/// Eight packets of a VLP-16, and position packets between them.
fn recorded_capture() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../nodes/lidar-odometry/tests/data/vlp16_gps.pcap")
}

/// The packet of an HDL-32E at 10 turns a second, so many packets after the start behind, that sees 5 m all around.
fn packet(index: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    for block in 0..12 {
        bytes.extend([0xff, 0xee]);
        let turned = 0.165_888 * f64::from(index * 12 + block);
        bytes
            .extend((((180.0 + turned) * 100.0).round() as u64 % 36_000).to_le_bytes()[..2].iter());
        for _laser in 0..32 {
            bytes.extend(2500_u16.to_le_bytes());
            bytes.push(40);
        }
    }
    bytes.extend(((f64::from(index) * 552.96).round() as u32).to_le_bytes());
    bytes.extend([0x37, 0x21]);
    bytes
}

/// A pcap file of datagrams to a port, as many microseconds apart as the packets of an HDL-32E.
fn write_capture(path: &Path, port: u16, payloads: &[Vec<u8>]) {
    let mut bytes = Vec::new();
    for value in [0xa1b2_c3d4_u32, 0x0004_0002, 0, 0, 65_535, 1] {
        bytes.extend(value.to_le_bytes());
    }
    for (index, payload) in payloads.iter().enumerate() {
        let length = payload.len() as u16;
        let micros = (index as f64 * 552.96) as u32;
        let frame_bytes = u32::from(length) + 42;
        for value in [1000 + micros / 1_000_000, micros % 1_000_000, frame_bytes, frame_bytes] {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend([0xff; 6]);
        bytes.extend([0x60, 0x76, 0x88, 0, 0, 1, 0x08, 0x00, 0x45, 0]);
        bytes.extend((length + 28).to_be_bytes());
        bytes.extend([0, 0, 0x40, 0, 64, 17, 0, 0, 192, 168, 1, 201, 255, 255, 255, 255]);
        bytes.extend(443_u16.to_be_bytes());
        bytes.extend(port.to_be_bytes());
        bytes.extend((length + 8).to_be_bytes());
        bytes.extend([0, 0]);
        bytes.extend(payload);
    }
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn a_recorded_capture_becomes_an_organised_cloud() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("vlp16.mcap");
    let capture = recorded_capture();
    let (capture, output) = (capture.to_str().unwrap(), bag.to_str().unwrap());
    succeed(["import", "velodyne", capture, "--partial", "--frame", "roof", "-o", output]);
    let clouds = messages::<PointCloud2>(&bag, "/velodyne_points");
    assert_eq!(clouds.len(), 1);
    assert_eq!((clouds[0].height, clouds[0].width), (16, 8 * 24));
    let names: Vec<&str> = clouds[0].fields.iter().map(|field| field.name.as_str()).collect();
    assert_eq!(names, ["x", "y", "z", "intensity", "ring", "time"]);
    let cloud = convert::cloud_from_message(&clouds[0]).unwrap();
    // As many as an independent decoder finds.
    assert_eq!((cloud.points_m.len(), cloud.frame_id.as_str()), (2176, "roof"));
    // The capture's first frame, less the time that a packet takes.
    let first = Stamp::from_secs_nanos(1_453_364_282, 708_714_000);
    assert!((first.seconds_since(cloud.stamp) - 1_327.1e-6).abs() < 1e-6, "{:?}", cloud.stamp);

    // By the scanner's clock, which follows GPS: 1082340595 us past the hour.
    succeed([
        "import",
        "velodyne",
        capture,
        "--partial",
        "--clock",
        "scanner",
        "--overwrite",
        "-o",
        output,
    ]);
    let clouds = messages::<PointCloud2>(&bag, "/velodyne_points");
    let stamp = convert::stamp_from_time(clouds[0].header.stamp);
    assert_eq!(stamp, Stamp::from_secs_nanos(1_453_363_200 + 1082, 340_595_000));
}

#[test]
fn a_capture_is_mapped_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let capture = path("x.pcap");
    write_capture(&capture, 2368, &(0..400).map(packet).collect::<Vec<_>>());
    let trajectory = |out: &str, options: &[&str]| {
        let line = ["run", capture.to_str().unwrap(), "--out", path(out).to_str().unwrap()]
            .into_iter()
            .chain(options.iter().copied())
            .map(str::to_owned)
            .collect::<Vec<_>>();
        stillmap(&line);
        std::fs::read_to_string(path(out).join("trajectory.txt")).unwrap()
    };
    let named = trajectory("named", &["--pose", "lidar"]);
    assert!(named.lines().count() > 1, "{named}");
    assert_eq!(trajectory("by_itself", &[]), named);
}

#[test]
fn whole_turns_become_messages_and_losses_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let (capture, bag) = (folder.path().join("x.pcap"), folder.path().join("x.mcap"));
    let (input, output) = (capture.to_str().unwrap(), bag.to_str().unwrap());
    let mut packets: Vec<Vec<u8>> = (0..400).map(packet).collect();
    write_capture(&capture, 2368, &packets);
    succeed(["import", "velodyne", input, "-o", output]);
    let clouds = messages::<PointCloud2>(&bag, "/velodyne_points");
    assert_eq!(clouds.len(), 2);
    for cloud in &clouds {
        assert_eq!((cloud.height, cloud.is_dense), (32, true));
        assert!(cloud.width.abs_diff(2170) <= 1, "{}", cloud.width);
    }
    let between = convert::stamp_from_time(clouds[1].header.stamp)
        .seconds_since(convert::stamp_from_time(clouds[0].header.stamp));
    assert!((between - 0.1).abs() < 1e-4, "{between}");

    // The packets themselves, all of them.
    succeed(["import", "velodyne", input, "--packets", "--overwrite", "-o", output]);
    let scans = messages::<VelodyneScan>(&bag, "/velodyne_packets");
    let sizes: Vec<usize> = scans.iter().map(|scan| scan.packets.len()).collect();
    assert_eq!((sizes.len(), sizes.iter().sum::<usize>()), (3, 400));
    let found = scans.iter().flat_map(|scan| &scan.packets).map(|packet| packet.data.to_vec());
    assert!(found.eq(packets.iter().cloned()));
    assert_eq!(scans[1].header.stamp, scans[1].packets[0].stamp);

    write_capture(&capture, 2368, &packets[..100]);
    let result = stillmap(["import", "velodyne", input, "--overwrite", "-o", output]);
    assert_eq!(result.status.code(), Some(3));
    assert!(
        String::from_utf8_lossy(&result.stderr).contains("no revolution is complete (--partial")
    );

    packets.drain(100..103);
    packets[50].truncate(1000);
    write_capture(&capture, 2368, &packets);
    let result = stillmap(["import", "velodyne", input, "--overwrite", "-o", output]);
    assert_eq!(result.status.code(), Some(3));
    let stderr = String::from_utf8_lossy(&result.stderr);
    // The one that is broken is missing too.
    for part in ["4 packets are missing", "1 data packets could not", "1206 bytes, not 1000"] {
        assert!(stderr.contains(part), "{stderr}");
    }
    assert!(stderr.lines().count() <= 2, "{stderr}");
    assert_eq!(messages::<PointCloud2>(&bag, "/velodyne_points").len(), 2);
}

#[test]
fn what_is_no_capture_of_a_velodyne_is_named_with_the_mend() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (bag, text, other, yaml) =
        (path("x.mcap"), path("a.txt"), path("other.pcap"), path("c.yaml"));
    std::fs::write(&text, "this is no capture, whatever its name says").unwrap();
    std::fs::write(&yaml, "lasers: []\n").unwrap();
    write_capture(Path::new(&other), 2369, &[packet(0)]);
    let recorded = recorded_capture();
    let recorded = recorded.to_str().unwrap();
    for (arguments, wanted) in [
        (vec![path("absent.pcap")], vec!["cannot open"]),
        (vec![text.clone()], vec!["neither pcap nor pcapng", "tcpdump"]),
        (
            vec![other.clone()],
            vec!["no data packet of a Velodyne on UDP port 2368", "--data-port 2369 "],
        ),
        (
            vec![recorded.to_owned(), "--calibration".into(), yaml],
            vec!["no data packet could be decoded: 0 lasers"],
        ),
        (vec![recorded.to_owned(), "--cut".into(), "400".into()], vec!["not within 0 .. 360"]),
    ] {
        let mut command = vec!["import".to_owned(), "velodyne".to_owned()];
        command.extend(arguments);
        command.extend(["-o".to_owned(), bag.clone()]);
        let output = stillmap(&command);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        for part in wanted {
            assert!(stderr.contains(part), "{command:?}: {stderr}");
        }
        assert!(stderr.lines().count() <= 2, "{stderr}");
        assert!(!Path::new(&bag).exists());
    }
}

/// Regression: `run` of a capture of another LiDAR wrote a map without a point, over that of an earlier run, and named `info`, which
/// named `run`.
#[test]
fn a_capture_of_another_lidar_is_refused_before_a_map_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (other, out, trajectory) = (path("ouster.pcap"), path("out"), path("drive.txt"));
    write_capture(Path::new(&other), 7502, &[packet(0)]);
    for command in [
        vec!["run", &other, "--out", &out],
        vec!["odometry", &other, "--of", "lidar", "-o", &trajectory],
    ] {
        let output = stillmap(&command);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        let parts =
            ["no data packet of a Velodyne on UDP port 2368", "--data-port 7502 ", "driver"];
        assert!(parts.iter().all(|part| stderr.contains(part)), "{command:?}: {stderr}");
    }
    assert!(!Path::new(&out).join("map.ply").exists() && !Path::new(&trajectory).exists());
}

/// Three rows of points 10 m off, counterclockwise from forward.
fn kitti_scan() -> Vec<u8> {
    let mut bytes = Vec::new();
    for row in 0..3 {
        for point in 0..100 {
            let azimuth_rad = (point as f32 + 0.5) / 100.0 * std::f32::consts::TAU;
            let (sin, cos) = azimuth_rad.sin_cos();
            for value in [10.0 * cos, 10.0 * sin, -(row as f32), 0.25] {
                bytes.extend(value.to_le_bytes());
            }
        }
    }
    bytes
}

#[test]
fn a_sequence_of_kitti_keeps_its_times_and_its_truth() {
    let folder = tempfile::tempdir().unwrap();
    let sequence = folder.path().join("sequences/07");
    std::fs::create_dir_all(sequence.join("velodyne")).unwrap();
    std::fs::create_dir_all(folder.path().join("poses")).unwrap();
    for name in ["000000.bin", "000002.bin"] {
        std::fs::write(sequence.join("velodyne").join(name), kitti_scan()).unwrap();
    }
    std::fs::write(sequence.join("times.txt"), "0.0\n1.037e-01\n2.5e-01\n").unwrap();
    // The camera looks forward: its z is the scanner's x.
    std::fs::write(sequence.join("calib.txt"), "P0: 1 2\nTr: 0 -1 0 0 0 0 -1 0 1 0 0 -0.3\n")
        .unwrap();
    let pose = |x: f64, z: f64| format!("1 0 0 {x} 0 1 0 0 0 0 1 {z}\n");
    let poses = pose(0.0, 0.0) + &pose(0.0, 1.0) + &pose(-0.5, 2.0);
    std::fs::write(folder.path().join("poses/07.txt"), poses).unwrap();
    let bag = folder.path().join("kitti.mcap");
    let (input, output) = (sequence.to_str().unwrap(), bag.to_str().unwrap());
    succeed(["import", "kitti", input, "-o", output]);
    let clouds = messages::<PointCloud2>(&bag, "/velodyne_points");
    assert_eq!(clouds.len(), 2);
    assert_eq!(clouds[0].height, 3);
    let cloud = convert::cloud_from_message(&clouds[1]).unwrap();
    assert_eq!(cloud.points_m.len(), 300);
    assert_eq!(cloud.stamp, Stamp::from_secs_nanos(1_000_000_000, 250_000_000));
    let truth: Vec<_> = messages::<PoseStamped>(&bag, "/truth/pose")
        .iter()
        .map(|pose| convert::pose_from_message(pose).unwrap())
        .collect();
    assert_eq!(truth.len(), 2);
    assert_eq!(truth[1].stamp, cloud.stamp);
    let position_m = truth[1].map_from_rig.translation.vector;
    // 2 m forward, 0.5 m to the left.
    assert!((position_m - nalgebra::Vector3::new(2.0, 0.5, 0.0)).norm() < 1e-9, "{position_m}");

    std::fs::write(sequence.join("velodyne/000001.bin"), [1, 2, 3]).unwrap();
    let result = stillmap(["import", "kitti", input, "--overwrite", "-o", output]);
    assert_eq!(result.status.code(), Some(1));
    let stderr = String::from_utf8_lossy(&result.stderr);
    assert!(stderr.contains("000001.bin: 3 bytes are not a whole number"), "{stderr}");
    let result =
        stillmap(["import", "kitti", folder.path().to_str().unwrap(), "--overwrite", "-o", output]);
    let stderr = String::from_utf8_lossy(&result.stderr);
    assert!(stderr.contains("holds no numbered .bin files"), "{stderr}");
}

#[test]
fn a_scan_that_another_driver_recorded_is_read_and_decoded_as_an_independent_decoder_does() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/velodyne");
    let bytes = std::fs::read(data.join("vlp16_scan.cdr")).unwrap();
    let scan: VelodyneScan = msgs::cdr::decode(&bytes).unwrap();
    assert_eq!((scan.header.frame_id.as_str(), scan.packets.len()), ("velodyne", 6));
    assert_eq!(msgs::cdr::encode(&scan).unwrap(), bytes);

    let reference = std::fs::read(data.join("vlp16_scan.reference.bin")).unwrap();
    let values: Vec<f32> =
        reference.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let mut reference = values.as_chunks::<4>().0.iter();
    // The reference knows the manual's heights of the lasers before they were rounded to tenths of a millimetre, and
    // rounds azimuths to hundredths of a degree.
    let mut calibration = Calibration::of_data_sheet(Model::Vlp16);
    for laser in &mut calibration.lasers {
        laser.height_m = -0.041_91 * laser.elevation_deg.to_radians().tan();
    }
    let calibration = Some(calibration);
    let config = DecoderConfig {
        calibration,
        range_min_m: 0.1,
        range_max_m: 200.0,
        ..DecoderConfig::default()
    };
    let mut decoder = PacketDecoder::new(config).unwrap();
    for packet in &scan.packets {
        let packet = decoder.decode(&packet.data).unwrap();
        assert_eq!((packet.model, packet.return_mode), (Model::Vlp16, ReturnMode::Dual));
        for shot in packet.shots {
            let [x_m, y_m, z_m, intensity] = *reference.next().unwrap();
            let expected_m = nalgebra::Point3::new(x_m, y_m, z_m);
            assert_eq!(f32::from(shot.intensity), intensity);
            let off_m = (shot.position_m - expected_m).norm();
            assert!(off_m < 2e-5 + 9e-5 * shot.range_m, "{shot:?} {expected_m}");
        }
    }
    assert_eq!(reference.next(), None);
}
