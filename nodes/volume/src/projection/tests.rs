use geometry::CameraModel;
use nalgebra::{Point2, Point3};
use proptest::prelude::*;

use super::*;
use crate::testing;

fn models() -> (CameraModel, Pinhole, SphericalModel, Spherical) {
    let camera = testing::camera(64, 48);
    let (columns, rows) = (90, 16);
    let model =
        SphericalModel { columns, rows, least_elevation_rad: -0.4, most_elevation_rad: 0.3 };
    (camera, Pinhole::of(&camera), model, Spherical::of(&model))
}

/// Whether some point of a box is outside of its bounds.
fn breaks_bounds<P: Project>(projection: P, of: &CameraBox, pixels: u32, columns: u32) -> bool {
    let extent = projection.extent(of);
    let at = |share: f32, axis: usize| of.middle_m[axis] + (2.0 * share - 1.0) * of.half_m[axis];
    let shares = [0.0, 0.2, 0.5, 0.9, 1.0];
    shares.iter().any(|x| {
        shares.iter().any(|y| {
            shares.iter().any(|z| {
                let row = projection.row([at(*x, 0), at(*y, 1), at(*z, 2)], [0.0; 3]);
                let (depth_m, pixel) = (row.depth_m[0], row.pixel[0]);
                match extent {
                    Extent::Undecided => false,
                    Extent::Outside => pixel < pixels,
                    Extent::Within(covered) => {
                        let within =
                            |value: u32, [first, last]: [u32; 2]| (first..=last).contains(&value);
                        let is_beside = if pixel < pixels {
                            !within(pixel % columns, covered.columns)
                                || !within(pixel / columns, covered.rows)
                        } else {
                            !covered.is_cut
                        };
                        is_beside || depth_m < covered.nearest_m || depth_m > covered.farthest_m
                    }
                }
            })
        })
    })
}

fn extents_of(projection: impl Project, boxes: &CameraBoxes) -> [Extent; LANES] {
    let mut extents = [Extent::Undecided; LANES];
    projection.for_each_extent(boxes, |lane, extent| extents[lane] = extent);
    extents
}

proptest! {
    #[test]
    fn a_box_covers_all_its_points(
        middle_m in prop::array::uniform3(-4.0..4.0_f32),
        half_m in prop::array::uniform3(0.01..0.8_f32),
    ) {
        let (_, pinhole, _, spherical) = models();
        let of = CameraBox { middle_m, half_m };
        prop_assert!(!breaks_bounds(pinhole, &of, 64 * 48, 64));
        prop_assert!(!breaks_bounds(spherical, &of, 90 * 16, 90));
    }

    #[test]
    fn several_boxes_cover_what_each_of_them_covers(
        middles_m in prop::array::uniform8([-6.0..6.0_f32, -6.0..6.0_f32, -1.0..8.0_f32]),
        half_m in prop::array::uniform3(0.0..1.0_f32),
    ) {
        let (_, pinhole, _, spherical) = models();
        let middle_m = [0, 1, 2].map(|axis: usize| middles_m.map(|middle_m| middle_m[axis]));
        let boxes = CameraBoxes { middle_m, half_m };
        let each = middles_m.map(|middle_m| CameraBox { middle_m, half_m });
        prop_assert_eq!(extents_of(pinhole, &boxes), each.map(|of| pinhole.extent(&of)));
        prop_assert_eq!(extents_of(spherical, &boxes), each.map(|of| spherical.extent(&of)));
    }

    #[test]
    fn a_pinhole_projects_as_the_camera_does(
        x in -2.0..2.0_f64, y in -2.0..2.0_f64, z in -1.0..5.0_f64, level in 0..4_u32,
    ) {
        let (camera, pinhole, _, _) = models();
        let row = pinhole.coarser(level).row([x as f32, y as f32, z as f32], [0.0; 3]);
        let (columns, rows) = (64_u32.div_ceil(1 << level), 48_u32.div_ceil(1 << level));
        let expected = camera.project(&Point3::new(x, y, z)).filter(|_| z > 0.05);
        // A point between two pixels may be rounded to either.
        let at = |seen: f64| {
            let coarse = (seen + 0.5) / f64::from(1 << level);
            [coarse - 1e-3, coarse + 1e-3].map(|value| value.floor() as i64)
        };
        match expected {
            Some(Point2 { coords }) => {
                let is_border = row.pixel[0] == columns * rows;
                let (column, line) = (row.pixel[0] % columns, row.pixel[0] / columns);
                let fits = at(coords.x).contains(&i64::from(column)) && at(coords.y).contains(&i64::from(line));
                let near_border = coords.x < -0.49 || coords.y < -0.49 || coords.x > 63.49 || coords.y > 47.49;
                prop_assert!(fits || (is_border && near_border));
            }
            None => {
                let on_border = z > 0.05 && {
                    let u = x / z * camera.fx_px + camera.cx_px;
                    let v = y / z * camera.fy_px + camera.cy_px;
                    [u + 0.5, v + 0.5, u - 63.5, v - 47.5].iter().any(|beside| beside.abs() < 1e-2)
                };
                prop_assert!(row.pixel[0] == columns * rows || (0.04..0.06).contains(&z) || on_border);
            }
        }
    }
}

#[test]
fn a_panorama_has_its_columns_clockwise_and_its_rows_downwards() {
    let (_, _, _, spherical) = models();
    let pixel =
        |x, y, z| spherical.pixel(&Point3::new(x, y, z)).map(|(pixel, _)| (pixel % 90, pixel / 90));
    let ahead = pixel(5.0, 0.01, 0.0).unwrap();
    assert_eq!(ahead.0, 44);
    assert!(pixel(5.0, 1.0, 0.0).unwrap().0 < ahead.0, "left");
    assert!(pixel(5.0, 0.01, 1.0).unwrap().1 < ahead.1, "up");
    assert_eq!(pixel(-5.0, 1e-6, 0.0).unwrap().0, 0);
    assert_eq!(pixel(-5.0, -1e-6, 0.0).unwrap().0, 89);
    assert_eq!(pixel(0.0, 0.0, 5.0), None);
    assert_eq!(pixel(0.0, 0.0, 0.0), None);
}

#[test]
fn numbers_that_describe_no_panorama_are_refused() {
    let (_, _, model, _) = models();
    assert!(model.validate().is_ok());
    for broken in [
        SphericalModel { columns: 0, ..model },
        SphericalModel { rows: usize::MAX, ..model },
        SphericalModel { least_elevation_rad: 0.4, ..model },
        SphericalModel { most_elevation_rad: f64::NAN, ..model },
        SphericalModel { most_elevation_rad: 2.0, ..model },
    ] {
        assert!(broken.validate().is_err(), "{broken:?}");
    }
}
