//! The objects that cross a scene, and their paths.

use std::f64::consts::TAU;

use super::{CART_ID, LEAD_S, START_SPREAD_S};
use crate::objects::{PERSON_SPEED_M_PER_S, ROBOT_SPEED_M_PER_S};
use crate::platform::SPEED_SHARE;
use crate::scenes::CROSSING_DEPTHS_M;
use crate::variation::{Quantity, Variation};
use crate::{MovingObject, PERSON_ID, Path, ROBOT_ID, SceneName, Spline, Walker};

/// An object that crosses a scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum CrossingObject {
    /// The robot of Rec-HV 3.4.1, at 0.98 m/s.
    Robot,
    /// The person of Rec-HV 3.4.1, at 1.4 m/s.
    Person,
    /// A plain box of 0.6 x 0.5 x 1.4 m, at the robot's speed.
    Cart,
}

/// A path of Rec-HV Figure 2.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PathName {
    /// Across, parallel to y.
    A,
    /// Across, with changing depth.
    B,
    /// Across, not straight.
    C,
    /// The sensors on a rail along x ([`Platform::Rail`](crate::Platform::Rail)); the object crosses as in A.
    D,
    /// The sensors along x ([`Platform::Drive`](crate::Platform::Drive)), the object perpendicular to them, as in A.
    E,
}

/// The largest offset from the nominal path.
const OFFSET_M: f64 = 0.25;
/// The largest offset when there is no room for that.
pub(super) const SMALL_OFFSET_M: f64 = 0.08;
/// The nominal depths of the crossings, along x in the room: those of the demo.
const ROBOT_X_M: f64 = 2.4;
const PERSON_X_M: f64 = 2.9;
const CART_SIZE_M: [f64; 3] = [0.6, 0.5, 1.4];

/// A straight path across in one direction.
pub(super) struct Crossing {
    pub(super) from_x_m: f64,
    pub(super) to_x_m: f64,
    pub(super) speed_m_per_s: f64,
    pub(super) start_s: f64,
    /// 1 for the path from left (positive y) to right, -1 for the other.
    pub(super) side: f64,
}

impl Crossing {
    pub(super) fn path(&self, waiting_y_m: f64) -> Path {
        let from_m = [self.from_x_m, self.side * waiting_y_m];
        let to_m = [self.to_x_m, -self.side * waiting_y_m];
        Path::straight(self.start_s, from_m, to_m, self.speed_m_per_s)
    }
}

impl CrossingObject {
    /// Its label.
    #[must_use]
    pub fn id(self) -> u16 {
        match self {
            Self::Robot => ROBOT_ID,
            Self::Person => PERSON_ID,
            Self::Cart => CART_ID,
        }
    }

    fn usual_speed_m_per_s(self) -> f64 {
        if self == Self::Person { PERSON_SPEED_M_PER_S } else { ROBOT_SPEED_M_PER_S }
    }

    pub(super) fn crossing(self, seed: u64) -> Crossing {
        let variation = Variation::new(seed, self.id());
        let usual_x_m = if self == Self::Person { PERSON_X_M } else { ROBOT_X_M };
        let x_m = usual_x_m + OFFSET_M * variation.symmetric(Quantity::Offset);
        Crossing {
            from_x_m: x_m,
            to_x_m: x_m,
            speed_m_per_s: varied_speed(self.usual_speed_m_per_s(), &variation),
            start_s: LEAD_S + START_SPREAD_S * variation.unit(Quantity::Start),
            side: variation.side(Quantity::Direction),
        }
    }

    pub(super) fn along(self, path: Path, seed: u64) -> MovingObject {
        match self {
            Self::Robot => MovingObject::robot(ROBOT_ID, path),
            Self::Person => person(PERSON_ID, path, seed),
            Self::Cart => MovingObject::cart(CART_ID, CART_SIZE_M, path),
        }
    }
}

pub(super) fn varied_speed(usual_m_per_s: f64, variation: &Variation) -> f64 {
    usual_m_per_s * (1.0 + SPEED_SHARE * variation.symmetric(Quantity::Speed))
}

/// A person from 1.6 to 1.9 m in any phase of the gait.
pub(super) fn person(id: u16, path: Path, seed: u64) -> MovingObject {
    let variation = Variation::new(seed, id);
    let walker = Walker {
        gait_phase_rad: TAU * variation.unit(Quantity::GaitPhase),
        ..Walker::of_height(1.75 + 0.15 * variation.symmetric(Quantity::Height))
    };
    MovingObject::person(id, walker, path)
}

/// The path of an object through a scene.
pub(super) fn way(scene: SceneName, object: CrossingObject, path: PathName, seed: u64) -> Path {
    let waiting_y_m = scene.waiting_y_m();
    let usual = object.crossing(seed);
    let (nearest_m, farthest_m) = CROSSING_DEPTHS_M;
    match path {
        PathName::A | PathName::D | PathName::E => usual.path(waiting_y_m),
        PathName::B => {
            // From near to far or from far to near, as far as the doorways are wide.
            let shift_m =
                SMALL_OFFSET_M * Variation::new(seed, object.id()).symmetric(Quantity::Offset);
            let (near_m, far_m) =
                (nearest_m + SMALL_OFFSET_M + shift_m, farthest_m - SMALL_OFFSET_M + shift_m);
            let nears = Variation::new(seed, object.id()).side(Quantity::Height) > 0.0;
            let (from_x_m, to_x_m) = if nears { (far_m, near_m) } else { (near_m, far_m) };
            Crossing { from_x_m, to_x_m, ..usual }.path(waiting_y_m)
        }
        PathName::C => {
            let shift_m =
                SMALL_OFFSET_M * Variation::new(seed, object.id()).symmetric(Quantity::Offset);
            // Nowhere does it turn back: it goes on towards the other side all the way.
            let places_m = [(2.5, 1.0), (3.15, 0.45), (2.4, -0.02), (3.1, -0.4), (2.8, -1.0)];
            let through_m =
                places_m.map(|(x_m, share)| [x_m + shift_m, usual.side * share * waiting_y_m]);
            Spline::new(usual.start_s, &through_m, usual.speed_m_per_s).path()
        }
    }
}
