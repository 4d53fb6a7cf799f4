//! What the tests of registrations share, here and in the crates that stand on them: chance that a seed decides, and scenes.

use std::num::NonZeroUsize;

pub use estimation::Random;
use estimation::ScopedThreads;
use nalgebra::{Isometry3, Point3, Vector3};

/// An executor with this many threads.
#[must_use]
pub fn threads(count: usize) -> ScopedThreads {
    ScopedThreads::new(NonZeroUsize::new(count).unwrap_or(NonZeroUsize::MIN))
}

/// A rectangle of a scene: a corner and two sides.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    /// A corner.
    pub corner_m: Vector3<f64>,
    /// From the corner along both sides.
    pub sides_m: [Vector3<f64>; 2],
}

impl Rectangle {
    /// From a corner and two sides, in metres.
    #[must_use]
    pub fn new(corner_m: [f64; 3], first_m: [f64; 3], second_m: [f64; 3]) -> Self {
        Self { corner_m: corner_m.into(), sides_m: [first_m.into(), second_m.into()] }
    }
}

/// A street along x: ground, house fronts with recesses, boxes as large as cars.
#[must_use]
pub fn street(random: &mut Random) -> Vec<Rectangle> {
    let mut scene = vec![Rectangle::new([-40.0, -9.0, -1.7], [80.0, 0.0, 0.0], [0.0, 18.0, 0.0])];
    for side in [-1.0, 1.0] {
        let mut from = -40.0;
        while from < 40.0 {
            let (length, depth) = (random.between(4.0, 10.0), random.between(7.0, 9.0));
            let front = [from, side * depth, -1.7];
            scene.push(Rectangle::new(front, [length, 0.0, 0.0], [0.0, 0.0, 6.0]));
            scene.push(Rectangle::new(front, [0.0, side * 2.0, 0.0], [0.0, 0.0, 6.0]));
            from += length;
        }
        for _ in 0..6 {
            let at = [random.between(-35.0, 35.0), side * random.between(4.0, 5.0), -1.7];
            let (long, wide, tall) = ([4.2, 0.0, 0.0], [0.0, 1.8, 0.0], [0.0, 0.0, 1.5]);
            scene.push(Rectangle::new(at, long, tall));
            scene.push(Rectangle::new([at[0], at[1] + 1.8, at[2]], long, tall));
            scene.push(Rectangle::new(at, wide, tall));
            scene.push(Rectangle::new([at[0] + 4.2, at[1], at[2]], wide, tall));
        }
    }
    scene
}

/// Points on a scene, each square metre alike, seen from `scene_from_sensor`, with noise in all directions.
#[must_use]
pub fn seen(
    scene: &[Rectangle],
    scene_from_sensor: &Isometry3<f64>,
    points: usize,
    noise_m: f64,
    random: &mut Random,
) -> Vec<Point3<f32>> {
    let areas: Vec<f64> =
        scene.iter().map(|face| face.sides_m[0].cross(&face.sides_m[1]).norm()).collect();
    let whole: f64 = areas.iter().sum();
    let sensor_from_scene = scene_from_sensor.inverse();
    (0..points)
        .filter_map(|_| {
            let mut at = random.between(0.0, whole);
            let face = scene.iter().zip(&areas).find(|(_, area)| {
                at -= **area;
                at <= 0.0
            })?;
            let [a, b] = face.0.sides_m;
            let place =
                face.0.corner_m + random.between(0.0, 1.0) * a + random.between(0.0, 1.0) * b;
            let noise = Vector3::new(random.normal(), random.normal(), random.normal());
            Some((sensor_from_scene * Point3::from(place + noise_m * noise)).cast())
        })
        .collect()
}

/// How far two poses are apart: metres and radians.
#[must_use]
pub fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let between = a.inv_mul(b);
    (between.translation.vector.norm(), between.rotation.angle())
}
