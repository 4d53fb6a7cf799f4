//! The second stage: the group of points nearest to the sensors (Rec-HV 3.2.6, 3.3.3.1).

/// A contiguous group of occupied cells of the depth histogram.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DepthGroup {
    /// The least depth of its points.
    pub min_x_m: f32,
    /// The largest depth of its points: the thesis' x_max where the group is the object.
    pub max_x_m: f32,
    /// The mean depth of its points.
    pub centroid_x_m: f32,
    /// How many points it has.
    pub points: usize,
}

/// The groups of a zone's points along the depth axis x, near to far.
///
/// The depths are laid into cells of `cell_m` whose bounds are multiples of it; cells side by side that
/// hold a point make one group (figure 21 of the thesis). The depths need no order. Depths that are
/// not finite are left out.
#[must_use]
pub fn depth_groups(depths_x_m: impl IntoIterator<Item = f32>, cell_m: f64) -> Vec<DepthGroup> {
    let mut sorted_m: Vec<f32> = depths_x_m.into_iter().filter(|x_m| x_m.is_finite()).collect();
    sorted_m.sort_unstable_by(f32::total_cmp);
    let cell = |x_m: f32| (f64::from(x_m) / cell_m).floor();
    sorted_m
        // Not of one cell and not of neighbouring ones: an empty cell is between.
        .chunk_by(|near_m, far_m| cell(*far_m) - cell(*near_m) <= 1.0)
        .filter_map(|group_m| {
            let (min_x_m, max_x_m) = (*group_m.first()?, *group_m.last()?);
            let sum_m: f64 = group_m.iter().copied().map(f64::from).sum();
            let centroid_x_m = (sum_m / group_m.len() as f64) as f32;
            Some(DepthGroup { min_x_m, max_x_m, centroid_x_m, points: group_m.len() })
        })
        .collect()
}

/// The group whose centroid is nearest to the sensors: the object. `None` without a group.
///
/// The distance is taken along x, the axis of the histogram. Of two equally near ones, one before and
/// one behind the sensors, it is the one behind that comes first.
#[must_use]
pub fn nearest_group(groups: &[DepthGroup]) -> Option<&DepthGroup> {
    groups.iter().min_by(|a, b| a.centroid_x_m.abs().total_cmp(&b.centroid_x_m.abs()))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A quarter of a metre is exact in binary, so that depths on the bound of a cell are no accident.
    const CELL_M: f64 = 0.25;

    fn extents(groups: &[DepthGroup]) -> Vec<(f32, f32, usize)> {
        groups.iter().map(|group| (group.min_x_m, group.max_x_m, group.points)).collect()
    }

    #[test]
    fn an_empty_cell_parts_two_groups() {
        // Cells 4, 4, 5 | 7.
        let groups = depth_groups([1.0, 1.4, 1.2, 1.75], CELL_M);
        assert_eq!(extents(&groups), [(1.0, 1.4, 3), (1.75, 1.75, 1)]);
        assert!((groups[0].centroid_x_m - 1.2).abs() < 1e-6);
    }

    #[test]
    fn neighbouring_cells_are_one_group_however_far_their_points() {
        // 1.01 lies at the near end of cell 4 and 1.49 at the far end of cell 5: nearly two cells apart.
        assert_eq!(depth_groups([1.01, 1.49], CELL_M).len(), 1);
        // 1.24 and 1.51 are nearer than that, but cell 5 between them is empty.
        assert_eq!(depth_groups([1.24, 1.51], CELL_M).len(), 2);
    }

    #[test]
    fn the_object_is_the_group_whose_centroid_is_nearest() {
        let groups = depth_groups([4.0, 4.1, 2.0, 2.1, 2.2, 6.0], CELL_M);
        let object = nearest_group(&groups).unwrap();
        assert_eq!((object.min_x_m, object.max_x_m, object.points), (2.0, 2.2, 3));
        assert_eq!(nearest_group(&[]), None);
    }

    #[test]
    fn depths_without_a_number_are_left_out() {
        let groups = depth_groups([f32::NAN, 1.0, f32::INFINITY, f32::NEG_INFINITY], CELL_M);
        assert_eq!(extents(&groups), [(1.0, 1.0, 1)]);
    }

    #[test]
    fn a_cell_count_beyond_every_integer_does_no_harm() {
        let groups = depth_groups([f32::MIN, 0.0, f32::MAX], 1e-12);
        assert_eq!(groups.len(), 3);
    }

    proptest! {
        #[test]
        fn groups_are_apart_in_order_and_hold_every_depth(
            depths_m in prop::collection::vec(-5.0f32..10.0, 0..200),
        ) {
            let groups = depth_groups(depths_m.iter().copied(), CELL_M);
            prop_assert_eq!(groups.iter().map(|group| group.points).sum::<usize>(), depths_m.len());
            for pair in groups.windows(2) {
                let gap_m = f64::from(pair[1].min_x_m - pair[0].max_x_m);
                prop_assert!(gap_m > CELL_M, "{}", gap_m);
            }
            for group in &groups {
                prop_assert!(group.min_x_m <= group.centroid_x_m + 1e-5);
                prop_assert!(group.centroid_x_m <= group.max_x_m + 1e-5);
            }
        }
    }
}
