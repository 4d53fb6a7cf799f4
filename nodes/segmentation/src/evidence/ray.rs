//! The voxels that a ray goes through (Amanatides and Woo, "A Fast Voxel Traversal Algorithm for Ray
//! Tracing", 1987).

use nalgebra::Vector3;

/// Calls `visit` with each voxel, its edge the unit, that the ray from `from` along the unit vector
/// `direction` enters before `end`, and to whose middle it comes nearer than `radius`; from the start on.
pub(super) fn walk(
    from: Vector3<f64>,
    direction: Vector3<f64>,
    end: f64,
    radius: f64,
    mut visit: impl FnMut([i64; 3]),
) {
    let mut voxel: [i64; 3] = from.map(|value| value.floor() as i64).into();
    // Along each axis: which way, how far the ray goes for one voxel, and where it next crosses over.
    let mut step = [0_i64; 3];
    let mut per_voxel = [f64::INFINITY; 3];
    let mut next = [f64::INFINITY; 3];
    for axis in 0..3 {
        let (start, slope) = (from[axis], direction[axis]);
        if slope != 0.0 {
            step[axis] = if slope > 0.0 { 1 } else { -1 };
            per_voxel[axis] = 1.0 / slope.abs();
            let border = start.floor() + if slope > 0.0 { 1.0 } else { 0.0 };
            next[axis] = (border - start) / slope;
        }
    }
    let mut entered = 0.0;
    while entered < end {
        let middle = Vector3::from(voxel.map(|cell| cell as f64 + 0.5)) - from;
        let along = middle.dot(&direction);
        // A middle behind the start or beyond the end was not passed.
        if along > 0.0 && along < end && middle.norm_squared() - along * along <= radius * radius {
            visit(voxel);
        }
        let axis = if next[0] <= next[1] && next[0] <= next[2] {
            0
        } else if next[1] <= next[2] {
            1
        } else {
            2
        };
        entered = next[axis];
        next[axis] += per_voxel[axis];
        voxel[axis] += step[axis];
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn voxels_of(from: [f64; 3], to: [f64; 3], radius: f64) -> Vec<[i64; 3]> {
        let (from, to) = (Vector3::from(from), Vector3::from(to));
        let length = (to - from).norm();
        let mut voxels = Vec::new();
        walk(from, (to - from) / length, length, radius, |voxel| voxels.push(voxel));
        voxels
    }

    #[test]
    fn a_ray_along_an_axis_goes_through_the_middles() {
        let voxels = voxels_of([0.5, 0.5, -0.5], [4.0, 0.5, -0.5], 0.5);
        assert_eq!(voxels, [[1, 0, -1], [2, 0, -1], [3, 0, -1]]);
        assert_eq!(voxels_of([0.5, 0.95, 0.95], [4.0, 0.95, 0.95], 0.5), [[0; 3]; 0]);
    }

    proptest! {
        /// Sampling finds no voxel that the walk left out, and the walk none that lies off the ray.
        #[test]
        fn the_walk_finds_what_sampling_finds(
            from in prop::array::uniform3(-6.0..6.0_f64),
            to in prop::array::uniform3(-6.0..6.0_f64),
        ) {
            let (start, span) = (Vector3::from(from), Vector3::from(to) - Vector3::from(from));
            prop_assume!(span.norm() > 0.1);
            let walked = voxels_of(from, to, 10.0);
            for sample in 0..500 {
                let along = f64::from(sample) / 500.0;
                let voxel: [i64; 3] = (start + span * along).map(|value| value.floor() as i64).into();
                let middle = Vector3::from(voxel.map(|cell| cell as f64 + 0.5)) - start;
                let share = middle.dot(&span) / span.norm_squared();
                if share > 1e-6 && share < 1.0 - 1e-6 {
                    prop_assert!(walked.contains(&voxel), "{voxel:?} is missing");
                }
            }
            for voxel in walked {
                let middle = Vector3::from(voxel.map(|cell| cell as f64 + 0.5)) - start;
                let off = middle - span * (middle.dot(&span) / span.norm_squared());
                prop_assert!(off.norm() <= 0.75_f64.sqrt() + 1e-9);
            }
        }
    }
}
