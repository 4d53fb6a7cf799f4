use geometry::{CameraModel, Distortion};
use nalgebra::Vector3;
use proptest::prelude::*;

use super::*;
use crate::testing;

fn empty() -> DepthView {
    DepthView::new(DepthRange { min_m: 0.5, max_m: 5.0 }, DepthNoise::default()).unwrap()
}

#[test]
fn depths_out_of_range_and_what_moves_show_free_space_alone() {
    let camera = testing::camera(8, 1);
    let values = vec![f32::NAN, 0.0, -1.0, f32::INFINITY, 0.4, 2.0, 6.0, 3.0];
    let is_moving = [true, true, true, true, true, false, true, true];
    let mut view = empty();
    let frame = testing::frame(&camera, 0.0, values);
    testing::fill(&mut view, frame, Some(&is_moving), &Isometry3::identity());
    let expected = [0.0, 0.0, 0.0, 0.0, 0.0, 2.0, -5.0, -3.0];
    for (depth_m, expected_m) in view.depths_m.iter().zip(expected) {
        assert!((depth_m - expected_m).abs() <= 5e-5 * f32::abs(expected_m), "{depth_m}");
    }
}

#[test]
fn a_pose_or_a_range_that_is_none_is_refused() {
    let frame = testing::frame(&testing::camera(8, 4), 0.0, vec![1.0; 32]);
    let mut view = empty();
    view.fill(&DepthInput::new(&frame, &Isometry3::identity())).unwrap();
    let nowhere = Isometry3::translation(f64::NAN, 0.0, 0.0);
    let error = view.fill(&DepthInput::new(&frame, &nowhere)).unwrap_err();
    assert!(view.is_empty() && matches!(error, ViewError::Pose(_)), "{error}");
    for (min_m, max_m) in [(1.0, 1.0), (-1.0, 1.0), (f32::NAN, 1.0), (0.0, f32::INFINITY)] {
        assert!(DepthView::new(DepthRange { min_m, max_m }, DepthNoise::default()).is_err());
    }
}

#[test]
fn colours_are_those_of_the_image_where_they_are_wanted() {
    let frame = testing::frame(&testing::camera(8, 4), 0.0, vec![1.0; 32]);
    let frame = frame.with_colours(vec![[1, 2, 3]; 32]).unwrap();
    let (mut view, pose) = (empty(), Isometry3::identity());
    view.fill(&DepthInput::new(&frame, &pose)).unwrap();
    assert_eq!(view.colour, vec![[1, 2, 3]; 32]);
    view.fill(&DepthInput::new(&frame, &pose).without_colours()).unwrap();
    assert!(view.colour.is_empty());
}

/// Regression: two nodes of one process each computed the tiles of an image.
#[test]
fn views_of_one_frame_share_its_tiles_whatever_moves() {
    let (camera, pose) = (testing::camera(64, 48), Isometry3::identity());
    let depth_m = |pixel: usize| 0.3 + 0.1 * (pixel * 7919 % 61) as f32;
    let frame = Arc::new(testing::frame(&camera, 0.0, (0..64 * 48).map(depth_m).collect()));
    let masked =
        MaskedDepth::new(Arc::clone(&frame), (0..64 * 48).map(|pixel| pixel % 3 == 0).collect());
    let masked = masked.unwrap();
    let (mut one, mut other) = (empty(), empty());
    one.fill(&DepthInput::new(&frame, &pose)).unwrap();
    other.fill(&DepthInput::masked(&masked, &pose)).unwrap();
    assert!(Arc::ptr_eq(&one.tiles, &other.tiles));
    let range = DepthRange { min_m: 0.5, max_m: 4.0 };
    let mut nearer = DepthView::new(range, DepthNoise::default()).unwrap();
    nearer.fill(&DepthInput::new(&frame, &pose)).unwrap();
    assert!(!Arc::ptr_eq(&one.tiles, &nearer.tiles));
    assert!(one.farthest_m() == 5.0 && nearer.farthest_m() == 4.0);

    // Nobody has them any more: the same again.
    let tile = |view: &DepthView| view.tiles.span([3, 40], [5, 30]);
    let before = tile(&one);
    one.clear();
    other.clear();
    assert!(frame.computed::<RangedTiles>().is_none());
    other.fill(&DepthInput::masked(&masked, &pose)).unwrap();
    assert_eq!(tile(&other), before);
}

/// No allocation in the steady state.
#[test]
fn tiles_that_are_shared_no_more_are_filled_again() {
    let (camera, pose) = (testing::camera(64, 48), Isometry3::identity());
    let (mut one, mut other) = (empty(), empty());
    let mut places = Vec::new();
    for cycle in 0..3 {
        let frame = testing::frame(&camera, 0.0, vec![1.0 + 0.1 * cycle as f32; 64 * 48]);
        one.fill(&DepthInput::new(&frame, &pose)).unwrap();
        places.push(one.tiles.least_return_m().as_ptr());
        other.fill(&DepthInput::new(&frame, &pose)).unwrap();
        other.clear();
    }
    assert!(places.iter().all(|place| *place == places[0]));
}

#[test]
fn the_tiles_alone_are_those_of_the_view() {
    let (plain, pose) = (testing::camera(67, 45), Isometry3::identity());
    let distortion = Distortion::PlumbBob([-0.2, 0.05, 0.001, -0.001, 0.0]);
    let depth_m = |pixel: usize| 0.1 * (pixel * 7919 % 71) as f32;
    let depths_m: Vec<f32> = (0..67 * 45).map(depth_m).collect();
    for camera in [plain, CameraModel { distortion, ..plain }] {
        // Of one frame they would be shared.
        let [of_one, of_other] = [(); 2].map(|()| testing::frame(&camera, 3.0, depths_m.clone()));
        let (mut whole, mut tiles_alone) = (empty(), empty());
        whole.fill(&DepthInput::new(&of_one, &pose)).unwrap();
        tiles_alone.fill_tiles(&DepthInput::new(&of_other, &pose)).unwrap();
        assert!(!tiles_alone.is_empty());
        assert_eq!(tiles_alone.size_px(), whole.size_px());
        assert_eq!((tiles_alone.stamp, tiles_alone.kind), (whole.stamp, whole.kind));
        assert_eq!(tiles_alone.farthest_m(), 5.0);
        let tiles = [&whole, &tiles_alone].map(|view| {
            let most_m: Vec<f32> = view.tiles.most_m().collect();
            let spans = (0..60).map(|at| view.tiles.span([at, at + 6], [at / 2, at / 2 + at / 5]));
            (view.tiles.least_return_m().to_vec(), most_m, spans.collect::<Vec<_>>())
        });
        assert_eq!(tiles[0], tiles[1]);
    }
    let nowhere = Isometry3::translation(f64::NAN, 0.0, 0.0);
    let frame = testing::frame(&plain, 0.0, depths_m);
    let mut view = empty();
    assert!(view.fill_tiles(&DepthInput::new(&frame, &nowhere)).is_err() && view.is_empty());
}

#[test]
fn a_lens_is_taken_out_of_the_image() {
    let distortion = Distortion::PlumbBob([-0.2, 0.05, 0.001, -0.001, 0.0]);
    let camera = CameraModel { distortion, ..testing::camera(64, 48) };
    // A slanted wall: its depth is that of the ray, at whatever pixel the lens shows it.
    let normal = Vector3::new(0.3, 0.2, 1.0);
    let depth = |x: f64, y: f64| 2.0 / normal.dot(&Vector3::new(x, y, 1.0));
    let pixels = (0..48).flat_map(|row| (0..64).map(move |column| (column, row)));
    let depths_m = pixels.clone().map(|(column, row)| {
        let ray = camera.ray(&nalgebra::Point2::new(f64::from(column), f64::from(row)));
        ray.map_or(0.0, |ray| depth(ray.x, ray.y) as f32)
    });
    let view = testing::view_of(&camera, &Isometry3::identity(), 0.0, depths_m.collect(), None);
    let mut shown = 0;
    for ((column, row), &depth_m) in pixels.zip(&view.depths_m) {
        let x = (f64::from(column) - camera.cx_px) / camera.fx_px;
        let y = (f64::from(row) - camera.cy_px) / camera.fy_px;
        if depth_m != 0.0 {
            shown += 1;
            assert!((f64::from(depth_m) - depth(x, y)).abs() < 0.03, "column {column}, row {row}");
        }
    }
    assert!(shown > 2500, "{shown} pixels");
}

#[test]
fn a_cloud_is_seen_as_a_panorama_and_the_nearest_point_counts() {
    let model = SphericalModel {
        columns: 360,
        rows: 10,
        least_elevation_rad: -0.3,
        most_elevation_rad: 0.3,
    };
    let points = [[3.0, 0.01, 0.01], [2.0, 0.007, 0.007], [f32::NAN, 0.0, 0.0], [0.0, 4.0, 0.01]];
    let points = points.map(Point3::from);
    let mut view = empty();
    let pose = Isometry3::identity();
    let moving = [false, false, true, true];
    view.fill_from_points(Stamp::default(), &points, Some(&moving), &model, &pose).unwrap();
    let mut seen: Vec<f32> = view.depths_m.iter().copied().filter(|m| *m != 0.0).collect();
    seen.sort_by(f32::total_cmp);
    assert_eq!(seen.len(), 2);
    assert!((seen[0] + 4.0).abs() < 1e-3 && (seen[1] - 2.0).abs() < 1e-3);
    let error = view.fill_from_points(Stamp::default(), &points, Some(&[]), &model, &pose);
    assert_eq!(error, Err(ViewError::Mask { mask_points: 0, points: 4 }));
    assert!(view.is_empty());
}

proptest! {
    /// The pyramid gives the same extremes of a rectangle as the tiles in it.
    #[test]
    fn a_rectangle_has_the_extremes_of_its_tiles(
        depths_m in prop::collection::vec(prop_oneof![Just(0.0_f32), 0.5..5.0_f32, -5.0..-0.5_f32], 37 * 29),
        columns in (0..37_u32, 0..37_u32),
        rows in (0..29_u32, 0..29_u32),
    ) {
        let mut tiles = Tiles::default();
        tiles.refill(Depths::Metres(&depths_m), 37, 29);
        let sorted = |(a, b): (u32, u32)| [a.min(b), a.max(b)];
        let (columns, rows) = (sorted(columns), sorted(rows));
        let span = tiles.span(columns, rows);
        let (mut free_to_m, mut known_to_m) = (f32::MAX, 0.0_f32);
        for tile_row in rows[0] / 4..=rows[1] / 4 {
            for tile_column in columns[0] / 4..=columns[1] / 4 {
                let lines = 4 * tile_row..29.min(4 * tile_row + 4);
                let seen: Vec<f32> = lines
                    .flat_map(|row| (4 * tile_column..37.min(4 * tile_column + 4)).map(move |column| row * 37 + column))
                    .map(|pixel| depths_m[pixel as usize].abs())
                    .collect();
                let returns: Vec<f32> = seen.iter().copied().filter(|depth_m| *depth_m > 0.0).collect();
                let least = returns.iter().copied().fold(f32::MAX, f32::min);
                free_to_m = free_to_m.min(if 2 * returns.len() < seen.len() { 0.0 } else { least });
                known_to_m = returns.iter().copied().fold(known_to_m, f32::max);
            }
        }
        prop_assert_eq!((span.free_to_m, span.known_to_m), (free_to_m, known_to_m));
    }
}
