//! The directions that can show that something has gone: blank now, and something came from them once. Where there are
//! none, as in a room all of whose walls are seen, nothing is looked up.

use std::ops::Range;

use geometry::{DepthByDirection, View};
use nalgebra::{Vector2, Vector3};

/// Counts of the directions' squares, as sums over all squares to the right of and below each one.
#[derive(Clone, Debug)]
pub(super) struct OpenDirections {
    /// Row by row from the lower right, with a row and a column of zeros first.
    sums: Vec<u32>,
}

impl OpenDirections {
    /// Those in which this cycle met nothing, and an earlier one something, within the borders of all that was met.
    pub(super) fn of(nearest: &DepthByDirection, farthest: &DepthByDirection, view: &View) -> Self {
        let side = DepthByDirection::SQUARES;
        let middle = |square: usize| {
            (square as f64 + 0.5) * DepthByDirection::SQUARE_SLOPE - DepthByDirection::WIDEST_SLOPE
        };
        let [columns, rows] = [0, 1].map(|axis| {
            DepthByDirection::square_of(view.least[axis])
                ..=DepthByDirection::square_of(view.most[axis])
        });
        let mut sums = vec![0; (side + 1) * (side + 1)];
        for row in 0..side {
            let mut in_row = 0;
            for column in 0..side {
                let slopes = Vector2::new(middle(column), middle(row));
                let is_open = columns.contains(&column)
                    && rows.contains(&row)
                    && farthest.depth_m(&slopes).is_some()
                    && nearest.depth_m(&slopes).is_none();
                in_row += u32::from(is_open);
                sums[(row + 1) * (side + 1) + column + 1] =
                    sums[row * (side + 1) + column + 1] + in_row;
            }
        }
        Self { sums }
    }

    /// Whether a ball, `from_camera_m` away from the camera in the rig frame, may have a part in one of them at these
    /// depths, which are positive.
    pub(super) fn may_show(
        &self,
        from_camera_m: &Vector3<f64>,
        radius_m: f64,
        depths_m: Range<f64>,
    ) -> bool {
        let near_m = (from_camera_m.x - radius_m).max(depths_m.start);
        let far_m = (from_camera_m.x + radius_m).min(depths_m.end);
        if far_m < near_m {
            return false;
        }
        let [columns, rows] = [from_camera_m.y, from_camera_m.z].map(|aside_m| {
            let (least_m, most_m) = (aside_m - radius_m, aside_m + radius_m);
            let least = least_m / if least_m < 0.0 { near_m } else { far_m };
            let most = most_m / if most_m > 0.0 { near_m } else { far_m };
            DepthByDirection::square_of(least)..DepthByDirection::square_of(most) + 1
        });
        let side = DepthByDirection::SQUARES + 1;
        let sum = |row: usize, column: usize| {
            self.sums.get(row * side + column).copied().unwrap_or_default()
        };
        let up_to_left = sum(rows.end, columns.end).saturating_sub(sum(rows.start, columns.end));
        let up_to_right =
            sum(rows.end, columns.start).saturating_sub(sum(rows.start, columns.start));
        up_to_left > up_to_right
    }

    /// Whether there is none.
    pub(super) fn is_empty(&self) -> bool {
        self.sums.last().is_none_or(|all| *all == 0)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// What is passed over has no point in an open direction.
        #[test]
        fn no_point_in_an_open_direction_is_passed_over(
            open in prop::collection::vec((-1.8..1.8_f64, -1.8..1.8_f64), 0..4),
            middle in (-1.0..6.0_f64, -8.0..8.0_f64, -8.0..8.0_f64),
            radius_m in 0.01..1.5_f64,
            within in (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64),
        ) {
            let (nearest, mut farthest) = (DepthByDirection::default(), DepthByDirection::default());
            let mut view = View::default();
            for (y, z) in open {
                view.widen(&Vector2::new(y, z));
                farthest.keep_farthest(&Vector2::new(y, z), &Vector2::zeros(), 3.0);
            }
            let directions = OpenDirections::of(&nearest, &farthest, &view);
            let middle_m = Vector3::new(middle.0, middle.1, middle.2);
            let offset = Vector3::new(within.0, within.1, within.2);
            let point_m = middle_m + offset * radius_m / offset.norm().max(1.0);
            let is_open = (0.8..5.0).contains(&point_m.x)
                && geometry::slopes_from(&Point3::origin(), &point_m.into())
                    .is_some_and(|slopes| farthest.depth_m(&slopes).is_some());
            prop_assert!(!is_open || directions.may_show(&middle_m, radius_m, 0.8..5.0));
        }
    }

    #[test]
    fn what_is_seen_or_was_never_met_is_not_open() {
        let (mut nearest, mut farthest) =
            (DepthByDirection::default(), DepthByDirection::default());
        let mut view = View::default();
        view.widen(&Vector2::repeat(-0.5));
        view.widen(&Vector2::repeat(0.8));
        let of = |nearest: &DepthByDirection, farthest: &DepthByDirection| {
            OpenDirections::of(nearest, farthest, &view)
        };
        assert!(of(&nearest, &farthest).is_empty());
        let (ahead, aside) = (Vector2::new(0.01, 0.01), Vector2::new(0.7, 0.01));
        farthest.keep_farthest(&ahead, &Vector2::zeros(), 3.0);
        let open = of(&nearest, &farthest);
        assert!(!open.is_empty());
        assert!(open.may_show(&Vector3::new(2.0, 0.0, 0.0), 0.1, 0.8..5.0));
        assert!(
            !open.may_show(&Vector3::new(2.0, 1.0, 0.0), 0.1, 0.8..5.0),
            "in another direction"
        );
        assert!(!open.may_show(&Vector3::new(0.5, 0.0, 0.0), 0.1, 0.8..5.0), "too near");
        assert!(!open.may_show(&Vector3::new(5.2, 0.0, 0.0), 0.1, 0.8..5.0), "too far");
        nearest.keep_nearest(&ahead, &Vector2::zeros(), 2.0);
        assert!(of(&nearest, &farthest).is_empty());
        nearest.keep_nearest(&aside, &Vector2::zeros(), 2.0);
        assert!(of(&nearest, &farthest).is_empty());
    }
}
