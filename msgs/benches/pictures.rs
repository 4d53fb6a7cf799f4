//! How long compressed images take and how small they are: `cargo bench -p msgs --bench pictures`. A
//! room of the simulator, and where a folder is given (`-- FOLDER`) its PNG pictures: depth where they
//! are grey of 16 bits, else colours.

#![allow(clippy::print_stdout, reason = "the table is what this program is for")]

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use geometry::DepthImage;
use msgs::convert::{
    self, DepthCodec, ImageCodec, InverseDepth, JpegQuality, MetresAs,
    compressed_depth_from_message, compressed_message_from_depth_with,
    compressed_message_from_image, depth_from_message, image_from_compressed_message,
};
use msgs::sensor_msgs::{CompressedImage, Image};
use simulator::{Sample, Scenario};

/// Frames of a recording, and how often each is measured.
const FRAMES: usize = 20;
const ROUNDS: usize = 7;

fn main() -> Result<(), Box<dyn Error>> {
    depths("simulated room", &simulated_depths()?)?;
    // Cargo adds an argument of its own.
    for folder in std::env::args().skip(1).filter(|argument| !argument.starts_with("--")) {
        let mut recorded: Vec<Image> = Vec::new();
        for path in pictures(Path::new(&folder))? {
            let picture =
                CompressedImage { data: std::fs::read(path)?, ..CompressedImage::default() };
            recorded.push(image_from_compressed_message(&picture)?);
        }
        if recorded.first().is_some_and(|image| image.encoding == "16UC1") {
            let recorded: Result<Vec<DepthImage>, _> =
                recorded.iter().map(depth_from_message).collect();
            depths(&folder, &recorded?)?;
        } else {
            colours(&folder, &recorded)?;
        }
    }
    Ok(())
}

/// Pictures from all over a folder.
fn pictures(folder: &Path) -> Result<Vec<std::path::PathBuf>, Box<dyn Error>> {
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        paths.push(entry?.path());
    }
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "png"));
    paths.sort();
    let step = paths.len().div_ceil(FRAMES).max(1);
    Ok(paths.into_iter().step_by(step).collect())
}

fn simulated_depths() -> Result<Vec<DepthImage>, Box<dyn Error>> {
    let depths = Scenario::demo().samples()?.filter_map(|sample| match sample {
        Sample::Depth { image, .. } => Some(image),
        _ => None,
    });
    // A frame of each third of a second.
    Ok(depths.step_by(10).take(FRAMES).collect())
}

fn depths(name: &str, images: &[DepthImage]) -> Result<(), Box<dyn Error>> {
    let Some(first) = images.first() else { return Ok(()) };
    println!(
        "{name}: {} depth images of {} x {}",
        images.len(),
        first.width_px(),
        first.height_px()
    );
    let metres = MetresAs::InverseDepth(InverseDepth::default());
    for codec in [DepthCodec::Png, DepthCodec::Rvl] {
        measure(
            codec.name(),
            images,
            |image| compressed_message_from_depth_with(image, codec, metres),
            compressed_depth_from_message,
        )?;
    }
    Ok(())
}

fn colours(name: &str, images: &[Image]) -> Result<(), Box<dyn Error>> {
    let Some(first) = images.first() else { return Ok(()) };
    println!(
        "{name}: {} {} images of {} x {}",
        images.len(),
        first.encoding,
        first.width,
        first.height
    );
    let jpeg = |quality| JpegQuality::new(quality).map(ImageCodec::Jpeg);
    for (name, codec) in [("jpeg 80", jpeg(80)?), ("jpeg 95", jpeg(95)?), ("png", ImageCodec::Png)]
    {
        measure(
            name,
            images,
            |image| compressed_message_from_image(image, codec),
            image_from_compressed_message,
        )?;
    }
    Ok(())
}

/// Medians over all images and rounds.
fn measure<I, O>(
    name: &str,
    images: &[I],
    compress: impl Fn(&I) -> Result<CompressedImage, convert::ConvertError>,
    decompress: impl Fn(&CompressedImage) -> Result<O, convert::ConvertError>,
) -> Result<(), Box<dyn Error>> {
    let (mut compress_ms, mut decompress_ms, mut kb) = (Vec::new(), Vec::new(), Vec::new());
    for image in images {
        for _ in 0..ROUNDS {
            let start = Instant::now();
            let message = black_box(compress(image)?);
            compress_ms.push(start.elapsed().as_secs_f64() * 1e3);
            let start = Instant::now();
            black_box(decompress(&message)?);
            decompress_ms.push(start.elapsed().as_secs_f64() * 1e3);
            kb.push(message.data.len() as f64 / 1e3);
        }
    }
    println!(
        "  {name:8} {:7.0} kB, compressed in {:6.2} ms, decompressed in {:6.2} ms",
        median(&mut kb),
        median(&mut compress_ms),
        median(&mut decompress_ms)
    );
    Ok(())
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}
