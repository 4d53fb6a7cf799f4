//! The building of the tour: a corridor around a square, and the path of the platform through it.
//!
//! Each side of the square takes a minute, and all four are identical, so that minutes can be compared: they
//! differ only by the state of the cores.

use std::f64::consts::{FRAC_PI_2, PI};

use geometry::{Stamp, pose_from_vector, pose_vector};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use simulator::{Body, Material, MovingObject, Path, Rig, Scenario, Scene, Walker, Waypoint};

/// The four sides.
pub(super) const SIDES: usize = 4;
/// The time for a side, with its corner.
pub(super) const SIDE_S: f64 = 60.0;
/// The time for one lap.
pub(in crate::bench) const LAP_S: f64 = SIDES as f64 * SIDE_S;
/// From corner to corner, along the corridor's middle.
const SIDE_M: f64 = 28.0;
/// The time for the turn into the next side.
const TURN_S: f64 = 4.0;
/// The corridor.
const HALF_WIDTH_M: f64 = 1.5;
const HEIGHT_M: f64 = 2.6;
const WALL_M: f64 = 0.2;
/// The camera's height, of the third mounting of Rec-HV 3.4.2.
const RIG_HEIGHT_M: f64 = 1.2;
/// The distance between two pieces of furniture.
const FURNITURE_STEP_M: f64 = 3.5;
/// A person crosses the corridor back and forth, at this distance along each side.
const CROSSING_AT_M: f64 = 15.0;
const CROSSING_HALF_M: f64 = 1.0;
/// The speed of the person: less than the 1.4 m/s of Rec-HV 3.4.1, which is not reached over 2 m.
const CROSSING_M_PER_S: f64 = 1.0;
/// The pause at either wall, in which the person turns around.
const CROSSING_REST_S: f64 = 1.0;
/// Two images per revolution of the scanner: each scan has one within the matcher's 0.05 s.
const IMAGES_HZ: f64 = 14.0;

/// One lap through the building, as long as `duration_s`: its noise by the lap's number, its stamps from `start`.
pub(in crate::bench) fn lap(
    number: u64,
    start: Stamp,
    duration_s: f64,
    size_px: (usize, usize),
) -> Scenario {
    let mut rig = Rig { path: way(), ..Rig::default() };
    rig.depth_camera.rate_hz = IMAGES_HZ;
    Scenario {
        name: "tour".to_owned(),
        seed: number + 1,
        start,
        duration_s,
        scene: building(),
        rig,
    }
    .with_depth_size(size_px.0, size_px.1)
}

/// The transform from the frame of a side to the room: x along the middle of the corridor from its first corner, y inwards.
fn room_from_side(side: usize) -> Isometry3<f64> {
    let half_m = SIDE_M / 2.0;
    let quarter = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), side as f64 * FRAC_PI_2);
    Isometry3::from_parts(Translation3::identity(), quarter)
        * Translation3::new(-half_m, -half_m, 0.0)
}

fn building() -> Scene {
    let mut scene = Scene::default();
    for side in 0..SIDES {
        let room_from_side = room_from_side(side);
        let in_room = |pose: [f64; 6]| pose_vector(&(room_from_side * pose_from_vector(&pose)));
        scene.bodies.extend(
            side_bodies().into_iter().map(|body| Body { pose: in_room(body.pose), ..body }),
        );
        let waypoints = crossing()
            .into_iter()
            .map(|waypoint| Waypoint { pose: in_room(waypoint.pose), ..waypoint })
            .collect();
        let id = side as u16 + 1;
        scene.objects.push(MovingObject::person(id, Walker::default(), Path { waypoints }));
    }
    scene
}

/// Walls, floor, ceiling and furniture of one side, in its frame. Floor and ceiling end where those of the next
/// side begin.
fn side_bodies() -> Vec<Body> {
    let (from_m, to_m) = (-HALF_WIDTH_M, SIDE_M - HALF_WIDTH_M);
    let plaster = Material::PLASTER;
    let mut bodies = vec![
        Body::cuboid(
            "outer wall",
            [from_m - WALL_M, -HALF_WIDTH_M - WALL_M, 0.0],
            [to_m + 2.0 * HALF_WIDTH_M, -HALF_WIDTH_M, HEIGHT_M],
            plaster,
        ),
        Body::cuboid(
            "inner wall",
            [HALF_WIDTH_M, HALF_WIDTH_M, 0.0],
            [to_m, HALF_WIDTH_M + WALL_M, HEIGHT_M],
            plaster,
        ),
        Body::cuboid(
            "floor",
            [from_m, -HALF_WIDTH_M, -WALL_M],
            [to_m, HALF_WIDTH_M, 0.0],
            Material::WOOD,
        ),
        Body::cuboid(
            "ceiling",
            [from_m, -HALF_WIDTH_M, HEIGHT_M],
            [to_m, HALF_WIDTH_M, HEIGHT_M + WALL_M],
            plaster,
        ),
    ];
    let places = (SIDE_M / FURNITURE_STEP_M) as usize;
    for place in 1..places {
        let x_m = place as f64 * FURNITURE_STEP_M;
        if (x_m - CROSSING_AT_M).abs() < FURNITURE_STEP_M / 2.0 {
            continue;
        }
        let height_m = 0.6 + 0.25 * place as f64;
        // Alternately on the left and on the right, along the wall.
        let (near_m, far_m) = (HALF_WIDTH_M - 0.5, HALF_WIDTH_M);
        let y_m = if place % 2 == 0 { (near_m, far_m) } else { (-far_m, -near_m) };
        bodies.push(Body::cuboid(
            "cabinet",
            [x_m, y_m.0, 0.0],
            [x_m + 0.9, y_m.1, height_m.min(2.2)],
            Material::VARNISH,
        ));
        bodies.push(Body::cuboid(
            "shelf",
            [x_m + 1.8, -y_m.1, 1.5],
            [x_m + 2.6, -y_m.0 - 0.2, 1.55],
            Material::WOOD,
        ));
    }
    bodies
}

/// Back and forth across the corridor for a lap, in the frame of a side.
fn crossing() -> Vec<Waypoint> {
    let walk_s = 2.0 * CROSSING_HALF_M / CROSSING_M_PER_S;
    let leg_s = walk_s + CROSSING_REST_S;
    let legs = (LAP_S / leg_s) as usize;
    (0..legs)
        .flat_map(|leg| {
            let outwards = if leg % 2 == 0 { 1.0 } else { -1.0 };
            let start_s = leg as f64 * leg_s;
            [(start_s, -outwards), (start_s + walk_s, outwards)].map(|(time_s, side)| Waypoint {
                time_s,
                pose: [CROSSING_AT_M, side * CROSSING_HALF_M, 0.0, outwards * FRAC_PI_2, 0.0, 0.0],
            })
        })
        .collect()
}

/// Along each side and around its corner. The last waypoint is the first one of the next lap.
fn way() -> Path {
    let corner = |time_s: f64, side: usize, along_m: f64, yaw_rad: f64| {
        let pose = [along_m, 0.0, RIG_HEIGHT_M, yaw_rad, 0.0, 0.0];
        let mut pose = pose_vector(&(room_from_side(side) * pose_from_vector(&pose)));
        // Half a turn with the opposite sign would turn in the other direction.
        pose[3] = pose[3].rem_euclid(2.0 * PI);
        Waypoint { time_s, pose }
    };
    let mut waypoints = Vec::new();
    for side in 0..SIDES {
        let start_s = side as f64 * SIDE_S;
        waypoints.push(corner(start_s, side, 0.0, 0.0));
        waypoints.push(corner(start_s + SIDE_S - TURN_S, side, SIDE_M, 0.0));
    }
    waypoints.push(corner(LAP_S, 0, 0.0, 0.0));
    Path { waypoints }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_is_closed_and_each_side_a_quarter_turn_on() {
        let path = way();
        let (first, last) = (path.pose_at(0.0), path.pose_at(LAP_S));
        assert!((first.inverse() * last).translation.vector.norm() < 1e-9);
        assert!(first.rotation.angle_to(&last.rotation) < 1e-9);
        for time_s in [0.0, 13.0, 57.5, 59.9] {
            let turned = path.pose_at(time_s + SIDE_S);
            let expected = Isometry3::rotation(Vector3::z() * FRAC_PI_2) * path.pose_at(time_s);
            assert!((turned.translation.vector - expected.translation.vector).norm() < 1e-9);
            assert!(turned.rotation.angle_to(&expected.rotation) < 1e-9, "at {time_s}");
        }
        let way_m = path.distance_at(LAP_S);
        assert!((way_m - SIDES as f64 * SIDE_M).abs() < 1e-9, "{way_m}");
    }

    #[test]
    fn nothing_stands_in_the_way() {
        for body in side_bodies() {
            let simulator::Shape::Box { size_m } = body.shape else { panic!("{}", body.name) };
            let is_clear = (body.pose[1].abs() - size_m[1] / 2.0) > 0.8;
            let is_above_or_below = (body.pose[2] - RIG_HEIGHT_M).abs() - size_m[2] / 2.0 > 0.5;
            assert!(is_clear || is_above_or_below, "{body:?}");
        }
        assert_eq!(lap(0, Stamp::default(), LAP_S, (160, 120)).validate(), Ok(()));
    }
}
