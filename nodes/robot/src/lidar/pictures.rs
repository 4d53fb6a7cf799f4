//! Pictures of a drive: its trajectory, its map from above, a scan as a panorama.

use std::path::Path;

use geometry::LidarCloud;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use lidar_odometry::drawing::{DrawnTrajectory, DrawnView, drawn};
use lidar_odometry::panorama::{ColourMap, PanoramaConfig, Quantity};
use lidar_odometry::recorded::revolution_from_cloud;
use lidar_odometry::road_map::RoadMap;
use nalgebra::{Isometry3, Point2};
use report::PagePicture;

use super::files::{RoadColour, RoadExtent, cannot_write, for_each};
use crate::failure::Failure;

/// A picture with its file's name.
pub(super) struct NamedPicture {
    pub(super) name: &'static str,
    pub(super) picture: PagePicture,
}

/// Pixels of a drawing of the trajectory: half of a screen.
const DRAWING_PX: usize = 800;
/// The radius of the drawing around the vehicle: a few streets.
const DRAWING_RADIUS_M: f64 = 100.0;
/// Pixels of the longer side of the map from above, at most ...
const MAP_PX: f64 = 1400.0;
/// ... and of a voxel's edge: with more, neighbouring voxels would have gaps between them.
const VOXEL_PX: f64 = 0.75;

fn png(rgb: &[u8], (width, height): (usize, usize)) -> Result<Vec<u8>, Failure> {
    let mut png = Vec::new();
    let size = |value: usize| u32::try_from(value).unwrap_or(u32::MAX);
    PngEncoder::new(&mut png)
        .write_image(rgb, size(width), size(height), ExtendedColorType::Rgb8)
        .map_err(|error| Failure::new(format!("cannot make a picture: {error}")))?;
    Ok(png)
}

fn named(
    name: &'static str,
    rgb: &[u8],
    size_px: (usize, usize),
    caption: String,
) -> Result<NamedPicture, Failure> {
    let size = |value: usize| u32::try_from(value).unwrap_or(u32::MAX);
    let picture = PagePicture {
        png: png(rgb, size_px)?,
        size_px: (size(size_px.0), size(size_px.1)),
        alt: caption.clone(),
        caption,
    };
    Ok(NamedPicture { name, picture })
}

/// The drawings of the thesis' options A and B.
pub(super) fn drawings(
    trajectory: &[Isometry3<f64>],
    truth: Option<&[Isometry3<f64>]>,
    surroundings_m: &[Point2<f32>],
) -> Result<Vec<NamedPicture>, Failure> {
    let about = DrawnView::AboutVehicle { radius_m: DRAWING_RADIUS_M };
    let views = [
        (
            "drive_from_above.png",
            about,
            "A: the vehicle in the middle, looking up, at the end of the drive",
        ),
        ("whole_drive.png", DrawnView::Whole, "B: the whole drive, x to the right"),
    ];
    let draw = |(name, view, caption): (&'static str, DrawnView, &str)| {
        let surroundings_m = if view == about { surroundings_m } else { &[] };
        let truth = truth.filter(|_| view != about);
        let drawing = drawn(
            &DrawnTrajectory { map_from_vehicle: trajectory, truth, surroundings_m },
            view,
            DRAWING_PX,
        );
        let truth_note = if truth.is_some() { "; the true trajectory in orange" } else { "" };
        let caption = format!("{caption}; {} m between grid lines{truth_note}", drawing.grid_m);
        named(name, &drawing.picture.rgb, (DRAWING_PX, DRAWING_PX), caption)
    };
    views.into_iter().map(draw).collect()
}

/// A scan as panoramas, in our colours and in those of the thesis; none if the cloud has no rings.
pub(super) fn panoramas(cloud: &LidarCloud) -> Result<Vec<NamedPicture>, Failure> {
    let Some(revolution) = revolution_from_cloud(cloud) else { return Ok(Vec::new()) };
    let mut intensities: Vec<f32> = cloud.intensities.clone().unwrap_or_default();
    intensities.retain(|value| value.is_finite());
    intensities.sort_by(f32::total_cmp);
    // KITTI's intensities are 0 to 1, those of others 0 to 255, and few are bright.
    let bright = intensities.get(intensities.len() * 98 / 100).copied().unwrap_or(1.0);
    let limits = [0.0, bright.max(f32::MIN_POSITIVE)];
    // The fewer lasers, the higher the rows, so that the picture can be read.
    let row_height_px = (240 / revolution.rows().max(1)).clamp(2, 12);
    let base = PanoramaConfig { row_height_px, ..PanoramaConfig::default() };
    let kinds = [
        (
            "panorama_intensity.png",
            PanoramaConfig { limits, ..PanoramaConfig::intensities() },
            "intensity",
        ),
        (
            "panorama_range.png",
            PanoramaConfig::default(),
            "range, by its logarithm from 2 to 100 m",
        ),
        (
            "panorama_intensity_pink.png",
            PanoramaConfig {
                quantity: Quantity::Intensity,
                colour_map: ColourMap::Pink,
                limits,
                ..PanoramaConfig::default()
            },
            "intensity, in the thesis' colours (PINK)",
        ),
        (
            "panorama_range_hsv.png",
            PanoramaConfig::hsv_ranges(),
            "range, in the thesis' colours (HSV, evenly scaled)",
        ),
    ];
    let draw = |(name, config, caption): (&'static str, PanoramaConfig, &str)| {
        let config = PanoramaConfig { row_height_px: base.row_height_px, ..config };
        let picture = config
            .draw(&revolution)
            .map_err(|error| Failure::new(format!("cannot draw a panorama: {error}")))?;
        let size_px = (picture.width_px, picture.height_px);
        named(name, &picture.rgb, size_px, format!("Panorama: {caption}; forward in the middle"))
    };
    kinds.into_iter().map(draw).collect()
}

/// The map from above: the highest point of each pixel.
pub(super) fn map_from_above(
    map: &RoadMap,
    extent: &RoadExtent,
    (by, voxel_edge_m): (RoadColour, f64),
    name: &'static str,
) -> Result<NamedPicture, Failure> {
    let size_m = [0, 1].map(|axis: usize| {
        let of = |corner: &[f64; 3]| corner.get(axis).copied().unwrap_or(0.0);
        (of(&extent.high_m) - of(&extent.low_m)).max(1.0)
    });
    let px_per_m = (MAP_PX / size_m[0].max(size_m[1])).min(VOXEL_PX / voxel_edge_m);
    let [width, height] = size_m.map(|size_m| (size_m * px_per_m).ceil() as usize + 1);
    let mut rgb = vec![255; 3 * width * height];
    let mut heights_m = vec![f64::NEG_INFINITY; width * height];
    for_each(map, |point| {
        let column = ((point.position_m.x - extent.low_m[0]) * px_per_m) as usize;
        let row = ((extent.high_m[1] - point.position_m.y) * px_per_m) as usize;
        let index = row * width + column;
        if let Some(known_m) =
            heights_m.get_mut(index).filter(|known_m| **known_m < point.position_m.z)
        {
            *known_m = point.position_m.z;
            if let Some(pixel) = rgb.get_mut(3 * index..3 * index + 3) {
                pixel.copy_from_slice(&extent.colour(point, by));
            }
        }
        Ok(())
    })?;
    let caption = match by {
        RoadColour::Intensity => "The map from above, by intensity".to_owned(),
        RoadColour::Height => {
            let [low_m, high_m] = extent.heights_m;
            format!("The map from above, by height: {low_m:.1} to {high_m:.1} m")
        }
    };
    named(name, &rgb, (width, height), caption)
}

/// Writes the pictures into a folder.
pub(super) fn write(folder: &Path, pictures: &[NamedPicture]) -> Result<(), Failure> {
    for NamedPicture { name, picture } in pictures {
        let path = folder.join(name);
        std::fs::write(&path, &picture.png).map_err(|error| cannot_write(&path, &error))?;
    }
    Ok(())
}
