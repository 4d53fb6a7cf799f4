//! The status of the features of a frame.

use super::FeatureStatus;
use crate::frame::{Frame, LeftOut};
use crate::local_map::{Associations, Verdicts};

/// The status of the features of the whole frame, by that of those that were not left out.
pub(super) fn statuses(
    frame: &Frame,
    left_out: &LeftOut,
    seen: Option<(&Associations, Verdicts<'_>, &LeftOut)>,
) -> (Vec<FeatureStatus>, Vec<FeatureStatus>) {
    let (mut corners, mut lines) = (
        vec![FeatureStatus::New; frame.corners.len()],
        vec![FeatureStatus::New; frame.lines.len()],
    );
    if let Some((associations, verdicts, otherwise)) = seen {
        let status =
            |is_inlier| if is_inlier { FeatureStatus::Inlier } else { FeatureStatus::Outlier };
        let mark = |statuses: &mut Vec<FeatureStatus>, index: usize, status: FeatureStatus| {
            if let Some(place) = statuses.get_mut(index) {
                *place = status;
            }
        };
        for (pair, verdict) in associations.points.iter().zip(verdicts.points) {
            mark(&mut corners, pair.feature, status(verdict.is_inlier()));
        }
        for (pair, verdict) in associations.lines.iter().zip(verdicts.lines) {
            mark(&mut lines, pair.feature, status(verdict.is_inlier()));
        }
        for (index, status) in
            corners.iter_mut().enumerate().filter(|(_, status)| **status != FeatureStatus::Inlier)
        {
            if otherwise.has_corner(index) {
                *status = FeatureStatus::LeftOut;
            }
        }
        for (index, status) in
            lines.iter_mut().enumerate().filter(|(_, status)| **status != FeatureStatus::Inlier)
        {
            if otherwise.has_line(index) {
                *status = FeatureStatus::LeftOut;
            }
        }
    }
    let spread = |statuses: Vec<FeatureStatus>, is_out: &dyn Fn(usize) -> bool| {
        let all = statuses.len();
        let mut statuses = statuses.into_iter();
        let status = |index: usize| {
            if is_out(index) { FeatureStatus::LeftOut } else { statuses.next().unwrap_or_default() }
        };
        (0..all).map(status).collect::<Vec<FeatureStatus>>()
    };
    (
        spread(corners, &|index| left_out.has_corner(index)),
        spread(lines, &|index| left_out.has_line(index)),
    )
}
