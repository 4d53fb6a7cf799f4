use proptest::prelude::*;

use super::*;

fn levels(depths_m: &[f32]) -> Levels {
    let mut levels = Levels::default();
    levels.refill(depths_m, [16, 16], &DepthNoise::default(), 0);
    levels
}

#[test]
fn means_are_of_one_surface_alone() {
    let mut depths_m = vec![2.0; 256];
    for (pixel, depth_m) in depths_m.iter_mut().enumerate() {
        *depth_m += if pixel % 2 == 0 { 0.001 } else { -0.001 };
        if pixel % 16 >= 9 {
            *depth_m = 4.0;
        }
    }
    let levels = levels(&depths_m);
    let coarse = levels.pixels(1);
    assert!((coarse[0].depth_m - 2.0).abs() < 2e-4 && (coarse[7].depth_m - 4.0).abs() < 2e-4);
    assert!(coarse.iter().all(|pixel| !(2.5..3.5).contains(&pixel.depth_m)));
    assert_eq!([0, 1, 2, 3].map(|level| levels.pixels(level).len()), [257, 65, 17, 5]);
    let outside = [0, 1, 2, 3].map(|level| *levels.pixels(level).last().unwrap());
    assert_eq!(outside, [LevelPixel::default(); 4]);
}

/// However steep: on the floor far off a pixel is a step of several noises.
#[test]
fn a_plane_has_its_slope_on_each_level() {
    for [by_column_m, by_row_m] in [[0.004, -0.011], [-0.09, 0.05], [0.0, -0.2]] {
        let plane_m = |[column, row]: [f32; 2]| 9.0 + column * by_column_m + row * by_row_m;
        let depths_m: Vec<f32> =
            (0..32 * 32).map(|pixel| plane_m([(pixel % 32) as f32, (pixel / 32) as f32])).collect();
        let mut levels = Levels::default();
        levels.refill(&depths_m, [32, 32], &DepthNoise::default(), 0);
        for level in 0..3 {
            let (columns, scale) = (32 >> level, (1 << level) as f32);
            // At the border no plane says where between pixels a depth is.
            let inner = 2..columns - 2;
            for (column, row) in
                inner.clone().flat_map(|row| inner.clone().map(move |at| (at, row)))
            {
                let seen = levels.pixels(level)[row * columns + column];
                let expected = [by_column_m, by_row_m].map(|slope_m| slope_m * scale);
                for (slope_m, expected_m) in seen.slopes_m().into_iter().zip(expected) {
                    assert!((slope_m - expected_m).abs() < 1e-4, "{level}: {seen:?}");
                }
                // The depth is that of the middle of its square.
                let middle_px = [column, row].map(|place| scale * (place as f32 + 0.5) - 0.5);
                let off_m = seen.depth_m - plane_m(middle_px);
                assert!(off_m.abs() < 5e-4, "{level}: {seen:?}, off by {off_m} m");
            }
        }
    }
}

#[test]
fn pixels_at_an_edge_or_beside_none_have_no_slope() {
    let mut depths_m = vec![2.0; 256];
    for (pixel, depth_m) in depths_m.iter_mut().enumerate() {
        *depth_m += 0.01 * (pixel / 16) as f32;
        match pixel % 16 {
            0..5 => {}
            // Something before it, what moves, and nothing.
            5..9 => *depth_m -= 1.0,
            9..12 => *depth_m = -*depth_m,
            _ => *depth_m = 0.0,
        }
    }
    let levels = levels(&depths_m);
    for (pixel, seen) in levels.pixels(0).iter().take(240).enumerate().skip(16) {
        let [by_column_m, by_row_m] = seen.slopes_m();
        let column = pixel % 16;
        assert!(by_column_m.abs() < 1e-4, "{pixel}: {seen:?}");
        let by_row = if (1..9).contains(&column) { 0.01 } else { 0.0 };
        assert!((by_row_m - by_row).abs() < 1e-4, "{pixel}: {seen:?}");
    }
}

proptest! {
    /// Pixel by pixel, in the words of [`halve`].
    #[test]
    fn halving_several_pixels_at_once_is_the_same_as_one_by_one(
        (width_px, height_px, finest_m) in (1..23_usize, 1..9_usize).prop_flat_map(|(width, height)| {
            let depth_m = prop_oneof![4 => 1.995..2.005_f32, 1 => 3.0..3.1_f32, 1 => -2.0..0.0_f32, 1 => Just(0.0)];
            (Just(width), Just(height), prop::collection::vec(depth_m, width * height))
        }),
    ) {
        let noise = DepthNoise::default();
        let finest = ImageRef { width_px, height_px, depths_m: &finest_m };
        let mut coarser = Image {
            width_px: width_px.div_ceil(2),
            height_px: height_px.div_ceil(2),
            depths_m: vec![0.0; width_px.div_ceil(2) * height_px.div_ceil(2)],
        };
        halve(finest, finest, 1, &noise, &mut coarser);
        for (pixel, mean_m) in coarser.depths_m.iter().enumerate() {
            let (column, row) = (2 * (pixel % coarser.width_px), 2 * (pixel / coarser.width_px));
            let at = |right: usize, down: usize| {
                finest.depth_m((column + right).min(width_px - 1), (row + down).min(height_px - 1))
            };
            let four = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
            let least = four.into_iter().fold(f32::MAX, f32::min);
            let most = four.into_iter().fold(f32::MIN, f32::max);
            let is_one = least > 0.0 && most - least <= SAME_SURFACE_SIGMAS * noise.sigma_m(least);
            let expected = if is_one {
                0.25 * ((four[0] + four[1]) + (four[2] + four[3]))
            } else {
                finest.between_m(column, row, &noise)
            };
            prop_assert_eq!(mean_m.to_bits(), expected.to_bits());
        }
    }
}
