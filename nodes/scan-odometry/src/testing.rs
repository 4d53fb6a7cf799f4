//! What several tests share: rooms of walls and posts, a scanner that turns in them, and noise.

use std::f64::consts::TAU;

pub(crate) use estimation::Random;
use geometry::{BeamOrder, Scan, Stamp};
use nalgebra::{Isometry2, Point2, Vector2};

use crate::{ScanOdometry, ScanOdometryConfig, ScanPose};

/// A pole or a leg.
pub(crate) type Post = (Point2<f64>, f64);

/// Static walls, and posts that may walk.
#[derive(Clone, Default)]
pub(crate) struct World {
    pub(crate) walls: Vec<[Point2<f64>; 2]>,
    pub(crate) posts: Vec<Post>,
    /// The posts of people at a time.
    pub(crate) walkers: Vec<fn(f64) -> Vec<Post>>,
}

impl World {
    /// Walls along the edges of a rectangle between two corners.
    pub(crate) fn with_box(mut self, from: [f64; 2], to: [f64; 2]) -> Self {
        let corners = [[from[0], from[1]], [to[0], from[1]], [to[0], to[1]], [from[0], to[1]]]
            .map(Point2::from);
        self.walls.extend((0..4).map(|edge| [corners[edge], corners[(edge + 1) % 4]]));
        self
    }

    pub(crate) fn with_post(mut self, x: f64, y: f64, radius: f64) -> Self {
        self.posts.push((Point2::new(x, y), radius));
        self
    }

    pub(crate) fn with_walker(mut self, walker: fn(f64) -> Vec<Post>) -> Self {
        self.walkers.push(walker);
        self
    }

    /// A room of 8 by 6 m around the origin, with cupboards, a table's legs and a pillar.
    pub(crate) fn furnished() -> Self {
        Self::default()
            .with_box([-4.0, -3.0], [4.0, 3.0])
            .with_box([-4.0, 1.2], [-3.4, 3.0])
            .with_box([1.5, 2.5], [3.0, 3.0])
            .with_box([3.3, -2.0], [4.0, -0.8])
            .with_box([-1.5, -3.0], [-0.2, -2.6])
            .with_post(-2.9, -2.2, 0.03)
            .with_post(-2.9, -1.4, 0.03)
            .with_post(-2.0, -2.2, 0.03)
            .with_post(-2.0, -1.4, 0.03)
            .with_post(2.4, -2.4, 0.2)
    }

    /// How far a ray of length 1 goes.
    fn cast(&self, origin: &Point2<f64>, direction: &Vector2<f64>, time_s: f64) -> f64 {
        let walls = self.walls.iter().filter_map(|[from, to]| {
            let (along, offset) = (to - from, from - origin);
            let cross = direction.perp(&along);
            let (far, share) = (offset.perp(&along) / cross, offset.perp(direction) / cross);
            (far > 0.0 && (0.0..=1.0).contains(&share)).then_some(far)
        });
        let walking = self.walkers.iter().flat_map(|walker| walker(time_s));
        let posts = self.posts.iter().copied().chain(walking).filter_map(|(centre, radius)| {
            let to_centre = centre - origin;
            let (closest, aside) = (to_centre.dot(direction), direction.perp(&to_centre));
            let half_chord = (radius * radius - aside * aside).sqrt();
            let far = closest - half_chord;
            (far > 0.0).then_some(far)
        });
        walls.chain(posts).fold(f64::INFINITY, f64::min)
    }
}

/// Two legs at a place, one before the other by the phase of the step.
pub(crate) fn legs(x: f64, y: f64, time_s: f64) -> Vec<Post> {
    let swing = 0.25 * (TAU * 0.9 * time_s).sin();
    vec![(Point2::new(x + swing, y - 0.1), 0.07), (Point2::new(x - swing, y + 0.1), 0.07)]
}

/// A scanner in a world.
#[derive(Clone)]
pub(crate) struct Scanner {
    pub(crate) beams: usize,
    pub(crate) first_rad: f64,
    pub(crate) step_rad: f64,
    pub(crate) noise_m: f64,
    pub(crate) reach_m: f64,
    pub(crate) period_s: f64,
    pub(crate) order: BeamOrder,
}

impl Default for Scanner {
    /// 270 degrees in 768 beams, ten times a second, a centimetre of noise.
    fn default() -> Self {
        let step_rad = 270_f64.to_radians() / 767.0;
        Self {
            beams: 768,
            first_rad: -135_f64.to_radians(),
            step_rad,
            noise_m: 0.01,
            reach_m: 10.0,
            period_s: 0.1,
            order: BeamOrder::FirstToLast,
        }
    }
}

impl Scanner {
    /// A full revolution of this many beams.
    pub(crate) fn full_turn(beams: usize) -> Self {
        let step_rad = TAU / beams as f64;
        Self { beams, first_rad: -TAU / 2.0, step_rad, ..Self::default() }
    }

    /// The middle of a scan, in seconds since the start.
    pub(crate) fn middle_s(&self, scan: usize) -> f64 {
        scan as f64 * self.period_s
            + 0.5 * self.turn_s() * (self.beams as f64 - 1.0) / self.beams as f64
    }

    /// The beams fill three quarters of a period: the rest looks backwards.
    fn turn_s(&self) -> f64 {
        0.75 * self.period_s
    }

    /// The scan number `scan`, on a path that gives the pose in the world at a time.
    pub(crate) fn scan(
        &self,
        world: &World,
        path: &dyn Fn(f64) -> Isometry2<f64>,
        scan: usize,
        random: &mut Random,
    ) -> Scan {
        let start_s = scan as f64 * self.period_s;
        let increment_s = self.turn_s() / self.beams as f64;
        let measure = |beam: usize| {
            let place = match self.order {
                BeamOrder::LastToFirst => self.beams - 1 - beam,
                _ => beam,
            };
            let time_s = start_s + place as f64 * increment_s;
            let pose = path(time_s);
            let azimuth_rad = self.first_rad + beam as f64 * self.step_rad;
            let direction = pose.rotation * Vector2::new(azimuth_rad.cos(), azimuth_rad.sin());
            let range_m = world.cast(&pose.translation.vector.into(), &direction, time_s);
            let noisy_m = range_m + self.noise_m * random.normal();
            if noisy_m < self.reach_m { noisy_m as f32 } else { f32::INFINITY }
        };
        Scan {
            stamp: Stamp::from_secs_nanos(1_700_000_000, 0).plus_seconds(start_s),
            frame_id: "laser".to_owned(),
            angle_min_rad: self.first_rad as f32,
            angle_increment_rad: self.step_rad as f32,
            time_increment_s: increment_s as f32,
            scan_time_s: self.period_s as f32,
            range_min_m: 0.05,
            range_max_m: self.reach_m as f32,
            ranges_m: (0..self.beams).map(measure).collect(),
        }
    }

    pub(crate) fn odometry(&self) -> ScanOdometry {
        let config = ScanOdometryConfig { beam_order: self.order, ..ScanOdometryConfig::default() };
        ScanOdometry::new(config).unwrap()
    }
}

/// A pose that was found, and the true one in the same frame.
pub(crate) struct Found {
    pub(crate) pose: ScanPose,
    pub(crate) truth: Isometry2<f64>,
}

impl Found {
    /// The error in the scanner's frame.
    pub(crate) fn error(&self) -> Isometry2<f64> {
        self.truth.inv_mul(&self.pose.odom_from_lidar)
    }
}

/// Runs an odometry over this many scans of a path.
pub(crate) fn follow(
    scanner: &Scanner,
    world: &World,
    path: &dyn Fn(f64) -> Isometry2<f64>,
    scans: usize,
    seed: u64,
) -> Vec<Found> {
    let mut odometry = scanner.odometry();
    let mut random = Random::new(seed);
    let start = path(scanner.middle_s(0));
    (0..scans)
        .map(|scan| Found {
            pose: odometry.step(&scanner.scan(world, path, scan, &mut random)),
            truth: start.inv_mul(&path(scanner.middle_s(scan))),
        })
        .collect()
}
