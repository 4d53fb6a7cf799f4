use estimation::Serial;

use super::*;
use crate::noise::Stream;
use crate::solid::nearest_sighting;
use crate::{Body, Material, Ray, Scenario, Scene};
use geometry::pose_from_vector;
use nalgebra::Vector3;

/// A Kinect in the origin of the room without random failures.
fn camera() -> DepthCamera {
    DepthCamera { dropout_ratio: 0.0, ..DepthCamera::kinect_v1() }
}

fn wall(x_m: f64, material: Material) -> Body {
    Body::cuboid("wall", [x_m, -9.0, -9.0], [x_m + 0.1, 9.0, 9.0], material)
}

fn canvas(config: &DepthCamera, bodies: &[Body]) -> Canvas {
    let room_from_camera = pose_from_vector(&config.rig_from_camera);
    let scene = Scene { bodies: bodies.to_vec(), ..Scene::default() };
    let mut canvas = Canvas::new(&config.camera);
    let solids = scene.static_solids();
    let min_signal = config.min_signal;
    canvas.draw(&config.camera, &room_from_camera, solids.iter(), min_signal, &Serial);
    canvas
}

fn read(config: &DepthCamera, bodies: &[Body], frame: u64) -> Vec<u16> {
    let noise = FrameNoise::new(5, Stream::DepthPixel, frame);
    Sensor::new(config).read(&canvas(config, bodies), &noise).depth_mm
}

#[test]
fn a_wall_at_3_m_reads_3_m_within_the_published_noise() {
    let config = camera();
    let depth_mm = read(&config, &[wall(3.0, Material::PLASTER)], 0);
    let live: Vec<f64> = depth_mm
        .chunks(640)
        .flat_map(|row| &row[..632])
        .map(|&depth_mm| f64::from(depth_mm) * 1e-3)
        .collect();
    assert!(live.iter().all(|&depth_m| depth_m > 0.0));
    let mean_m = live.iter().sum::<f64>() / live.len() as f64;
    let std_dev_m =
        (live.iter().map(|d| (d - mean_m).powi(2)).sum::<f64>() / live.len() as f64).sqrt();
    assert!((mean_m - 3.0).abs() < 0.003, "mean {mean_m}");
    // sigma_z = 1.43e-3 z^2 (Khoshelham and Elberink 2012).
    assert!((std_dev_m / (1.43e-3 * 9.0) - 1.0).abs() < 0.08, "deviation {std_dev_m}");
    // Neighbouring depths are 2.85e-3 z^2 apart, rounded to millimetres.
    let mut values = live.iter().map(|d| (d * 1e3).round() as i32).collect::<Vec<_>>();
    values.sort_unstable();
    values.dedup();
    assert!(values.len() < 8, "{values:?}");
    for pair in values.windows(2) {
        let step_mm = pair[1] - pair[0];
        assert!((24..=28).contains(&step_mm), "a step of {step_mm} mm in {values:?}");
    }
    // The columns that the correlation window does not reach.
    assert!(depth_mm.chunks(640).all(|row| row[632..].iter().all(|&depth| depth == 0)));
}

#[test]
fn nothing_is_measured_out_of_range_or_of_black_or_mirroring_things() {
    let config = camera();
    let none = |bodies: &[Body]| read(&config, bodies, 0).iter().all(|&depth_mm| depth_mm == 0);
    assert!(none(&[]));
    assert!(none(&[wall(0.4, Material::PLASTER)]));
    assert!(none(&[wall(6.5, Material::PLASTER)]));
    assert!(none(&[wall(3.0, Material::BLACK_GLASS)]));
    // The lowest row looks 23 degrees down, so every ray meets a floor at 63 degrees or more (in the corners):
    // a matt floor is measured, if it is near enough, a polished one is not.
    let floor = |material| Body::cuboid("floor", [-9.0, -9.0, -1.3], [9.0, 9.0, -1.2], material);
    let polished = Material { max_incidence_rad: 1.05, ..Material::PLASTER };
    assert!(none(&[floor(polished)]));
    assert!(!none(&[floor(Material::PLASTER)]));
}

#[test]
fn the_projector_leaves_a_shadow_left_of_a_thing_and_none_right_of_it() {
    let config = camera();
    let thing = Body::cuboid("thing", [1.5, -0.15, -0.15], [1.52, 0.15, 0.15], Material::PLASTER);
    let depth_mm = read(&config, &[wall(3.0, Material::PLASTER), thing], 0);
    let row = &depth_mm[235 * 640..236 * 640];
    let near = |depth_mm: u16| (1000..2000).contains(&depth_mm);
    let first = row.iter().position(|&depth| near(depth)).unwrap();
    let last = row.iter().rposition(|&depth| near(depth)).unwrap();
    // f b (1 / 1.5 - 1 / 3.0) = 14.4 columns
    let shadow = row[..first].iter().rev().take_while(|&&depth| depth == 0).count();
    assert!((13..=15).contains(&shadow), "a shadow of {shadow} columns");
    assert!(row[last + 1] > 2800, "{:?}", &row[last..last + 3]);
    assert!(row[..first - shadow].iter().all(|&depth| depth > 2800));
    // Above the thing nothing is in shadow.
    assert!(depth_mm[100 * 640..100 * 640 + 632].iter().all(|&depth| depth > 2800));
}

/// Drawing within bounds must not lose anything: every pixel of the demo room, with the person in it,
/// equals the nearest hit of its own ray among all solids.
#[test]
fn the_canvas_equals_casting_every_ray_by_itself() {
    let mut scenario = Scenario::demo().with_depth_size(80, 60);
    // A pane before what crosses, and one behind it.
    let pane =
        |x_m: f64| Body::cuboid("pane", [x_m, -1.0, 0.5], [x_m + 0.01, 0.5, 1.8], Material::GLASS);
    scenario.scene.bodies.extend([pane(1.5), pane(4.0)]);
    let config = &scenario.rig.depth_camera;
    for time_s in [4.9, 11.3, 12.1] {
        let room_from_camera =
            scenario.rig.path.pose_at(time_s) * pose_from_vector(&config.rig_from_camera);
        let mut solids = scenario.scene.static_solids();
        solids.extend(scenario.scene.moving_solids(time_s));
        let mut canvas = Canvas::new(&config.camera);
        let min_signal = config.min_signal;
        canvas.draw(&config.camera, &room_from_camera, solids.iter(), min_signal, &Serial);
        let mut labelled = 0;
        for index in 0..80 * 60 {
            let (column, row) = ((index % 80) as f64, (index / 80) as f64);
            let direction = Vector3::new(
                (column - config.camera.cx_px) / config.camera.fx_px,
                (row - config.camera.cy_px) / config.camera.fy_px,
                1.0,
            );
            let ray = Ray { origin: Point3::origin(), direction: direction.normalize() }
                .transformed(&room_from_camera);
            let sighting = nearest_sighting(solids.iter(), &ray, config.min_signal).unwrap();
            let depth_m = sighting.distance_m / direction.norm();
            assert!((depth_m - f64::from(canvas.depth_m[index])).abs() < 1e-5);
            assert_eq!(sighting.id, canvas.id[index]);
            assert!((sighting.strength - f64::from(canvas.strength[index])).abs() < 1e-3);
            labelled += usize::from(sighting.id > 0);
        }
        assert!(labelled > 100, "{labelled} pixels of an object at {time_s} s");
    }
}

#[test]
fn a_turned_camera_inside_a_solid_room_sees_its_walls() {
    // A room as one hollow box around the camera: it lies partly behind the camera.
    let config = camera();
    let hull = Body::cuboid("hull", [-2.0, -2.0, -2.0], [2.5, 2.0, 2.0], Material::PLASTER);
    let canvas = canvas(&config, &[hull]);
    assert!((canvas.depth_m[235 * 640 + 314] - 2.5).abs() < 1e-5);
    assert!(canvas.depth_m.iter().all(|depth_m| depth_m.is_finite()));
}
