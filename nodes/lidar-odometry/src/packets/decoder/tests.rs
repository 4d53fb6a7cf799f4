use nalgebra::Vector3;
use proptest::prelude::*;

use super::*;
use crate::packets::encoder::Encoder;
use crate::packets::{LaserCalibration, PACKET_BYTES};

const MODES: [ReturnMode; 3] = [ReturnMode::Strongest, ReturnMode::Last, ReturnMode::Dual];

fn decoder() -> PacketDecoder {
    PacketDecoder::new(DecoderConfig::default()).unwrap()
}

/// Something else for each shot.
fn range_m(firing: usize, laser: usize) -> f64 {
    2.0 + (firing * 37 + laser * 101) as f64 % 2500.0 * 0.02
}

/// By the angles alone, as anybody would write it.
fn plain_point(laser: &LaserCalibration, range_m: f64, azimuth_deg: f64) -> Vector3<f64> {
    let azimuth_rad = -(azimuth_deg - laser.rotation_deg).to_radians();
    let elevation_rad = laser.elevation_deg.to_radians();
    let forward = Vector3::new(azimuth_rad.cos(), azimuth_rad.sin(), 0.0);
    let up = Vector3::z();
    forward * (range_m * elevation_rad.cos())
        + up * (range_m * elevation_rad.sin() + laser.height_m)
}

#[test]
fn every_model_and_mode_is_decoded_to_where_its_lasers_looked() {
    for (model, mode) in Model::ALL.into_iter().flat_map(|model| MODES.map(|mode| (model, mode))) {
        if model == Model::Hdl64e && mode == ReturnMode::Last {
            // Its packets do not distinguish it from the strongest.
            continue;
        }
        let encoder = Encoder::new(model, mode);
        let packets = encoder.packets(3, |firing, laser| {
            let range_m = range_m(firing, laser);
            [Some((range_m, 9)), Some((range_m + 1.0, 90))]
        });
        let calibration = Calibration::of_data_sheet(model);
        let rows = calibration.rows();
        let mut decoder = decoder();
        for (index, bytes) in packets.iter().enumerate() {
            let packet = decoder.decode(bytes).unwrap();
            let firings = encoder.firings_per_packet();
            assert_eq!((packet.model, packet.return_mode), (model, mode));
            assert_eq!(packet.firings.len(), firings, "{model} {mode:?}");
            let echoes = if mode == ReturnMode::Dual { 2 } else { 1 };
            assert_eq!(packet.shots.len(), firings * model.lasers() * echoes);
            for shot in &packet.shots {
                let laser = rows.iter().position(|row| *row == shot.row).unwrap();
                let firing = index * firings + usize::from(shot.firing);
                let second = f64::from(u8::from(shot.echo == Echo::Strongest && echoes == 2));
                let range_m = range_m(firing, laser) + second;
                assert!((f64::from(shot.range_m) - range_m).abs() <= 0.0021, "{model} {shot:?}");
                let time_s = usize::from(shot.firing) as f64 * model.firing_period_s()
                    + model.laser_delay_s(laser);
                assert!((f64::from(shot.time_s) - time_s).abs() < 1e-9);
                // Where the head really was: the packet rounds it to hundredths.
                let since_start_s = (index * firings) as f64 * model.firing_period_s() + time_s;
                let azimuth_deg = 180.0 + 3600.0 * since_start_s;
                let expected = plain_point(&calibration.lasers[laser], range_m, azimuth_deg);
                let off_m = (shot.position_m.coords.cast::<f64>() - expected).norm();
                let bound_m = 0.0021 + range_m * 0.008_f64.to_radians();
                assert!(off_m < bound_m, "{model} {mode:?} {shot:?} {off_m}");
            }
            let azimuths: Vec<f64> =
                packet.firings.iter().map(|firing| firing.azimuth_deg).collect();
            assert!(azimuths.windows(2).all(|pair| pair[0] < pair[1]), "{azimuths:?}");
        }
    }
}

#[test]
fn between_two_azimuths_the_head_turns_evenly_over_north_too() {
    let mut encoder = Encoder::new(Model::Vlp16, ReturnMode::Strongest);
    encoder.start_azimuth_deg = 359.0;
    let packet = decoder().decode(&encoder.packets(1, |_, _| [None; 2])[0]).unwrap();
    assert!(packet.shots.is_empty());
    for (index, firing) in packet.firings.iter().enumerate() {
        let expected_deg = (359.0 + 3600.0 * 55.296e-6 * index as f64).rem_euclid(360.0);
        assert!((firing.azimuth_deg - expected_deg).abs() < 0.008, "{index} {firing:?}");
    }
    assert!(packet.firings[11].azimuth_deg < 2.0);
}

#[test]
fn the_two_point_calibration_is_that_of_the_manual() {
    let calibration = LaserCalibration {
        elevation_deg: -10.0,
        rotation_deg: 3.0,
        range_offset_m: 1.2,
        near_range_offset_m: [1.3, 1.15],
        height_m: 0.2,
        horizontal_offset_m: -0.026,
    };
    let laser = Laser::new(&calibration);
    for (raw_m, head_deg) in [(2.0, 40.0), (11.0, 200.0), (25.0, 300.0), (25.1, 300.0_f64)] {
        // Step by step as the appendix F has it, x to the right and y forward.
        let range_m = raw_m + calibration.range_offset_m;
        let (sin_v, cos_v) = (-10.0_f64).to_radians().sin_cos();
        let (sin_r, cos_r) = (head_deg - 3.0).to_radians().sin_cos();
        let xx = (range_m * cos_v * sin_r + 0.026 * cos_r).abs();
        let yy = (range_m * cos_v * cos_r - 0.026 * sin_r).abs();
        let near = raw_m <= 25.04;
        let correction_x = if near { (1.2 - 1.3) * (xx - 2.4) / (25.04 - 2.4) + 1.3 } else { 1.2 };
        let correction_y =
            if near { (1.2 - 1.15) * (yy - 1.93) / (25.04 - 1.93) + 1.15 } else { 1.2 };
        let x = (raw_m + correction_x) * cos_v * sin_r + 0.026 * cos_r;
        let y = (raw_m + correction_y) * cos_v * cos_r - 0.026 * sin_r;
        let z = (raw_m + (correction_x + correction_y) / 2.0) * sin_v + 0.2;
        let found = laser.point_m(raw_m, head_deg);
        let off = (found.coords.cast::<f64>() - Vector3::new(y, -x, z)).norm();
        assert!(off < 1e-5, "{found} {y} {} {z}", -x);
    }
}

#[test]
fn of_two_echoes_each_is_known() {
    let echoes = [
        ([Some((5.0, 30)), Some((5.0, 30))], vec![(5.0, Echo::StrongestAndLast)]),
        ([Some((9.0, 30)), Some((5.0, 60))], vec![(9.0, Echo::Last), (5.0, Echo::Strongest)]),
        (
            [Some((9.0, 30)), Some((5.0, 10))],
            vec![(9.0, Echo::StrongestAndLast), (5.0, Echo::SecondStrongest)],
        ),
        ([Some((9.0, 30)), None], vec![(9.0, Echo::StrongestAndLast)]),
        ([None, None], vec![]),
    ];
    for (given, expected) in echoes {
        let encoder = Encoder::new(Model::Vlp32c, ReturnMode::Dual);
        let bytes = encoder.packets(
            1,
            |firing, laser| {
                if (firing, laser) == (2, 7) { given } else { [None; 2] }
            },
        );
        let packet = decoder().decode(&bytes[0]).unwrap();
        let found: Vec<_> =
            packet.shots.iter().map(|shot| (f64::from(shot.range_m), shot.echo)).collect();
        assert_eq!(found, expected);
        assert!(packet.shots.iter().all(|shot| shot.firing == 2));
    }
}

#[test]
fn ranges_outside_of_the_limits_are_no_returns() {
    let config = DecoderConfig { range_min_m: 3.0, range_max_m: 7.0, ..DecoderConfig::default() };
    let encoder = Encoder::new(Model::Hdl32e, ReturnMode::Strongest);
    let bytes = encoder.packets(1, |_, laser| [Some((laser as f64 / 2.0, 1)), None]);
    let packet = PacketDecoder::new(config).unwrap().decode(&bytes[0]).unwrap();
    assert_eq!(packet.shots.len(), 12 * 9);
}

#[test]
fn a_step_that_no_head_makes_is_an_error_with_its_numbers() {
    let encoder = Encoder::new(Model::Hdl32e, ReturnMode::Strongest);
    let good = encoder.packets(1, |_, _| [None; 2]).remove(0);
    for azimuth in [17_000_u16, 18_700] {
        let mut bytes = good.clone();
        bytes[702..704].copy_from_slice(&azimuth.to_le_bytes());
        let error = decoder().decode(&bytes).unwrap_err();
        let DecodeError::Packet(PacketError::AzimuthJump { block, to_deg, limit_deg, .. }) = error
        else {
            panic!("{error}");
        };
        assert_eq!((block, to_deg), (7, f64::from(azimuth) / 100.0));
        assert!((limit_deg - 0.41472).abs() < 1e-9);
    }
    // A head that does not turn does not.
    let mut static_scan = Encoder::new(Model::Hdl32e, ReturnMode::Strongest);
    static_scan.turn_rate_hz = 0.0;
    assert!(decoder().decode(&static_scan.packets(1, |_, _| [None; 2])[0]).is_ok());
}

#[test]
fn the_packets_of_another_model_are_refused_and_the_decoder_goes_on() {
    let packet =
        |model| Encoder::new(model, ReturnMode::Strongest).packets(1, |_, _| [None; 2]).remove(0);
    let mut decoder = decoder();
    decoder.decode(&packet(Model::Vlp16)).unwrap();
    let error = decoder.decode(&packet(Model::Hdl32e)).unwrap_err();
    assert_eq!(error.to_string(), "a packet of the HDL-32E among those of the VLP-16");
    decoder.decode(&packet(Model::Vlp16)).unwrap();

    let config = DecoderConfig { model: Some(Model::Hdl64e), ..DecoderConfig::default() };
    let mut stated = PacketDecoder::new(config).unwrap();
    let error = stated.decode(&packet(Model::Vlp16)).unwrap_err();
    assert_eq!(error.to_string(), "a packet of the VLP-16 among those of the HDL-64E");
}

#[test]
fn packets_without_factory_bytes_are_decoded_where_the_model_is_stated() {
    let encoder = Encoder::new(Model::Vlp16, ReturnMode::Strongest);
    let mut bytes = encoder.packets(1, |_, _| [Some((4.0, 1)), None]).remove(0);
    bytes[1204..].copy_from_slice(&[0, 0]);
    assert!(decoder().decode(&bytes).unwrap_err().to_string().contains("0x00 is not known"));
    let config = DecoderConfig {
        model: Some(Model::Vlp16),
        return_mode: Some(ReturnMode::Strongest),
        ..DecoderConfig::default()
    };
    let packet = PacketDecoder::new(config).unwrap().decode(&bytes).unwrap();
    assert_eq!((packet.model, packet.shots.len()), (Model::Vlp16, 24 * 16));
}

#[test]
fn a_configuration_that_does_not_hold_is_refused() {
    let of = |config: DecoderConfig| PacketDecoder::new(config).unwrap_err().to_string();
    let defaults = DecoderConfig::default;
    assert!(of(DecoderConfig { range_min_m: 9.0, range_max_m: 9.0, ..defaults() }).contains("9"));
    assert!(of(DecoderConfig { range_max_m: f64::NAN, ..defaults() }).contains("NaN"));
    assert!(of(DecoderConfig { max_turn_rate_hz: 0.0, ..defaults() }).contains("not above 0"));
    let calibration = Some(Calibration::of_data_sheet(Model::Vlp16));
    let wrong = DecoderConfig { model: Some(Model::Hdl32e), calibration, ..defaults() };
    assert!(of(wrong.clone()).contains("16 lasers"));
    // Where the model is not stated, the first packet names it.
    let mut decoder = PacketDecoder::new(DecoderConfig { model: None, ..wrong }).unwrap();
    let packets = Encoder::new(Model::Hdl32e, ReturnMode::Strongest).packets(1, |_, _| [None; 2]);
    let error = decoder.decode(&packets[0]).unwrap_err();
    assert!(matches!(error, DecodeError::Calibration(_)), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn no_bytes_make_it_panic(
        noise in proptest::collection::vec(any::<u8>(), PACKET_BYTES),
        keep in proptest::collection::vec(any::<bool>(), 14),
        model in 0..5_usize,
        dual in any::<bool>(),
    ) {
        // Packets that are right in parts get farther than noise.
        let mode = if dual { ReturnMode::Dual } else { ReturnMode::Strongest };
        let mut bytes = Encoder::new(Model::ALL[model], mode).packets(1, |_, _| [Some((3.0, 3)); 2]).remove(0);
        for (part, keep) in keep.into_iter().enumerate() {
            if !keep {
                // Shots, then azimuths, never the flags.
                let from = (part * 100 + if part % 2 == 0 { 4 } else { 2 }).min(1200);
                let to = (part * 100 + 100).min(PACKET_BYTES);
                bytes[from..to].copy_from_slice(&noise[from..to]);
            }
        }
        let mut decoder = decoder();
        if let Ok(packet) = decoder.decode(&bytes) {
            for shot in &packet.shots {
                prop_assert!(shot.position_m.iter().all(|value| value.is_finite()));
                prop_assert!(usize::from(shot.firing) < packet.firings.len());
                prop_assert!(usize::from(shot.row) < packet.elevations_rad.len());
            }
        }
        let _ = decoder.decode(&noise);
    }
}
