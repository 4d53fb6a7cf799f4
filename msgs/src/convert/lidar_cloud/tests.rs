use geometry::Stamp;
use proptest::prelude::*;

use super::*;
use crate::sensor_msgs::PointField;
use crate::std_msgs::Header;

const STAMP_S: i32 = 1_700_000_000;
const TURN_S: f64 = 0.1;

fn field(name: &str, offset: u32, datatype: u8) -> PointField {
    PointField { name: name.to_owned(), offset, datatype, count: 1 }
}

/// A turn of ten points whose times a driver writes as `time_of` a share of it.
fn turn(name: &str, datatype: u8, time_of: impl Fn(f64) -> f64) -> PointCloud2 {
    let mut data = Vec::new();
    for point in 0..10_u16 {
        for value in [f32::from(point) + 1.0, 2.0, 3.0, 40.0] {
            data.extend(value.to_le_bytes());
        }
        data.extend((point % 4).to_le_bytes());
        let time = time_of(f64::from(point) / 9.0);
        match datatype {
            PointField::FLOAT32 => data.extend((time as f32).to_le_bytes()),
            PointField::UINT32 => data.extend((time as u32).to_le_bytes()),
            _ => data.extend(time.to_le_bytes()),
        }
    }
    let point_step = data.len() as u32 / 10;
    let float = PointField::FLOAT32;
    PointCloud2 {
        header: Header {
            stamp: crate::convert::time_from_stamp(Stamp::from_secs_nanos(STAMP_S, 0)),
            frame_id: "lidar".to_owned(),
        },
        height: 1,
        width: 10,
        fields: vec![
            field("x", 0, float),
            field("y", 4, float),
            field("z", 8, float),
            field("intensity", 12, float),
            field("ring", 16, PointField::UINT16),
            field(name, 18, datatype),
        ],
        is_bigendian: false,
        point_step,
        row_step: point_step * 10,
        data,
        is_dense: true,
    }
}

#[test]
fn times_of_all_drivers_become_seconds_since_the_stamp() {
    let epoch_s = f64::from(STAMP_S);
    type TimeOf = Box<dyn Fn(f64) -> f64>;
    let cases: [(&'static str, u8, TimeOf, TimeUnit, TimeOrigin, f64); 7] = [
        // velodyne_pointcloud, of old and of new.
        (
            "time",
            PointField::FLOAT32,
            Box::new(|s| s * TURN_S),
            TimeUnit::Seconds,
            TimeOrigin::Stamp,
            0.0,
        ),
        (
            "time",
            PointField::FLOAT32,
            Box::new(|s| s * TURN_S - TURN_S),
            TimeUnit::Seconds,
            TimeOrigin::Stamp,
            -TURN_S,
        ),
        (
            "time",
            PointField::FLOAT32,
            Box::new(|s| s * TURN_S * 1e6),
            TimeUnit::Microseconds,
            TimeOrigin::Stamp,
            0.0,
        ),
        // ouster-ros.
        (
            "t",
            PointField::UINT32,
            Box::new(|s| s * TURN_S * 1e9),
            TimeUnit::Nanoseconds,
            TimeOrigin::Stamp,
            0.0,
        ),
        // Hesai and RoboSense.
        (
            "timestamp",
            PointField::FLOAT64,
            Box::new(move |s| epoch_s + s * TURN_S),
            TimeUnit::Seconds,
            TimeOrigin::Epoch,
            0.0,
        ),
        // livox_ros_driver2.
        (
            "timestamp",
            PointField::FLOAT64,
            Box::new(move |s| (epoch_s + s * TURN_S) * 1e9),
            TimeUnit::Nanoseconds,
            TimeOrigin::Epoch,
            0.0,
        ),
        // Milliseconds since it was switched on.
        (
            "timestamp",
            PointField::FLOAT64,
            Box::new(|s| 7e6 + s * TURN_S * 1e3),
            TimeUnit::Milliseconds,
            TimeOrigin::EarliestPoint,
            0.0,
        ),
    ];
    for (name, datatype, time_of, unit, origin, first_s) in cases {
        let reading = lidar_cloud_from_message(&turn(name, datatype, time_of), None).unwrap();
        assert_eq!(reading.times, PointTimes::Known { field: name, unit, origin });
        let times_s = reading.cloud.times_s.unwrap();
        let off = |time_s: f32, expected_s: f64| (f64::from(time_s) - expected_s).abs();
        // A double holds seconds since 1970 to a quarter of a microsecond.
        assert!(off(times_s[0], first_s) < 1e-6, "{name} {unit}: {times_s:?}");
        assert!(off(times_s[9], first_s + TURN_S) < 1e-6, "{name} {unit}: {times_s:?}");
        assert_eq!(reading.cloud.rings.unwrap()[..5], [0, 1, 2, 3, 0]);
        assert_eq!(reading.cloud.intensities.unwrap(), [40.0; 10]);
    }
}

#[test]
fn what_is_no_time_is_said_and_left_out() {
    let float = PointField::FLOAT64;
    let read = |time_of: fn(f64) -> f64, unit| {
        lidar_cloud_from_message(&turn("time", float, time_of), unit).unwrap()
    };
    let still = read(|_| 0.0, None);
    assert_eq!(
        (still.times, still.cloud.times_s),
        (PointTimes::AllTheSame { field: "time" }, None)
    );
    let broken = read(|_| f64::NAN, None);
    assert_eq!(broken.times, PointTimes::AllTheSame { field: "time" });
    let long = read(|s| 1e12 * s, None);
    assert_eq!(long.cloud.times_s, None);
    assert!(long.times.to_string().contains("in no unit"), "{}", long.times);
    // A caller may give a known unit: a slow scanner's hour.
    let known = read(|s| 9.0 * s, Some(TimeUnit::Milliseconds));
    assert!((known.cloud.times_s.unwrap()[9] - 0.009).abs() < 1e-6);
    let mut bare = turn("time", float, |s| s);
    bare.fields.truncate(3);
    let bare = lidar_cloud_from_message(&bare, None).unwrap();
    assert_eq!(bare.times, PointTimes::NoField);
    assert_eq!((bare.cloud.rings, bare.cloud.intensities), (None, None));
}

/// Regression: the time of one point, as of a return that a driver stamps wrongly, decided on the unit and the origin of all.
#[test]
fn a_stray_time_changes_neither_unit_nor_origin() {
    let epoch_s = f64::from(STAMP_S);
    let drivers: [(f64, TimeUnit, f64); 3] = [
        (0.0, TimeUnit::Seconds, 1.0),
        (0.0, TimeUnit::Nanoseconds, 1e-9),
        (epoch_s, TimeUnit::Seconds, 1.0),
    ];
    for (from_s, unit, unit_s) in drivers {
        for stray in [-1.0, 3.0, 1e12] {
            let mut times: Vec<f64> = (0..200_u8)
                .map(|point| (from_s + TURN_S * f64::from(point) / 199.0) / unit_s)
                .collect();
            let stamp = Stamp::from_secs_nanos(STAMP_S, 0);
            let healthy = times::understood("time", &mut times.clone(), stamp, None);
            times[70] = times[0] + stray / unit_s;
            let read = times::understood("time", &mut times, stamp, None);
            assert_eq!(read, healthy, "{stray} s off");
            assert!(matches!(read, PointTimes::Known { unit: of, .. } if of == unit), "{read}");
            assert!(times[0].abs() < 1e-6 && (times[199] - TURN_S).abs() < 1e-6);
        }
    }
}

#[test]
fn points_that_are_no_returns_are_left_out_with_all_that_is_said_of_them() {
    let mut message = turn("time", PointField::FLOAT64, |s| s * TURN_S);
    // The second is not a number, the third at the scanner.
    let step = message.point_step as usize;
    message.data[step..step + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    message.data[2 * step..2 * step + 12].fill(0);
    let cloud = lidar_cloud_from_message(&message, None).unwrap().cloud;
    assert_eq!((cloud.points_m.len(), cloud.points_m[1].x), (8, 4.0));
    assert_eq!(cloud.rings.unwrap()[..2], [0, 3]);
    assert_eq!((cloud.times_s.unwrap().len(), cloud.intensities.unwrap().len()), (8, 8));
}

#[test]
fn rows_of_an_organised_cloud_are_rings_where_nothing_says_more() {
    let mut message = turn("time", PointField::FLOAT64, |s| s * TURN_S);
    message.fields.remove(4);
    (message.height, message.width) = (2, 5);
    message.row_step = 5 * message.point_step;
    let cloud = lidar_cloud_from_message(&message, None).unwrap().cloud;
    assert_eq!(cloud.rings.unwrap(), [0, 0, 0, 0, 0, 1, 1, 1, 1, 1]);
}

proptest! {
    #[test]
    fn any_message_is_read_or_refused(
        width in 0..20_u32,
        height in 0..5_u32,
        point_step in 0..40_u32,
        row_step in 0..400_u32,
        offsets in proptest::array::uniform6(0..40_u32),
        datatypes in proptest::array::uniform6(0..10_u8),
        data in proptest::collection::vec(any::<u8>(), 0..400),
        big in any::<bool>(),
    ) {
        let names = ["x", "y", "z", "intensity", "ring", "t"];
        let fields = names.iter().zip(offsets).zip(datatypes);
        let message = PointCloud2 {
            header: Header::default(),
            height,
            width,
            fields: fields.map(|((name, offset), datatype)| field(name, offset, datatype)).collect(),
            is_bigendian: big,
            point_step,
            row_step,
            data,
            is_dense: true,
        };
        if let Ok(LidarCloudReading { cloud, .. }) = lidar_cloud_from_message(&message, None) {
            let count = cloud.points_m.len();
            prop_assert!(count <= (width * height) as usize);
            prop_assert!(cloud.rings.is_none_or(|rings| rings.len() == count));
            prop_assert!(cloud.times_s.is_none_or(|times_s| times_s.len() == count));
        }
    }
}
