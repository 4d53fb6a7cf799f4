use std::num::NonZeroUsize;

use estimation::ScopedThreads;

use super::*;
use crate::{Body, Figure, Material, MovingObject, Waypoint};

/// A scanner without errors.
fn exact(model: VelodyneModel) -> Velodyne {
    Velodyne {
        model,
        range_noise_m: 0.0,
        range_step_m: 1e-6,
        intensity_noise: 0.0,
        dropout_ratio: 0.0,
        ..Velodyne::default()
    }
}

fn turn(velodyne: &Velodyne, scene: &Scene, path: &Path, threads: usize) -> VelodyneTurn {
    let still = StillSolids::new(&scene.static_solids());
    let view = VelodyneView {
        seed: 3,
        start: Stamp::from_secs_nanos(100, 0),
        path,
        scene,
        still: &still,
        executor: &ScopedThreads::new(NonZeroUsize::new(threads).unwrap()),
    };
    velodyne.turn(&view, 1)
}

/// A room of 20 x 20 m, the scanner 2 m over its floor.
fn room(material: Material) -> Scene {
    let wall = |min_m, max_m| Body::cuboid("wall", min_m, max_m, material);
    let bodies = vec![
        wall([10.0, -11.0, -3.0], [10.1, 11.0, 9.0]),
        wall([-10.1, -11.0, -3.0], [-10.0, 11.0, 9.0]),
        wall([-11.0, 10.0, -3.0], [11.0, 10.1, 9.0]),
        wall([-11.0, -10.1, -3.0], [11.0, -10.0, 9.0]),
        wall([-11.0, -11.0, -2.1], [11.0, 11.0, -2.0]),
    ];
    Scene { bodies, ..Scene::default() }
}

#[test]
fn the_cloud_is_organised_and_its_points_lie_on_the_walls() {
    let scene = room(Material::PLASTER);
    for (model, rings, columns) in [
        (VelodyneModel::Hdl32e, 32, 2170),
        (VelodyneModel::Vlp16, 16, 1808),
        (VelodyneModel::Hdl64e, 64, 2083),
    ] {
        let turn = turn(&exact(model), &scene, &Path::still([0.0; 6]), 1);
        assert_eq!((turn.rings, turn.columns), (rings, columns));
        assert_eq!((turn.points.len(), turn.labels.len()), (rings * columns, rings * columns));
        assert_eq!(turn.stamp, Stamp::from_secs_nanos(100, 100_000_000));
        let mut measured = 0;
        for (index, point) in turn.points.iter().enumerate() {
            let (row, column) = (index / columns, index % columns);
            assert_eq!(usize::from(point.ring), row);
            let expected_s = column as f64 * model.firing_period_s();
            let after_s = f64::from(point.time_s) - expected_s;
            assert!((-1e-8..model.firing_period_s()).contains(&after_s));
            if !point.is_measured() {
                continue;
            }
            measured += 1;
            let [x, y, z] = point.position_m.map(f64::from);
            let off = (10.0 - x.abs()).abs().min((10.0 - y.abs()).abs()).min((z + 2.0).abs());
            assert!(off < 1e-4, "{point:?}");
            // Clockwise from behind.
            let azimuth_rad =
                std::f64::consts::PI - std::f64::consts::TAU * f64::from(point.time_s) * 10.0;
            let (sin, cos) = azimuth_rad.sin_cos();
            assert!((x * cos + y * sin) / x.hypot(y) > 1.0 - 1e-6);
        }
        assert!(measured * 10 > turn.points.len() * 8, "{model:?}: {measured}");
        let elevations: Vec<f32> = turn
            .points
            .chunks(columns)
            .filter_map(|row| row.iter().find(|point| point.is_measured()))
            .map(|point| point.position_m[2] / point.position_m[0].hypot(point.position_m[1]))
            .collect();
        assert!(elevations.windows(2).all(|pair| pair[0] < pair[1]));
    }
}

#[test]
fn ranges_and_intensities_have_the_stated_noise() {
    let velodyne = Velodyne { dropout_ratio: 0.01, ..Velodyne::default() };
    let scene = room(Material::matt(0.6));
    let (exact, noisy) = (
        turn(&exact(VelodyneModel::Hdl32e), &scene, &Path::still([0.0; 6]), 1),
        turn(&velodyne, &scene, &Path::still([0.0; 6]), 1),
    );
    let range = |point: &VelodynePoint| {
        point.position_m.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt()
    };
    let (mut squares, mut compared, mut lost) = (0.0, 0.0, 0.0);
    for (truth, point) in exact.points.iter().zip(&noisy.points) {
        if truth.is_measured() {
            if point.is_measured() {
                squares += (range(point) - range(truth)).powi(2);
                compared += 1.0;
                let steps = range(point) / 0.002;
                assert!((steps - steps.round()).abs() < 0.01);
                assert!((point.intensity - truth.intensity).abs() <= 1.0 + 0.2 * truth.intensity);
            } else {
                lost += 1.0;
            }
        }
    }
    assert!(((squares / compared).sqrt() / 0.02 - 1.0_f64).abs() < 0.05);
    assert!((lost / (compared + lost) - 0.01_f64).abs() < 0.004);
    // Straight ahead a surface of 60 % reflectivity has the intensity 60.
    let ahead = exact.points.iter().find(|p| p.ring == 23 && p.position_m[1].abs() < 0.05).unwrap();
    assert!((ahead.intensity - 60.0).abs() <= 1.0, "{ahead:?}");
}

#[test]
fn a_platform_that_moves_distorts_the_cloud_and_labels_follow_what_moves() {
    let mut scene = room(Material::PLASTER);
    let cart = Path::still([5.0, 0.0, -2.0, 0.0, 0.0, 0.0]);
    scene.objects.push(MovingObject {
        id: 7,
        name: "box".to_owned(),
        figure: Figure::Rigid(vec![Body::cuboid(
            "box",
            [-0.5, -0.5, 0.0],
            [0.5, 0.5, 3.0],
            Material::PLASTER,
        )]),
        path: cart,
        label_span_s: None,
    });
    let waypoint =
        |time_s: f64| Waypoint { time_s, pose: [10.0 * (time_s - 0.1), 0.0, 0.0, 0.0, 0.0, 0.0] };
    let driving = Path { waypoints: vec![waypoint(0.0), waypoint(1.0)] };
    let turn = turn(&exact(VelodyneModel::Hdl32e), &scene, &driving, 2);
    let mut labelled = 0;
    for (point, label) in turn.points.iter().zip(&turn.labels) {
        if !point.is_measured() {
            assert_eq!(*label, 0);
            continue;
        }
        // The position of the scanner at the shot, at 10 m/s ahead.
        let x_m = f64::from(point.position_m[0]) + 10.0 * f64::from(point.time_s);
        let y_m = f64::from(point.position_m[1]);
        if *label == 7 {
            labelled += 1;
            assert!((4.49..5.51).contains(&x_m) && y_m.abs() < 0.51, "{point:?}");
        } else {
            let z_m = f64::from(point.position_m[2]);
            let off = (10.0 - x_m.abs()).abs().min((10.0 - y_m.abs()).abs()).min((z_m + 2.0).abs());
            assert!(off < 1e-2, "{point:?}");
        }
    }
    assert!(labelled > 300, "{labelled}");
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (scene, path) = (room(Material::PLASTER), Path::still([0.0; 6]));
    let of = |threads| turn(&Velodyne::default(), &scene, &path, threads);
    let bits = |turn: &VelodyneTurn| -> Vec<u32> {
        turn.points.iter().flat_map(|p| p.position_m.map(f32::to_bits)).collect()
    };
    assert_eq!(bits(&of(1)), bits(&of(3)));
    assert_eq!(of(1).labels, of(5).labels);
}

#[test]
fn dark_things_are_lost_in_the_distance() {
    let scene = |reflectivity| room(Material::polished(reflectivity, 1.55));
    let share = |reflectivity: f64| {
        let velodyne = Velodyne { min_signal: 0.1 / (8.0 * 8.0), ..exact(VelodyneModel::Vlp16) };
        let turn = turn(&velodyne, &scene(reflectivity), &Path::still([0.0; 6]), 1);
        turn.points.iter().filter(|p| p.is_measured()).count() as f64 / turn.points.len() as f64
    };
    assert!(share(0.5) > 0.8 && share(0.05) < 0.4, "{} and {}", share(0.5), share(0.05));
}
