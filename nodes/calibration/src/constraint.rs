//! The distance of a return from the surface that the camera sees, and how it changes with the scanner's pose.

#[cfg(test)]
mod tests;

use geometry::DepthImage;
use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};

use crate::calibrate::RigMounts;
use crate::config::CalibrationConfig;
use crate::optics::{DepthOptics, EdgeSought, ImageNoise, Patch, Surface, edge_at};
use crate::returns::LidarReturn;

/// The variance of a beam's azimuth in squares of its step: it was measured anywhere within (uniformly).
const AZIMUTH_VARIANCE_STEPS: f64 = 1.0 / 12.0;
/// The same of an edge between two beams, each of which was measured anywhere within its step.
const EDGE_VARIANCE_STEPS: f64 = 1.0 / 6.0;
/// Neighbours are on the same surface when their distances from it differ by no more than this many standard deviations.
const NEIGHBOUR_STD_DEVS: f64 = 5.0;
/// Beside an edge, the near surface continues evenly for one more beam: the range changes by no more than this share of the
/// jump. Of a curve, it would depend on where a beam happens to lie whether the edge is seen.
const EVEN_SHARE: f64 = 0.3;
/// ... and by no more than this: a wall at 45 degrees 4 m away, and the noise of two ranges.
const EVEN_M: f64 = 0.12;
/// The range rises at an edge by this many standard deviations at least.
const EDGE_STD_DEVS: f64 = 6.0;

/// The surface that a return must be on.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Kind {
    /// The plane of the pixels around it.
    Plane,
    /// The edge of a near surface, beyond which the next beam is longer.
    Edge,
}

/// A return, and the surface that it must lie on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Constraint {
    /// The beam.
    pub beam: usize,
    /// The kind of surface.
    pub kind: Kind,
    /// See [`LidarReturn::step_rad`].
    pub step_rad: f64,
    /// The return in the scanner's frame.
    pub point_in_lidar_m: Point3<f64>,
    /// See [`LidarReturn::image_rig_from_rig`].
    pub image_rig_from_rig: Isometry3<f64>,
    /// The surface, in the camera frame.
    pub surface: Surface,
    /// Standard deviation of the distance, of both sensors.
    pub std_dev_m: f64,
}

/// A distance and its derivative by a correction of the scanner's pose.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Linearised {
    /// The distance of the return from the surface.
    pub distance_m: f64,
    /// Its derivative by the six numbers of a correction (see the crate's page).
    pub jacobian: Vector6<f64>,
    /// From the scanner to the return, along the rig's axes.
    pub lever_m: Vector3<f64>,
    /// The surface's normal along the rig's axes at the moment of the beam.
    pub normal: Vector3<f64>,
}

impl Constraint {
    /// The distance of the return from the surface with the scanner at `mounts.rig_from_lidar`, linearised there.
    ///
    /// With the normal `n` and the lever `a` the distance changes by `n . shift` and `n . (turn x a) = turn . (a x n)`.
    #[must_use]
    pub fn linearised(&self, mounts: &RigMounts) -> Linearised {
        let lever_m = mounts.rig_from_lidar.rotation * self.point_in_lidar_m.coords;
        let point_in_camera = self.point_in_camera_m(mounts);
        let normal = self.image_rig_from_rig.rotation.inverse()
            * (mounts.rig_from_camera.rotation * self.surface.normal);
        let by_turn = lever_m.cross(&normal);
        Linearised {
            distance_m: self.surface.distance_m(&point_in_camera),
            jacobian: Vector6::new(normal.x, normal.y, normal.z, by_turn.x, by_turn.y, by_turn.z),
            lever_m,
            normal,
        }
    }

    fn point_in_camera_m(&self, mounts: &RigMounts) -> Point3<f64> {
        mounts.camera_from_lidar(&self.image_rig_from_rig) * self.point_in_lidar_m
    }
}

impl Linearised {
    /// The matrix of a correction's effect: the squared displacement of this return is `correction . matrix correction`.
    #[must_use]
    pub fn displacement_matrix(&self) -> Matrix6<f64> {
        // The displacement is shift + rotation x lever.
        let cross = self.lever_m.cross_matrix();
        let mut matrix = Matrix6::identity();
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&cross);
        matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&cross.transpose());
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&(cross * cross.transpose()));
        matrix
    }
}

/// The constraints of the returns of a cycle by the depth image; in the order of the beams, planes first.
///
/// `is_static` marks the returns of static surfaces; the others are left out.
#[must_use]
pub fn constraints_of(
    returns: &[LidarReturn],
    is_static: impl Fn(usize) -> bool,
    image: &DepthImage,
    optics: DepthOptics<'_>,
    mounts: &RigMounts,
    config: &CalibrationConfig,
) -> Vec<Constraint> {
    let planes = planes_of(returns, &is_static, image, optics, mounts, config).constraints;
    let on_planes = planes
        .into_iter()
        .filter(|one| one.linearised(mounts).distance_m.abs() <= config.max_offset_m);
    let on_edges = returns
        .windows(4)
        .enumerate()
        .filter(|(index, _)| (*index..index + 4).all(&is_static))
        .filter_map(|(_, four)| match four {
            [before, one, next, after] if is_even_step([before, one, next, after]) => {
                on_edge(one, next, image, optics, mounts, config)
            }
            _ => None,
        });
    on_planes.chain(on_edges).collect()
}

/// The planes of a cycle.
pub(crate) struct Planes {
    /// Of the returns, however far they lie from them.
    pub(crate) constraints: Vec<Constraint>,
    /// Returns where the pixels scatter too much for a plane.
    pub(crate) noisy: usize,
}

/// The planes that the image shows where the returns are.
pub(crate) fn planes_of(
    returns: &[LidarReturn],
    is_static: impl Fn(usize) -> bool,
    image: &DepthImage,
    optics: DepthOptics<'_>,
    mounts: &RigMounts,
    config: &CalibrationConfig,
) -> Planes {
    let (threes, patches): (Vec<[&LidarReturn; 3]>, Vec<Patch>) = returns
        .windows(3)
        .enumerate()
        .filter(|(index, _)| is_static(index + 1))
        .filter_map(|(_, three)| match three {
            [before, one, after] if are_neighbours([before, one, after]) => {
                let point_in_camera_m =
                    mounts.camera_from_lidar(&one.image_rig_from_rig) * one.point_in_lidar_m();
                // Half of the sphere lies behind the camera.
                let is_ahead = point_in_camera_m.z > 0.0;
                let patch = is_ahead
                    .then(|| Patch::around(&point_in_camera_m, image, optics, config))
                    .flatten()?;
                Some(([before, one, after], patch))
            }
            _ => None,
        })
        .unzip();
    let noise = ImageNoise::of(&patches);
    Planes {
        noisy: patches.iter().filter(|patch| patch.is_noisy(noise, config)).count(),
        constraints: threes
            .into_iter()
            .zip(&patches)
            .filter_map(|(three, patch)| on_plane(three, (patch, noise), mounts, config))
            .collect(),
    }
}

fn are_neighbours([before, one, after]: [&LidarReturn; 3]) -> bool {
    let follow =
        |one: &LidarReturn, other: &LidarReturn| other.beam.checked_sub(1) == Some(one.beam);
    follow(before, one) && follow(one, after)
}

/// The plane around a return whose neighbours are on it too. Next to an edge a beam hits the surface only when it points
/// inwards of its own azimuth, which on a slanting surface is a shorter or a longer range.
fn on_plane(
    [before, one, after]: [&LidarReturn; 3],
    (patch, noise): (&Patch, ImageNoise),
    mounts: &RigMounts,
    config: &CalibrationConfig,
) -> Option<Constraint> {
    let camera_from_lidar = mounts.camera_from_lidar(&one.image_rig_from_rig);
    let point_in_lidar_m = one.point_in_lidar_m();
    let point_in_camera = camera_from_lidar * point_in_lidar_m;
    let surface = patch.surface(&point_in_camera, noise, config)?;
    let along = camera_from_lidar.rotation * one.direction_in_lidar();
    let aside = camera_from_lidar.rotation
        * Vector3::new(-one.azimuth_rad.sin(), one.azimuth_rad.cos(), 0.0);
    let squareness = surface.normal.dot(&along);
    if squareness.abs() < config.max_incidence_rad.cos() {
        return None;
    }
    let range_m = config.range_std_dev_m(one.range_m) * squareness;
    let azimuth_m =
        AZIMUTH_VARIANCE_STEPS.sqrt() * one.step_rad * one.range_m * surface.normal.dot(&aside);
    let std_dev_m = range_m.hypot(azimuth_m).hypot(surface.std_dev_m);
    let own_m = surface.distance_m(&point_in_camera);
    let is_on_it = |neighbour: &LidarReturn| {
        let distance_m = surface.distance_m(&(camera_from_lidar * neighbour.point_in_lidar_m()));
        (distance_m - own_m).abs() <= NEIGHBOUR_STD_DEVS * std_dev_m
    };
    if !is_on_it(before) || !is_on_it(after) {
        return None;
    }
    Some(Constraint {
        beam: one.beam,
        kind: Kind::Plane,
        step_rad: one.step_rad,
        point_in_lidar_m,
        image_rig_from_rig: one.image_rig_from_rig,
        surface,
        std_dev_m,
    })
}

/// Whether the second and the third of four returns are of neighbours, and so is the next on the near side, at about
/// the same range.
fn is_even_step([before, one, next, after]: [&LidarReturn; 4]) -> bool {
    let jump_m = (next.range_m - one.range_m).abs();
    let is_even = |a: &LidarReturn, b: &LidarReturn| {
        b.beam == a.beam + 1 && (b.range_m - a.range_m).abs() <= EVEN_M.min(EVEN_SHARE * jump_m)
    };
    let near_is_even =
        if one.range_m <= next.range_m { is_even(before, one) } else { is_even(next, after) };
    next.beam == one.beam + 1 && near_is_even
}

/// The edge between two beams, if one reaches far beyond the surface that the other hits.
fn on_edge(
    one: &LidarReturn,
    next: &LidarReturn,
    image: &DepthImage,
    optics: DepthOptics<'_>,
    mounts: &RigMounts,
    config: &CalibrationConfig,
) -> Option<Constraint> {
    let (near, far) = if one.range_m <= next.range_m { (one, next) } else { (next, one) };
    let jump_m = far.range_m - near.range_m;
    let least_m = config.min_edge_jump_m.max(EDGE_STD_DEVS * config.range_std_dev_m(far.range_m));
    if jump_m < least_m {
        return None;
    }
    let camera_from_lidar = mounts.camera_from_lidar(&near.image_rig_from_rig);
    let at = |azimuth_rad: f64| LidarReturn { azimuth_rad, ..*near }.point_in_lidar_m();
    let point_in_lidar_m = at(f64::midpoint(near.azimuth_rad, far.azimuth_rad));
    let point_in_camera_m = camera_from_lidar * point_in_lidar_m;
    let (near_side, far_side) =
        (camera_from_lidar * at(near.azimuth_rad), camera_from_lidar * at(far.azimuth_rad));
    if point_in_camera_m.z <= 0.0 || near_side.z <= 0.0 || far_side.z <= 0.0 {
        return None;
    }
    let near_is_right = near_side.x / near_side.z > far_side.x / far_side.z;
    let sought = EdgeSought { point_in_camera_m, near_is_right, jump_m };
    let surface = edge_at(&sought, image, optics, config)?;
    let between_m = EDGE_VARIANCE_STEPS.sqrt() * near.step_rad * near.range_m;
    Some(Constraint {
        beam: one.beam,
        kind: Kind::Edge,
        step_rad: near.step_rad,
        point_in_lidar_m,
        image_rig_from_rig: near.image_rig_from_rig,
        std_dev_m: between_m.hypot(surface.std_dev_m),
        surface,
    })
}
