//! Once round a square of corridor, with an odometry that drifts, and then a loop closing.

use nalgebra::{Point2, Vector2};

use super::*;

/// The corridor is between these two squares, about the origin: half their edges. Each wall is in the middle of its voxels:
/// on the border of two the noise alone would make it double.
const INNER_M: f64 = 4.04;
const OUTER_M: f64 = 6.04;
const RANGE_M: f64 = 4.0;
const RAYS: u32 = 240;
const HEIGHTS_M: [f32; 2] = [0.2, 0.6];
const STEP_M: f64 = 0.1;
const STEP_S: f64 = 0.1;
/// A vertex of the path each so many steps.
const VERTEX_STEPS: usize = 5;
/// Once round, and 3 m of the first side again.
const STEPS: usize = 430;
/// Of an odometry that is neither good nor bad: a degree in 12 m.
const DRIFT_RAD_PER_STEP: f64 = 1.5e-4;
const DRIFT_SHARE: f64 = 0.003;

/// The platform after so many steps, in the middle of the corridor, against the clock from the middle of the lower side.
fn truth(step: usize) -> Isometry3<f64> {
    let side_m = INNER_M + OUTER_M;
    let way_m = step as f64 * STEP_M + side_m / 2.0;
    let side = (way_m / side_m).floor();
    let (along_m, yaw) = (way_m - side * side_m, side * std::f64::consts::FRAC_PI_2);
    let corner =
        nalgebra::Rotation2::new(yaw) * Vector2::new(along_m - side_m / 2.0, -side_m / 2.0);
    pose_from_vector(&[corner.x, corner.y, 0.4, yaw, 0.0, 0.0])
}

/// The same by an odometry whose steps are a little too long and turn a little.
fn drifting() -> Vec<Isometry3<f64>> {
    let mut poses = vec![truth(0)];
    for step in 1..=STEPS {
        let mut motion = truth(step - 1).inverse() * truth(step);
        motion.translation.vector *= 1.0 + DRIFT_SHARE;
        let drift = pose_from_vector(&[0.0, 0.0, 0.0, DRIFT_RAD_PER_STEP, 0.0, 0.0]);
        let last = poses[step - 1];
        poses.push(last * motion * drift);
    }
    poses
}

/// How far it is to the next wall.
fn range_m(from: &Point2<f64>, direction: &Vector2<f64>) -> f64 {
    let along = |half_m: f64| {
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..2 {
            let to = |border: f64| (border - from[axis]) / direction[axis];
            let (a, b) = (to(-half_m), to(half_m));
            (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
        }
        (enter, leave)
    };
    let ((enter, leave), (_, outer)) = (along(INNER_M), along(OUTER_M));
    if enter > 0.0 && enter < leave { enter.min(outer) } else { outer }
}

/// What a scanner of two rings sees at a step, with 1 cm of noise, in the rig.
fn seen(step: usize, noise: &mut impl FnMut() -> f64) -> Vec<Point3<f32>> {
    let map_from_rig = truth(step);
    let (yaw, place) = (map_from_rig.rotation.euler_angles().2, map_from_rig.translation.vector);
    let rays = (0..RAYS).filter_map(|ray| {
        let azimuth = f64::from(ray) / f64::from(RAYS) * std::f64::consts::TAU;
        let (sin, cos) = (yaw + azimuth).sin_cos();
        let range_m = range_m(&place.xy().into(), &Vector2::new(cos, sin)) + 0.01 * noise();
        let (x, y) = (range_m * azimuth.cos(), range_m * azimuth.sin());
        (range_m < RANGE_M).then_some([x as f32, y as f32])
    });
    rays.flat_map(|[x, y]| HEIGHTS_M.map(|z| Point3::new(x, y, z - 0.4))).collect()
}

fn noise() -> impl FnMut() -> f64 {
    let mut state = 7_u64;
    move || {
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

fn way(poses: &[Isometry3<f64>], last: usize) -> MapPath {
    let vertices = (0..=last).step_by(VERTEX_STEPS).map(|step| (step as f64 * STEP_S, poses[step]));
    path(last as f64 * STEP_S, &vertices.collect::<Vec<_>>())
}

/// The map of these poses. The path comes with its vertices.
fn map_of(mut map: StaticMap, poses: &[Isometry3<f64>]) -> StaticMap {
    let mut noise = noise();
    for (step, map_from_rig) in poses.iter().enumerate() {
        if step.is_multiple_of(VERTEX_STEPS) {
            map.follow_path(&way(poses, step)).unwrap();
        }
        let cloud = Cloud {
            stamp: at(step as f64 * STEP_S),
            frame_id: "rig".to_owned(),
            points_m: seen(step, &mut noise),
        };
        map.add(&cloud.transformed(map_from_rig, "map")).unwrap();
    }
    map
}

/// How good a map is.
#[derive(Debug)]
struct Score {
    voxels: usize,
    /// Of all points, to the next wall: root mean square.
    off_m: f64,
    /// Points farther than 10 cm from each wall.
    astray: f64,
    /// The share of the walls with a point within 10 cm.
    complete: f64,
}

fn score(map: &StaticMap) -> Score {
    const NEAR_M: f64 = 0.1;
    let points: Vec<Point3<f64>> = map.points().iter().map(|point| point.cast()).collect();
    let off_m = |point: &Point3<f64>| {
        let to_square = |half_m: f64| {
            let [x, y] = [point.x.abs() - half_m, point.y.abs() - half_m];
            if x <= 0.0 && y <= 0.0 { x.max(y).abs() } else { x.max(0.0).hypot(y.max(0.0)) }
        };
        to_square(INNER_M).min(to_square(OUTER_M))
    };
    let count = points.len() as f64;
    let squares = points.iter().map(|point| off_m(point).powi(2)).sum::<f64>();
    let astray = points.iter().filter(|point| off_m(point) > NEAR_M).count() as f64;
    let walls = [INNER_M, OUTER_M].into_iter().flat_map(|half_m| {
        let along = (0..)
            .map(move |index| -half_m + 0.05 * f64::from(index))
            .take_while(move |x| *x < half_m);
        along.flat_map(move |x| [[x, half_m], [x, -half_m], [half_m, x], [-half_m, x]])
    });
    let walls: Vec<Point2<f64>> = walls.map(Point2::from).collect();
    let is_seen = |place: &&Point2<f64>| {
        points.iter().any(|point| (point.xy() - **place).norm_squared() < NEAR_M * NEAR_M)
    };
    let complete = walls.iter().filter(is_seen).count() as f64 / walls.len() as f64;
    Score {
        voxels: points.len(),
        off_m: (squares / count).sqrt(),
        astray: astray / count,
        complete,
    }
}

fn empty() -> StaticMap {
    let pipeline = PipelineConfig::new(Method::RecHv, 0.08);
    StaticMap::new(ReconstructionConfig { pipeline, ..ReconstructionConfig::default() }).unwrap()
}

#[test]
fn double_walls_are_single_ones_after_a_loop_is_closed() {
    let (drifting, truth) = (drifting(), (0..=STEPS).map(truth).collect::<Vec<_>>());
    let off = (truth[STEPS].inverse() * drifting[STEPS]).translation.vector.norm();
    let best = score(&map_of(empty(), &truth));
    let mut map = map_of(empty(), &drifting);
    let before = score(&map);
    let done = map.follow_path(&way(&truth, STEPS)).unwrap();
    let after = score(&map);
    println!("{off:.2} m open; true poses {best:?}; before {before:?}; {done:?}; after {after:?}");
    assert!(off > 0.3, "{off}");
    assert!(before.off_m > 0.1 && before.astray > 0.3, "{before:?}");
    assert!(before.voxels > best.voxels * 5 / 4, "{before:?}");
    // What has moved by less than 2 cm has stayed, and what was seen from afar has the anchor of then.
    assert!(after.off_m < best.off_m + 0.025 && after.astray < 0.01, "{after:?}");
    assert!(after.complete > 0.995 * best.complete, "{after:?}");
    let surplus = after.voxels as f64 / best.voxels as f64;
    assert!((0.95..1.05).contains(&surplus), "{surplus}");
}

#[test]
fn each_correction_costs_few_voxels() {
    let truth: Vec<_> = (0..=STEPS).map(truth).collect();
    let mut map = map_of(empty(), &truth);
    let mut voxels = vec![map.len()];
    for turn in 1..=10 {
        // To and fro, by a few voxels and a few degrees.
        let share = f64::from(turn % 3) - 1.0;
        let moved = pose_from_vector(&[0.13 * share, 0.07 * share, 0.0, 0.03 * share, 0.0, 0.0]);
        let elsewhere: Vec<_> = truth.iter().map(|pose| moved * pose).collect();
        map.follow_path(&way(&elsewhere, STEPS)).unwrap();
        voxels.push(map.len());
    }
    println!("{voxels:?}");
    let complete = score(&map).complete;
    assert!(complete > 0.99, "{complete}");
    assert!(voxels[10] > voxels[0] * 9 / 10, "{voxels:?}");
}
