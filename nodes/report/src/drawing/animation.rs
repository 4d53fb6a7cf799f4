//! The map while it forms, as a picture that moves (APNG, of the third edition of the PNG specification): to the left with all that
//! was ever seen, to the right without what was removed.

use png::{BitDepth, BlendOp, ColorType, Compression, DisposeOp, Encoder, Filter};

use super::eye::{Eye, Projection};
use super::raster::Raster;
use super::{DrawnPoint, GAP, GAP_PX, MapDrawing, PathPoint};
use crate::PictureError;
use crate::pictures::PATH;
use crate::pictures::canvas::{Canvas, Colour};
use crate::scene::moments::moment;

/// The size of each half, at most: both are 800 pixels wide.
const HALF_PX: (usize, usize) = (396, 420);
const FRAMES_PER_S: u16 = 10;
/// It goes so much faster than what happened ...
const SPEED: f64 = 2.0;
/// ... and faster yet if it had more frames than this.
const MAX_FRAMES: usize = 240;
/// How long the last frame, the whole map, stays.
const LAST_FRAME_S: u16 = 3;
/// Bits of a channel that are kept: fewer bytes, and no difference that is seen.
const CHANNEL_MASK: u8 = 0b1111_1000;
/// Half the side of the mark where the rig is, and its colour: a light blue (Okabe and Ito 2008), which is not mistaken for the
/// orange of what moves.
const MARK_REACH_PX: i64 = 4;
const MARK: Colour = [0x56, 0xb4, 0xe9];

impl MapDrawing {
    /// The bytes of a PNG file that shows how the map forms, over and over. In a program that does not show moving pictures it is the
    /// whole map.
    ///
    /// # Errors
    /// When it cannot be encoded.
    pub fn animation_png(&self) -> Result<Vec<u8>, PictureError> {
        let view = self.projection(Eye::Oblique, &self.path, HALF_PX);
        let frames = self.frame_ends();
        let mut halves = Halves::new(self, &view);
        let whole = posterised(self.before_after(HALF_PX).pixels());
        let (width_px, height_px) = halves.size_px();

        let mut bytes = Vec::new();
        let size = |px: usize| u32::try_from(px).unwrap_or(u32::MAX);
        let mut encoder = Encoder::new(&mut bytes, size(width_px), size(height_px));
        encoder.set_color(ColorType::Rgba);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(Compression::High);
        encoder.set_filter(Filter::NoFilter);
        encoder.set_animated(size(frames.len()), 0)?;
        encoder.set_sep_def_img(true)?;
        let mut writer = encoder.write_header()?;
        let rgba = |pixels: &[Colour]| {
            pixels.iter().flat_map(|[r, g, b]| [*r, *g, *b, u8::MAX]).collect::<Vec<u8>>()
        };
        writer.write_image_data(&rgba(&whole))?;
        writer.set_dispose_op(DisposeOp::None)?;
        let mut shown: Option<Vec<Colour>> = None;
        for (number, cycles) in frames.iter().enumerate() {
            let is_last = number + 1 == frames.len();
            let pixels = posterised(halves.frame(*cycles).pixels());
            let seconds = if is_last { (LAST_FRAME_S, 1) } else { (1, FRAMES_PER_S) };
            writer.set_frame_delay(seconds.0, seconds.1)?;
            let change = Change::between(shown.as_deref(), &pixels, width_px);
            writer.reset_frame_position()?;
            writer.set_frame_dimension(size(change.width_px), size(change.height_px))?;
            writer.set_frame_position(size(change.left_px), size(change.top_px))?;
            writer.set_blend_op(if shown.is_some() { BlendOp::Over } else { BlendOp::Source })?;
            writer.write_image_data(&change.rgba)?;
            shown = Some(pixels);
        }
        writer.finish()?;
        Ok(bytes)
    }

    /// How many cycles each frame has: of frames that are equally long apart.
    fn frame_ends(&self) -> Vec<usize> {
        let duration_s = self.path.last().map_or(0.0, |last: &PathPoint| last.time_s).max(0.0);
        let step_s = (SPEED / f64::from(FRAMES_PER_S)).max(duration_s / MAX_FRAMES as f64);
        let count = (duration_s / step_s).ceil() as usize + 1;
        let before = |time_s: f64| self.path.partition_point(|at| at.time_s <= time_s);
        (1..count)
            .map(|number| before(number as f64 * step_s - step_s))
            .chain([self.path.len()])
            .collect()
    }
}

/// Both halves while the map forms: what stays is drawn once.
struct Halves<'a> {
    map: &'a MapDrawing,
    view: &'a Projection,
    before: Raster,
    after: Raster,
    points_drawn: usize,
    removed_drawn: usize,
}

impl<'a> Halves<'a> {
    fn new(map: &'a MapDrawing, view: &'a Projection) -> Self {
        let raster = Raster::new(view.size_px());
        Self { map, view, before: raster.clone(), after: raster, points_drawn: 0, removed_drawn: 0 }
    }

    fn size_px(&self) -> (usize, usize) {
        let (width_px, height_px) = self.view.size_px();
        (2 * width_px + GAP_PX, height_px)
    }

    /// After so many cycles.
    fn frame(&mut self, cycles: usize) -> Canvas {
        let (map, view) = (self.map, self.view);
        let is_shown =
            |point: &DrawnPoint| usize::from(point.moment) < cycles || cycles == map.path.len();
        let end = |points: &[DrawnPoint]| points.partition_point(is_shown);
        let (points_end, removed_end) = (end(&map.points), end(&map.removed));
        for point in map.points.get(self.points_drawn..points_end).unwrap_or_default() {
            map.splat(&mut self.before, view, point);
            map.splat(&mut self.after, view, point);
        }
        for point in map.removed.get(self.removed_drawn..removed_end).unwrap_or_default() {
            map.splat_removed(&mut self.before, view, point);
        }
        (self.points_drawn, self.removed_drawn) = (points_end, removed_end);
        let path = map.path.get(..cycles).unwrap_or_default();
        // What is removed now is seen on its way; at the end it has gone.
        let mut with_now = self.after.clone();
        let now = cycles.checked_sub(1).filter(|_| cycles < map.path.len()).map(moment);
        for point in map.removed[..removed_end].iter().rev().take_while(|at| Some(at.moment) == now)
        {
            map.splat_removed(&mut with_now, view, point);
        }
        let [before, after] = [&self.before, &with_now].map(|raster| {
            let mut canvas = raster.shaded(view.px_per_m());
            let mut path_px = path.iter().map(|at| view.pixel_of(&at.on_floor_m));
            canvas.paint_path(path_px.clone(), PATH);
            if let Some((column, row)) = path_px.next_back() {
                let from =
                    (column.saturating_sub(MARK_REACH_PX), row.saturating_sub(MARK_REACH_PX));
                canvas.fill(from, (2 * MARK_REACH_PX + 1, 2 * MARK_REACH_PX + 1), MARK);
            }
            canvas
        });
        before.beside(&after, GAP_PX, GAP)
    }
}

fn posterised(pixels: &[Colour]) -> Vec<Colour> {
    // The upper bits again below the others, so that white stays white.
    let kept = |channel: u8| channel & CHANNEL_MASK | channel >> CHANNEL_MASK.count_ones();
    pixels.iter().map(|colour| colour.map(kept)).collect()
}

/// The part of a picture that differs from the one before it; the pixels in it that do not are transparent.
struct Change {
    left_px: usize,
    top_px: usize,
    width_px: usize,
    height_px: usize,
    rgba: Vec<u8>,
}

impl Change {
    fn between(before: Option<&[Colour]>, after: &[Colour], width_px: usize) -> Self {
        let differs =
            |pixel: usize| before.is_none_or(|before| before.get(pixel) != after.get(pixel));
        let mut columns: Option<[usize; 2]> = None;
        let mut rows: Option<[usize; 2]> = None;
        let widened = |range: Option<[usize; 2]>, at: usize| {
            Some(range.map_or([at; 2], |[low, high]| [low.min(at), high.max(at)]))
        };
        for pixel in (0..after.len()).filter(|pixel| differs(*pixel)) {
            columns = widened(columns, pixel % width_px);
            rows = widened(rows, pixel / width_px);
        }
        // A frame has a pixel at least.
        let ([left_px, right_px], [top_px, bottom_px]) =
            (columns.unwrap_or_default(), rows.unwrap_or_default());
        let in_it = (top_px..=bottom_px)
            .flat_map(|row| (left_px..=right_px).map(move |column| row * width_px + column));
        let shown = |pixel: usize| match after.get(pixel) {
            Some([r, g, b]) if differs(pixel) => [*r, *g, *b, u8::MAX],
            _ => [0; 4],
        };
        Self {
            left_px,
            top_px,
            width_px: right_px - left_px + 1,
            height_px: bottom_px - top_px + 1,
            rgba: in_it.flat_map(shown).collect(),
        }
    }
}
