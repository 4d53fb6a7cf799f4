//! From an image to its corners.

use std::sync::Arc;

use estimation::executor::{map, map_with};
use estimation::{Executor, Serial};
use geometry::ParameterError;
use nalgebra::Point2;

use super::{
    config::PointConfig,
    corner::Corner,
    description::describe,
    detection::{self, Candidate, Search, detect},
    levels::Pyramid,
    orientation::direction,
    spread::{allot, choose},
};
use crate::image::{Blur, GrayImage, blur_rows};

/// Corners that are described at once: short enough that threads end together.
const DESCRIBED_AT_ONCE: usize = 32;

/// Extracts corners from images, one after another; it keeps the memory that it works on.
#[derive(Clone, Debug)]
pub struct PointExtractor {
    config: PointConfig,
    executor: Arc<dyn Executor>,
    pyramid: Pyramid,
    blurred: Vec<GrayImage>,
    /// One a thread.
    scratches: Vec<Scratch>,
}

/// The scratch memory of a thread.
#[derive(Clone, Default, Debug)]
struct Scratch {
    detection: detection::Scratch,
    blur: Blur,
}

/// A band of rows of a level: what one thread works on at a time.
struct Band<'a> {
    level: usize,
    first_row: usize,
    blurred: &'a mut [u8],
}

impl PointExtractor {
    /// An extractor with these parameters.
    ///
    /// # Errors
    /// When a parameter means nothing; see [`PointConfig::validate`].
    pub fn new(config: PointConfig) -> Result<Self, ParameterError> {
        config.validate()?;
        Ok(Self {
            config,
            executor: Arc::new(Serial),
            pyramid: Pyramid::default(),
            blurred: Vec::new(),
            scratches: vec![Scratch::default()],
        })
    }

    /// Has this executor do the work; what is found does not depend on its threads.
    #[must_use]
    pub fn with_executor(self, executor: Arc<dyn Executor>) -> Self {
        let scratches = vec![Scratch::default(); executor.threads().get()];
        Self { executor, scratches, ..self }
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &PointConfig {
        &self.config
    }

    /// The corners of an image, by level, and row by row within a level. None in an image too small for one.
    pub fn extract(&mut self, image: &GrayImage) -> Vec<Corner> {
        if !self.fit(image) {
            return Vec::new();
        }
        self.pyramid.fill(image);
        let candidates = self.detect(image);
        let chosen = self.choose(candidates);
        self.describe(image, &chosen)
    }

    /// Makes the memory fit images of this size. False where no corner has room.
    fn fit(&mut self, image: &GrayImage) -> bool {
        let size_px = (image.width_px(), image.height_px());
        if size_px != self.pyramid.size_px {
            self.pyramid = Pyramid::new(size_px, self.config.levels, self.config.scale_factor);
            let sizes = self.pyramid.sizes_px();
            self.blurred = sizes.iter().filter_map(|&(w, h)| GrayImage::black(w, h)).collect();
        }
        Pyramid::has_room(size_px) && self.blurred.len() == self.pyramid.sizes_px().len()
    }

    /// Finds the corners of each level of the pyramid, and blurs the levels.
    fn detect(&mut self, image: &GrayImage) -> Vec<Vec<Candidate>> {
        let PointConfig { threshold, low_threshold, cell_px, .. } = self.config;
        let search = Search { threshold, low_threshold, cell_px };
        let mut bands = Vec::new();
        for (level, blurred) in self.blurred.iter_mut().enumerate() {
            let band_pixels = blurred.width_px() * cell_px;
            let chunks = blurred.pixels_mut().chunks_mut(band_pixels).enumerate();
            bands.extend(chunks.map(|(band, blurred)| Band {
                level,
                first_row: band * cell_px,
                blurred,
            }));
        }
        let levels: Vec<usize> = bands.iter().map(|band| band.level).collect();
        let pyramid = &self.pyramid;
        let found = map_with(&*self.executor, &mut self.scratches, bands, |scratch, band| {
            let level = pyramid.level(image, band.level).unwrap_or(image);
            let rows = band.first_row..band.first_row + cell_px;
            blur_rows(level, band.first_row, band.blurred, &mut scratch.blur);
            detect(level, rows, &search, &mut scratch.detection)
        });
        let mut candidates = vec![Vec::new(); self.blurred.len()];
        for (level, found) in levels.into_iter().zip(found) {
            candidates[level].extend(found);
        }
        candidates
    }

    /// The corners that are kept, with their levels.
    fn choose(&self, candidates: Vec<Vec<Candidate>>) -> Vec<(usize, Candidate)> {
        let sizes = self.pyramid.sizes_px();
        let sides: Vec<usize> = sizes.iter().map(|&(width, _)| width).collect();
        let available: Vec<usize> = candidates.iter().map(Vec::len).collect();
        let counts = allot(self.config.max_corners, &sides, &available);
        let levels = candidates.into_iter().zip(sizes).zip(counts).enumerate();
        let chosen = levels.flat_map(|(level, ((candidates, size), count))| {
            let chosen = choose(candidates, size, count, self.config.even_share);
            chosen.into_iter().map(move |chosen| (level, chosen))
        });
        chosen.collect()
    }

    /// The directions and descriptors of the chosen corners.
    fn describe(&self, image: &GrayImage, chosen: &[(usize, Candidate)]) -> Vec<Corner> {
        let corner = |&(level, candidate): &(usize, Candidate)| {
            let (column, row) = (usize::from(candidate.column), usize::from(candidate.row));
            let direction = direction(self.pyramid.level(image, level)?, column, row)?;
            let descriptor = describe(self.blurred.get(level)?, column, row, direction)?;
            let [x, y] = candidate.refined();
            Some(Corner {
                pixel: self.pyramid.in_image(level, Point2::new(x, y))?,
                level: level as u8,
                angle_rad: direction.y.atan2(direction.x),
                response: f32::from(candidate.strength),
                descriptor,
            })
        };
        let described =
            |chosen: &[(usize, Candidate)]| chosen.iter().filter_map(corner).collect::<Vec<_>>();
        map(&*self.executor, chosen.chunks(DESCRIBED_AT_ONCE).collect(), described).concat()
    }
}
