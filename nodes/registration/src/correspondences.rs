//! Which element of the target corresponds to each point of the source, and what they come to at a pose.

use estimation::executor::for_each;
use estimation::{Executor, RobustKernel};
use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3};

use super::config::Method;
use super::factor::{agreement, weight_matrix};
use super::normal_equations::Sums;
use super::prepared_cloud::PreparedCloud;
use super::surface::Surface;

/// Points that one thread takes at a time. The sums of each chunk are added in the order of the chunks.
const CHUNK_POINTS: usize = 512;
/// Points of a neighbourhood: in the order of the tree points that follow each other are close together, these on a patch of some
/// eight by eight. Their errors have a part in common, since normals are those of ten to twenty neighbours, and several of them
/// are registered to the same element.
const NEIGHBOURHOOD_POINTS: usize = 64;
/// No element.
const NONE: u32 = u32::MAX;

/// How correspondences are found and weighed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    pub(super) method: Method,
    pub(super) max_correspondence_m: f64,
    pub(super) kernel: RobustKernel,
    pub(super) kernel_width_m: f64,
}

/// Points of the source with the elements of the target that correspond to them.
pub(super) struct Correspondences<'a, S> {
    source: &'a PreparedCloud,
    target: &'a S,
    rules: Rules,
    executor: &'a dyn Executor,
    /// One of this many points takes part.
    every: usize,
    chunks: Vec<Chunk>,
}

struct Chunk {
    first: usize,
    /// The element of every point of the chunk that takes part.
    elements: Vec<u32>,
    sums: Sums,
    scatter: Scatter,
}

/// By how much the pulls of neighbourhoods differ.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Scatter {
    /// `sum p p^T` over the neighbourhoods, with the pull `p = sum A^T M e` of each.
    pub(super) squares: Matrix6<f64>,
    /// Neighbourhoods with a correspondence.
    pub(super) count: usize,
}

impl<'a, S: Surface> Correspondences<'a, S> {
    pub(super) fn new(
        source: &'a PreparedCloud,
        target: &'a S,
        every: usize,
        rules: Rules,
        executor: &'a dyn Executor,
    ) -> Self {
        let every = every.max(1);
        let points = source.len().div_ceil(every);
        let chunks = (0..points)
            .step_by(CHUNK_POINTS)
            .map(|first| Chunk {
                first: first * every,
                elements: vec![NONE; CHUNK_POINTS.min(points - first)],
                sums: Sums::default(),
                scatter: Scatter::default(),
            })
            .collect();
        Self { source, target, rules, executor, every, chunks }
    }

    /// How many points take part.
    pub(super) fn points(&self) -> usize {
        self.source.len().div_ceil(self.every)
    }

    /// Points farther apart do not correspond.
    pub(super) fn max_correspondence_m(&self) -> f64 {
        self.rules.max_correspondence_m
    }

    /// Finds the correspondences at a pose, and their normal equations.
    pub(super) fn found_at(&mut self, target_from_source: &Isometry3<f64>) -> Sums {
        let Self { source, target, rules, every, .. } = *self;
        let placed = Placed::new(source, target_from_source);
        let width_square = rules.kernel_width_m * rules.kernel_width_m;
        self.sum(|chunk| {
            let mut sums = Sums::default();
            for (element, number) in chunk.elements.iter_mut().zip((chunk.first..).step_by(every)) {
                let Point { lever_m, place_m, normal } = placed.point(number);
                let before = Some(*element).filter(|element| *element != NONE);
                let found = target.corresponding(&place_m, rules.max_correspondence_m, before);
                *element = found.unwrap_or(NONE);
                let Some(found) = found else { continue };
                let element = target.element(found);
                let error_m = element.place_m - place_m;
                let matrix = weight_matrix(rules.method, &element.normals, &normal);
                let square_m2 = error_m.dot(&matrix.times(&error_m));
                let (_, weight) = rules.kernel.loss_and_weight(square_m2, width_square);
                sums.add(&error_m, weight, &matrix, &lever_m);
            }
            sums
        })
    }

    /// The information that both surfaces of the last correspondences agree upon.
    pub(super) fn agreement_at(&mut self, target_from_source: &Isometry3<f64>) -> Sums {
        let Self { source, target, every, .. } = *self;
        let placed = Placed::new(source, target_from_source);
        self.sum(|chunk| {
            let mut sums = Sums::default();
            for (element, number) in chunk.elements.iter().zip((chunk.first..).step_by(every)) {
                if *element == NONE {
                    continue;
                }
                let Point { lever_m, normal, .. } = placed.point(number);
                let matrix = agreement(&target.element(*element).normals, &normal);
                sums.add(&Vector3::zeros(), 1.0, &matrix, &lever_m);
            }
            sums
        })
    }

    /// By how much the pulls of neighbourhoods differ, by the correspondences found last.
    pub(super) fn scatter_at(&mut self, target_from_source: &Isometry3<f64>) -> Scatter {
        let Self { source, target, rules, every, .. } = *self;
        let placed = Placed::new(source, target_from_source);
        let width_square = rules.kernel_width_m * rules.kernel_width_m;
        for_each(self.executor, &mut self.chunks, |chunk| {
            let mut scatter = Scatter::default();
            let mut numbers = (chunk.first..).step_by(every);
            for elements in chunk.elements.chunks(NEIGHBOURHOOD_POINTS) {
                let mut sums = Sums::default();
                for (element, number) in elements.iter().zip(&mut numbers) {
                    if *element == NONE {
                        continue;
                    }
                    let Point { lever_m, place_m, normal } = placed.point(number);
                    let element = target.element(*element);
                    let error_m = element.place_m - place_m;
                    let matrix = weight_matrix(rules.method, &element.normals, &normal);
                    let square_m2 = error_m.dot(&matrix.times(&error_m));
                    let (_, weight) = rules.kernel.loss_and_weight(square_m2, width_square);
                    sums.add(&error_m, weight, &matrix, &lever_m);
                }
                if sums.count > 0 {
                    let pull = sums.pull();
                    scatter.squares += pull * pull.transpose();
                    scatter.count += 1;
                }
            }
            chunk.scatter = scatter;
        });
        let mut all = Scatter::default();
        for chunk in &self.chunks {
            all.squares += chunk.scatter.squares;
            all.count += chunk.scatter.count;
        }
        all
    }

    fn sum(&mut self, of_chunk: impl Fn(&mut Chunk) -> Sums + Sync) -> Sums {
        for_each(self.executor, &mut self.chunks, |chunk| chunk.sums = of_chunk(chunk));
        let mut all = Sums::default();
        for chunk in &self.chunks {
            all.add_all(&chunk.sums);
        }
        all
    }
}

/// A cloud at a pose.
struct Placed<'a> {
    source: &'a PreparedCloud,
    rotation: Matrix3<f64>,
    translation_m: Vector3<f64>,
}

/// A point of the source along the axes of the target.
struct Point {
    /// From the source's origin.
    lever_m: Vector3<f64>,
    /// From the target's origin.
    place_m: Vector3<f64>,
    normal: Vector3<f64>,
}

impl<'a> Placed<'a> {
    fn new(source: &'a PreparedCloud, target_from_source: &Isometry3<f64>) -> Self {
        let rotation = target_from_source.rotation.to_rotation_matrix().into_inner();
        Self { source, rotation, translation_m: target_from_source.translation.vector }
    }

    #[inline]
    fn point(&self, number: usize) -> Point {
        let (point_m, normal) = self.source.point(number);
        let lever_m = self.rotation * point_m;
        Point { lever_m, place_m: lever_m + self.translation_m, normal: self.rotation * normal }
    }
}
