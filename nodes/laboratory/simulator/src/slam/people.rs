//! The people in view.

use crate::{
    Body, Figure, Handheld, Material, MovingObject, PERSON_ID, Path, SECOND_PERSON_ID, Shape,
    Walker,
};

/// Hands are separate objects: their label is the person's plus this.
const HANDS: u16 = 10;
/// The speed of people walking slowly.
const STROLL_M_PER_S: f64 = 1.0;

/// A person at the desk who types and reaches for things.
pub(super) fn at_work(end_s: f64) -> Vec<MovingObject> {
    seated(PERSON_ID, [3.4, 0.1], std::f64::consts::PI, end_s)
}

/// Two persons at the desk who gesture while talking.
pub(super) fn sitting(end_s: f64) -> Vec<MovingObject> {
    let mut people = seated(PERSON_ID, [3.35, 0.35], std::f64::consts::PI, end_s);
    people.extend(seated(SECOND_PERSON_ID, [2.5, -1.25], 1.4, end_s));
    people
}

/// Two persons who walk round the desk, one each way, until the end.
pub(super) fn walking(end_s: f64) -> Vec<MovingObject> {
    /// Between camera and desk, beside it, and behind it.
    const CORNERS_M: [[f64; 2]; 4] = [[1.75, -2.1], [1.75, 2.1], [3.7, 2.1], [3.7, -2.1]];
    let mut other_way = CORNERS_M;
    other_way.reverse();
    vec![
        MovingObject::person(PERSON_ID, Walker::default(), laps(&CORNERS_M, 1.0, end_s)),
        MovingObject::person(
            SECOND_PERSON_ID,
            Walker::of_height(1.85),
            laps(&other_way, 3.5, end_s),
        ),
    ]
}

/// From corner to corner, over and over, with a moment at each.
fn laps(corners_m: &[[f64; 2]], start_s: f64, end_s: f64) -> Path {
    const REST_S: f64 = 0.3;
    let next = corners_m.iter().cycle().skip(1);
    let mut waypoints = Vec::new();
    let mut start_s = start_s;
    for (from_m, to_m) in corners_m.iter().cycle().zip(next) {
        if start_s > end_s {
            break;
        }
        let leg = Path::straight(start_s, *from_m, *to_m, STROLL_M_PER_S);
        start_s = leg.end_s() + REST_S;
        waypoints.extend(leg.waypoints);
    }
    Path { waypoints }
}

/// A person sitting at a position and facing a direction: a trunk that leans and turns a little, and two moving hands.
fn seated(id: u16, [x_m, y_m]: [f64; 2], yaw_rad: f64, end_s: f64) -> Vec<MovingObject> {
    let (cloth, skin) = (Material::CLOTH, Material::SKIN);
    let ball = |name: &str, radius_m: f64, pose: [f64; 6], material| Body {
        name: name.to_owned(),
        shape: Shape::Sphere { radius_m },
        pose,
        material,
    };
    let limb = |name: &str, radius_m: f64, length_m: f64, pose: [f64; 6], material| Body {
        name: name.to_owned(),
        shape: Shape::Capsule { radius_m, length_m },
        pose,
        material,
    };
    let lying = std::f64::consts::FRAC_PI_2;
    let trunk = vec![
        limb("trunk", 0.13, 0.4, [0.0, 0.09, 0.8, 0.0, 0.0, 0.0], cloth),
        limb("trunk", 0.13, 0.4, [0.0, -0.09, 0.8, 0.0, 0.0, 0.0], cloth),
        limb("thigh", 0.08, 0.35, [0.2, 0.1, 0.52, 0.0, lying, 0.0], cloth),
        limb("thigh", 0.08, 0.35, [0.2, -0.1, 0.52, 0.0, lying, 0.0], cloth),
        ball("head", 0.11, [0.02, 0.0, 1.27, 0.0, 0.0, 0.0], skin),
    ];
    let hands = vec![
        limb("forearm", 0.045, 0.22, [0.25, 0.2, 0.98, 0.0, lying, 0.0], cloth),
        ball("hand", 0.05, [0.4, 0.2, 0.98, 0.0, 0.0, 0.0], skin),
        limb("forearm", 0.045, 0.22, [0.25, -0.2, 0.98, 0.0, lying, 0.0], cloth),
        ball("hand", 0.05, [0.4, -0.2, 0.98, 0.0, 0.0, 0.0], skin),
    ];
    let sway = |step_s: f64, reach: [f64; 6]| {
        // Incommensurable periods, so that the motion does not repeat.
        const PHASES: [f64; 6] = [2.4, 1.7, 2.9, 2.1, 1.3, 2.6];
        let steps = (end_s / step_s).ceil() as u32;
        let near = (0..=steps)
            .map(|step| {
                let at = [x_m, y_m, 0.0, yaw_rad, 0.0, 0.0];
                let moved = |axis: usize| reach[axis] * (f64::from(step) * PHASES[axis]).sin();
                std::array::from_fn(|axis| at[axis] + moved(axis))
            })
            .collect();
        Handheld { start_s: 0.0, step_s, near, tremor: 0.0, seed: 0 }.path()
    };
    let object = |id, name: &str, bodies, path| MovingObject {
        id,
        name: name.to_owned(),
        figure: Figure::Rigid(bodies),
        path,
        label_span_s: None,
    };
    vec![
        object(id, "seated person", trunk, sway(1.5, [0.05, 0.06, 0.02, 0.25, 0.06, 0.0])),
        object(id + HANDS, "hands", hands, sway(0.5, [0.12, 0.1, 0.12, 0.35, 0.0, 0.0])),
    ]
}
