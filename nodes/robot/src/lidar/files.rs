//! The road map as files, written tile by tile: only one tile at a time is in memory.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use lidar_odometry::panorama::ColourMap;
use lidar_odometry::road_map::{RoadMap, RoadPoint};

use crate::failure::Failure;
use crate::las_file::{LasError, LasFile, LasKind};
use crate::unfinished::Unfinished;

/// What a map is coloured by.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, clap::ValueEnum)]
pub(crate) enum RoadColour {
    /// By the intensity of the returns
    #[default]
    Intensity,
    /// By the height
    Height,
}

/// The properties of a map that determine the colours of its points.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct RoadExtent {
    /// Points.
    pub points: u64,
    /// The lowest and the highest intensity, without a hundredth at each end.
    pub intensities: [f32; 2],
    /// The lowest and the greatest height, likewise.
    pub heights_m: [f64; 2],
    /// The corners, in metres.
    pub low_m: [f64; 3],
    pub high_m: [f64; 3],
}

/// About how many points of a map are sampled for the quantiles, at most.
const MOST_SAMPLES: usize = 200_000;

impl RoadExtent {
    pub(crate) fn of(map: &RoadMap) -> Result<Self, Failure> {
        let (mut points, mut low_m, mut high_m) = (0, [f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let (mut intensities, mut heights_m) = (Vec::new(), Vec::new());
        // If there are too many samples, every second one is dropped.
        let mut stride = 1_u64;
        for_each(map, |point| {
            for (axis, value_m) in point.position_m.iter().enumerate() {
                if let (Some(low), Some(high)) = (low_m.get_mut(axis), high_m.get_mut(axis)) {
                    *low = value_m.min(*low);
                    *high = value_m.max(*high);
                }
            }
            if points % stride == 0 {
                intensities.push(f64::from(point.intensity));
                heights_m.push(point.position_m.z);
                if intensities.len() > MOST_SAMPLES {
                    stride *= 2;
                    every_second(&mut intensities);
                    every_second(&mut heights_m);
                }
            }
            points += 1;
            Ok(())
        })?;
        let [dark, bright] = middle(&mut intensities);
        let heights_m = middle(&mut heights_m);
        Ok(Self { points, intensities: [dark as f32, bright as f32], heights_m, low_m, high_m })
    }

    /// The colour of a point.
    pub(crate) fn colour(&self, point: &RoadPoint, by: RoadColour) -> [u8; 3] {
        let share = |value: f64, low: f64, high: f64| {
            if high > low { ((value - low) / (high - low)) as f32 } else { 0.5 }
        };
        ColourMap::Even.colour(match by {
            RoadColour::Intensity => {
                let [low, high] = self.intensities.map(f64::from);
                share(f64::from(point.intensity), low, high)
            }
            RoadColour::Height => share(point.position_m.z, self.heights_m[0], self.heights_m[1]),
        })
    }
}

fn every_second(values: &mut Vec<f64>) {
    let mut keep = false;
    values.retain(|_| {
        keep = !keep;
        keep
    });
}

/// The values at the first and the last hundredth.
fn middle(values: &mut [f64]) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    [last / 100, last - last / 100].map(|index| values.get(index).copied().unwrap_or(0.0))
}

/// All points of a map, in the order of its tiles.
pub(crate) fn for_each(
    map: &RoadMap,
    mut take: impl FnMut(&RoadPoint) -> Result<(), Failure>,
) -> Result<(), Failure> {
    for tile in map.tiles() {
        let points = map.points(tile).map_err(|error| Failure::new(error.to_string()))?;
        points.iter().try_for_each(&mut take)?;
    }
    Ok(())
}

/// Writes PLY: x, y, z, intensity and a colour; coordinates in the map frame in single precision.
pub(crate) fn write_ply(
    path: &Path,
    map: &RoadMap,
    extent: &RoadExtent,
    colour: RoadColour,
) -> Result<(), Failure> {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nproperty float intensity\nproperty uchar red\nproperty uchar green\n\
         property uchar blue\nend_header\n",
        extent.points
    );
    write(path, &header, map, |file, point| {
        single_precision(file, point)?;
        file.write_all(&extent.colour(point, colour))
    })
}

/// Writes PCD: x, y, z, intensity.
pub(crate) fn write_pcd(path: &Path, map: &RoadMap, extent: &RoadExtent) -> Result<(), Failure> {
    let points = extent.points;
    let header = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\n\
         TYPE F F F F\nCOUNT 1 1 1 1\nWIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA binary\n"
    );
    write(path, &header, map, single_precision)
}

fn single_precision(file: &mut BufWriter<File>, point: &RoadPoint) -> io::Result<()> {
    for value_m in point.position_m.iter() {
        file.write_all(&(*value_m as f32).to_le_bytes())?;
    }
    file.write_all(&point.intensity.to_le_bytes())
}

fn write(
    path: &Path,
    header: &str,
    map: &RoadMap,
    mut record: impl FnMut(&mut BufWriter<File>, &RoadPoint) -> io::Result<()>,
) -> Result<(), Failure> {
    let failed = |error: io::Error| cannot_write(path, &error);
    let temporary = Unfinished::beside(path);
    let mut file = BufWriter::new(File::create(temporary.path()).map_err(failed)?);
    file.write_all(header.as_bytes()).map_err(failed)?;
    for_each(map, |point| record(&mut file, point).map_err(failed))?;
    file.flush().and_then(|()| temporary.becomes(path)).map_err(failed)
}

/// Writes LAS 1.4 with intensities and colours: of both, 16 bits for what the extent spans.
pub(crate) fn write_las(
    path: &Path,
    map: &RoadMap,
    extent: &RoadExtent,
    colour: RoadColour,
) -> Result<(), Failure> {
    let failed = |error: LasError| {
        Failure::new(format!("cannot write {}: {error}", path.display()))
            .fix("give a folder that can be written with --out")
    };
    let temporary = Unfinished::beside(path);
    let file = File::create(temporary.path()).map_err(|error| cannot_write(path, &error))?;
    let kind = LasKind { has_colour: true, is_compressed: false, epsg: None };
    let mut las = LasFile::new(BufWriter::new(file), extent.low_m, kind).map_err(failed)?;
    let [dark, bright] = extent.intensities;
    for_each(map, |point| {
        let share = if bright > dark { (point.intensity - dark) / (bright - dark) } else { 0.5 };
        // The float-to-int cast saturates.
        let intensity = (share * f32::from(u16::MAX)) as u16;
        let rgb = extent.colour(point, colour);
        las.push(point.position_m.coords.into(), intensity, Some(rgb)).map_err(failed)
    })?;
    let flushed = las.finish().map_err(failed)?.flush();
    flushed.and_then(|()| temporary.becomes(path)).map_err(|error| cannot_write(path, &error))
}

pub(super) fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    Failure::new(format!("cannot write {}: {error}", path.display()))
        .fix("give a folder that can be written with --out")
}

#[cfg(test)]
mod tests;
