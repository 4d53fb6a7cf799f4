//! What became of the features of a frame.

use super::Fate;
use crate::frame::{Frame, LeftOut};
use crate::local_map::{Associations, Verdicts};

/// What became of the features of the whole frame, by what became of those that were not left out.
pub(super) fn fates(
    frame: &Frame,
    left_out: &LeftOut,
    seen: Option<(&Associations, Verdicts<'_>, &LeftOut)>,
) -> (Vec<Fate>, Vec<Fate>) {
    let (mut corners, mut lines) =
        (vec![Fate::New; frame.corners.len()], vec![Fate::New; frame.lines.len()]);
    if let Some((associations, verdicts, otherwise)) = seen {
        let fate = |is_inlier| if is_inlier { Fate::Inlier } else { Fate::Outlier };
        let mark = |fates: &mut Vec<Fate>, index: usize, fate: Fate| {
            if let Some(place) = fates.get_mut(index) {
                *place = fate;
            }
        };
        for (pair, verdict) in associations.points.iter().zip(verdicts.points) {
            mark(&mut corners, pair.feature, fate(verdict.is_inlier()));
        }
        for (pair, verdict) in associations.lines.iter().zip(verdicts.lines) {
            mark(&mut lines, pair.feature, fate(verdict.is_inlier()));
        }
        for (index, fate) in
            corners.iter_mut().enumerate().filter(|(_, fate)| **fate != Fate::Inlier)
        {
            if otherwise.has_corner(index) {
                *fate = Fate::LeftOut;
            }
        }
        for (index, fate) in lines.iter_mut().enumerate().filter(|(_, fate)| **fate != Fate::Inlier)
        {
            if otherwise.has_line(index) {
                *fate = Fate::LeftOut;
            }
        }
    }
    let spread = |fates: Vec<Fate>, is_out: &dyn Fn(usize) -> bool| {
        let all = fates.len();
        let mut fates = fates.into_iter();
        let fate = |index: usize| {
            if is_out(index) { Fate::LeftOut } else { fates.next().unwrap_or_default() }
        };
        (0..all).map(fate).collect::<Vec<Fate>>()
    };
    (
        spread(corners, &|index| left_out.has_corner(index)),
        spread(lines, &|index| left_out.has_line(index)),
    )
}
