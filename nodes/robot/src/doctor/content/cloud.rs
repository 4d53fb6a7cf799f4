//! The content of clouds: the distances and the times of their points.

use std::f64::consts::TAU;

use estimation::quantile::upper_median;
use geometry::span_without_strays;
use msgs::convert::{PointTimes, lidar_cloud_from_message};
use msgs::sensor_msgs::{PointCloud2, PointField};

use super::{Check, Finding, Subject, Typical};
use crate::lidar::POINT_TIMES_FIX;

/// About how many points of a cloud are sampled.
const SAMPLES: usize = 2000;
/// No scanner of a car sees this far for half of its points.
const FARTHEST_M: f64 = 500.0;
/// The horizon in parts; a scanner that turns has points in nearly all of them.
const SECTORS: u32 = 12;
const MOST_SECTORS: u32 = 10;
/// Names of the field with the laser of each point; only 3D scanners have one.
const RING_FIELDS: [&str; 5] = ["ring", "line", "channel", "laser_id", "row"];
/// Parts of the names that 3D scanners have as topics and frames.
const SCANNER_NAMES: [&str; 8] =
    ["velodyne", "lidar", "ouster", "os_sensor", "hesai", "pandar", "rslidar", "livox"];
/// A cloud's points take no longer than so many times the time between clouds, ...
const MOST_PERIODS: f64 = 3.0;
/// ... and no less than this share of it.
const LEAST_PERIODS: f64 = 0.02;
/// A sensor with fewer points than this share measures nothing.
const LEAST_SHARE: f64 = 0.005;

/// What is known of clouds.
#[derive(Clone, PartialEq, Debug, Default)]
pub(in crate::doctor) struct CloudFacts {
    clouds: u64,
    /// The fields of the first cloud.
    fields: Vec<String>,
    samples: u64,
    finite: u64,
    distance_m: Typical,
    /// Of the horizon, a bit for each part that has points.
    sectors: u32,
    /// Whether a frame or a field is a 3D scanner's.
    is_scanner: bool,
    /// The field with the times of points, as the nodes read it, and how long the points of a cloud take by it.
    time_field: Option<&'static str>,
    turn_s: Typical,
    /// The same in the field's own unit, of the first cloud whose times are in no unit those of a turn.
    no_turn: Option<f64>,
}

/// Reads one field of a point.
struct FieldReader {
    offset: usize,
    datatype: u8,
    is_bigendian: bool,
}

impl FieldReader {
    fn of(cloud: &PointCloud2, field: &PointField) -> Self {
        let offset = field.offset as usize;
        Self { offset, datatype: field.datatype, is_bigendian: cloud.is_bigendian }
    }

    fn read(&self, point: &[u8]) -> Option<f64> {
        match self.datatype {
            PointField::UINT16 => {
                Some(self.bytes(point, u16::from_le_bytes, u16::from_be_bytes)?.into())
            }
            PointField::INT32 => {
                Some(self.bytes(point, i32::from_le_bytes, i32::from_be_bytes)?.into())
            }
            PointField::UINT32 => {
                Some(self.bytes(point, u32::from_le_bytes, u32::from_be_bytes)?.into())
            }
            PointField::FLOAT32 => {
                Some(self.bytes(point, f32::from_le_bytes, f32::from_be_bytes)?.into())
            }
            PointField::FLOAT64 => self.bytes(point, f64::from_le_bytes, f64::from_be_bytes),
            _ => None,
        }
    }

    fn bytes<T, const N: usize>(
        &self,
        point: &[u8],
        little: fn([u8; N]) -> T,
        big: fn([u8; N]) -> T,
    ) -> Option<T> {
        let bytes = *point.get(self.offset..)?.first_chunk::<N>()?;
        Some(if self.is_bigendian { big(bytes) } else { little(bytes) })
    }
}

impl CloudFacts {
    pub(super) fn take(&mut self, cloud: &PointCloud2) {
        let field =
            |names: &[&str]| cloud.fields.iter().find(|field| names.contains(&field.name.as_str()));
        if self.clouds == 0 {
            self.fields = cloud.fields.iter().map(|field| field.name.clone()).collect();
        }
        self.clouds += 1;
        self.is_scanner |= field(&RING_FIELDS).is_some() || is_scanner(&cloud.header.frame_id);
        let [Some(x), Some(y), Some(z)] =
            [["x"], ["y"], ["z"]].map(|name| Some(FieldReader::of(cloud, field(&name)?)))
        else {
            return;
        };
        let point_bytes = (cloud.point_step as usize).max(1);
        // Rows may be padded; a few wrong samples do not change the median.
        let points = cloud.data.chunks_exact(point_bytes);
        let step = (points.len() / SAMPLES).max(1) | 1;
        let mut distances_m = Vec::new();
        for point in points.step_by(step) {
            self.samples += 1;
            let (Some(x_m), Some(y_m), Some(z_m)) = (x.read(point), y.read(point), z.read(point))
            else {
                continue;
            };
            let position = nalgebra::Vector3::new(x_m, y_m, z_m);
            let distance_m = position.norm();
            if !distance_m.is_finite() || distance_m == 0.0 {
                continue;
            }
            self.finite += 1;
            distances_m.push(distance_m);
            let bearing = y_m.atan2(x_m).rem_euclid(TAU) / TAU;
            self.sectors |= 1 << ((bearing * f64::from(SECTORS)) as u32).min(SECTORS - 1);
        }
        if let Some(distance_m) = upper_median(&mut distances_m) {
            self.distance_m.add(distance_m);
        }
        self.take_times(cloud);
    }

    /// How the nodes understand the times of the points.
    fn take_times(&mut self, cloud: &PointCloud2) {
        // What cannot be read is reported of the message.
        let Ok(reading) = lidar_cloud_from_message(cloud, None) else { return };
        match reading.times {
            PointTimes::NoField => {}
            PointTimes::AllTheSame { field } => {
                self.time_field = Some(field);
                self.turn_s.add(0.0);
            }
            PointTimes::NoRevolution { field, span } => {
                self.time_field = Some(field);
                self.no_turn.get_or_insert(span);
            }
            PointTimes::Known { field, .. } => {
                self.time_field = Some(field);
                let times_s = reading.cloud.times_s.unwrap_or_default().into_iter();
                if let Some(turn) = span_without_strays(times_s.map(f64::from)) {
                    self.turn_s.add(turn.end() - turn.start());
                }
            }
        }
    }

    pub(super) fn findings(&self, subject: &Subject<'_>) -> Vec<Finding> {
        let topic = subject.topic;
        let mut findings = Vec::new();
        if let Some(distance_m) = self.distance_m.median()
            && distance_m > FARTHEST_M
        {
            findings.push(subject.grave(
                Check::Units,
                format!(
                    "{topic}: the median distance of its points is {distance_m:.0} m, which is {:.2} m if they are \
                     millimetres",
                    distance_m * 1e-3
                ),
                "x, y and z have metres (REP-103): divide by 1000 in the driver",
            ));
        }
        findings.extend(self.point_times(subject));
        if self.samples > 0 && (self.finite as f64) < LEAST_SHARE * self.samples as f64 {
            findings.push(Finding::grave_if(
                self.finite == 0 && subject.is_read,
                Check::Returns,
                format!(
                    "{topic}: {} of {} points of {} clouds have a position",
                    self.finite, self.samples, self.clouds
                ),
                "uncover the sensor; see that it turns, or that it is in its range and out of the sun",
            ));
        }
        findings
    }

    /// Whether it is known when the points of a turn were measured.
    fn point_times(&self, subject: &Subject<'_>) -> Option<Finding> {
        let turns = self.sectors.count_ones() >= MOST_SECTORS;
        if !turns || !(self.is_scanner || is_scanner(subject.topic)) {
            return None;
        }
        let topic = subject.topic;
        let Some(name) = self.time_field else {
            let what = format!(
                "{topic}: the clouds of a scanner that turns have no time for each point (fields: {})",
                self.fields.join(", ")
            );
            return Some(Finding::warn(Check::PointTimes, what, POINT_TIMES_FIX));
        };
        const UNITS: &str = "the times of the points of a turn, in seconds or a thousandth, millionth or billionth of them, as drivers have \
                              them: see what the driver publishes";
        let Some(turn_s) = self.turn_s.median() else {
            let span = self.no_turn?;
            let what = format!(
                "{topic}: by the field {name} the points of a cloud take {span:.3e}, in no unit the time of a turn: the motion within a \
                 turn is not corrected"
            );
            return Some(subject.grave(Check::Units, what, UNITS));
        };
        if turn_s == 0.0 {
            let what = format!("{topic}: the field {name} is the same for all points of a cloud");
            return Some(Finding::warn(Check::PointTimes, what, POINT_TIMES_FIX));
        }
        let period_s = subject.period_s?;
        if (LEAST_PERIODS * period_s..=MOST_PERIODS * period_s).contains(&turn_s) {
            return None;
        }
        let what = format!(
            "{topic}: by the field {name} the points of a cloud take {turn_s:.3e} s, and clouds come every {period_s:.3} s"
        );
        Some(subject.grave(Check::Units, what, UNITS))
    }
}

fn is_scanner(name: &str) -> bool {
    SCANNER_NAMES.iter().any(|part| name.contains(part))
}
