use std::num::NonZeroUsize;
use std::sync::Arc;

use estimation::{ScopedThreads, Serial};
use geometry::pose_from_vector;
use nalgebra::{Point3, Vector3};

use super::*;
use crate::{Body, DepthCamera, Lamp, Material, Paint, Sample, Scenario, Shape, Texture};

/// A camera of 160 x 120 pixels without noise.
fn config() -> ColourCamera {
    ColourCamera::default().without_noise()
}

fn camera() -> CameraModel {
    DepthCamera::kinect_v1().with_size(160, 120).camera
}

/// Ambient light only, as bright as white.
fn even_light() -> Lighting {
    Lighting::of_lamps(0.8, Vec::new())
}

fn solids(bodies: &[Body]) -> Vec<Solid> {
    bodies.iter().map(|body| body.solid(0, &Isometry3::identity())).collect()
}

/// The image of a camera at this pose, looking along x.
fn taken_from(
    rig: [f64; 6],
    config: &ColourCamera,
    statics: &[Solid],
    lighting: &Lighting,
) -> Vec<u8> {
    let room_from_camera =
        pose_from_vector(&rig) * pose_from_vector(&DepthCamera::kinect_v1().rig_from_camera);
    let moment = Moment { room_from_camera, moving: Vec::new() };
    ColourSensor::new(config, camera()).take(statics, &[moment], lighting, (1, 0), &Serial)
}

fn facing_wall(paint: Paint) -> Body {
    Body {
        name: "wall".to_owned(),
        shape: Shape::Box { size_m: [0.1, 9.0, 9.0] },
        pose: [3.05, 0.0, 0.0, 0.0, 0.0, 0.0],
        material: Material::PLASTER.painted(paint),
    }
}

/// A room with everything that can go wrong in an image.
fn room() -> (Vec<Solid>, Lighting) {
    let scenario = Scenario::demo();
    (scenario.scene.static_solids(), scenario.scene.lighting)
}

#[test]
fn a_point_of_a_wall_has_the_same_colour_from_everywhere() {
    let texture = Texture::Noise { size_m: 0.6, contrast: 0.5 };
    let wall = solids(&[facing_wall(Paint::with([0.5, 0.4, 0.3], texture, 0.0))]);
    let (here, there) = ([0.0; 6], [0.4, 0.5, -0.2, -0.15, 0.05, 0.1]);
    let [first, second] = [here, there].map(|rig| taken_from(rig, &config(), &wall, &even_light()));
    let rig_from_camera = pose_from_vector(&DepthCamera::kinect_v1().rig_from_camera);
    let camera = camera();
    let there_from_here = (pose_from_vector(&there) * rig_from_camera).inverse()
        * (pose_from_vector(&here) * rig_from_camera);
    let (mut compared, mut differences, mut spread) = (0, 0.0, 0.0);
    for row in 0..120 {
        for column in 0..160 {
            let ray = Vector3::new(
                (column as f64 - camera.cx_px) / camera.fx_px,
                (row as f64 - camera.cy_px) / camera.fy_px,
                1.0,
            );
            let Some(pixel) = camera.project(&(there_from_here * Point3::from(ray * 3.0))) else {
                continue;
            };
            let shade = f64::from(first[3 * (row * 160 + column)]);
            if let Some(other) = interpolated(&second, pixel.x, pixel.y) {
                differences += (shade - other).powi(2);
                spread += (shade - 180.0).powi(2);
                compared += 1;
            }
        }
    }
    let (off, spread) =
        ((differences / f64::from(compared)).sqrt(), (spread / f64::from(compared)).sqrt());
    assert!(compared > 5_000 && spread > 15.0, "{compared} pixels, spread {spread}");
    assert!(off < 0.12 * spread, "off by {off} of {spread}");
}

/// The red channel between four pixels.
fn interpolated(rgb: &[u8], x: f64, y: f64) -> Option<f64> {
    let (column, row) = (x.floor() as usize, y.floor() as usize);
    if x < 0.0 || y < 0.0 || column + 1 >= 160 || row + 1 >= 120 {
        return None;
    }
    let (s, t) = (x.fract(), y.fract());
    let at = |i: usize, j: usize| f64::from(rgb[3 * ((row + j) * 160 + column + i)]);
    let upper = at(0, 0) * (1.0 - s) + at(1, 0) * s;
    let lower = at(0, 1) * (1.0 - s) + at(1, 1) * s;
    Some(upper * (1.0 - t) + lower * t)
}

/// sRGB undone, to sum light.
fn linear(shade: u8) -> f64 {
    let encoded = f64::from(shade) / 255.0;
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[test]
fn edges_lie_where_they_are_to_a_tenth_of_a_pixel() {
    // Black to the left of y = 0, white to the right: the sum over a row gives the position of the edge.
    let paint = Paint::with([0.0; 3], Texture::Checker { size_m: 20.0, other: [1.0; 3] }, 0.0);
    let wall = solids(&[facing_wall(paint)]);
    let config = ColourCamera { supersampling: 4, ..config() };
    let camera = camera();
    for y_m in [0.0, 0.004, 0.009, 0.013, 0.02] {
        let rig = [0.0, y_m, 0.5, 0.0, 0.0, 0.0];
        let light = Lighting::of_lamps(1.0, Vec::new());
        let rgb = taken_from(rig, &config, &wall, &light);
        let row = &rgb[3 * 160 * 60..3 * 160 * 61];
        let white: f64 = row.chunks(3).map(|pixel| linear(pixel[0])).sum();
        let edge_px = camera.cx_px + y_m / 3.0 * camera.fx_px;
        let (left, right) = (white - 0.5, 159.5 - white);
        let off = (left - edge_px).abs().min((right - edge_px).abs());
        assert!(off < 0.15, "edge at {edge_px}, white {white}");
    }
}

/// Each ray on its own, with nothing skipped or kept.
fn plainly(rig: [f64; 6], statics: &[Solid], lighting: &Lighting, side: usize) -> Vec<u8> {
    let rig_from_camera = pose_from_vector(&DepthCamera::kinect_v1().rig_from_camera);
    let room_from_camera = pose_from_vector(&rig) * rig_from_camera;
    let camera = camera();
    let table = SrgbTable::new();
    let mut rgb = Vec::new();
    for row in 0..camera.height_px {
        for column in 0..camera.width_px {
            let mut sum = [0.0_f32; 3];
            for ray in 0..side * side {
                let within = |index: usize| (index as f64 + 0.5) / side as f64 - 0.5;
                let (x, y) = (column as f64 + within(ray % side), row as f64 + within(ray / side));
                let direction = room_from_camera
                    * Vector3::new(
                        (x - camera.cx_px) / camera.fx_px,
                        (y - camera.cy_px) / camera.fy_px,
                        1.0,
                    );
                let ray = crate::Ray { origin: room_from_camera * Point3::origin(), direction };
                let nearest = statics
                    .iter()
                    .filter(|solid| !solid.is_pane())
                    .filter_map(|solid| {
                        let local = ray.transformed(&solid.solid_from_room);
                        Some((solid, local, solid.shape.intersect(&local)?))
                    })
                    .min_by(|a, b| a.2.parameter.total_cmp(&b.2.parameter));
                let Some((solid, local, hit)) = nearest else { continue };
                let point = local.at(hit.parameter);
                let place = crate::surface::place(&solid.shape, &point, &hit.normal);
                let cos = hit.cos_incidence(&local.direction).max(0.05);
                let surface_point = crate::paint::SurfacePoint {
                    uv_m: place.uv_m.map(|m| m as f32),
                    seed: solid.pattern_seed.wrapping_add(place.side.wrapping_mul(0x9e37_79b9)),
                    footprint_m: (hit.parameter / camera.fx_px / cos.sqrt()) as f32,
                };
                let light = lighting.in_frame(&solid.solid_from_room).on(&point, &hit.normal)
                    as f32
                    * solid.paint.shade(&surface_point);
                for (sum, share) in sum.iter_mut().zip(solid.paint.ground(&surface_point)) {
                    *sum += share * light / (side * side) as f32;
                }
            }
            rgb.extend(sum.map(|channel| table.encode(channel)));
        }
    }
    rgb
}

#[test]
fn what_is_skipped_would_have_changed_little() {
    let (statics, lighting) = room();
    let rig = [1.0, 0.3, 1.2, 0.1, 0.15, 0.05];
    let config = ColourCamera { supersampling: 2, ..config() };
    let fast = taken_from(rig, &config, &statics, &lighting);
    let plain = plainly(rig, &statics, &lighting, 2);
    let differences: Vec<i32> =
        fast.iter().zip(&plain).map(|(a, b)| (i32::from(*a) - i32::from(*b)).abs()).collect();
    let mean = f64::from(differences.iter().sum::<i32>()) / differences.len() as f64;
    let large = differences.iter().filter(|&&difference| difference > 12).count();
    assert!(mean < 0.5, "mean {mean}");
    assert!(large * 500 < differences.len(), "{large} of {}", differences.len());
    // With one ray per pixel nothing is skipped.
    let config = ColourCamera { supersampling: 1, ..config };
    let single = taken_from(rig, &config, &statics, &lighting);
    let differing = single
        .iter()
        .zip(plainly(rig, &statics, &lighting, 1))
        .filter(|(a, b)| (i32::from(**a) - i32::from(*b)).abs() > 1)
        .count();
    assert!(differing * 2000 < single.len(), "{differing} of {}", single.len());
}

#[test]
fn light_that_is_low_has_the_noise_of_few_electrons() {
    let wall = solids(&[facing_wall(Paint::plain([0.45; 3]))]);
    let light = Lighting::of_lamps(1.0, Vec::new());
    let deviation = |config: &ColourCamera| {
        let rgb = taken_from([0.0; 6], config, &wall, &light);
        let values: Vec<f64> = rgb.iter().map(|&shade| linear(shade)).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        assert!((mean - 0.45).abs() < 0.01, "mean {mean}");
        let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        (squares / values.len() as f64).sqrt()
    };
    assert!(deviation(&config()) < 0.002);
    for (white, read) in [(160.0, 5.0), (1000.0, 20.0), (8000.0, 8.0)] {
        let config =
            ColourCamera { white_electrons: white, read_noise_electrons: read, ..config() };
        let expected = (0.45 * white + read * read).sqrt() / white;
        let found = deviation(&config);
        // Rounding to sRGB values adds the deviation of a step.
        let expected = (expected.powi(2) + (0.0056_f64).powi(2) / 12.0).sqrt();
        assert!((found / expected - 1.0).abs() < 0.05, "{found} for {expected}");
    }
}

#[test]
fn motion_blurs_an_edge_over_as_far_as_it_moves() {
    let paint = Paint::with([0.0; 3], Texture::Checker { size_m: 20.0, other: [1.0; 3] }, 0.0);
    let wall = solids(&[facing_wall(paint)]);
    let config = ColourCamera { supersampling: 1, ..config() };
    let rig_from_camera = pose_from_vector(&DepthCamera::kinect_v1().rig_from_camera);
    let moments: Vec<Moment> = (0..24)
        .map(|moment| {
            // 10 pixels at 3 m.
            let y_m = 10.0 * 3.0 / camera().fx_px * (f64::from(moment) / 23.0 - 0.5);
            let rig = Isometry3::translation(0.0, y_m, 0.5);
            Moment { room_from_camera: rig * rig_from_camera, moving: Vec::new() }
        })
        .collect();
    let light = Lighting::of_lamps(1.0, Vec::new());
    let rgb = ColourSensor::new(&config, camera()).take(&wall, &moments, &light, (1, 0), &Serial);
    let row = &rgb[3 * 160 * 60..3 * 160 * 61];
    let between = row.chunks(3).filter(|pixel| (3..252).contains(&pixel[0])).count();
    assert!((9..=11).contains(&between), "{between} pixels");
}

#[test]
fn the_number_of_threads_changes_nothing_and_the_same_seed_repeats() {
    let mut scenario = Scenario::small().with_depth_size(96, 72).with_duration_s(2.2);
    scenario.rig.colour_camera = Some(ColourCamera::default().with_motion_blur(0.02, 2));
    scenario.rig.path = crate::Platform::Sway.path(3.0, 1);
    let samples = |scenario: &Scenario, threads: usize| -> Vec<Sample> {
        let executor = Arc::new(ScopedThreads::new(NonZeroUsize::new(threads).unwrap()));
        scenario.samples().unwrap().with_executor(executor).collect()
    };
    let one = samples(&scenario, 1);
    assert_eq!(one, samples(&scenario, 3));
    assert_eq!(one, samples(&scenario, 64));
    let images = |samples: &[Sample]| -> Vec<ColourImage> {
        let image = |sample: &Sample| match sample {
            Sample::Colour(image) => Some(image.clone()),
            _ => None,
        };
        samples.iter().filter_map(image).collect()
    };
    let taken = images(&one);
    assert_eq!(taken.len(), 66);
    assert!(taken.windows(2).all(|pair| pair[0].rgb != pair[1].rgb));
    let other = images(&samples(&scenario.clone().with_seed(9), 2));
    // Another seed changes the noise, not the room.
    let differing =
        taken[0].rgb.iter().zip(&other[0].rgb).filter(|(a, b)| a.abs_diff(**b) > 25).count();
    assert!(taken[0].rgb != other[0].rgb && differing * 100 < taken[0].rgb.len());
}

#[test]
fn a_registered_image_shows_at_each_pixel_what_the_depth_image_measures() {
    let mut scenario = Scenario::demo().with_depth_size(160, 120).with_duration_s(3.9);
    scenario.rig.colour_camera = Some(ColourCamera { supersampling: 1, ..config() });
    // The robot's paint is unique.
    let red = Paint::plain([0.9, 0.0, 0.0]);
    if let crate::Figure::Rigid(bodies) = &mut scenario.scene.objects[0].figure {
        bodies.iter_mut().for_each(|body| body.material = body.material.painted(red));
    }
    let (mut last_labels, mut compared) = (None, 0);
    for sample in scenario.samples().unwrap() {
        match sample {
            Sample::Depth { labels, .. } => last_labels = Some(labels),
            Sample::Colour(image) => {
                let labels = last_labels.take().unwrap();
                assert_eq!((image.stamp, &image.frame_id), (labels.stamp, &labels.frame_id));
                for (label, pixel) in labels.object_ids().iter().zip(image.rgb.chunks(3)) {
                    if *label == crate::ROBOT_ID {
                        assert!(pixel[0] > 60 && pixel[1] < 10, "{pixel:?}");
                        compared += 1;
                    }
                }
            }
            _ => {}
        }
    }
    assert!(compared > 1000, "{compared}");
}

#[test]
fn a_camera_of_its_own_pose_and_clock_is_where_and_when_it_says() {
    let mut scenario = Scenario::small().with_depth_size(64, 48).with_duration_s(0.5);
    let camera = CameraModel { width_px: 32, height_px: 24, ..camera() };
    scenario.rig.colour_camera = Some(ColourCamera {
        rig_from_camera: Some([0.0, 0.025, 0.0, -1.5, 0.0, -1.5]),
        camera: Some(camera),
        delay_s: 0.01,
        ..config()
    });
    let mut stamps_s = Vec::new();
    for sample in scenario.samples().unwrap() {
        if let Sample::Colour(image) = sample {
            assert_eq!(image.frame_id, "camera_rgb_optical_frame");
            assert_eq!((image.width_px, image.height_px, image.rgb.len()), (32, 24, 32 * 24 * 3));
            stamps_s.push(image.stamp.seconds_since(scenario.start));
        }
    }
    assert!((stamps_s[0] - (1.0 / 60.0 + 0.01)).abs() < 1e-9);
    assert_eq!(stamps_s.len(), 15);
}

#[test]
fn lamps_light_what_they_face_and_white_is_not_exceeded() {
    let wall = solids(&[facing_wall(Paint::plain([0.5; 3]))]);
    let lamp = |y_m: f64| Lamp { position_m: [2.0, y_m, 0.0], brightness: 0.6 };
    let lit = |y_m: f64| Lighting::of_lamps(0.05, vec![lamp(y_m)]);
    let middle = 3 * (60 * 160 + 79);
    let [near, far] =
        [0.0, 4.0].map(|y_m| taken_from([0.0; 6], &config(), &wall, &lit(y_m))[middle]);
    assert!(near > far + 60, "{near} and {far}");
    let dazzling = Lighting::of_lamps(9.0, Vec::new());
    assert_eq!(taken_from([0.0; 6], &config(), &wall, &dazzling)[middle], 255);
}
