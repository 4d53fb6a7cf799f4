//! Clouds of turning LiDARs, with what their drivers say of each point.

#[cfg(test)]
mod tests;
mod times;

use geometry::LidarCloud;
use nalgebra::Point3;

use super::cloud::layout::FieldPlace;
use super::rows::Rows;
use super::{ConvertError, stamp_from_time};
use crate::sensor_msgs::PointCloud2;
pub use times::{PointTimes, TimeOrigin, TimeUnit};

/// The names that drivers give to the time of a point: Velodyne's and most others, Ouster's, those of Hesai, RoboSense and Livox.
const TIME_FIELDS: [&str; 6] =
    ["time", "t", "timestamp", "time_stamp", "offset_time", "time_offset"];
/// ... the laser,
const RING_FIELDS: [&str; 4] = ["ring", "channel", "laser_id", "line"];
/// ... and how much light came back.
const INTENSITY_FIELDS: [&str; 3] = ["intensity", "reflectivity", "i"];
/// An organised cloud without a field for the laser has a row for each; no scanner has more.
const MOST_ROWS: u32 = 256;

/// A cloud, and how the times of its points were understood.
#[derive(Clone, PartialEq, Debug)]
pub struct LidarCloudReading {
    /// The cloud.
    pub cloud: LidarCloud,
    /// How its times were read.
    pub times: PointTimes,
}

/// The cloud of a message of a LiDAR's driver: its points in the message's order, without those that are not finite or at the
/// scanner itself (no returns), with intensities, rings and times where there are fields for them.
///
/// Times may be in any unit, and count from the stamp, from 1970 or from anything: this is inferred from the duration of a revolution
/// ([`PointTimes`]), unless `unit` gives it. The rows of an organised cloud without rings are its rings.
///
/// # Errors
/// When x, y or z is missing, a field that is read is repeated, of unknown datatype or not within the point; when rows overlap
/// or the data is shorter than they are.
pub fn lidar_cloud_from_message(
    message: &PointCloud2,
    unit: Option<TimeUnit>,
) -> Result<LidarCloudReading, ConvertError> {
    let stamp = stamp_from_time(message.header.stamp);
    let mut cloud =
        LidarCloud { stamp, frame_id: message.header.frame_id.clone(), ..LidarCloud::default() };
    if message.width == 0 || message.height == 0 {
        return Ok(LidarCloudReading { cloud, times: PointTimes::NoField });
    }
    let fields = Fields::of(message)?;
    let rows = Rows::checked(&message.data, &message.into())?;
    let mut listed = fields.list(message, &rows);
    let times = match fields.time {
        None => PointTimes::NoField,
        Some((name, _)) => times::understood(name, &mut listed.times, stamp, unit),
    };
    cloud.points_m = listed.points_m;
    cloud.intensities = fields.intensity.map(|_| listed.intensities);
    cloud.rings = (fields.ring.is_some() || fields.rows_are_rings).then_some(listed.rings);
    if matches!(times, PointTimes::Known { .. }) {
        cloud.times_s = Some(listed.times.into_iter().map(|time_s| time_s as f32).collect());
    }
    Ok(LidarCloudReading { cloud, times })
}

struct Fields {
    position: [FieldPlace; 3],
    intensity: Option<FieldPlace>,
    ring: Option<FieldPlace>,
    rows_are_rings: bool,
    time: Option<(&'static str, FieldPlace)>,
}

#[derive(Default)]
struct Listed {
    points_m: Vec<Point3<f32>>,
    intensities: Vec<f32>,
    rings: Vec<u16>,
    times: Vec<f64>,
}

impl Fields {
    fn of(message: &PointCloud2) -> Result<Self, ConvertError> {
        let place = |name: &'static str| FieldPlace::of(message, name);
        let first = |names: &[&'static str]| {
            let is_there = |name: &&&str| message.fields.iter().any(|field| field.name == **name);
            let found = names.iter().find(is_there);
            found.map(|name| place(name).map(|place| (*name, place))).transpose()
        };
        let ring = first(&RING_FIELDS)?.map(|(_, place)| place);
        let rows_are_rings = ring.is_none()
            && (2..=MOST_ROWS).contains(&message.height)
            && message.width > message.height;
        Ok(Self {
            position: [place("x")?, place("y")?, place("z")?],
            intensity: first(&INTENSITY_FIELDS)?.map(|(_, place)| place),
            ring,
            rows_are_rings,
            time: first(&TIME_FIELDS)?,
        })
    }

    fn list(&self, message: &PointCloud2, rows: &Rows<'_>) -> Listed {
        let mut listed = Listed::default();
        let big_endian = message.is_bigendian;
        listed.points_m.reserve(rows.records());
        for (row, bytes) in rows.iter().enumerate() {
            for record in bytes.chunks_exact(message.point_step.max(1) as usize) {
                let read = |place: FieldPlace| place.read(record, big_endian).unwrap_or(f64::NAN);
                let point_m = Point3::from(self.position.map(|place| read(place) as f32));
                if !geometry::is_finite(&point_m) || point_m == Point3::origin() {
                    continue;
                }
                listed.points_m.push(point_m);
                listed.intensities.extend(self.intensity.map(|place| read(place) as f32));
                match self.ring {
                    // The float-to-int cast saturates.
                    Some(place) => listed.rings.push(read(place) as u16),
                    None if self.rows_are_rings => listed.rings.push(row as u16),
                    None => {}
                }
                listed.times.extend(self.time.map(|(_, place)| read(place)));
            }
        }
        listed
    }
}
