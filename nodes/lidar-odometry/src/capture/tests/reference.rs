//! Recorded packets, decoded by an independent decoder too.

use std::path::{Path, PathBuf};

use super::*;
use crate::packets::{
    Calibration, Continuity, DATA_PORT, DecodedPacket, DecoderConfig, Model, POSITION_PORT,
    PacketDecoder, PositionPacket, PpsStatus,
};
use crate::revolution::{RevolutionBuilder, RevolutionConfig};

/// A file of the committed recordings.
fn committed(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// A folder of recordings that are not part of the repository; says so where it is not there.
fn recorded() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/velodyne-packets");
    if path.exists() {
        Some(path)
    } else {
        eprintln!("skipped: {} is not there", path.display());
        None
    }
}

fn floats(path: &Path) -> Vec<f32> {
    let bytes = std::fs::read(path).unwrap();
    bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

fn datagrams(path: &Path, port: u16) -> Vec<Datagram> {
    let file = std::fs::File::open(path).unwrap();
    let all: Vec<Datagram> = CaptureReader::new(file).unwrap().map(Result::unwrap).collect();
    all.into_iter().filter(|datagram| datagram.port == port).collect()
}

/// The limits of the independent decoder; and its calibration: angles are rounded to hundredths as the manual prints
/// them, and all beams intersect before the scanner, at a distance from its axis that the reference has: 41.91 mm in a
/// VLP-16, which is the vertical correction of its manual before that was rounded; the other manuals have none.
fn as_the_reference(model: Model) -> DecoderConfig {
    let mut calibration = Calibration::of_data_sheet(model);
    for laser in &mut calibration.lasers {
        let circle_m = match model {
            Model::Hdl32e => 0.028_93,
            Model::Vlp32c => 0.042_4,
            _ => 0.041_91,
        };
        if model != Model::Vlp32c {
            laser.elevation_deg = (laser.elevation_deg * 100.0).round() / 100.0;
        }
        laser.height_m = -circle_m * laser.elevation_deg.to_radians().tan();
    }
    DecoderConfig {
        calibration: Some(calibration),
        range_min_m: 0.1,
        range_max_m: 200.0,
        ..DecoderConfig::default()
    }
}

fn decode_all(path: &Path, config: DecoderConfig) -> Vec<DecodedPacket> {
    let mut decoder = PacketDecoder::new(config).unwrap();
    let data = datagrams(path, DATA_PORT);
    data.iter().map(|datagram| decoder.decode(&datagram.payload).unwrap()).collect()
}

/// How far apart the points are; the number and the intensities are the same. The reference rounds this many angles.
fn compare(packets: &[DecodedPacket], reference: &[[f32; 4]], roundings: f32) -> f32 {
    let shots: Vec<_> = packets.iter().flat_map(|packet| &packet.shots).collect();
    assert_eq!(shots.len(), reference.len());
    let mut largest = 0.0_f32;
    for (index, (shot, [x, y, z, intensity])) in shots.iter().zip(reference).enumerate() {
        let expected = nalgebra::Point3::new(*x, *y, *z);
        assert_eq!(f32::from(shot.intensity), *intensity, "point {index}");
        let off_m = (shot.position_m - expected).norm();
        // The reference rounds azimuths to whole hundredths of a degree: 0.09 mm a metre at most, and the floats.
        assert!(
            off_m < 2e-5 + 9e-5 * roundings * shot.range_m,
            "point {index}: {shot:?} {expected}"
        );
        largest = largest.max(off_m / shot.range_m);
    }
    largest
}

#[test]
fn the_first_packets_are_decoded_as_an_independent_decoder_does() {
    for (name, model) in [("hdl32", Model::Hdl32e), ("vlp16_gps", Model::Vlp16)] {
        let packets = decode_all(&committed(&format!("{name}.pcap")), as_the_reference(model));
        let values = floats(&committed(&format!("{name}.reference.bin")));
        let reference = values.as_chunks::<6>().0;
        let points: Vec<[f32; 4]> = reference.iter().map(|r| [r[0], r[1], r[2], r[3]]).collect();
        let largest = compare(&packets, &points, 1.0);
        println!("{name}: {} points, off by {largest:.2e} of the range at most", points.len());
        let mut reference = reference.iter();
        let start_us = packets[0].timestamp_us;
        for packet in &packets {
            let after_s = f64::from(packet.timestamp_us - start_us) * 1e-6;
            for shot in &packet.shots {
                let [.., time_s, ring] = reference.next().unwrap();
                // The reference counts rings from the lowest.
                assert_eq!(packet.elevations_rad.len() - 1 - usize::from(shot.row), *ring as usize);
                let late_s = after_s + f64::from(shot.time_s) - f64::from(*time_s);
                assert!(late_s.abs() < 1e-6, "{late_s}");
            }
        }
    }
}

#[test]
fn made_up_packets_are_decoded_as_an_independent_decoder_does() {
    let yaml = std::fs::read_to_string(committed("synthetic/hdl64e.calibration.yaml")).unwrap();
    let own = Calibration::from_yaml(&yaml).unwrap();
    let of_hdl_64e = DecoderConfig { calibration: Some(own), ..as_the_reference(Model::Hdl64e) };
    for (name, config, roundings) in [
        ("vlp32c", as_the_reference(Model::Vlp32c), 1.0),
        ("vlp16_dual", as_the_reference(Model::Vlp16), 1.0),
        ("hdl32_dual", as_the_reference(Model::Hdl32e), 1.0),
        // The sideways angle of the laser is rounded too.
        ("hdl64e", of_hdl_64e, 2.0),
    ] {
        let packets = decode_all(&committed(&format!("synthetic/{name}.pcap")), config);
        let values = floats(&committed(&format!("synthetic/{name}.reference.bin")));
        let points: Vec<[f32; 4]> =
            values.as_chunks::<7>().0.iter().map(|r| [r[0], r[1], r[2], r[3]]).collect();
        let largest = compare(&packets, &points, roundings);
        println!("{name}: {} points, off by {largest:.2e} of the range at most", points.len());
    }
}

#[test]
fn whole_recordings_are_decoded_as_an_independent_decoder_does() {
    let Some(folder) = recorded() else { return };
    for (name, model, scans) in [
        ("sample_velodyne_hdl32", Model::Hdl32e, 3),
        ("sample_velodyne_vlp16_gps", Model::Vlp16, 4),
    ] {
        let pcap = folder.join(format!("{name}.pcap"));
        let packets = decode_all(&pcap, as_the_reference(model));
        let mut reference = Vec::new();
        for scan in 0..scans {
            let file = folder.join(format!("reference_decode/{name}.scan{scan}.xyzi.bin"));
            reference.extend_from_slice(floats(&file).as_chunks::<4>().0);
        }
        let largest = compare(&packets, &reference, 1.0);
        println!("{name}: {} points, off by {largest:.2e} of the range at most", reference.len());
    }
}

#[test]
fn nothing_is_lost_in_whole_recordings_and_their_revolutions_are_whole() {
    let Some(folder) = recorded() else { return };
    for (name, whole) in [("sample_velodyne_hdl32", 2), ("sample_velodyne_vlp16_gps", 3)] {
        let pcap = folder.join(format!("{name}.pcap"));
        let mut continuity = Continuity::default();
        let mut builder = RevolutionBuilder::new(RevolutionConfig::default()).unwrap();
        let mut decoder = PacketDecoder::new(DecoderConfig::default()).unwrap();
        let mut built = Vec::new();
        for datagram in datagrams(&pcap, DATA_PORT) {
            let packet = decoder.decode(&datagram.payload).unwrap();
            continuity.push(&packet);
            built.extend(builder.push(&packet, packet.stamp_by_arrival(datagram.arrival)));
        }
        let counts = continuity.counts();
        assert_eq!((counts.lost, counts.lost_by_azimuth, counts.out_of_order), (0, 0, 0), "{name}");
        built.extend(builder.finish());
        let found = built.iter().filter(|built| built.is_whole()).count();
        println!("{name}: {found} whole of {} revolutions", built.len());
        assert!(found.abs_diff(whole) <= 1, "{found}");
        let returns: usize = built.iter().map(|built| built.revolution.measured().count()).sum();
        println!("{name}: {returns} returns");
    }
}

#[test]
fn position_packets_are_read() {
    let packets = datagrams(&committed("vlp16_gps.pcap"), POSITION_PORT);
    assert!(!packets.is_empty());
    for datagram in packets {
        let packet = PositionPacket::parse(&datagram.payload).unwrap();
        assert_eq!(packet.pps, PpsStatus::Locked);
        let gprmc = packet.gprmc.unwrap();
        assert!(gprmc.valid);
        // 2016-01-21 08:18:02; the capture's clock is behind.
        assert_eq!(gprmc.time.unwrap(), Stamp::from_secs_nanos(1_453_364_282, 0));
        assert!((gprmc.latitude_deg.unwrap() - 36.829).abs() < 1e-3);
        // The scanner's clock follows the receiver's: 18 minutes and 2 seconds past the hour.
        assert_eq!(packet.timestamp_us / 1_000_000, 18 * 60 + 2);
    }
}
