//! The pixels of a picture, and their encoding as a PNG file.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageResult};

use super::frame::{Column, PictureFrame};

/// Red, green, blue.
pub(crate) type Colour = [u8; 3];

/// Dark in both of the page's modes: the colours of the points are made for it.
pub(crate) const BACKGROUND: Colour = [0x0f, 0x14, 0x1b];
const SCALE_BAR: Colour = [0xc8, 0xd0, 0xda];
/// Distance of the bar of scale from the corner, and its thickness.
const SCALE_BAR_INSET_PX: i64 = 8;
const SCALE_BAR_THICKNESS_PX: i64 = 3;
/// Half the thickness of the path, less the pixel in its middle.
const PATH_REACH_PX: i64 = 1;

/// The colours of the heights, lowest first, evenly apart.
pub(crate) const HEIGHT_COLOURS: [Colour; 5] = [
    [0x4f, 0x6b, 0xed],
    [0x2f, 0xa8, 0xd5],
    [0x43, 0xc5, 0x9e],
    [0xb5, 0xd9, 0x56],
    [0xff, 0xd9, 0x4a],
];

/// The colour of a height between the lowest (0) and the highest (1).
pub(crate) fn height_colour(relative: f64) -> Colour {
    let position = relative.clamp(0.0, 1.0) * (HEIGHT_COLOURS.len() - 1) as f64;
    let index = (position as usize).min(HEIGHT_COLOURS.len() - 2);
    mixed(HEIGHT_COLOURS[index], HEIGHT_COLOURS[index + 1], position - index as f64)
}

/// A colour with the background shining through: all of it at brightness 1, none at 0.
pub(crate) fn faded(colour: Colour, brightness: f64) -> Colour {
    mixed(BACKGROUND, colour, brightness)
}

fn mixed(from: Colour, to: Colour, share: f64) -> Colour {
    let mut colour = from;
    for (channel, &target) in colour.iter_mut().zip(&to) {
        let start = f64::from(*channel);
        // The cast saturates: a share out of 0 to 1 cannot wrap a channel around.
        *channel = (start + (f64::from(target) - start) * share).round() as u8;
    }
    colour
}

/// A picture in the making.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Canvas {
    width_px: usize,
    height_px: usize,
    pixels: Vec<u8>,
}

impl Canvas {
    /// A picture of the background alone.
    pub(crate) fn new((width_px, height_px): (usize, usize)) -> Self {
        Self { width_px, height_px, pixels: BACKGROUND.repeat(width_px * height_px) }
    }

    /// A picture of pixels, row by row; the background where there are too few.
    pub(crate) fn of_pixels(size_px: (usize, usize), pixels: &[Colour]) -> Self {
        let mut canvas = Self::new(size_px);
        for (to, from) in canvas.pixels.chunks_exact_mut(BACKGROUND.len()).zip(pixels) {
            to.copy_from_slice(from);
        }
        canvas
    }

    /// Red, green and blue of each pixel, row by row.
    pub(crate) fn pixels(&self) -> &[Colour] {
        self.pixels.as_chunks().0
    }

    /// This picture and another one to its right, with so many pixels between them, whose colour is `between`.
    pub(crate) fn beside(&self, other: &Self, gap_px: usize, between: Colour) -> Self {
        let width_px = self.width_px + gap_px + other.width_px;
        let mut both = Self::new((width_px, self.height_px.max(other.height_px)));
        both.fill((self.width_px as i64, 0), (gap_px as i64, both.height_px as i64), between);
        for (picture, left_px) in [(self, 0), (other, self.width_px + gap_px)] {
            let row_bytes = picture.width_px * BACKGROUND.len();
            for (row, bytes) in picture.pixels.chunks_exact(row_bytes.max(1)).enumerate() {
                let start = (row * width_px + left_px) * BACKGROUND.len();
                both.pixels[start..start + row_bytes].copy_from_slice(bytes);
            }
        }
        both
    }

    /// Paints each column of a frame that holds a point.
    pub(super) fn paint_columns(
        &mut self,
        frame: &PictureFrame,
        columns: &[Column],
        colour_of: impl Fn(&Column) -> Colour,
    ) {
        let (across, _) = frame.size_columns();
        let edge_px = i64::from(frame.column_px());
        for (index, column) in columns.iter().enumerate().filter(|(_, column)| column.points > 0) {
            let left_px = (index % across) as i64 * edge_px;
            let top_px = (index / across) as i64 * edge_px;
            self.fill((left_px, top_px), (edge_px, edge_px), colour_of(column));
        }
    }

    /// Paints the line through pixels, between those that lie in the picture.
    pub(crate) fn paint_path(&mut self, path_px: impl Iterator<Item = (i64, i64)>, colour: Colour) {
        let mut from = None;
        for to in path_px {
            let inside = |px: i64, size_px: usize| (0..size_px as i64).contains(&px);
            if !inside(to.0, self.width_px) || !inside(to.1, self.height_px) {
                from = None;
                continue;
            }
            self.paint_line(from.unwrap_or(to), to, colour);
            from = Some(to);
        }
    }

    fn paint_line(&mut self, from: (i64, i64), to: (i64, i64), colour: Colour) {
        let (across, down) = (to.0 - from.0, to.1 - from.1);
        let steps = across.abs().max(down.abs());
        let between = |start: i64, length: i64, step: i64| {
            start + (length as f64 * step as f64 / steps.max(1) as f64).round() as i64
        };
        let side = 2 * PATH_REACH_PX + 1;
        for step in 0..=steps {
            let (x, y) = (between(from.0, across, step), between(from.1, down, step));
            self.fill((x - PATH_REACH_PX, y - PATH_REACH_PX), (side, side), colour);
        }
    }

    /// Paints the bar of scale of a frame into the lower left corner.
    pub(super) fn paint_scale_bar(&mut self, frame: &PictureFrame) {
        let length_px = (frame.scale_bar_m() * frame.px_per_m()).round() as i64;
        let top_px = self.height_px as i64 - SCALE_BAR_INSET_PX - SCALE_BAR_THICKNESS_PX;
        let size_px = (length_px, SCALE_BAR_THICKNESS_PX);
        self.fill((SCALE_BAR_INSET_PX, top_px), size_px, SCALE_BAR);
    }

    /// Fills a rectangle as far as it lies in the picture.
    pub(crate) fn fill(
        &mut self,
        (left_px, top_px): (i64, i64),
        size_px: (i64, i64),
        colour: Colour,
    ) {
        let clamp = |value: i64, limit: usize| value.clamp(0, limit as i64) as usize;
        let columns = clamp(left_px, self.width_px)..clamp(left_px + size_px.0, self.width_px);
        for row in clamp(top_px, self.height_px)..clamp(top_px + size_px.1, self.height_px) {
            let start = row * self.width_px;
            for column in columns.clone() {
                let offset = (start + column) * colour.len();
                self.pixels[offset..offset + colour.len()].copy_from_slice(&colour);
            }
        }
    }

    /// The bytes of a PNG file of areas of one colour: no filter, since they are what deflate does best.
    pub(super) fn into_png(self) -> ImageResult<Vec<u8>> {
        self.png_with(FilterType::NoFilter)
    }

    /// The bytes of a PNG file of a picture with shades.
    pub(crate) fn into_shaded_png(self) -> ImageResult<Vec<u8>> {
        self.png_with(FilterType::Adaptive)
    }

    fn png_with(&self, filter: FilterType) -> ImageResult<Vec<u8>> {
        let mut png = Vec::new();
        let size = |px: usize| u32::try_from(px).unwrap_or(u32::MAX);
        PngEncoder::new_with_quality(&mut png, CompressionType::Best, filter).write_image(
            &self.pixels,
            size(self.width_px),
            size(self.height_px),
            ExtendedColorType::Rgb8,
        )?;
        Ok(png)
    }
}
