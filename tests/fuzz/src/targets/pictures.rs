//! The pictures of compressed images: PNG, JPEG and RVL.

use msgs::convert::{self, DepthCodec, ImageCodec, JpegQuality, MetresAs};
use msgs::sensor_msgs::CompressedImage;

use super::{FAST, samples};
use crate::{MemoryBound, Target, checksums};

/// DEFLATE makes 1032 bytes out of one; a picture is held while it is decoded, as it is and as pixels. Its decoder may take 16 MiB
/// besides.
const PNG: MemoryBound = MemoryBound { base_bytes: 24 << 20, per_byte: 1032 * 4 };
/// A block of 64 pixels takes a bit, a pixel three bytes and in between six numbers.
const JPEG: MemoryBound = MemoryBound { base_bytes: 8 << 20, per_byte: 512 * 24 };
/// What an image without a measurement takes; see `compressed_depth`.
const RVL: MemoryBound = MemoryBound { base_bytes: 160 << 20, per_byte: 4096 };

const CHUNKS: &[&[u8]] =
    &[b"IHDR", b"IDAT", b"IEND", b"PLTE", b"tRNS", b"acTL", b"fcTL", b"fdAT", b"zTXt"];
const MARKERS: &[&[u8]] = &[
    &[0xff, 0xc0],
    &[0xff, 0xc2],
    &[0xff, 0xc4],
    &[0xff, 0xda],
    &[0xff, 0xdb],
    &[0xff, 0xdd],
    &[0xff, 0xe1],
    &[0xff, 0xd9],
    &[0xff, 0xd8],
];

pub(super) const TARGETS: &[Target] = &[
    Target { name: "png", body: png, seeds: pngs, words: CHUNKS, memory: PNG, gate_cases: FAST },
    Target {
        name: "jpeg",
        body: jpeg,
        seeds: jpegs,
        words: MARKERS,
        memory: JPEG,
        gate_cases: FAST / 2,
    },
    Target { name: "rvl", body: rvl, seeds: rvls, words: &[], memory: RVL, gate_cases: FAST },
];

/// The header of `compressed_depth_image_transport`: a format, and two numbers of inverse depth.
const HEADER: [u8; 12] = [0; 12];

fn message(format: &str, data: Vec<u8>) -> CompressedImage {
    samples::compressed(&samples::depth_image(), format, data)
}

fn png(bytes: &[u8]) {
    let file = checksums::of_png(bytes);
    let _ =
        convert::image_from_compressed_message(&message("rgb8; png compressed bgr8", file.clone()));
    let data = [&HEADER[..], &file].concat();
    let _ = convert::compressed_depth_from_message(&message("16UC1; compressedDepth png", data));
}

fn pngs() -> Vec<Vec<u8>> {
    let depth = samples::depth();
    let depth =
        convert::compressed_message_from_depth_with(&depth, DepthCodec::Png, MetresAs::Millimetres);
    let depth = depth.map(|message| message.data.get(HEADER.len()..).unwrap_or_default().to_vec());
    let colour = convert::compressed_message_from_image(&samples::colour_image(), ImageCodec::Png);
    depth.into_iter().chain(colour.map(|message| message.data)).collect()
}

fn jpeg(bytes: &[u8]) {
    let _ = convert::image_from_compressed_message(&message(
        "rgb8; jpeg compressed bgr8",
        bytes.to_vec(),
    ));
}

fn jpegs() -> Vec<Vec<u8>> {
    let codec = ImageCodec::Jpeg(JpegQuality::default());
    let colour = convert::compressed_message_from_image(&samples::colour_image(), codec);
    colour.map(|message| message.data).into_iter().collect()
}

fn rvl(bytes: &[u8]) {
    let _ = convert::compressed_depth_from_message(&message(
        "16UC1; compressedDepth rvl",
        bytes.to_vec(),
    ));
    let _ = convert::compressed_depth_from_message(&message(
        "32FC1; compressedDepth rvl",
        bytes.to_vec(),
    ));
}

fn rvls() -> Vec<Vec<u8>> {
    let depth = samples::depth();
    let rvl =
        convert::compressed_message_from_depth_with(&depth, DepthCodec::Rvl, MetresAs::Millimetres);
    rvl.map(|message| message.data).into_iter().collect()
}
