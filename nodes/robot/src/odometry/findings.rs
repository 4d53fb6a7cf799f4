//! What is wrong with the images of a camera that was followed nevertheless.

use pose::shell::PoseParameters;

use crate::failure::Failure;
use crate::run::are_many;
use crate::visual::{DropsOfCause, VisualOdometry};

/// How the cause of messages that the node cannot use begins.
const UNUSABLE_MESSAGE_ON: &str = "unusable message on ";

/// What the user should know, each with its fix; empty if there is nothing.
pub(super) fn findings(
    odometry: &VisualOdometry,
    poses: usize,
    parameters: &PoseParameters,
) -> Vec<Failure> {
    let without_pose = odometry.without_pose();
    let mut findings: Vec<Failure> =
        odometry.lost_after_the_end().map(Failure::new).into_iter().collect();
    for (cause, DropsOfCause { count, .. }) in without_pose.drops() {
        if let Some(topic) = cause.strip_prefix(UNUSABLE_MESSAGE_ON) {
            findings.push(
                Failure::new(format!("{topic}: {count} messages cannot be used"))
                    .fix("`stillmap doctor BAG` says more of them"),
            );
        }
    }
    let missing = without_pose.missing(poses);
    if are_many(missing, poses) {
        let finding = Failure::new(format!("{missing} images have no pose, {poses} have one"));
        findings.push(finding.fix(apart(odometry, parameters).unwrap_or_else(|| {
            "the causes are above; a camera that is lost is found again where it sees what it has seen before".to_owned()
        })));
    }
    findings
}

/// That no image has a pose.
pub(super) fn no_pose(odometry: &VisualOdometry, parameters: &PoseParameters) -> Failure {
    Failure::new("no image has a pose").fix(apart(odometry, parameters).unwrap_or_else(|| {
        "the causes are above; `stillmap info` lists what the bag holds".to_owned()
    }))
}

/// That the images of the two cameras are farther apart than those of a pair may be, if they are.
fn apart(odometry: &VisualOdometry, parameters: &PoseParameters) -> Option<String> {
    let (gap_s, allowed_s) = (odometry.without_pose().median_gap_s()?, parameters.max_pair_gap_s);
    (gap_s > allowed_s).then(|| {
        format!(
            "images without a partner are {:.0} ms from the nearest one of the other camera (median), and max_pair_gap_s allows {:.0} ms: \
             synchronise the cameras, or raise it",
            1e3 * gap_s,
            1e3 * allowed_s
        )
    })
}
