//! One depth image, prepared for projective updates: depths in metres, and the least and greatest depth of any rectangle.

mod remap;
mod tiles;

use std::sync::Arc;

use geometry::{DepthFrame, MaskedDepth, NO_COLOUR, Stamp, UnusablePose};
use multiversion::multiversion;
use nalgebra::{Isometry3, Point3};

use crate::noise::DepthNoise;
use crate::projection::{Pinhole, Project, Spherical, SphericalModel, SphericalModelError};
use remap::Remap;
pub(crate) use tiles::{Depths, Tiles};

/// Which depths are used.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DepthRange {
    /// Smaller depths count as not measured.
    pub min_m: f32,
    /// Larger depths add no surface; they do show that the space up to this depth is free.
    pub max_m: f32,
}

impl Default for DepthRange {
    /// The range of depth cameras: see [`crate::NEAREST_SEEN_M`] and [`crate::FARTHEST_SEEN_M`]; the minimum is lower.
    fn default() -> Self {
        Self { min_m: 0.3, max_m: crate::FARTHEST_SEEN_M as f32 }
    }
}

/// A depth image with its camera, colours and pose, and what moves in it.
#[derive(Clone, Copy, Debug)]
pub struct DepthInput<'a> {
    frame: &'a DepthFrame,
    is_moving: Option<&'a [bool]>,
    has_colour: bool,
    map_from_camera: &'a Isometry3<f64>,
}

impl<'a> DepthInput<'a> {
    /// An image in which nothing moves. `map_from_camera` takes a point of the camera's optical frame (x right, y down, z forward)
    /// to the map.
    #[must_use]
    pub fn new(frame: &'a DepthFrame, map_from_camera: &'a Isometry3<f64>) -> Self {
        Self { frame, is_moving: None, has_colour: true, map_from_camera }
    }

    /// An image with what moves in it. A pixel that moves adds no surface and no colour; like any other it shows that the space in
    /// front of it is free.
    #[must_use]
    pub fn masked(masked: &'a MaskedDepth, map_from_camera: &'a Isometry3<f64>) -> Self {
        Self { is_moving: Some(masked.is_moving()), ..Self::new(masked.frame(), map_from_camera) }
    }

    /// The same without the colours, for those who have no use for them.
    #[must_use]
    pub fn without_colours(self) -> Self {
        Self { has_colour: false, ..self }
    }
}

/// A depth image that cannot be used. The view is then empty.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum ViewError {
    /// The panorama model is invalid.
    #[error(transparent)]
    Panorama(#[from] SphericalModelError),
    /// A mask has another length than the points.
    #[error("a mask of {mask_points} points does not fit a cloud of {points}")]
    Mask {
        /// How many points the mask has.
        mask_points: usize,
        /// How many points there are.
        points: usize,
    },
    /// The pose is invalid.
    #[error(transparent)]
    Pose(#[from] UnusablePose),
    /// The range of depths is invalid.
    #[error("depths from {min_m} m to {max_m} m: they must be finite, not negative, and rise")]
    Range {
        /// The minimum.
        min_m: f32,
        /// The maximum.
        max_m: f32,
    },
}

/// The projection of the image.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Kind {
    Pinhole(Pinhole),
    Spherical(Spherical),
}

/// The tiles of the depths of an image within a range.
#[derive(Debug, Default)]
pub(crate) struct RangedTiles {
    range: DepthRange,
    tiles: Tiles,
}

impl std::ops::Deref for RangedTiles {
    type Target = Tiles;

    fn deref(&self) -> &Tiles {
        &self.tiles
    }
}

/// One depth image, prepared. It is refilled for each image and keeps its memory; several layers with different voxel edges
/// can be updated from one view.
///
/// A positive number is the depth of a possible surface, a negative one means only that the space up to this
/// depth is free (moving objects, and depths out of range), and 0 means unknown.
#[derive(Clone, Debug)]
pub struct DepthView {
    pub(crate) stamp: Stamp,
    pub(crate) map_from_camera: Isometry3<f64>,
    pub(crate) kind: Kind,
    pub(crate) range: DepthRange,
    pub(crate) noise: DepthNoise,
    /// The depths, row by row; see above.
    pub(crate) depths_m: Vec<f32>,
    pub(crate) width_px: usize,
    height_px: usize,
    pub(crate) tiles: Arc<RangedTiles>,
    pub(crate) colour: Vec<[u8; 3]>,
    remap: Option<Remap>,
}

impl DepthView {
    /// An empty view, for the depths of a sensor with this noise.
    ///
    /// # Errors
    /// When the range is invalid.
    pub fn new(range: DepthRange, noise: DepthNoise) -> Result<Self, ViewError> {
        let DepthRange { min_m, max_m } = range;
        let is_range = min_m >= 0.0 && max_m > min_m && max_m.is_finite();
        if !is_range {
            return Err(ViewError::Range { min_m, max_m });
        }
        Ok(Self {
            stamp: Stamp::default(),
            map_from_camera: Isometry3::identity(),
            kind: Kind::Spherical(Spherical::of(&SphericalModel {
                columns: 1,
                rows: 1,
                least_elevation_rad: -1.0,
                most_elevation_rad: 1.0,
            })),
            range,
            noise,
            depths_m: Vec::new(),
            width_px: 0,
            height_px: 0,
            tiles: Arc::default(),
            colour: Vec::new(),
            remap: None,
        })
    }

    /// Fills the view with a depth image. Its tiles are those of another view of the same frame and range, where there is one.
    ///
    /// # Errors
    /// When the pose is invalid.
    pub fn fill(&mut self, input: &DepthInput<'_>) -> Result<(), ViewError> {
        self.begin(input)?;
        let DepthInput { frame, is_moving, has_colour, .. } = *input;
        let camera = frame.camera();
        load(frame.depths_mm(), is_moving, self.range, &mut self.depths_m);
        self.colour.clear();
        self.colour.extend_from_slice(frame.colours().filter(|_| has_colour).unwrap_or_default());
        if !camera.distortion.is_none() {
            let known = self.remap.take().filter(|known| known.is_of(camera));
            let remap = known.unwrap_or_else(|| Remap::of(camera));
            remap.apply(&mut self.depths_m, 0.0);
            if !self.colour.is_empty() {
                remap.apply(&mut self.colour, NO_COLOUR);
            }
            self.remap = Some(remap);
        }
        let depths_m = std::mem::take(&mut self.depths_m);
        self.take_tiles(frame, Depths::Metres(&depths_m));
        self.depths_m = depths_m;
        Ok(())
    }

    /// Fills the view with the tiles of a depth image, without its depths: for the evidence of free space and for [`TiledView`](crate::TiledView),
    /// which ask for no more. A map is not made of such a view.
    ///
    /// # Errors
    /// When the pose is invalid.
    pub fn fill_tiles(&mut self, input: &DepthInput<'_>) -> Result<(), ViewError> {
        if !input.frame.camera().distortion.is_none() {
            // The pixels have to go to their places first.
            return self.fill(&input.without_colours());
        }
        self.begin(input)?;
        self.depths_m.clear();
        self.colour.clear();
        self.take_tiles(input.frame, Depths::Millimetres(input.frame.depths_mm(), self.range));
        Ok(())
    }

    fn begin(&mut self, input: &DepthInput<'_>) -> Result<(), ViewError> {
        if let Err(unusable) = geometry::check_pose(input.map_from_camera) {
            self.empty();
            return Err(unusable.into());
        }
        let image = input.frame.image();
        self.stamp = image.stamp;
        self.map_from_camera = *input.map_from_camera;
        self.kind = Kind::Pinhole(Pinhole::of(input.frame.camera()));
        (self.width_px, self.height_px) = (image.width_px(), image.height_px());
        Ok(())
    }

    /// Takes the tiles of another view of the frame, or those of these depths.
    fn take_tiles(&mut self, frame: &DepthFrame, depths: Depths<'_>) {
        // They are of absolute depths, which what moves does not change.
        let of_another = frame.computed::<RangedTiles>().filter(|of| of.range == self.range);
        self.tiles = of_another.unwrap_or_else(|| {
            let own = self.own_tiles(depths);
            frame.share(&own);
            own
        });
    }

    /// Fills the view with the points of a cloud without an image, such as that of a 3D LiDAR. The nearest point of each pixel
    /// is used. Points are in the sensor's frame (x forward, y left, z up).
    ///
    /// # Errors
    /// When the panorama or the pose is invalid, or the mask has another length than the points.
    pub fn fill_from_points(
        &mut self,
        stamp: Stamp,
        points_m: &[Point3<f32>],
        is_moving: Option<&[bool]>,
        model: &SphericalModel,
        map_from_sensor: &Isometry3<f64>,
    ) -> Result<(), ViewError> {
        self.empty();
        model.validate()?;
        geometry::check_pose(map_from_sensor)?;
        let (mask_points, points) =
            (is_moving.map_or(points_m.len(), <[bool]>::len), points_m.len());
        if mask_points != points {
            return Err(ViewError::Mask { mask_points, points });
        }
        self.stamp = stamp;
        self.map_from_camera = *map_from_sensor;
        let spherical = Spherical::of(model);
        self.kind = Kind::Spherical(spherical);
        self.colour.clear();
        let range = self.range;
        (self.width_px, self.height_px) = (model.columns, model.rows);
        self.depths_m.clear();
        self.depths_m.resize(model.columns * model.rows, 0.0);
        for (index, point) in points_m.iter().enumerate() {
            if !geometry::is_finite(point) {
                continue;
            }
            let Some((pixel, range_m)) = spherical.pixel(point) else { continue };
            let Some(kept_m) = self.depths_m.get_mut(pixel as usize) else { continue };
            let depth_m = within(range_m, range);
            let is_moving = is_moving.and_then(|mask| mask.get(index)).copied().unwrap_or(false);
            let depth_m = if is_moving { -depth_m.abs() } else { depth_m };
            if depth_m != 0.0 && (*kept_m == 0.0 || depth_m.abs() < kept_m.abs()) {
                *kept_m = depth_m;
            }
        }
        let depths_m = std::mem::take(&mut self.depths_m);
        self.tiles = self.own_tiles(Depths::Metres(&depths_m));
        self.depths_m = depths_m;
        Ok(())
    }

    /// The tiles of depths, in the memory of those before where no other view has these.
    fn own_tiles(&mut self, depths: Depths<'_>) -> Arc<RangedTiles> {
        let before = std::mem::take(&mut self.tiles);
        let mut tiles = Arc::try_unwrap(before).unwrap_or_default().tiles;
        tiles.refill(depths, self.width_px, self.height_px);
        Arc::new(RangedTiles { range: self.range, tiles })
    }

    /// Empties it, and lets its tiles go: a view that shares them can then use their memory again.
    pub fn clear(&mut self) {
        self.empty();
        self.tiles = Arc::default();
    }

    fn empty(&mut self) {
        self.depths_m.clear();
        (self.width_px, self.height_px) = (0, 0);
    }

    /// Whether it holds no image.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.width_px == 0
    }

    /// The time of the image.
    #[must_use]
    pub fn stamp(&self) -> Stamp {
        self.stamp
    }

    /// The noise of its depths.
    #[must_use]
    pub fn noise(&self) -> DepthNoise {
        self.noise
    }

    /// The pose of the camera: the transform from its frame to the map.
    #[must_use]
    pub fn map_from_camera(&self) -> &Isometry3<f64> {
        &self.map_from_camera
    }

    /// Columns and rows of the image.
    pub(crate) fn size_px(&self) -> (usize, usize) {
        (self.width_px, self.height_px)
    }

    /// The greatest depth in the image, in metres.
    pub(crate) fn farthest_m(&self) -> f32 {
        self.tiles.farthest_m()
    }

    /// The memory in use, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.depths_m.capacity() * size_of::<f32>()
            + self.tiles.memory_bytes()
            + self.colour.capacity() * size_of::<[u8; 3]>()
            + self.remap.as_ref().map_or(0, Remap::memory_bytes)
    }
}

/// Converts depths to metres, 0 where nothing was measured and negative where something moves.
#[multiversion(targets("x86_64+avx2"))]
fn load(depths_mm: &[u16], is_moving: Option<&[bool]>, range: DepthRange, depths_m: &mut Vec<f32>) {
    depths_m.clear();
    let depth_m = |depth_mm: u16| of_millimetres(depth_mm, range);
    match is_moving {
        None => depths_m.extend(depths_mm.iter().map(|&depth_mm| depth_m(depth_mm))),
        Some(is_moving) => {
            depths_m.extend(depths_mm.iter().zip(is_moving).map(|(&depth_mm, &is_moving)| {
                let depth_m = depth_m(depth_mm);
                if is_moving { -depth_m.abs() } else { depth_m }
            }))
        }
    }
}

#[inline(always)]
fn of_millimetres(depth_mm: u16, range: DepthRange) -> f32 {
    within(f32::from(depth_mm) / 1e3, range)
}

#[inline(always)]
fn within(depth_m: f32, range: DepthRange) -> f32 {
    let is_measured = (depth_m > 0.0) & (depth_m >= range.min_m);
    let depth_m = if depth_m > range.max_m { -range.max_m } else { depth_m };
    if is_measured { depth_m } else { 0.0 }
}

/// Calls a function with the projection, of either kind.
macro_rules! with_projection {
    ($kind:expr, $projection:ident => $call:expr) => {
        match $kind {
            crate::depth_view::Kind::Pinhole($projection) => $call,
            crate::depth_view::Kind::Spherical($projection) => $call,
        }
    };
}
pub(crate) use with_projection;

impl DepthView {
    /// The length that a pixel spans at a depth of 1 m.
    pub(crate) fn pixel_slope(&self) -> f32 {
        with_projection!(self.kind, projection => projection.pixel_slope())
    }
}

#[cfg(test)]
mod tests;
