use msgs::convert::time_from_stamp;

use super::*;

/// What the node says in a recording, in tenths of a second.
#[derive(Default)]
struct Node {
    reports: Vec<StageReport>,
    drops: BTreeMap<String, u64>,
    without_pose: WithoutPose,
}

impl Node {
    fn says(&mut self, at: u32, processed: bool, drop_reason: &str) {
        let stamp = Stamp::from_secs_nanos(100, 0).plus_seconds(0.1 * f64::from(at));
        let mut report = StageReport { processed, ..StageReport::default() };
        report.header.stamp = time_from_stamp(stamp);
        drop_reason.clone_into(&mut report.drop_reason);
        self.reports.push(report);
    }

    fn drops(&mut self, at: u32, cause: &str, reason: &str) {
        *self.drops.entry(cause.to_owned()).or_default() += 1;
        self.says(at, false, reason);
    }

    fn flows(&mut self) {
        self.without_pose.note(&self.reports, self.drops.clone());
    }

    fn first_reason(&self, cause: &str) -> &str {
        self.without_pose.drops()[cause].first_reason.as_deref().unwrap()
    }

    fn has_pose(&mut self, at: u32) {
        self.says(at, true, "");
        self.flows();
    }
}

/// Regression: a camera that was lost for half of the recording had no word of it, and exit code 0.
#[test]
fn pairs_without_a_pose_are_missing_and_the_first_reason_is_kept() {
    let mut node = Node::default();
    (0..30).for_each(|at| node.has_pose(at));
    for at in 30..60 {
        node.drops(at, "no pose", &format!("{at} inliers are too few"));
        node.flows();
    }
    assert_eq!((node.without_pose.pairs(), node.without_pose.missing(30)), (60, 30));
    assert_eq!(node.first_reason("no pose"), "30 inliers are too few");
    let losses = [("no pose; the first: 30 inliers are too few".to_owned(), 30)];
    assert_eq!(node.without_pose.losses(), losses);
}

/// Regression: that a camera was lost for the rest of the recording was a count alone.
#[test]
fn it_is_told_when_a_camera_was_lost_and_when_it_was_found_again() {
    let mut node = Node::default();
    let is_lost = |at: u32| (40..60).contains(&at) || (70..75).contains(&at) || at >= 80;
    for at in 0..100 {
        match is_lost(at) {
            true => node.drops(at, "no pose", &format!("{at} inliers are too few")),
            false => node.says(at, true, ""),
        }
        node.flows();
    }
    let tenths = |seconds: f64| (10.0 * seconds).round() as u32;
    let spans = node.without_pose.lost().map(|span| {
        (tenths(span.from_s), span.to.map(|(to_s, _)| tenths(to_s)), span.reason.as_str())
    });
    let spans: Vec<_> = spans.collect();
    // Half a second is a moment.
    let told = [(40, Some(60), "40 inliers are too few"), (80, None, "80 inliers are too few")];
    assert_eq!(spans, told);
}

/// Images without a partner were counted as pairs.
#[test]
fn a_camera_that_is_faster_than_the_other_one_misses_nothing() {
    let mut node = Node::default();
    for at in 0..90 {
        match at % 3 {
            0 => node.has_pose(at),
            _ => node.drops(at, Stage::IMAGE_WITHOUT_DEPTH, "no image of /depth was taken then"),
        }
    }
    node.flows();
    let told = &node.without_pose;
    assert_eq!((told.pairs(), told.missing(30), told.losses()), (30, 0, vec![]));
}

/// Regression: depth images that ended at half of the recording left no trace but a count.
#[test]
fn images_whose_partner_has_ceased_to_come_are_missing() {
    let mut node = Node::default();
    (0..30).for_each(|at| node.has_pose(at));
    for at in 30..60 {
        node.drops(at, Stage::IMAGE_WITHOUT_DEPTH, "no image of /depth was taken then");
        node.flows();
    }
    assert_eq!((node.without_pose.pairs(), node.without_pose.missing(30)), (30, 30));
    assert_eq!(node.without_pose.losses().len(), 1);
    // It has come back.
    node.has_pose(60);
    assert_eq!((node.without_pose.pairs(), node.without_pose.missing(31)), (31, 30));
}

#[test]
fn a_reason_is_of_the_cause_that_was_counted_with_it() {
    let mut node = Node::default();
    node.drops(0, Stage::IMAGE_WITHOUT_DEPTH, "alone");
    node.drops(1, "unusable image", "bare");
    node.flows();
    assert_eq!(node.first_reason(Stage::IMAGE_WITHOUT_DEPTH), "alone");
    assert_eq!(node.first_reason("unusable image"), "bare");
    assert_eq!((node.without_pose.pairs(), node.without_pose.missing(0)), (1, 1));
}

/// Regression: of cameras whose stamps are too far apart nothing said how far.
#[test]
fn the_gap_between_images_without_a_partner_is_known() {
    let mut node = Node::default();
    for at in (0..40).step_by(4) {
        node.drops(at, Stage::IMAGE_WITHOUT_DEPTH, "no image of /depth was taken then");
        node.drops(at + 1, Stage::DEPTH_WITHOUT_IMAGE, "no image of /rgb was taken then");
        node.flows();
    }
    let gap_s = node.without_pose.median_gap_s().unwrap();
    assert!((gap_s - 0.1).abs() < 1e-6, "{gap_s}");
}
