//! Colours of what is static, through everything that happens to a surface.

use estimation::executor::{Executor, ScopedThreads, Serial};
use geometry::NO_COLOUR;
use nalgebra::{Isometry3, Point3, Vector3};

use super::{config, contents, points};
use crate::testing::{self, Scene};
use crate::{
    BLOCK_VOXELS, BlockBox, ChangeFollower, DepthView, PointRules, Surface, SurfaceConfig,
    SurfacePoint,
};

const RED: [u8; 3] = [200, 30, 30];
const BLUE: [u8; 3] = [20, 20, 220];
const GREEN: [u8; 3] = [10, 240, 10];
const WIDTH: usize = 160;
const HEIGHT: usize = 120;

fn coloured_surface() -> Surface {
    Surface::new(SurfaceConfig { has_colour: true, ..config(0.04) }).unwrap()
}

/// A wall at 1.5 m, red on the left and blue on the right, with other colours by pixel.
fn integrate(
    surface: &mut Surface,
    time_s: f64,
    is_moving: Option<&[bool]>,
    colour_of: impl Fn(usize, [u8; 3]) -> [u8; 3],
) {
    integrate_by(&Serial, surface, time_s, is_moving, colour_of);
}

fn integrate_by(
    executor: &dyn Executor,
    surface: &mut Surface,
    time_s: f64,
    is_moving: Option<&[bool]>,
    colour_of: impl Fn(usize, [u8; 3]) -> [u8; 3],
) {
    let camera = testing::camera(WIDTH, HEIGHT);
    let map_from_camera = &Isometry3::identity();
    let depths_m = Scene::wall(1.5).depths_m(&camera, map_from_camera);
    let colours: Vec<[u8; 3]> = (0..WIDTH * HEIGHT)
        .map(|pixel| colour_of(pixel, if pixel % WIDTH < WIDTH / 2 { RED } else { BLUE }))
        .collect();
    let mut view = DepthView::new(Default::default(), Default::default()).unwrap();
    let frame = testing::frame(&camera, time_s, depths_m).with_colours(colours).unwrap();
    testing::fill(&mut view, frame, is_moving, map_from_camera);
    surface.integrate(&view, executor);
}

fn walls() -> Surface {
    let mut surface = coloured_surface();
    for index in 0..3 {
        integrate(&mut surface, f64::from(index), None, |_, colour| colour);
    }
    surface
}

/// Every point away from the seam has the colour of its side.
fn assert_sides(points: &[SurfacePoint]) {
    assert!(points.len() > 500, "{}", points.len());
    for point in points.iter().filter(|point| point.position_m.x.abs() > 0.1) {
        let expected = if point.position_m.x < 0.0 { RED } else { BLUE };
        let colour = point.colour.unwrap_or(NO_COLOUR);
        let off = colour.iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max();
        assert!(off <= Some(2), "{point:?}");
    }
}

/// A voxel spans several pixels, some of which show what moves: these give it no colour, alone or in a mean.
#[test]
fn what_moves_gives_no_colour() {
    let is_moving: Vec<bool> =
        (0..WIDTH * HEIGHT).map(|pixel| (31..58).contains(&(pixel % WIDTH))).collect();
    let mut surface = coloured_surface();
    // What is known, also behind the mask, keeps its colour.
    integrate(&mut surface, 0.0, None, |_, colour| colour);
    for index in 1..9 {
        integrate(&mut surface, f64::from(index), Some(&is_moving), |pixel, colour| {
            if is_moving[pixel] { GREEN } else { colour }
        });
    }
    let points = points(&surface);
    assert!(points.iter().filter(|point| point.colour.is_some()).count() > 500);
    for point in points {
        let [red, green, blue] = point.colour.unwrap_or(NO_COLOUR);
        assert!(green <= red.max(blue) && green <= 40, "{point:?}");
    }
}

#[test]
fn a_pixel_without_a_colour_changes_none() {
    let mut surface = coloured_surface();
    integrate(&mut surface, 0.0, None, |_, _| NO_COLOUR);
    assert!(points(&surface).iter().all(|point| point.colour.is_none()));
    integrate(&mut surface, 1.0, None, |_, colour| colour);
    assert_sides(&points(&surface));
    for index in 2..9 {
        integrate(&mut surface, f64::from(index), None, |_, _| NO_COLOUR);
    }
    assert_sides(&points(&surface));
}

#[test]
fn without_a_colour_image_no_memory_is_taken_for_colours() {
    let plain = |has_colour| {
        let mut surface = Surface::new(SurfaceConfig { has_colour, ..config(0.04) }).unwrap();
        let camera = testing::camera(WIDTH, HEIGHT);
        let view = testing::view_of_scene(&Scene::wall(1.5), &camera, &Isometry3::identity(), 0.0);
        surface.integrate(&view, &Serial);
        surface
    };
    assert_eq!(plain(true).memory_bytes(), plain(false).memory_bytes());
    let (coloured, plain) = (walls(), plain(true));
    assert_eq!(coloured.blocks(), plain.blocks());
    // With colours the image is there in full, too.
    let of_blocks = |surface: &Surface| surface.memory_bytes() - surface.levels.memory_bytes();
    let more = (of_blocks(&coloured) - of_blocks(&plain)) as f64 / plain.blocks() as f64;
    let of_all_nodes = 3.0 * BLOCK_VOXELS as f64;
    assert!((0.3 * of_all_nodes..1.1 * of_all_nodes).contains(&more), "{more} bytes a block");
}

#[test]
fn colours_come_back_from_bytes() {
    let surface = walls();
    let mut copy = surface.emptied();
    for key in surface.block_keys() {
        copy.put_block(&surface.block_bytes(key).unwrap()).unwrap();
    }
    assert_eq!(points(&copy), points(&surface));
}

/// A correction takes the colours along: turned by a quarter about the axis of the camera, left is below.
#[test]
fn a_correction_takes_the_colours_along() {
    let quarter = Isometry3::rotation(Vector3::z() * std::f64::consts::FRAC_PI_2);
    let moved = walls().corrected(|_| quarter);
    let back: Vec<SurfacePoint> = points(&moved)
        .into_iter()
        .map(|point| {
            let position_m = quarter.cast::<f32>().inverse() * point.position_m;
            SurfacePoint { position_m, ..point }
        })
        .collect();
    assert!(back.iter().filter(|point| point.colour.is_some()).count() > back.len() * 9 / 10);
    let coloured: Vec<SurfacePoint> =
        back.into_iter().filter(|point| point.colour.is_some()).collect();
    assert_sides(&coloured);
}

#[test]
fn points_with_colours_give_a_coloured_surface() {
    let saved = points(&walls());
    let mut surface = coloured_surface();
    let put = saved.iter().map(|point| (point.position_m, point.normal, point.colour.unwrap()));
    assert_eq!(surface.put_coloured_points(put, 0.04, BlockBox::ALL), 0);
    assert_sides(&points(&surface));
    let mut plain = coloured_surface();
    let put = saved.iter().map(|point| (point.position_m, point.normal));
    plain.put_points(put, 0.04, BlockBox::ALL);
    assert!(points(&plain).iter().all(|point| point.colour.is_none()));
    let positions = |surface: &Surface| -> Vec<Point3<f32>> {
        points(surface).iter().map(|point| point.position_m).collect()
    };
    assert_eq!(positions(&plain), positions(&surface), "colours move nothing");
}

/// The colour camera may begin later than the depth camera: listeners are told of the colours then, and once.
#[test]
fn listeners_are_told_of_the_first_colour() {
    let mut surface = coloured_surface();
    let mut follower = ChangeFollower::default();
    let mut told = |surface: &mut Surface, time_s, has_colour| {
        integrate(surface, time_s, None, |_, colour| if has_colour { colour } else { NO_COLOUR });
        follower.follow(surface);
        follower.take(surface, PointRules::default(), usize::MAX).updated
    };
    let first = told(&mut surface, 0.0, false);
    assert!(first.len() > 500 && first.iter().all(|point| point.colour.is_none()));
    assert_eq!(told(&mut surface, 1.0, false), []);
    assert_sides(&told(&mut surface, 2.0, true));
    assert_eq!(told(&mut surface, 3.0, true), []);
    // What was told of leaves with its block, and comes back.
    let known: Vec<_> =
        surface.block_keys().into_iter().map(|key| (key, follower.known_bytes(key))).collect();
    let mut another = ChangeFollower::default();
    known.iter().for_each(|(key, bytes)| another.come_back(*key, bytes));
    another.follow(&surface);
    assert_eq!(another.take(&surface, PointRules::default(), usize::MAX).updated, []);
}

#[test]
fn the_number_of_threads_changes_no_colour() {
    let two = ScopedThreads::new(std::num::NonZeroUsize::new(2).unwrap());
    let contents_by = |executor: &dyn Executor| {
        let mut surface = coloured_surface();
        for index in 0..3_u8 {
            let shade = |pixel: usize, [red, green, blue]: [u8; 3]| {
                [red, green.wrapping_add(pixel as u8), blue.wrapping_sub(20 * index)]
            };
            integrate_by(executor, &mut surface, f64::from(index), None, shade);
        }
        contents(&surface)
    };
    let (one, two) = (contents_by(&Serial), contents_by(&two));
    assert!(one.iter().any(|(_, block)| block.colour.is_some()) && one == two);
}
