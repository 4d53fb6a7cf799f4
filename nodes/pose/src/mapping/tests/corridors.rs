//! Long paths: a corridor about a block of rooms, and floors that look alike.

use super::*;

/// Odometry of a good camera: half a per cent of a step of 0.3 m.
const ODOMETRY: StepNoise = StepNoise { shift_m: 0.0015, turn_rad: 0.0005, is_told: true };
/// Ten of each hold, too; each takes seconds.
const SEEDS: u64 = 1;
const STEP_M: f64 = 0.3;
const SEEN_TO_M: f64 = 6.0;
const HALF_WIDTH_M: f64 = 1.2;

/// Looking along a heading about the vertical from a place.
fn at(place: Vector3<f64>, heading_rad: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * heading_rad);
    Isometry3::from_parts(Translation3::from(place), turn).inverse()
}

/// Landmarks on both walls along a path, this many a metre.
fn walls(path: &[Isometry3<f64>], per_m: f64, random: &mut Random) -> World {
    let points = path.iter().flat_map(|camera_from_map| {
        let things = (per_m * STEP_M) as usize;
        let place = |random: &mut Random| {
            let side = if random.between(-1.0, 1.0) < 0.0 { -HALF_WIDTH_M } else { HALF_WIDTH_M };
            // As far ahead as a camera sees that looks along.
            let ahead = random.between(2.0, 2.0 + 3.0 * STEP_M);
            camera_from_map.inverse() * Point3::new(side, random.between(-1.2, 1.2), ahead)
        };
        let things =
            (0..things).map(|_| (place(random), Descriptor([(); 4].map(|()| random.bits()))));
        things.collect::<Vec<_>>()
    });
    World { points: points.collect(), lines: Vec::new(), noise: 1.0 }
}

/// What is near enough before each camera.
fn near(world: &World, path: &[Isometry3<f64>]) -> Vec<World> {
    let near = path.iter().map(|camera_from_map| {
        let is_near = |place: &Point3<f64>| (camera_from_map * place).coords.norm() < SEEN_TO_M;
        let points = world.points.iter().filter(|(place, _)| is_near(place)).copied().collect();
        World { points, lines: Vec::new(), noise: world.noise }
    });
    near.collect()
}

/// Root mean square of how far off the cameras that were kept are, in the map as it is in the end.
fn rms_m(trip: &Trip) -> f64 {
    let map = trip.mapper.map();
    let off = trip.kept.iter().filter_map(|(id, truth)| {
        let pose = map.keyframes().get(*id)?.camera_from_map();
        Some(
            (pose.inverse().translation.vector - truth.inverse().translation.vector).norm_squared(),
        )
    });
    let off: Vec<f64> = off.collect();
    (off.iter().sum::<f64>() / off.len() as f64).sqrt()
}

/// Once about a block of 10 by 5 m, and on till the first side has been seen again.
fn about_a_block() -> Vec<Isometry3<f64>> {
    let mut path = Vec::new();
    let (mut place, mut heading_rad) = (Vector3::zeros(), 0.0_f64);
    for side_m in [10.0, 5.0, 10.0, 5.0, 9.0] {
        let steps = (side_m / STEP_M) as usize;
        for _ in 0..steps {
            place += STEP_M * Vector3::new(heading_rad.sin(), 0.0, heading_rad.cos());
            path.push(at(place, heading_rad));
        }
        for _ in 0..9 {
            heading_rad += 10.0_f64.to_radians();
            path.push(at(place, heading_rad));
        }
    }
    path
}

fn block(seed: u64) -> Trip {
    let path = about_a_block();
    let first_round = &path[..path.len() - 30 - 9];
    let world = walls(first_round, 60.0, &mut Random::new(1000 + seed));
    let shown = near(&world, &path);
    walk(&path, &|frame| &shown[frame], ODOMETRY, seed)
}

#[test]
fn the_loop_around_a_block_is_closed() {
    for seed in 0..SEEDS {
        let trip = block(seed);
        let (kept, rms_m) = (trip.kept.len(), rms_m(&trip));
        println!("seed {seed}: {kept} kept, {} closed, {rms_m:.4} m", trip.closed.len());
        // 0.3 % of the distance.
        assert!(!trip.closed.is_empty() && rms_m < 0.003 * 30.0, "{seed}: {rms_m}");
    }
}

/// Two floors 3 m above each other that look alike, thing for thing, and the stairs between them.
fn floors(seed: u64) -> Trip {
    const HEIGHT_M: f64 = 3.0;
    let along: Vec<_> = (0..30).map(|step| f64::from(step) * STEP_M).collect();
    let ground: Vec<_> = along.iter().map(|z| at(Vector3::new(0.0, 0.0, *z), 0.0)).collect();
    let up: Vec<_> = (1..=10)
        .map(|step| at(Vector3::new(0.0, -HEIGHT_M * f64::from(step) / 10.0, along[29]), 0.0))
        .collect();
    // Backwards, looking in the same direction as on the ground floor.
    let above: Vec<_> =
        along.iter().rev().map(|z| at(Vector3::new(0.0, -HEIGHT_M, *z), 0.0)).collect();
    let mut random = Random::new(2000 + seed);
    let twin = walls(&ground, 60.0, &mut random);
    let lifted = World {
        points: twin.points.iter().map(|(p, d)| (p - Vector3::y() * HEIGHT_M, *d)).collect(),
        lines: Vec::new(),
        noise: 1.0,
    };
    let stairs = walls(&up, 200.0, &mut random);
    let with_stairs = |floor: &World| World {
        points: floor.points.iter().chain(&stairs.points).copied().collect(),
        lines: Vec::new(),
        noise: 1.0,
    };
    let mut shown = near(&twin, &ground[..24]);
    shown.extend(near(&with_stairs(&twin), &ground[24..]));
    shown.extend(near(&stairs, &up));
    shown.extend(near(&with_stairs(&lifted), &above[..6]));
    shown.extend(near(&lifted, &above[6..]));
    let path: Vec<_> = ground.iter().chain(&up).chain(&above).copied().collect();
    walk(&path, &|frame| &shown[frame], ODOMETRY, seed)
}

#[test]
fn floors_that_look_alike_stay_apart() {
    for seed in 0..SEEDS {
        let trip = floors(seed);
        let (kept, rms_m) = (trip.kept.len(), rms_m(&trip));
        println!("seed {seed}: {kept} kept, {} closed, {rms_m:.4} m", trip.closed.len());
        // They are 3 m apart.
        assert!(
            trip.closed.iter().all(|(_, closed)| closed.gap_m < 0.3) && rms_m < 0.05,
            "{seed}: {rms_m}"
        );
    }
}
