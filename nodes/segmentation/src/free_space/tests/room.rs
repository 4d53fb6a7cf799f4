//! A room of boxes, seen by a depth camera that is cast ray by ray, with the truth of every point.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use estimation::Random;
use geometry::{
    BuildVoxelHasher, CameraModel, Cloud, DepthFrame, DepthImage, DepthPixels, DetectedCycle,
    Distortion, DynamicZone, ReturnSpan, Stamp, VoxelAccumulator, VoxelGrid, VoxelKey, ZoneSource,
};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

pub(super) const CELL_M: f64 = 0.08;
/// The RPLIDAR A1's turns.
pub(super) const CYCLE_S: f64 = 1.0 / 7.0;
pub(super) const SIZE_PX: (i32, i32) = (160, 120);
/// Half of 57 x 43 degrees.
const HALF_VIEW: (f64, f64) = (0.543, 0.394);
/// The camera's height in the room; the map's origin is the camera at the start.
pub(super) const CAMERA_M: f64 = 1.2;

/// A box along the axes of the room, whose floor is at z = 0; x forward, y left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    pub(super) id: u16,
    pub(super) min_m: [f64; 3],
    pub(super) max_m: [f64; 3],
}

pub(super) fn solid(id: u16, min_m: [f64; 3], max_m: [f64; 3]) -> Solid {
    Solid { id, min_m, max_m }
}

impl Solid {
    /// How far along the ray it is entered.
    fn hit(&self, from: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let a = (self.min_m[axis] - from[axis]) / direction[axis];
            let b = (self.max_m[axis] - from[axis]) / direction[axis];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter > 0.0 && enter <= leave).then_some(enter)
    }
}

/// Floor, walls, a cabinet, a lamp's pole and a table before the far wall.
pub(super) fn furnished() -> Vec<Solid> {
    vec![
        solid(0, [-1.0, -4.0, -0.1], [5.1, 4.0, 0.0]),
        solid(0, [4.5, -4.0, 0.0], [4.6, 4.0, 2.6]),
        solid(0, [-1.0, 3.0, 0.0], [5.0, 3.1, 2.6]),
        solid(0, [-1.0, -3.1, 0.0], [5.0, -3.0, 2.6]),
        solid(0, [4.0, 0.8, 0.0], [4.5, 1.6, 1.8]),
        solid(0, [3.5, -1.3, 0.7], [4.3, -0.2, 0.74]),
        solid(0, [3.52, -1.28, 0.0], [3.57, -1.23, 0.7]),
        solid(0, [3.52, -0.27, 0.0], [3.57, -0.22, 0.7]),
        solid(0, [3.9, 0.3, 0.0], [3.94, 0.34, 1.7]),
    ]
}

/// A low table close before the camera's path, in the way of what passes behind it.
pub(super) fn table_in_front() -> Vec<Solid> {
    vec![
        solid(0, [1.5, -0.5, 0.7], [2.0, 0.5, 0.74]),
        solid(0, [1.52, -0.48, 0.0], [1.57, -0.43, 0.7]),
        solid(0, [1.52, 0.43, 0.0], [1.57, 0.48, 0.7]),
        solid(0, [1.7, 0.0, 0.74], [1.85, 0.2, 0.95]),
    ]
}

/// A robot: a chassis, a mast, and the screen of 0.64 x 0.27 m of Rec-HV 3.4.1, going along y.
pub(super) fn robot(id: u16, x_m: f64, y_m: f64) -> Vec<Solid> {
    let part = |min: [f64; 3], max: [f64; 3]| {
        solid(id, [x_m + min[0], y_m + min[1], min[2]], [x_m + max[0], y_m + max[1], max[2]])
    };
    vec![
        part([-0.18, -0.22, 0.02], [0.18, 0.22, 0.4]),
        part([-0.03, -0.03, 0.4], [0.03, 0.03, 1.27]),
        part([-0.05, -0.32, 1.0], [-0.03, 0.32, 1.27]),
    ]
}

/// A person: two legs that swing, a trunk and a head, going along y.
pub(super) fn person(id: u16, x_m: f64, y_m: f64, walked_m: f64) -> Vec<Solid> {
    let swing_m = 0.2 * (walked_m / 1.4 * std::f64::consts::TAU).sin();
    let part = |x: [f64; 2], y: [f64; 2], z: [f64; 2]| {
        solid(id, [x_m + x[0], y_m + y[0], z[0]], [x_m + x[1], y_m + y[1], z[1]])
    };
    vec![
        part([-0.15, -0.01], [swing_m - 0.07, swing_m + 0.07], [0.0, 0.85]),
        part([0.01, 0.15], [-swing_m - 0.07, -swing_m + 0.07], [0.0, 0.85]),
        part([-0.22, 0.22], [-0.12, 0.12], [0.8, 1.45]),
        part([-0.09, 0.09], [-0.1, 0.1], [1.5, 1.75]),
    ]
}

/// What a cycle shows, and what is true of it.
pub(super) struct View {
    pub(super) cycle: DetectedCycle,
    /// For each point of the reduced cloud, the object that most pixels of its voxel show.
    pub(super) ids: Vec<u16>,
    /// For each point, whether it lies within a voxel of the border of object and scene.
    pub(super) is_border: Vec<bool>,
    /// The mean of each object's pixels, in the map, and their number.
    pub(super) centres_m: BTreeMap<u16, (Point3<f64>, usize)>,
    /// For each pixel, row by row, the object that it shows; 0 where that is the room, or nothing was measured.
    pub(super) ids_of_pixels: Vec<u16>,
}

/// The cycle `index` of a rig at `room_from_rig`, which is reported as `map_from_rig`.
pub(super) fn look(
    solids: &[Solid],
    index: u32,
    room_from_rig: &Isometry3<f64>,
    map_from_rig: Isometry3<f64>,
    random: &mut Random,
) -> View {
    let grid = VoxelGrid::new(CELL_M).unwrap();
    let camera = Point3::from(room_from_rig.translation.vector);
    let mut points_m = Vec::new();
    let pixels = (SIZE_PX.0 * SIZE_PX.1) as usize;
    let (mut depths_m, mut ids_of_pixels) = (vec![0.0_f32; pixels], vec![0; pixels]);
    let mut ids_of: HashMap<VoxelKey, BTreeMap<u16, usize>, BuildVoxelHasher> = HashMap::default();
    let mut sums: BTreeMap<u16, (Vector3<f64>, usize)> = BTreeMap::new();
    let mut at_scan: BTreeMap<u16, Vec<Point3<f64>>> = BTreeMap::new();
    for row in 0..SIZE_PX.1 {
        for column in 0..SIZE_PX.0 {
            let share =
                |pixel: i32, size: i32| 1.0 - (2.0 * f64::from(pixel) + 1.0) / f64::from(size);
            let ray_in_rig = Vector3::new(
                1.0,
                share(column, SIZE_PX.0) * HALF_VIEW.0,
                share(row, SIZE_PX.1) * HALF_VIEW.1,
            );
            let direction = room_from_rig * ray_in_rig;
            let nearest = solids
                .iter()
                .filter_map(|solid| {
                    solid.hit(&camera, &direction).map(|depth_m| (depth_m, solid.id))
                })
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((depth_m, id)) = nearest.filter(|(depth_m, _)| (0.5..6.0).contains(depth_m))
            else {
                continue;
            };
            // Khoshelham and Elberink 2012: the Kinect's noise and steps.
            let step_m = 2.85e-3 * depth_m * depth_m;
            let noisy_m = depth_m + 0.5 * step_m * random.normal();
            let measured_m = (noisy_m / step_m).round() * step_m;
            let point = Point3::from(ray_in_rig * measured_m).cast::<f32>();
            points_m.push(point);
            let pixel = (row * SIZE_PX.0 + column) as usize;
            (depths_m[pixel], ids_of_pixels[pixel]) = (measured_m as f32, id);
            *ids_of.entry(grid.key(&point)).or_default().entry(id).or_default() += 1;
            let (sum_m, count) = sums.entry(id).or_insert((Vector3::zeros(), 0));
            *sum_m += ray_in_rig * depth_m;
            *count += 1;
            if id != 0 && (ray_in_rig.z * depth_m + 0.05).abs() < 0.03 {
                at_scan.entry(id).or_default().push(Point3::from(ray_in_rig * depth_m));
            }
        }
    }
    let mut voxels = VoxelAccumulator::new(grid);
    voxels.push_all(&points_m);
    let (reduced_m, voxel_points) = voxels.finish_counted();
    let ids: Vec<u16> = reduced_m
        .iter()
        .map(|point| {
            let most = ids_of[&grid.key(point)].iter().max_by_key(|(_, count)| **count);
            *most.unwrap().0
        })
        .collect();
    let is_border = reduced_m
        .iter()
        .zip(&ids)
        .map(|(point, id)| {
            grid.key(point).with_neighbours().any(|beside| {
                let ids = ids_of.get(&beside);
                ids.is_some_and(|ids| ids.keys().any(|other| (*other == 0) != (*id == 0)))
            })
        })
        .collect();
    let zones = at_scan.values().map(|points| zone_of(points)).collect();
    let stamp = Stamp::from_nanos((f64::from(index) * CYCLE_S * 1e9) as i64);
    let centres_m = sums
        .into_iter()
        .map(|(id, (sum_m, count))| {
            (id, (map_from_rig * Point3::from(sum_m / count as f64), count))
        })
        .collect();
    let cycle = DetectedCycle {
        depth: Some(Arc::new(frame(stamp, depths_m))),
        scan_rays: std::sync::Arc::default(),
        index,
        scan_stamp: stamp,
        voxel_points,
        points_before_reduction: points_m.len(),
        reduced_cloud: Cloud { stamp, frame_id: "rig".to_owned(), points_m: reduced_m },
        map_from_rig,
        map_from_continuous: None,
        map_frame_id: "map".to_owned(),
        setup: geometry::CycleSetup::default(),
        zones,
        moving_beams: Vec::new(),
    };
    View { cycle, ids, is_border, centres_m, ids_of_pixels }
}

/// The image that shows squares of a voxel's edge in the places of points, upright and across the view.
pub(super) fn frame_of_squares(stamp: Stamp, points_m: &[Point3<f32>]) -> DepthFrame {
    let mut depths_m = vec![0.0_f32; (SIZE_PX.0 * SIZE_PX.1) as usize];
    for point in points_m.iter().map(|point| point.cast::<f64>()) {
        let pixels = |along_m: f64, half_view: f64, size_px: i32| {
            let at =
                |along_m: f64| (1.0 - along_m / point.x / half_view) * f64::from(size_px) / 2.0;
            let (first, end) = (at(along_m + CELL_M / 2.0), at(along_m - CELL_M / 2.0));
            // The casts saturate.
            (first.round() as i32).max(0)..(end.round() as i32).min(size_px)
        };
        for row in pixels(point.z, HALF_VIEW.1, SIZE_PX.1) {
            for column in pixels(point.y, HALF_VIEW.0, SIZE_PX.0) {
                let depth_m = &mut depths_m[(row * SIZE_PX.0 + column) as usize];
                if *depth_m == 0.0 || point.x < f64::from(*depth_m) {
                    *depth_m = point.x as f32;
                }
            }
        }
    }
    frame(stamp, depths_m)
}

/// The image with the camera that sees half of [`HALF_VIEW`] to each side.
fn frame(stamp: Stamp, depths_m: Vec<f32>) -> DepthFrame {
    let (width_px, height_px) = (SIZE_PX.0 as usize, SIZE_PX.1 as usize);
    let camera = CameraModel {
        width_px,
        height_px,
        fx_px: width_px as f64 / 2.0 / HALF_VIEW.0,
        fy_px: height_px as f64 / 2.0 / HALF_VIEW.1,
        cx_px: (width_px as f64 - 1.0) / 2.0,
        cy_px: (height_px as f64 - 1.0) / 2.0,
        distortion: Distortion::None,
    };
    let pixels = DepthPixels::Metres(depths_m);
    let image = DepthImage::new(stamp, "camera".to_owned(), (width_px, height_px), pixels);
    DepthFrame::new(image.unwrap(), camera).unwrap()
}

/// A degree of tolerance at each side.
fn zone_of(points: &[Point3<f64>]) -> DynamicZone {
    let azimuths = points.iter().map(|point| point.y.atan2(point.x));
    let distances = points.iter().map(|point| point.x.hypot(point.y) as f32);
    DynamicZone {
        azimuth_min_rad: azimuths.clone().fold(f64::INFINITY, f64::min) - 1_f64.to_radians(),
        azimuth_max_rad: azimuths.fold(f64::NEG_INFINITY, f64::max) + 1_f64.to_radians(),
        peak_std_dev_m: 0.5,
        source: ZoneSource::Measured,
        returns: Some(ReturnSpan {
            nearest_m: distances.clone().fold(f32::INFINITY, f32::min),
            farthest_m: distances.fold(f32::NEG_INFINITY, f32::max),
        }),
    }
}

/// A rig in the room.
pub(super) fn rig_at(x_m: f64, y_m: f64, yaw_rad: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(x_m, y_m, CAMERA_M),
        UnitQuaternion::from_euler_angles(0.0, 0.0, yaw_rad),
    )
}
