//! The measures of the road thesis (Road LiDAR, section 4.2.1.2, eq. 4.1 and 4.2, and table 4.6).

use serde::Serialize;

use super::absolute::MatchedPose;
use super::path::path_lengths_m;
use super::plane::Plane;

/// The errors of a drive, as defined in the thesis. Its poses begin at the same place: use
/// [`super::Alignment::Origin`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct RoadScore {
    /// RMSE of the position within the plane.
    pub rms_2d_m: f64,
    /// The same in space.
    pub rms_3d_m: f64,
    /// The distance between the ends, in percent of the reference's way. The thesis does not say what its "total error" is of:
    /// this is the usual one.
    pub end_error_percent: f64,
    /// 100 percent minus this error.
    pub precision_percent: f64,
}

/// The score of the pairs, in their order; the plane is that of the ground (x and z in the frame of KITTI's poses). None where
/// the reference has no way.
#[must_use]
pub fn road_score(pairs: &[MatchedPose], ground: Plane) -> Option<RoadScore> {
    let reference: Vec<_> = pairs.iter().map(|pair| pair.reference).collect();
    let way_m = path_lengths_m(&reference).last().copied().filter(|way_m| *way_m > 0.0)?;
    let end = pairs.last()?;
    let (mut squares_2d_m2, mut squares_3d_m2) = (0.0, 0.0);
    for pair in pairs {
        let off_m = pair.estimate.translation.vector - pair.reference.translation.vector;
        let (right_m, up_m) = ground.project(&off_m);
        squares_2d_m2 += right_m * right_m + up_m * up_m;
        squares_3d_m2 += off_m.norm_squared();
    }
    let count = pairs.len() as f64;
    let end_error_percent = 100.0 * end.translation_m / way_m;
    Some(RoadScore {
        rms_2d_m: (squares_2d_m2 / count).sqrt(),
        rms_3d_m: (squares_3d_m2 / count).sqrt(),
        end_error_percent,
        precision_percent: 100.0 - end_error_percent,
    })
}

#[cfg(test)]
mod tests {
    use super::super::testing::pose;
    use super::*;

    #[test]
    fn height_counts_in_space_only_and_the_end_as_a_share_of_the_way() {
        // Ten metres along z; the estimate is 0.3 m too far right and, at the end, 0.4 m too low.
        let at = |z_m: f64, off_m: [f64; 2]| {
            let reference = pose([0.0, 0.0, z_m], [0.0; 3]);
            MatchedPose::new(None, z_m, pose([off_m[0], off_m[1], z_m], [0.0; 3]), reference)
        };
        let pairs = [at(0.0, [0.3, 0.0]), at(5.0, [0.3, 0.0]), at(10.0, [0.3, 0.4])];
        let score = road_score(&pairs, Plane::Xz).unwrap();
        assert!((score.rms_2d_m - 0.3).abs() < 1e-12);
        assert!((score.rms_3d_m - (0.09_f64 + 0.16 / 3.0).sqrt()).abs() < 1e-12);
        assert!((score.end_error_percent - 5.0).abs() < 1e-12);
        assert!((score.precision_percent - 95.0).abs() < 1e-12);
    }

    #[test]
    fn without_a_way_there_is_no_score() {
        assert_eq!(road_score(&[], Plane::Xy), None);
        let still = MatchedPose::new(None, 0.0, pose([0.0; 3], [0.0; 3]), pose([0.0; 3], [0.0; 3]));
        assert_eq!(road_score(&[still, still], Plane::Xy), None);
    }
}
