//! A score on the report page of its run.

use std::collections::BTreeMap;
use std::convert::Infallible;

use geometry::{DynamicZone, SegmentationCounts, ZoneSource};
use nalgebra::Point3;

use report::{DropCount, DynamicScoreRules, RunRecord, Summary, headline, report_html};

use crate::testing::{cycle, run};
use crate::{LabelledPoint, TruthFrame, score_dynamic};

/// A wall, and a person before it who is removed in two of three cycles and leaves one voxel.
fn example() -> (RunRecord, Summary) {
    let person = Point3::new(2.05, 0.05, 0.05);
    let wall = Point3::new(4.05, 0.05, 0.05);
    let zone = DynamicZone {
        azimuth_min_rad: -0.1,
        azimuth_max_rad: 0.1,
        peak_std_dev_m: 0.5,
        source: ZoneSource::Measured,
        returns: None,
    };
    let cycles = (0..3).map(|index| {
        let mut record = cycle(index);
        record.counts = SegmentationCounts { reduced: 2, in_zone: 2, dynamic: 1 };
        record.map_points = 2;
        record.zones = vec![zone];
        if index > 0 {
            record.dynamic_points_m = vec![person];
            record.tracks_m = BTreeMap::from([(index, Point3::new(2.0, 0.0, 0.0))]);
        }
        record.step_durations_s = vec![("detection/gap_fill".to_owned(), 0.012_345)];
        record
    });
    let mut run = run(cycles.collect());
    run.bag_name = "a<b>&c.mcap".to_owned();
    run.static_map = vec![person, wall];
    run.unfiltered_map = vec![person, wall];
    run.drops = vec![DropCount {
        topic_or_stage: "scan".to_owned(),
        reason: "no pose on 'pose' within 0.5 s".to_owned(),
        count: 4,
    }];
    let labelled = |point_in_rig, object_id| LabelledPoint { point_in_rig, object_id };
    let truth = [vec![labelled(person, 1); 300], vec![labelled(wall, 0); 300]].concat();
    let truth_at =
        |_| Ok::<_, Infallible>(Some(TruthFrame::from_points((640, 480), truth.clone())));
    let names = BTreeMap::from([(1, "person".to_owned())]);
    // A map without error.
    let surface_m = Some(run.static_map.as_slice());
    let score =
        score_dynamic(&run, &DynamicScoreRules::default(), &names, surface_m, truth_at).unwrap();
    let summary = Summary::of_run(&run, Some(score), true).unwrap();
    (run, summary)
}

#[test]
fn the_page_says_first_what_came_of_it() {
    let (run, summary) = example();
    let page = report_html(&run, &summary).unwrap();
    let lead = page.find("The person was found in 2 of the 3 cycles in which it was in view, for the first time in the 2nd of them, and removed in 2 (66.7\u{a0}% of its points over the run); 1 of the 1 voxel that only it touched is left in the map.");
    assert!(lead.is_some_and(|lead| lead < page.find("<img").unwrap()), "{:?}", headline(&summary));
    assert!(page.contains("4 inputs were dropped in transit;"));
}

#[test]
fn the_page_tells_how_tracks_keep_to_their_objects_and_when_an_object_was_found() {
    let (run, summary) = example();
    let sentence = "Tracks followed moving objects in 2 of 3 sightings, with 1 identity switch.";
    assert!(headline(&summary).iter().any(|said| said == sentence), "{:?}", headline(&summary));
    let page = report_html(&run, &summary).unwrap();
    assert!(page.contains("identity switches"));
    assert!(page.contains("2nd (cycle 1)"));
    let json: serde_json::Value = serde_json::from_str(&summary.to_json().unwrap()).unwrap();
    assert_eq!(json["truth"]["identities"]["switches"], 1);
    assert_eq!(json["truth"]["objects"][0]["first_found"]["nth_in_view"], 2);
}

#[test]
fn the_static_scene_is_what_several_cycles_saw() {
    let (run, summary) = example();
    let sentences = headline(&summary);
    let kept = "100.0\u{a0}% of the voxels in which the static scene was seen in 3 cycles or more have a point of the map";
    assert!(sentences.iter().any(|sentence| sentence.starts_with(kept)), "{sentences:?}");
    let page = report_html(&run, &summary).unwrap();
    assert!(page.contains("when static points touched it in 3 cycles or more"));
    assert!(page.contains("static scene, touched at all"));
    assert!(page.contains("Map and true surface"));
    let surface = "The points of the map are 0.0 mm from the true surface in the mean";
    assert!(sentences.iter().any(|sentence| sentence.starts_with(surface)), "{sentences:?}");
}

/// The rules had one more, and no summary.json of an earlier version could be read.
#[test]
fn a_summary_from_before_the_map_was_compared_with_the_surface_is_read() {
    let (_, summary) = example();
    let mut json: serde_json::Value = serde_json::from_str(&summary.to_json().unwrap()).unwrap();
    let remove = |value: &mut serde_json::Value, key: &str| {
        value.as_object_mut().unwrap().remove(key).unwrap();
    };
    remove(&mut json["truth"]["rules"], "surface_tolerance_m");
    remove(&mut json["truth"]["map"], "surface");
    let read: Summary = serde_json::from_value(json).unwrap();
    let mut expected = summary;
    let score = expected.truth.as_mut().unwrap();
    assert!(score.map.surface.take().is_some());
    assert_eq!(read, expected);
}

#[test]
fn the_page_needs_nothing_but_itself() {
    let (run, summary) = example();
    let page = report_html(&run, &summary).unwrap();
    let script = page.rfind("<script>").unwrap();
    // The names of namespaces are no addresses that are loaded.
    let text = page.replace("http://www.w3.org", "");
    for outside in ["http:", "https:", "<link", "@import", "src=\"http"] {
        assert!(!text.contains(outside), "{outside}");
    }
    assert!(!page[..script].contains("url("));
    // One script and its data.
    assert_eq!(page.matches("<script>").count(), 1);
    assert!(page.contains("default-src 'none'; script-src 'sha256-"));
    assert_eq!(page.matches("src=\"data:image/png;base64,").count(), 6);
    assert_eq!(page.matches("<svg").count(), 4);
}

#[test]
fn the_page_tells_those_who_cannot_see_it() {
    let (run, summary) = example();
    let page = report_html(&run, &summary).unwrap();
    assert!(page.starts_with("<!DOCTYPE html><html lang=\"en\">"));
    assert_eq!(page.matches("<img").count(), page.matches(" alt=\"").count());
    assert_eq!(page.matches("<svg").count(), page.matches("<desc").count());
    assert_eq!(page.matches("<table").count(), page.matches("<caption").count());
}

#[test]
fn names_from_outside_are_escaped() {
    let (run, summary) = example();
    let page = report_html(&run, &summary).unwrap();
    assert!(page.contains("a&lt;b&gt;&amp;c.mcap"));
    assert!(!page.contains("a<b>"));
}

#[test]
fn no_duration_reaches_the_page() {
    let (run, summary) = example();
    let page = report_html(&run, &summary).unwrap();
    let mut slow = run.clone();
    for cycle in &mut slow.cycles {
        cycle.step_durations_s = vec![("detection/gap_fill".to_owned(), 9.0)];
    }
    let slow_summary = Summary::of_run(&slow, summary.truth.clone(), true).unwrap();
    assert_ne!(slow_summary.timing, summary.timing);
    assert_eq!(page, report_html(&slow, &slow_summary).unwrap());
}

#[test]
fn a_run_without_a_cycle_says_so() {
    let run = run(vec![]);
    let summary = Summary::of_run(&run, None, true).unwrap();
    let page = report_html(&run, &summary).unwrap();
    assert!(
        page.contains("No cycle was processed: 0 inputs were dropped."),
        "{:?}",
        headline(&summary)
    );
    assert!(page.contains("There is no cycle to draw."));
}

#[test]
fn a_run_without_truth_tells_what_was_found() {
    let (run, _) = example();
    let summary = Summary::of_run(&run, None, false).unwrap();
    let sentences = headline(&summary);
    assert_eq!(
        sentences[0],
        "A moving object was found in 3 of 3 cycles, and held over in 0 more."
    );
    let page = report_html(&run, &summary).unwrap();
    assert!(!page.contains("Against the truth"));
}
