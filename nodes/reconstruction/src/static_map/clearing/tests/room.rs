//! A room with thin things in it, seen by a depth camera with the noise of one.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::*;

pub(super) const EDGE_M: f64 = 0.08;

/// Pixels of the picture: a view of 57 x 43 degrees, 0.6 degrees a pixel.
const COLUMNS: usize = 96;
const ROWS: usize = 72;
const VIEW_RAD: [f64; 2] = [0.995, 0.75];

/// Standard deviation of a depth, by its square: Khoshelham & Elberink, "Accuracy and resolution of Kinect depth
/// data", Sensors 12, 2012, eq. 10.
const DEPTH_NOISE_PER_M: f64 = 1.425e-3;

/// The same numbers for the same seed.
pub(super) struct Numbers(u64);

impl Numbers {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// From 0 to 1.
    pub(super) fn uniform(&mut self) -> f64 {
        // A linear congruential generator with Knuth's constants.
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// With mean 0 and deviation 1, or nearly: the sum of twelve uniform numbers.
    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// A thing in the map frame.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// From its lowest to its highest corner. Seen from inside it is a room.
    Cuboid([f64; 3], [f64; 3]),
    /// Upright: x, y of the axis, lowest and highest z, radius.
    Post([f64; 5]),
}

impl Shape {
    /// How far the ray goes until it meets the thing.
    fn distance_m(&self, from: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        match self {
            Self::Cuboid(lowest, highest) => {
                let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
                for axis in 0..3 {
                    let to = |border: f64| (border - from[axis]) / direction[axis];
                    let (a, b) = (to(lowest[axis]), to(highest[axis]));
                    enter = enter.max(a.min(b));
                    leave = leave.min(a.max(b));
                }
                let distance_m = if enter > 0.0 { enter } else { leave };
                (leave >= enter && distance_m > 0.0).then_some(distance_m)
            }
            Self::Post([x, y, lowest, highest, radius]) => {
                let (dx, dy) = (from.x - x, from.y - y);
                let a = direction.x.powi(2) + direction.y.powi(2);
                let b = dx * direction.x + dy * direction.y;
                let root = b * b - a * (dx * dx + dy * dy - radius * radius);
                let distance_m = (-b - root.max(0.0).sqrt()) / a;
                let z = from.z + distance_m * direction.z;
                (root > 0.0 && distance_m > 0.0 && (*lowest..=*highest).contains(&z))
                    .then_some(distance_m)
            }
        }
    }
}

/// The room: walls, a table with its plate and legs, a chair's legs and seat, a lamp, a box on the floor.
pub(super) fn room() -> Vec<Shape> {
    let mut shapes = vec![
        Shape::Cuboid([-1.0, -2.5, -0.9], [4.6, 2.5, 1.7]),
        Shape::Cuboid([2.0, 0.5, -0.2], [3.0, 1.5, -0.16]),
        Shape::Cuboid([2.6, -0.8, -0.45], [3.0, -0.4, -0.42]),
        Shape::Cuboid([3.4, -1.9, -0.9], [3.9, -1.4, -0.3]),
        Shape::Post([3.8, 0.1, -0.9, 0.9, 0.02]),
    ];
    for (x, y) in [(2.05, 0.55), (2.05, 1.45), (2.95, 0.55), (2.95, 1.45)] {
        shapes.push(Shape::Post([x, y, -0.9, -0.2, 0.03]));
    }
    for (x, y) in [(2.63, -0.77), (2.63, -0.43), (2.97, -0.77), (2.97, -0.43)] {
        shapes.push(Shape::Post([x, y, -0.9, -0.45, 0.018]));
    }
    shapes
}

/// Whether the point is on one of the room's posts, within the noise.
pub(super) fn is_thin(point: &Point3<f32>) -> bool {
    let near = |shape: Shape| match shape {
        Shape::Post([x, y, lowest, highest, radius]) => {
            let (dx, dy, z) = (f64::from(point.x) - x, f64::from(point.y) - y, f64::from(point.z));
            // Not what stands beside the post on the floor.
            dx.hypot(dy) < radius + 0.02 && (lowest + 0.06..highest).contains(&z)
        }
        Shape::Cuboid(..) => false,
    };
    room().into_iter().any(near)
}

/// Where the rig stands in a cycle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Platform {
    Still,
    /// To and fro by 0.5 m along x and y, turning by 0.3 rad, at up to 0.4 m/s and 0.3 rad/s for 7 cycles a second;
    /// its pose is known within 4 mm and 2 mrad.
    Moving,
}

impl Platform {
    fn poses(self, cycle: u32, numbers: &mut Numbers) -> (Isometry3<f64>, Isometry3<f64>) {
        let pose = |x: f64, y: f64, yaw: f64| {
            let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw);
            Isometry3::from_parts(Translation3::new(x, y, 0.0), turn)
        };
        match self {
            Self::Still => (pose(0.0, 0.0, 0.0), pose(0.0, 0.0, 0.0)),
            Self::Moving => {
                let time_s = f64::from(cycle) / 7.0;
                let [x, y, yaw] = [0.8, 0.5, 1.0].map(|rate| (rate * time_s).sin());
                let (x, y, yaw) = (0.5 * x, 0.5 * y, 0.3 * yaw);
                let mut noise = |deviation: f64| deviation * numbers.normal();
                let known = pose(x + noise(0.004), y + noise(0.004), yaw + noise(0.002));
                (pose(x, y, yaw), known)
            }
        }
    }
}

/// What the camera measures of still and of moving things, in the rig frame, from this pose of the rig.
fn measure(
    still: &[Shape],
    moving: &[Shape],
    pose: &Isometry3<f64>,
    mut noise: impl FnMut(f64) -> f64,
) -> [Vec<Point3<f32>>; 2] {
    let from = Point3::from(pose.translation.vector);
    let mut points = [Vec::new(), Vec::new()];
    let slope = |pixel: usize, pixels: usize, view_rad: f64| {
        (0.5 - (pixel as f64 + 0.5) / pixels as f64) * 2.0 * (view_rad / 2.0).tan()
    };
    for (row, column) in (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column))) {
        let [y, z] = [slope(column, COLUMNS, VIEW_RAD[0]), slope(row, ROWS, VIEW_RAD[1])];
        let in_rig = Vector3::new(1.0, y, z);
        let direction = pose.rotation * in_rig;
        // The x axis has length 1, so that this is the depth.
        let depth_to = |shapes: &[Shape]| {
            let depths = shapes.iter().filter_map(|shape| shape.distance_m(&from, &direction));
            depths.fold(f64::INFINITY, f64::min)
        };
        let (still_m, moving_m) = (depth_to(still), depth_to(moving));
        let depth_m = still_m.min(moving_m);
        if depth_m.is_finite() {
            let noisy_m = depth_m + noise(depth_m);
            let is_moving = usize::from(moving_m < still_m);
            points[is_moving].push(Point3::from((in_rig * noisy_m).cast::<f32>()));
        }
    }
    points
}

/// What a camera without noise would see of the still things, in the map frame, not reduced.
pub(super) fn see_truly(still: &[Shape], platform: Platform, cycle: u32) -> Vec<Point3<f32>> {
    let (pose, _) = platform.poses(cycle, &mut Numbers::new(0));
    let [points_m, _] = measure(still, &[], &pose, |_| 0.0);
    let cloud = Cloud { points_m, ..Cloud::default() };
    cloud.transformed(&pose, "map").points_m
}

/// What the camera sees of these things in a cycle, reduced to one point a cell of the rig frame as detection does
/// it. `moving` things are seen too, and go into the dynamic cloud.
pub(super) fn see(
    still: &[Shape],
    moving: &[Shape],
    platform: Platform,
    cycle: u32,
    numbers: &mut Numbers,
) -> SegmentedCycle {
    let (pose, known_pose) = platform.poses(cycle, numbers);
    let noise = |depth_m: f64| DEPTH_NOISE_PER_M * depth_m.powi(2) * numbers.normal();
    let points = measure(still, moving, &pose, noise);
    let grid = VoxelGrid::new(EDGE_M).unwrap();
    let [in_rig, dynamic] = points.map(|points| Cloud {
        stamp: Stamp::from_nanos(i64::from(cycle)),
        frame_id: "rig".to_owned(),
        points_m: grid.reduce(&points),
    });
    SegmentedCycle {
        depth: None,
        index: cycle,
        static_cloud: in_rig.transformed(&known_pose, "map"),
        dynamic_cloud: dynamic,
        map_from_rig: known_pose,
        setup: geometry::CycleSetup::default(),
    }
}
