//! All steps in turn.

use std::ops::Range;
use std::sync::Arc;

use estimation::executor::map;
use estimation::{Executor, Serial};
use geometry::ParameterError;

use super::anchor::anchors;
use super::config::LineConfig;
use super::false_alarms::FalseAlarms;
use super::gradient::{GradientField, UNITS_PER_LEVEL};
use super::growing::{edge_point_px, grow};
use super::merging::{RatedEdge, merge};
use super::routing::EdgeChains;
use super::segment::LineSegment;
use crate::image::GrayImage;

/// Finds line segments by EDLines (Akinlar and Topal 2011). It keeps its memory, about 5 bytes a pixel, from image to
/// image, and nothing else: what it finds depends on the image alone.
#[derive(Clone, Debug)]
pub struct LineDetector {
    config: LineConfig,
    executor: Arc<dyn Executor>,
    field: GradientField,
    edges: EdgeChains,
}

/// The steps of [`LineDetector::detect`], in their order.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LineStep {
    /// The image is smoothed and differentiated.
    Gradient,
    /// Edges have places to begin at.
    Anchors,
    /// Edges are drawn.
    Routing,
    /// Straight parts of them are found, and each is rated by how many such noise has.
    Growing,
    /// Parts of one line are joined, and what noise may have is dropped.
    Merging,
}

impl LineDetector {
    /// A detector with these parameters.
    ///
    /// # Errors
    /// When a parameter has a value that means nothing.
    pub fn new(config: LineConfig) -> Result<Self, ParameterError> {
        config.validate()?;
        Ok(Self {
            config,
            executor: Arc::new(Serial),
            field: GradientField::default(),
            edges: EdgeChains::default(),
        })
    }

    /// Has this executor do the work; what is found does not depend on its threads.
    #[must_use]
    pub fn with_executor(self, executor: Arc<dyn Executor>) -> Self {
        Self { executor, ..self }
    }

    /// The line segments of an image, the most meaningful first.
    pub fn detect(&mut self, image: &GrayImage) -> Vec<LineSegment> {
        self.detect_in_steps(image, |_| ())
    }

    /// The same, calling `done` after each step: so that the steps can be timed, by a caller with a clock.
    pub fn detect_in_steps(
        &mut self,
        image: &GrayImage,
        mut done: impl FnMut(LineStep),
    ) -> Vec<LineSegment> {
        let Self { config, executor, field, edges } = self;
        let executor: &dyn Executor = &**executor;
        let units = |levels: f64| (levels * UNITS_PER_LEVEL).round() as u16;
        field.compute(image, executor);
        done(LineStep::Gradient);
        let anchor_gradient = units(config.anchor_gradient);
        let anchors = anchors(field, anchor_gradient, config.scan_interval_px, executor);
        done(LineStep::Anchors);
        edges.draw(field, &anchors, units(config.edge_gradient), config.seed_px);
        done(LineStep::Routing);
        let false_alarms = FalseAlarms::new(field);
        let parts = straight_parts(field, edges, &false_alarms, config, executor);
        done(LineStep::Growing);
        let size_px = (image.width_px(), image.height_px());
        let mut lines = merge(parts, &false_alarms, size_px, config);
        let log_most = config.max_false_alarms.ln();
        lines.retain(|line| line.log_expected <= log_most);
        // Stable: those of one rating stay in the order of their edges.
        lines.sort_by(|a, b| a.log_expected.total_cmp(&b.log_expected));
        let segments = lines.iter().map(segment).collect();
        done(LineStep::Merging);
        segments
    }

    /// The gradients of the image that was last looked at.
    pub(super) fn field(&self) -> &GradientField {
        &self.field
    }
}

fn segment(line: &RatedEdge) -> LineSegment {
    let px = |point: nalgebra::Point2<f64>| [point.x as f32, point.y as f32];
    LineSegment {
        start_px: px(line.edge.start_px()),
        end_px: px(line.edge.end_px()),
        response: (-line.log_expected / std::f64::consts::LN_10) as f32,
    }
}

/// The straight parts of all edges, in the order of these.
fn straight_parts(
    field: &GradientField,
    edges: &EdgeChains,
    false_alarms: &FalseAlarms<'_>,
    config: &LineConfig,
    executor: &dyn Executor,
) -> Vec<RatedEdge> {
    let parts_of = |chains: &[Range<usize>]| {
        let (mut points, mut found) = (Vec::new(), Vec::new());
        for chain in chains {
            points.clear();
            let pixels = &edges.pixels[chain.clone()];
            points.extend(pixels.iter().map(|&pixel| edge_point_px(field, pixel)));
            grow(&mut points, config, &mut found);
        }
        let rate = |edge| RatedEdge { edge, log_expected: false_alarms.log_expected(&edge) };
        found.into_iter().map(rate).collect::<Vec<_>>()
    };
    map(executor, shares(edges, executor.threads().get()), parts_of).concat()
}

/// The chains in runs of about as many pixels each.
fn shares(edges: &EdgeChains, count: usize) -> Vec<&[Range<usize>]> {
    let pixels = edges.pixels.len();
    let bound =
        |share: usize| edges.chains.partition_point(|chain| chain.start < pixels * share / count);
    (0..count).map(|share| &edges.chains[bound(share)..bound(share + 1)]).collect()
}
