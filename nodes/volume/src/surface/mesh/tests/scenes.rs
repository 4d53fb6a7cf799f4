//! Of images of a room, with the noise of a Kinect.

use estimation::executor::Serial;
use nalgebra::Point3;

use super::*;
use crate::testing::{self, Scene};
use crate::{DepthInput, DepthView};

fn room(edge_m: f64, images: usize) -> Surface {
    let camera = testing::camera(320, 240);
    let mut surface = Surface::new(config(edge_m)).unwrap();
    let mut noise = testing::Noise::new(3);
    for step in 0..images {
        let along_m = 0.01 * step as f64;
        let pose = testing::pose([along_m, 0.0, along_m], [0.0, 0.003 * step as f64, 0.0]);
        let mut depths_m = Scene::room().depths_m(&camera, &pose);
        for depth_m in &mut depths_m {
            *depth_m += crate::DepthNoise::default().sigma_m(*depth_m) * noise.normal() as f32;
        }
        surface.integrate(
            &testing::view_of(&camera, &pose, 0.1 * step as f64, depths_m, None),
            &Serial,
        );
    }
    surface
}

#[test]
fn a_room_with_the_noise_of_a_kinect_is_a_manifold_and_accurate() {
    let surface = room(0.03, 8);
    let mesh = whole(&surface);
    let edges = mesh.edges();
    assert!(edges.wrong == 0 && edges.border * 10 < edges.inner, "{edges:?}");
    let (mut error_m, mut inwards, mut within) = (0.0, 0, 0);
    for (point_m, normal) in mesh.points_m.iter().zip(&mesh.normals) {
        if point_m.z > 3.0 {
            continue;
        }
        let (distance_m, true_normal) = Scene::room().nearest(&point_m.cast());
        error_m += distance_m;
        within += 1;
        inwards += usize::from(normal.cast::<f64>().dot(&true_normal) > 0.0);
    }
    error_m /= f64::from(within);
    println!("{} triangles, {edges:?}, {:.2} mm", mesh.triangles.len(), 1e3 * error_m);
    assert!(within > 5_000 && error_m < 0.005, "{within} vertices, {error_m} m");
    assert!(inwards * 1000 > within as usize * 995, "{inwards} of {within}");
    // Each point of the map that has all of its cell known lies in a cell with triangles.
    let points = surface.points(PointRules::default());
    let vertices: std::collections::HashSet<_> =
        mesh.points_m.iter().map(|point| surface.grid().key(point)).collect();
    let bare = points
        .iter()
        .filter(|point| !point.voxel.with_neighbours().any(|beside| vertices.contains(&beside)));
    assert!(bare.count() * 50 < points.len());
}

#[test]
fn vertices_have_the_colours_of_the_pixels() {
    let camera = testing::camera(160, 120);
    let map_from_camera = nalgebra::Isometry3::identity();
    let depths_m = Scene::wall(1.5).depths_m(&camera, &map_from_camera);
    let [red, blue] = [[200, 30, 30], [20, 20, 220]];
    let colours: Vec<[u8; 3]> =
        (0..160 * 120).map(|pixel| if pixel % 160 < 80 { red } else { blue }).collect();
    let mut view = DepthView::new(Default::default(), Default::default()).unwrap();
    let mut surface = Surface::new(SurfaceConfig { has_colour: true, ..config(0.04) }).unwrap();
    let frame = testing::frame(&camera, 0.0, depths_m).with_colours(colours).unwrap();
    view.fill(&DepthInput::new(&frame, &map_from_camera)).unwrap();
    surface.integrate(&view, &Serial);
    let mesh = whole(&surface);
    assert_eq!(mesh.colours.len(), mesh.points_m.len());
    for (point_m, colour) in mesh.points_m.iter().zip(&mesh.colours) {
        if point_m.x.abs() > 0.05 {
            assert_eq!(*colour, if point_m.x < 0.0 { red } else { blue }, "{point_m}");
        }
    }
    let plain = room(0.05, 1);
    assert!(whole(&plain).colours.is_empty());
}

/// A map that was saved as points with normals and is put together again has about the same mesh.
#[test]
fn points_with_normals_give_the_mesh_again() {
    let surface = room(0.03, 4);
    let points = surface.points(PointRules::default());
    let mut again = surface.emptied();
    let put = points.iter().map(|point| (point.position_m, point.normal));
    assert_eq!(again.put_points(put, 0.03, crate::BlockBox::ALL), 0);
    let (mesh, again) = (whole(&surface), whole(&again));
    assert_eq!(again.edges().wrong, 0);
    let share = again.triangles.len() as f64 / mesh.triangles.len() as f64;
    assert!((0.9..1.1).contains(&share), "{share}");
    let error_m = |point: &Point3<f32>| Scene::room().nearest(&point.cast()).0;
    let within: Vec<f64> =
        again.points_m.iter().filter(|point| point.z < 3.0).map(error_m).collect();
    assert!(within.iter().sum::<f64>() / (within.len() as f64) < 0.006);
}
