//! The fast kernels beside plain ones.

use nalgebra::{Matrix2, Point2, Vector2};
use proptest::prelude::*;

use crate::feature::lines::anchor::anchors;
use crate::feature::lines::false_alarms::divergence;
use crate::feature::lines::gradient::{Gradient, GradientField};
use crate::feature::lines::moments::Moments;
use crate::feature::lines::routing::EdgeChains;
use crate::feature::lines::testing::busy_picture;
use crate::image::GrayImage;

/// The gradients of an image, pixel by pixel, as the formulas say.
fn plain_gradients(image: &GrayImage) -> Vec<Gradient> {
    let (width, height) = (image.width_px() as i64, image.height_px() as i64);
    let level = |x: i64, y: i64| {
        let (x, y) = (x.clamp(0, width - 1), y.clamp(0, height - 1));
        i64::from(image.row(y as usize)[x as usize])
    };
    let kernel = [1, 4, 6, 4, 1];
    let smoothed = |x: i64, y: i64| {
        let mut sum = 0;
        for (dy, by_row) in (-2..).zip(kernel) {
            for (dx, by_column) in (-2..).zip(kernel) {
                sum += by_row * by_column * level(x + dx, y + dy);
            }
        }
        (sum + 4) / 8
    };
    let gradient = |x: i64, y: i64| {
        if x == 0 || y == 0 || x == width - 1 || y == height - 1 {
            return Gradient::default();
        }
        let (mut by_x, mut by_y) = (0, 0);
        for (step, weight) in [(-1, 1), (0, 2), (1, 1)] {
            by_x += weight * (smoothed(x + 1, y + step) - smoothed(x - 1, y + step));
            by_y += weight * (smoothed(x + step, y + 1) - smoothed(x + step, y - 1));
        }
        Gradient { x: by_x.try_into().unwrap(), y: by_y.try_into().unwrap() }
    };
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| gradient(x, y)).collect()
}

fn field_of(image: &GrayImage, threads: usize) -> GradientField {
    let mut field = GradientField::default();
    field.compute(image, &crate::testing::threads(threads));
    field
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn gradients_are_those_of_the_formulas(
        (width_px, height_px, pixels) in (3..40_usize, 3..40_usize).prop_flat_map(|(width, height)| {
            let level = prop_oneof![Just(0_u8), Just(255), any::<u8>()];
            (Just(width), Just(height), proptest::collection::vec(level, width * height))
        }),
        threads in 1..6_usize,
    ) {
        let image = GrayImage::new(width_px, height_px, pixels).unwrap();
        prop_assert_eq!(field_of(&image, threads).gradients, plain_gradients(&image));
    }

    #[test]
    fn moments_fit_the_line_that_the_eigenvectors_give(
        points in proptest::collection::vec((-300.0..300.0, -300.0..300.0), 3..30),
        removed in 0..10_usize,
        mean_square in 0.1..1e4_f64,
    ) {
        let points: Vec<Point2<f64>> = points.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
        let mut moments = Moments::default();
        for point in points.iter().chain(&points[..removed.min(points.len())]) {
            moments.add(*point);
        }
        for point in &points[..removed.min(points.len())] {
            moments.remove(*point);
        }
        let mean = points.iter().map(|point| point.coords).sum::<Vector2<f64>>() / points.len() as f64;
        let scatter = points
            .iter()
            .map(|point| (point.coords - mean) * (point.coords - mean).transpose())
            .sum::<Matrix2<f64>>()
            / points.len() as f64;
        let eigen = scatter.symmetric_eigen();
        let small = eigen.eigenvalues.imin();
        let line = moments.line(Vector2::new(-1.0, 0.3));
        prop_assert!((line.centroid_px.coords - mean).norm() < 1e-9);
        prop_assert!((line.direction.norm() - 1.0).abs() < 1e-9);
        prop_assert!(line.direction.dot(&Vector2::new(-1.0, 0.3)) >= 0.0);
        // Of a round cloud any direction is as good.
        if eigen.eigenvalues[1 - small] - eigen.eigenvalues[small] > 1.0 {
            prop_assert!(line.direction.dot(&eigen.eigenvectors.column(small)).abs() < 1e-6);
        }
        if (eigen.eigenvalues[small] - mean_square).abs() > 1e-6 {
            prop_assert_eq!(moments.lie_within(mean_square), eigen.eigenvalues[small] <= mean_square);
        }
    }
}

#[test]
fn anchors_are_the_maxima_across_edges_the_strongest_first() {
    let field = field_of(&busy_picture(120, 90, 1).image(), 1);
    let magnitude = |pixel: usize| field.gradients[pixel].magnitude();
    let (least, width) = (300, field.width_px);
    for interval in [1, 3] {
        let mut plain = Vec::new();
        for row in 1..field.height_px - 1 {
            for column in 1..width - 1 {
                let pixel = row * width + column;
                let step = if field.gradients[pixel].edge_runs_along_row() { width } else { 1 };
                let is_scanned = row % interval == 0 || column % interval == 0;
                let here = magnitude(pixel);
                let is_peak = here >= magnitude(pixel - step) && here >= magnitude(pixel + step);
                if is_scanned && is_peak && here >= least {
                    plain.push(pixel);
                }
            }
        }
        plain.sort_by_key(|&pixel| (u16::MAX - magnitude(pixel)) / 8);
        assert!(plain.len() > 300, "{}", plain.len());
        for threads in [1, 2, 5, 100] {
            assert_eq!(anchors(&field, least, interval, &crate::testing::threads(threads)), plain);
        }
    }
}

#[test]
fn chains_are_paths_along_edges_with_the_bright_side_on_the_left() {
    let field = field_of(&busy_picture(120, 90, 2).image(), 1);
    let found = anchors(&field, 300, 1, &estimation::Serial);
    let mut edges = EdgeChains::default();
    edges.draw(&field, &found, 200, 5);
    assert!(edges.chains.len() > 20, "{}", edges.chains.len());
    let mut seen = vec![false; field.gradients.len()];
    for chain in &edges.chains {
        let pixels = &edges.pixels[chain.clone()];
        assert!(pixels.len() >= 5 && pixels.iter().any(|pixel| found.contains(pixel)));
        for &pixel in pixels {
            assert!(field.gradients[pixel].magnitude() >= 200);
            assert!(!std::mem::replace(&mut seen[pixel], true), "a pixel of two edges");
        }
        for step in pixels.windows(2) {
            let place = |pixel: usize| [pixel % field.width_px, pixel / field.width_px];
            let [from, to] = [place(step[0]), place(step[1])];
            let [dx, dy] = [0, 1].map(|axis| to[axis] as i32 - from[axis] as i32);
            assert!(dx.abs() <= 1 && dy.abs() <= 1, "a leap");
            let gradient = [step[0], step[1]].map(|pixel| field.gradients[pixel]);
            assert!(gradient[0].agrees(gradient[1]), "another edge");
            // Left of (dx, dy) is (dy, -dx). Of one of the two pixels at least: back from the anchor it is the second
            // one that gives the direction.
            let is_left = |g: Gradient| i32::from(g.x) * dy - i32::from(g.y) * dx > 0;
            assert!(gradient.into_iter().any(is_left), "the bright side is on the right");
        }
    }
}

#[test]
fn the_bound_of_the_binomial_tail_is_none_too_small_and_not_far_too_large() {
    // P(at least k of n), summed as it is written.
    let tail = |n: u32, k: u32| -> f64 {
        let term = |i: u32| {
            let ways: f64 = (0..i).map(|j| f64::from(n - j) / f64::from(j + 1)).product();
            ways * 0.125_f64.powi(i as i32) * 0.875_f64.powi((n - i) as i32)
        };
        (k..=n).map(term).sum()
    };
    for n in [1, 5, 13, 40, 100] {
        for k in n / 8 + 1..=n {
            let bound = (-f64::from(n) * divergence(f64::from(k) / f64::from(n))).exp();
            let exact = tail(n, k);
            assert!(bound >= exact * (1.0 - 1e-9), "{k} of {n}: {bound} {exact}");
            assert!(bound <= exact * 4.0 * f64::from(n).sqrt(), "{k} of {n}: {bound} {exact}");
        }
    }
}
