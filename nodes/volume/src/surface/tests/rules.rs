//! What an image says of space, rule by rule.

use super::*;

const BALL: ([f64; 3], f64) = ([0.0, 0.0, 1.5], 0.2);

fn with_ball() -> Scene {
    Scene { balls: vec![(BALL.0.into(), BALL.1)], ..Scene::wall(3.0) }
}

fn front_of_ball() -> Point3<f32> {
    Point3::new(0.0, 0.0, (BALL.0[2] - BALL.1) as f32)
}

fn middle_of_ball() -> Point3<f32> {
    Point3::from(BALL.0).cast()
}

/// A surface that saw a scene so many times.
fn after(scene: &Scene, images: usize) -> Surface {
    let mut surface = surface(0.05);
    see(&mut surface, scene, images);
    surface
}

fn see(surface: &mut Surface, scene: &Scene, images: usize) {
    let camera = testing::camera(160, 120);
    for index in 0..images {
        let pose = testing::pose([0.0; 3], [0.0; 3]);
        surface.integrate(&testing::view_of_scene(scene, &camera, &pose, index as f64), &Serial);
    }
}

#[test]
fn what_has_gone_is_cleared_by_what_is_seen_behind_it() {
    for images in [1, 5, 100] {
        let mut surface = after(&with_ball(), images);
        assert!(near(&surface, front_of_ball(), 0.1) > 5);
        let until_gone = (1..30).find(|_| {
            see(&mut surface, &Scene::wall(3.0), 1);
            near(&surface, middle_of_ball(), 0.3) == 0
        });
        assert!(until_gone.is_some_and(|cleared| cleared <= 12), "{images} images: {until_gone:?}");
        assert!(near(&surface, Point3::new(0.0, 0.0, 3.0), 0.3) > 20, "the wall is there");
    }
}

/// Blocks with the wall in them are never free as a whole: their nodes have to forget the ball.
#[test]
fn what_was_close_before_a_wall_for_long_goes_as_soon_as_what_was_there_shortly() {
    let ball = Scene { balls: vec![([0.0, 0.0, 2.9].into(), 0.15)], ..Scene::wall(3.0) };
    for images in [3, 300] {
        let mut surface = after(&ball, images);
        assert!(near(&surface, Point3::new(0.0, 0.0, 2.75), 0.06) > 2);
        let until_gone = (1..60).find(|_| {
            see(&mut surface, &Scene::wall(3.0), 1);
            let is_before = |point: &&SurfacePoint| point.position_m.z < 2.94;
            points(&surface).iter().filter(is_before).count() == 0
        });
        assert!(until_gone.is_some_and(|cleared| cleared <= 12), "{images} images: {until_gone:?}");
    }
}

#[test]
fn where_nothing_comes_back_nothing_is_cleared() {
    let camera = testing::camera(160, 120);
    let mut surface = after(&with_ball(), 3);
    let before = nodes(&surface);
    for index in 0..50 {
        let pose = Isometry3::identity();
        let view = testing::view_of(&camera, &pose, f64::from(index), vec![0.0; 160 * 120], None);
        assert_eq!(surface.integrate(&view, &Serial).compared_blocks, 0);
    }
    assert!(nodes(&surface) == before);
}

#[test]
fn what_moves_adds_nothing_and_proves_the_space_before_it_free() {
    let camera = testing::camera(160, 120);
    let pose = Isometry3::identity();
    let walker = Scene::wall(2.5).depths_m(&camera, &pose);
    let is_moving = vec![true; walker.len()];
    let mut surface = surface(0.05);
    let view = testing::view_of(&camera, &pose, 0.0, walker, Some(&is_moving));
    surface.integrate(&view, &Serial);
    assert_eq!(surface.blocks(), 0, "no surface");
    see(&mut surface, &with_ball(), 3);
    let wall = near(&surface, Point3::new(0.0, 0.5, 3.0), 0.3);
    assert!(near(&surface, front_of_ball(), 0.1) > 5);
    for _ in 0..15 {
        surface.integrate(&view, &Serial);
    }
    assert_eq!(near(&surface, middle_of_ball(), 0.3), 0, "the ball before it has gone");
    assert_eq!(near(&surface, Point3::new(0.0, 0.5, 3.0), 0.3), wall, "what it hides stays");
}

/// A floor that is seen at 4 degrees: rays to its far part pass close over its near part.
#[test]
fn rays_that_graze_a_floor_do_not_clear_it() {
    let camera = testing::camera(320, 240);
    let floor = Scene {
        planes: vec![(nalgebra::Vector3::y(), 0.02), (nalgebra::Vector3::z(), 6.0)],
        balls: Vec::new(),
    };
    let mut surface = surface(0.05);
    let from_above = testing::pose([0.0, -1.2, 0.0], [-0.5, 0.0, 0.0]);
    for index in 0..5 {
        let view = testing::view_of_scene(&floor, &camera, &from_above, f64::from(index));
        surface.integrate(&view, &Serial);
    }
    let on_floor = |surface: &Surface| {
        let is_floor = |point: &&SurfacePoint| {
            (point.position_m.y - 0.02).abs() < 0.02
                && point.position_m.x.abs() < 0.4
                && point.position_m.z < 3.5
        };
        points(surface).iter().filter(is_floor).count()
    };
    let before = on_floor(&surface);
    assert!(before > 300, "{before}");
    let mut noise = testing::Noise::new(3);
    for index in 0..60 {
        let grazing = testing::pose([0.0, -0.2, -1.0], [0.0; 3]);
        let mut depths_m = floor.depths_m(&camera, &grazing);
        for depth_m in &mut depths_m {
            *depth_m *= 1.0 + 0.003 * noise.normal() as f32;
        }
        let view = testing::view_of(&camera, &grazing, f64::from(index), depths_m, None);
        surface.integrate(&view, &Serial);
    }
    let after = on_floor(&surface);
    assert!(after * 100 >= before * 99, "{after} of {before}");
}

#[test]
fn a_thing_that_is_missed_now_and_then_stays() {
    let mut surface = after(&with_ball(), 5);
    for index in 0..60 {
        see(&mut surface, &if index % 3 == 0 { Scene::wall(3.0) } else { with_ball() }, 1);
        assert!(near(&surface, front_of_ball(), 0.1) > 3, "image {index}");
    }
}

/// A ball before nothing: it goes when nothing comes back from there any more.
#[test]
fn what_was_before_nothing_goes_when_nothing_comes_back() {
    let camera = testing::camera(160, 120);
    // A wall beside it, so that the camera is not blind.
    let seen = |has_ball: bool, far: bool| {
        let scene = Scene { planes: with_ball().planes, balls: vec![(BALL.0.into(), BALL.1)] };
        let mut depths_m = scene.depths_m(&camera, &Isometry3::identity());
        for (pixel, depth_m) in depths_m.iter_mut().enumerate() {
            let is_ball = *depth_m < 2.9;
            let is_shown = if is_ball { has_ball } else { far || pixel % 160 < 20 };
            *depth_m = if is_shown { *depth_m } else { 0.0 };
        }
        depths_m
    };
    let until_gone = |(mut surface, last_hit_s): (Surface, f64), from_m: [f64; 3]| {
        (0..40).find(|&index| {
            let pose = testing::pose(from_m, [0.0; 3]);
            let stamp_s = last_hit_s + 0.1 * f64::from(index + 1);
            let view = testing::view_of(&camera, &pose, stamp_s, seen(false, false), None);
            surface.integrate(&view, &Serial);
            near(&surface, front_of_ball(), 0.1) == 0
        })
    };
    let after = |has_wall: bool, lasted_s: f64| {
        let mut surface = surface(0.05);
        let pose = Isometry3::identity();
        if has_wall {
            let view = testing::view_of(
                &camera,
                &pose,
                0.0,
                Scene::wall(3.0).depths_m(&camera, &pose),
                None,
            );
            surface.integrate(&view, &Serial);
        }
        for index in 0..6 {
            let stamp_s = lasted_s * f64::from(index) / 5.0;
            let view = testing::view_of(&camera, &pose, stamp_s, seen(true, false), None);
            surface.integrate(&view, &Serial);
        }
        assert!(near(&surface, front_of_ball(), 0.1) > 5);
        (surface, lasted_s)
    };
    let gone = until_gone(after(true, 0.5), [0.0; 3]);
    assert!(gone.is_some_and(|images| (10..20).contains(&images)), "{gone:?}");
    assert_eq!(until_gone(after(false, 0.5), [0.0; 3]), None, "nothing ever came from there");
    let gone = until_gone(after(true, 12.0), [0.0; 3]);
    assert!(gone.is_some_and(|image| (28..31).contains(&image)), "a quarter of 12 s: {gone:?}");
    assert_eq!(until_gone(after(true, 20.0), [0.0; 3]), None, "it was there for long");
    assert_eq!(until_gone(after(true, 0.5), [0.0, 0.0, -0.3]), None, "it is farther away");
}

/// Regression: where a part of what was behind came back, and from the rest nothing, the feet of a person stayed in the map: their
/// places were neither free as a whole nor without a return.
#[test]
fn what_was_before_what_returns_in_parts_goes() {
    let camera = testing::camera(160, 120);
    let pose = Isometry3::identity();
    let mut surface = surface(0.05);
    let mut see = |index: i32, scene: &Scene, is_shown: fn(usize) -> bool| {
        let mut depths_m = scene.depths_m(&camera, &pose);
        for (pixel, depth_m) in depths_m.iter_mut().enumerate() {
            *depth_m = if is_shown(pixel / 160) { *depth_m } else { 0.0 };
        }
        let stamp_s = 0.1 * f64::from(index);
        surface.integrate(&testing::view_of(&camera, &pose, stamp_s, depths_m, None), &Serial);
        near(&surface, front_of_ball(), 0.3)
    };
    let of_ball = (0..6).map(|index| see(index, &with_ball(), |_| true)).last();
    assert!(of_ball > Some(20), "{of_ball:?}");
    let left = (6..46).map(|index| see(index, &Scene::wall(3.0), |row| row % 24 < 8)).last();
    assert_eq!(left, Some(0));
}

/// The same with a ball at the left border of the image, in a block that the border cuts.
#[test]
fn what_was_before_nothing_goes_also_at_the_border_of_the_image_while_the_platform_stands() {
    let camera = testing::camera(160, 120);
    let at_border = Point3::new(-1.5 * camera.cx_px / camera.fx_px, 0.0, 1.5);
    let scene = Scene { balls: vec![(at_border, 0.15)], ..Scene::wall(3.0) };
    let seen = |pose: &Isometry3<f64>, has_ball: bool| {
        let mut depths_m = scene.depths_m(&camera, pose);
        for (pixel, depth_m) in depths_m.iter_mut().enumerate() {
            let is_ball = *depth_m < 2.9;
            let is_shown = if is_ball { has_ball } else { pixel % 160 > 60 };
            *depth_m = if is_shown { *depth_m } else { 0.0 };
        }
        depths_m
    };
    let left_after = |turned_rad: f64| {
        let mut surface = surface(0.05);
        let still = Isometry3::identity();
        let mut integrate = |pose: &Isometry3<f64>, stamp_s: f64, depths_m: Vec<f32>| {
            surface.integrate(&testing::view_of(&camera, pose, stamp_s, depths_m, None), &Serial);
        };
        integrate(&still, 0.0, Scene::wall(3.0).depths_m(&camera, &still));
        // The ball is seen from two directions where the camera turned in between.
        let turned = testing::pose([0.0; 3], [0.0, turned_rad, 0.0]);
        integrate(&turned, 0.1, seen(&turned, true));
        (2..6).for_each(|index| integrate(&still, 0.1 * f64::from(index), seen(&still, true)));
        (6..46).for_each(|index| integrate(&still, 0.1 * f64::from(index), seen(&still, false)));
        near(&surface, at_border.cast(), 0.3)
    };
    assert_eq!(left_after(0.0), 0);
    assert!(left_after(-0.2) > 0, "the image shows another part of it than was seen");
}
