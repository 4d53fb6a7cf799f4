//! The figures of a merge, as text and as JSON.

use std::fmt;

use map_merge::{Agreement, Group, Merge, SavedMap};
use nalgebra::Isometry3;
use serde::Serialize;

/// Groups of each kind that the text lists, the largest first.
const LISTED: usize = 10;

/// The figures of a merge.
#[derive(Serialize, Debug)]
pub(super) struct Report {
    points: usize,
    second_in_first: Pose,
    /// The root of the mean squared distance between surfaces that lie upon each other.
    residual_m: f64,
    agreement: Share,
    /// Of the next best place, if there is one that is another.
    next_best: Option<Share>,
    gone: Vec<Part>,
    added: Vec<Part>,
    only_in_first: Vec<Part>,
    only_in_second: Vec<Part>,
}

#[derive(Serialize, Debug)]
struct Pose {
    x_m: f64,
    y_m: f64,
    z_m: f64,
    roll_rad: f64,
    pitch_rad: f64,
    yaw_rad: f64,
}

#[derive(Serialize, Debug)]
struct Share {
    /// Of the upright surfaces of the smaller map, those that the other says something of.
    overlap: f64,
    /// Of these, what is the same.
    same: f64,
    same_m2: f64,
    contradicting_m2: f64,
}

#[derive(Serialize, Debug)]
struct Part {
    points: usize,
    surface_m2: f64,
    /// In the frame of the first map.
    middle_m: [f64; 3],
    extent_m: [f64; 3],
}

impl Report {
    pub(super) fn of(merge: &Merge, first: &SavedMap, second: &SavedMap) -> Self {
        let parts = |groups: &[Group], map: &SavedMap| {
            let mut parts: Vec<Part> =
                groups.iter().map(|group| Part::of(group, map.edge_m)).collect();
            parts.sort_by_key(|part| std::cmp::Reverse(part.points));
            parts
        };
        let (alignment, changes) = (&merge.alignment, &merge.changes);
        Self {
            points: merge.merged.points.points_m.len(),
            second_in_first: Pose::of(&alignment.a_from_b),
            residual_m: alignment.residual_m,
            agreement: Share::of(&alignment.agreement),
            next_best: alignment.next.map(|next| Share::of(&next.agreement)),
            gone: parts(&changes.gone, first),
            added: parts(&changes.added, second),
            only_in_first: parts(&changes.only_in_a, first),
            only_in_second: parts(&changes.only_in_b, second),
        }
    }
}

impl Pose {
    fn of(pose: &Isometry3<f64>) -> Self {
        let [x_m, y_m, z_m] = pose.translation.vector.into();
        let (roll_rad, pitch_rad, yaw_rad) = pose.rotation.euler_angles();
        Self { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad }
    }
}

impl Share {
    fn of(agreement: &Agreement) -> Self {
        let Agreement { same_m2, contradicting_m2, overlap, .. } = *agreement;
        Self { overlap, same: agreement.share(), same_m2, contradicting_m2 }
    }
}

impl Part {
    fn of(group: &Group, edge_m: f64) -> Self {
        Self {
            points: group.points.len(),
            surface_m2: group.points.len() as f64 * edge_m * edge_m,
            middle_m: group.middle_m().into(),
            extent_m: group.extent_m().into(),
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad } = self.second_in_first;
        let [roll, pitch, yaw] = [roll_rad, pitch_rad, yaw_rad].map(f64::to_degrees);
        let Share { overlap, same, same_m2, contradicting_m2 } = self.agreement;
        writeln!(f, "{} points", self.points)?;
        writeln!(
            f,
            "the second map in the first: x {x_m:.3} y {y_m:.3} z {z_m:.3} m, roll {roll:.2} pitch {pitch:.2} yaw {yaw:.2} degrees"
        )?;
        write!(
            f,
            "overlap {:.0} % of the smaller map's upright surfaces; of these {:.1} % are the same ({same_m2:.1} m2), {contradicting_m2:.1} m2 contradict",
            100.0 * overlap,
            100.0 * same
        )?;
        for (what, parts) in [
            ("gone", &self.gone),
            ("added", &self.added),
            ("only in the first map, whether gone is not known", &self.only_in_first),
            ("only in the second map, whether new is not known", &self.only_in_second),
        ] {
            write_parts(f, what, parts)?;
        }
        Ok(())
    }
}

fn write_parts(f: &mut fmt::Formatter<'_>, what: &str, parts: &[Part]) -> fmt::Result {
    if parts.is_empty() {
        return Ok(());
    }
    let surface_m2: f64 = parts.iter().map(|part| part.surface_m2).sum();
    write!(f, "\n{what}: {} groups, {surface_m2:.1} m2", parts.len())?;
    for Part { surface_m2, middle_m: [x, y, z], extent_m: [dx, dy, dz], .. } in
        parts.iter().take(LISTED)
    {
        write!(
            f,
            "\n  {dx:.2} x {dy:.2} x {dz:.2} m at ({x:.2}, {y:.2}, {z:.2}), {surface_m2:.2} m2"
        )?;
    }
    if parts.len() > LISTED {
        write!(f, "\n  and {} smaller ones", parts.len() - LISTED)?;
    }
    Ok(())
}
