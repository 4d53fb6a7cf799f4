//! A walking person: two legs with knees, two arms with elbows, a trunk and a head, all of capsules.
//!
//! The gait is a function of the distance walked, not of time, so that feet do not slide at any speed.
//! Each leg swings about the hip as `amplitude * sin(phase)`; the knee bends while the leg comes
//! forward; the hip is as high as the straighter leg holds it. Standing still, the legs come together.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::solid::Solid;
use crate::{Material, Path, Shape};

/// A person who walks along a path.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Walker {
    /// The height of the person.
    pub height_m: f64,
    /// The distance from one footfall to the next of the same foot.
    pub stride_m: f64,
    /// The phase of the gait at the start of the path: 0 with both legs upright, the left one coming forward.
    pub gait_phase_rad: f64,
    /// Trousers and shirt.
    pub clothes: Material,
    /// Head and hands.
    pub skin: Material,
}

impl Default for Walker {
    /// A person of 1.75 m; two steps of 0.7 m make a stride.
    fn default() -> Self {
        Self {
            height_m: 1.75,
            stride_m: 1.4,
            gait_phase_rad: 0.0,
            clothes: Material::CLOTH,
            skin: Material::SKIN,
        }
    }
}

/// The proportions of the body as shares of its height, after Drillis and Contini 1966 (in Winter,
/// "Biomechanics and Motor Control of Human Movement").
mod share {
    pub(super) const THIGH: f64 = 0.245;
    pub(super) const SHIN: f64 = 0.246;
    pub(super) const ANKLE: f64 = 0.039;
    pub(super) const FOOT: f64 = 0.152;
    pub(super) const TRUNK: f64 = 0.288;
    pub(super) const UPPER_ARM: f64 = 0.186;
    pub(super) const FOREARM: f64 = 0.146;
    pub(super) const HALF_SHOULDERS: f64 = 0.115;
    pub(super) const HALF_HIPS: f64 = 0.055;
    pub(super) const HEAD_CENTRE_ABOVE_SHOULDERS: f64 = 0.117;
}

/// The bend of the knee while its leg comes forward.
const KNEE_BEND_RAD: f64 = 0.9;
/// The swing of an arm, opposite to the leg of its side.
const ARM_SWING_RAD: f64 = 0.4;
/// The bend of the elbow.
const ELBOW_BEND_RAD: f64 = 0.35;
/// The legs come together over this time before and after a stop.
const STOP_BLEND_S: f64 = 0.25;
/// Slower than this, the steps get shorter in proportion.
const FULL_STEP_SPEED_M_PER_S: f64 = 0.8;

struct Limb {
    from_m: Point3<f64>,
    to_m: Point3<f64>,
    radius_m: f64,
    material: Material,
}

impl Walker {
    /// A person of another height, whose steps are longer or shorter in proportion.
    #[must_use]
    pub fn of_height(height_m: f64) -> Self {
        let usual = Self::default();
        Self { height_m, stride_m: usual.stride_m * height_m / usual.height_m, ..usual }
    }

    pub(crate) fn solids(
        &self,
        id: u16,
        room_from_object: &Isometry3<f64>,
        path: &Path,
        time_s: f64,
    ) -> Vec<Solid> {
        let phase_rad = TAU * path.distance_at(time_s) / self.stride_m + self.gait_phase_rad;
        let walked_m =
            path.distance_at(time_s + STOP_BLEND_S) - path.distance_at(time_s - STOP_BLEND_S);
        let effort = (walked_m / (2.0 * STOP_BLEND_S) / FULL_STEP_SPEED_M_PER_S).min(1.0);
        let limbs = self.limbs(phase_rad, effort);
        limbs
            .iter()
            .zip(u32::from(id) << 8..)
            .map(|(limb, pattern_seed)| limb.solid(id, pattern_seed, room_from_object))
            .collect()
    }

    /// The limbs in the object's frame, for a phase of the gait and an effort from 0 (standing) to 1.
    fn limbs(&self, phase_rad: f64, effort: f64) -> Vec<Limb> {
        let height_m = self.height_m;
        let (thigh_m, shin_m) = (share::THIGH * height_m, share::SHIN * height_m);
        // Half a stride apart, the two feet of a straight-legged step are `stride / 2` from each other.
        let swing_rad = effort * (self.stride_m / 4.0 / (thigh_m + shin_m)).clamp(0.0, 1.0).asin();
        let legs = [(1.0, 0.0), (-1.0, PI)].map(|(side, offset_rad)| {
            let phase_rad = phase_rad + offset_rad;
            let hip_rad = swing_rad * phase_rad.sin();
            let knee_rad = effort * KNEE_BEND_RAD * phase_rad.cos().max(0.0);
            (side, hip_rad, knee_rad)
        });
        let reach_m = legs
            .map(|(_, hip_rad, knee_rad)| {
                thigh_m * hip_rad.cos() + shin_m * (hip_rad - knee_rad).cos()
            })
            .into_iter()
            .fold(0.0, f64::max);
        let hip_z_m = reach_m + share::ANKLE * height_m;

        let mut limbs = Vec::with_capacity(16);
        for (side, hip_rad, knee_rad) in legs {
            self.add_leg(&mut limbs, hip_z_m, side, hip_rad, knee_rad);
            self.add_arm(&mut limbs, hip_z_m, side, -hip_rad / swing_rad.max(1e-9) * effort);
        }
        self.add_trunk(&mut limbs, hip_z_m);
        limbs
    }

    fn add_leg(&self, limbs: &mut Vec<Limb>, hip_z_m: f64, side: f64, hip_rad: f64, knee_rad: f64) {
        let height_m = self.height_m;
        let hip = Point3::new(0.0, side * share::HALF_HIPS * height_m, hip_z_m);
        let knee = hip + pendulum(hip_rad) * share::THIGH * height_m;
        let shin_rad = hip_rad - knee_rad;
        let ankle = knee + pendulum(shin_rad) * share::SHIN * height_m;
        // The foot stays square to the shin as it swings, and flat as it stands.
        let toe = ankle
            + Vector3::new((-knee_rad).cos(), 0.0, (-knee_rad).sin())
                * share::FOOT
                * height_m
                * 0.8;
        let lowered = Vector3::z() * (share::ANKLE * height_m - 0.04);
        let cloth = self.clothes;
        limbs.push(Limb { from_m: hip, to_m: knee, radius_m: 0.046 * height_m, material: cloth });
        limbs.push(Limb { from_m: knee, to_m: ankle, radius_m: 0.032 * height_m, material: cloth });
        limbs.push(Limb {
            from_m: ankle - lowered,
            to_m: toe - lowered,
            radius_m: 0.04,
            material: cloth,
        });
    }

    fn add_arm(&self, limbs: &mut Vec<Limb>, hip_z_m: f64, side: f64, swing: f64) {
        let height_m = self.height_m;
        let shoulder = Point3::new(
            0.0,
            side * share::HALF_SHOULDERS * height_m,
            hip_z_m + share::TRUNK * height_m,
        );
        let swing_rad = ARM_SWING_RAD * swing;
        let elbow = shoulder + pendulum(swing_rad) * share::UPPER_ARM * height_m;
        let hand = elbow + pendulum(swing_rad + ELBOW_BEND_RAD) * share::FOREARM * height_m;
        let (cloth, skin) = (self.clothes, self.skin);
        let upper_m = 0.028 * height_m;
        limbs.push(Limb { from_m: shoulder, to_m: elbow, radius_m: upper_m, material: cloth });
        limbs.push(Limb { from_m: elbow, to_m: hand, radius_m: 0.022 * height_m, material: cloth });
        limbs.push(Limb { from_m: hand, to_m: hand, radius_m: 0.03 * height_m, material: skin });
    }

    /// Two upright capsules beside each other make a trunk that is wider than deep.
    fn add_trunk(&self, limbs: &mut Vec<Limb>, hip_z_m: f64) {
        let height_m = self.height_m;
        let radius_m = 0.066 * height_m;
        let shoulders_z_m = hip_z_m + share::TRUNK * height_m;
        for side in [1.0, -1.0] {
            let y_m = side * share::HALF_HIPS * height_m;
            limbs.push(Limb {
                from_m: Point3::new(0.0, y_m, hip_z_m),
                to_m: Point3::new(0.0, y_m, shoulders_z_m - radius_m / 2.0),
                radius_m,
                material: self.clothes,
            });
        }
        let head =
            Point3::new(0.0, 0.0, shoulders_z_m + share::HEAD_CENTRE_ABOVE_SHOULDERS * height_m);
        let neck = Point3::new(0.0, 0.0, shoulders_z_m);
        let skin = self.skin;
        limbs.push(Limb { from_m: neck, to_m: head, radius_m: 0.035 * height_m, material: skin });
        limbs.push(Limb { from_m: head, to_m: head, radius_m: 0.062 * height_m, material: skin });
    }
}

/// The direction of a limb that hangs from a joint, swung forward by an angle.
fn pendulum(swing_rad: f64) -> Vector3<f64> {
    Vector3::new(swing_rad.sin(), 0.0, -swing_rad.cos())
}

impl Limb {
    fn solid(&self, id: u16, pattern_seed: u32, room_from_object: &Isometry3<f64>) -> Solid {
        let along = self.to_m - self.from_m;
        // A capsule has no up and down: the upward half of directions is never opposite to z.
        let up = if along.z < 0.0 { -along } else { along };
        let rotation = UnitQuaternion::rotation_between(&Vector3::z(), &up).unwrap_or_default();
        let middle = nalgebra::center(&self.from_m, &self.to_m);
        let shape = Shape::Capsule { radius_m: self.radius_m, length_m: along.norm() };
        let object_from_limb = Isometry3::from_parts(middle.into(), rotation);
        let room_from_limb = room_from_object * object_from_limb;
        Solid::new(shape, &room_from_limb, &self.material, id, pattern_seed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_standing_person_is_as_tall_as_stated_and_stands_on_the_floor() {
        let walker = Walker::default();
        let limbs = walker.limbs(1.0, 0.0);
        let ends = || limbs.iter().flat_map(|l| [(l.from_m, l.radius_m), (l.to_m, l.radius_m)]);
        let top_m = ends().map(|(point, radius_m)| point.z + radius_m).fold(0.0, f64::max);
        let bottom_m = ends().map(|(point, radius_m)| point.z - radius_m).fold(9.0, f64::min);
        assert!((top_m - 1.75).abs() < 0.03, "top {top_m}");
        assert!(bottom_m.abs() < 0.01, "bottom {bottom_m}");
    }

    #[test]
    fn legs_swing_apart_by_half_a_stride_and_one_foot_stays_on_the_floor() {
        let walker = Walker::default();
        let mut widest_m: f64 = 0.0;
        for step in 0..100 {
            let limbs = walker.limbs(TAU * f64::from(step) / 100.0, 1.0);
            // Of each leg and arm in turn: thigh, shin, foot, upper arm, forearm, hand.
            let (left, right) = (&limbs[1], &limbs[7]);
            widest_m = widest_m.max((left.to_m.x - right.to_m.x).abs());
            let lowest_m = [left, right].map(|shin| shin.to_m.z).into_iter().fold(9.0, f64::min);
            assert!((lowest_m - share::ANKLE * 1.75).abs() < 1e-9, "ankle at {lowest_m}");
            // Left and right are opposite in phase.
            assert!(limbs[0].to_m.x * limbs[6].to_m.x <= 1e-12);
        }
        assert!((widest_m - 0.7).abs() < 0.1, "the feet get {widest_m} m apart");
    }
}
