use image::RgbImage;
use proptest::prelude::*;

use super::canvas::height_colour;
use super::*;
use crate::run_record::tests::{cycle, run};

fn decoded(png: &[u8]) -> RgbImage {
    image::load_from_memory(png).unwrap().into_rgb8()
}

fn background(picture: &RgbImage) -> Colour {
    picture.get_pixel(0, 0).0
}

/// How many pixels two pictures differ in.
fn differing(one: &RgbImage, other: &RgbImage) -> usize {
    assert_eq!(one.dimensions(), other.dimensions());
    one.pixels().zip(other.pixels()).filter(|(a, b)| a != b).count()
}

/// A floor of 10 x 20 voxels at z = 0, and a post on it that is only in the unfiltered map.
fn example() -> RunRecord {
    let middle = |cell: i32| (cell as f32 + 0.5) * 0.1;
    let mut run = run(vec![]);
    for x in 0..20 {
        for y in 0..10 {
            run.static_map.push(Point3::new(middle(x), middle(y), middle(0)));
        }
    }
    run.unfiltered_map = run.static_map.clone();
    run.unfiltered_map.extend((1..8).map(|z| Point3::new(middle(3), middle(9), middle(z))));
    run
}

/// The pictures, as if something had moved wherever the map has nothing.
fn pictures_of(run: &RunRecord) -> Result<MapPictures, PictureError> {
    let grid = VoxelGrid::new(run.voxel_edge_m)?;
    let mut voxels = crate::kept_out::kept_out(run, &grid);
    voxels.iter_mut().for_each(|voxel| voxel.cause = KeptOutCause::Moved);
    map_pictures(run, &voxels)
}

#[test]
fn with_and_without_removal_differ_only_where_something_was_removed() {
    let pictures = pictures_of(&example()).unwrap();
    let column_px = 16;
    let (with, without) =
        (decoded(&pictures.top.with_removal), decoded(&pictures.top.without_removal));
    // The post stands on one voxel seen from above, and on its own from the side.
    assert_eq!(differing(&with, &without), column_px * column_px);
    let (with, without) =
        (decoded(&pictures.side.with_removal), decoded(&pictures.side.without_removal));
    assert_eq!(differing(&with, &without), 7 * column_px * column_px);
}

#[test]
fn x_runs_right_y_up_from_above_and_z_up_from_the_side() {
    let pictures = pictures_of(&example()).unwrap();
    // From above 20 x 10 voxels and a margin of 3 all around; the post at voxel (3, 9), the farthest y.
    let above = decoded(&pictures.top.removed);
    assert_eq!(above.dimensions(), (26 * 16, 16 * 16));
    let orange = |picture: &RgbImage| {
        picture
            .enumerate_pixels()
            .filter(|(_, _, pixel)| pixel.0[0] > pixel.0[2].saturating_add(60))
            .map(|(x, y, _)| (x / 16, y / 16))
            .collect::<std::collections::BTreeSet<_>>()
    };
    assert_eq!(orange(&above).into_iter().collect::<Vec<_>>(), [(3 + 3, 3)]);
    // From the side 8 voxels of height: the post from z = 1 to 7.
    let side = decoded(&pictures.side.removed);
    assert_eq!(side.dimensions(), (26 * 16, 14 * 16));
    let rows: Vec<_> = orange(&side).into_iter().map(|cell| (cell.0, 13 - cell.1)).collect();
    assert_eq!(rows, (1..8).rev().map(|z| (6, z + 3)).collect::<Vec<_>>());
}

#[test]
fn the_scale_is_shared_and_stated() {
    let pictures = pictures_of(&example()).unwrap();
    assert_eq!(pictures.top.frame.px_per_m(), pictures.side.frame.px_per_m());
    assert!((pictures.top.frame.px_per_m() - 160.0).abs() < 1e-9);
    assert!((pictures.top.frame.scale_bar_m() - 1.0).abs() < 1e-9);
    let (low_m, high_m) = pictures.top.frame.height_range_m();
    assert!(low_m.abs() < 1e-9 && (high_m - 0.8).abs() < 1e-9);
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    assert_eq!(pictures_of(&example()).unwrap(), pictures_of(&example()).unwrap());
}

#[test]
fn the_path_is_in_the_picture_though_no_point_is_near_it() {
    let mut run = example();
    let mut behind = cycle(0);
    behind.map_from_rig.translation.vector.x = -2.0;
    run.cycles = vec![behind];
    let pictures = pictures_of(&run).unwrap();
    let with = decoded(&pictures.top.with_removal);
    assert_eq!(with.width(), 46 * 16);
    assert!(with.pixels().any(|pixel| pixel.0 == PATH));
}

#[test]
fn a_far_outlier_neither_shrinks_the_picture_nor_is_kept_silent() {
    let mut run = example();
    run.unfiltered_map.push(Point3::new(1e6, 0.0, 0.0));
    let frame = pictures_of(&run).unwrap().top.frame;
    assert_eq!(frame.points_outside(), 1);
    assert!(frame.size_px().0 < 40 * 16);
}

#[test]
fn an_empty_map_gives_an_empty_picture() {
    let pictures = pictures_of(&run(vec![])).unwrap();
    let picture = decoded(&pictures.top.with_removal);
    assert!(picture.width() > 0 && picture.height() > 0);
    assert_eq!(*picture.get_pixel(picture.width() / 2, 2), image::Rgb(background(&picture)));
}

#[test]
fn heights_run_from_blue_to_yellow() {
    let ([r_low, _, b_low], [r_high, _, b_high]) = (height_colour(0.0), height_colour(1.0));
    assert!(b_low > r_low && r_high > b_high);
    assert_eq!(height_colour(0.25), HEIGHT_COLOURS[1]);
    assert_eq!(height_colour(7.0), HEIGHT_COLOURS[4]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever the points, the pictures stay of a bounded size and nothing panics.
    #[test]
    fn any_points_give_pictures_of_bounded_size(
        points in prop::collection::vec(prop::array::uniform3(prop_oneof![-20.0_f32..20.0, any::<f32>()]), 0..40),
        edge_m in prop_oneof![Just(0.08), 1e-6..1e3_f64],
    ) {
        let mut run = run(vec![cycle(0)]);
        run.voxel_edge_m = edge_m;
        run.unfiltered_map = points.iter().map(|&[x, y, z]| Point3::new(x, y, z)).collect();
        run.static_map = run.unfiltered_map.iter().take(points.len() / 2).copied().collect();
        let pictures = pictures_of(&run).unwrap();
        for view in [&pictures.top, &pictures.side] {
            let (width_px, height_px) = view.frame.size_px();
            prop_assert!((1..=1200).contains(&width_px) && (1..=1200).contains(&height_px));
            prop_assert!(view.frame.px_per_m() > 0.0 && view.frame.scale_bar_m().is_finite());
        }
    }
}
