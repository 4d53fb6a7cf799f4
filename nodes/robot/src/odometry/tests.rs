//! Bags of a camera that sees nothing to hold on to.

use std::path::Path;

use clap::Parser;
use geometry::{CameraModel, DepthImage, DepthPixels, Distortion, Stamp};
use msgs::convert::time_from_stamp;
use msgs::sensor_msgs::CompressedImage;
use msgs::std_msgs::Header;

use super::*;
use crate::sensor_bag::{COLOUR, DEPTH_FRAME, SensorBag};

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    odometry: OdometryArgs,
}

/// White images at these times, in the colour camera's frame; `None` is one that is cut off.
fn write_bag(path: &Path, seconds: &[Option<f64>], frame_id: &str) {
    let (width_px, height_px) = (64, 48);
    let (fx_px, fy_px, cx_px, cy_px) = (60.0, 60.0, 31.5, 23.5);
    let distortion = Distortion::None;
    let camera = CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion };
    let mut png = std::io::Cursor::new(Vec::new());
    let white = image::RgbImage::from_pixel(64, 48, image::Rgb([255; 3]));
    white.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let png = png.into_inner();
    let mut bag = SensorBag::create(path).unwrap();
    let mut stamp = Stamp::from_secs_nanos(100, 0);
    for (index, at_s) in seconds.iter().enumerate() {
        stamp = at_s
            .map_or(stamp, |at_s| Stamp::from_secs_nanos(100, 0).plus_seconds(at_s))
            .plus_seconds(0.1);
        bag.camera(&camera, stamp).unwrap();
        let metres = DepthPixels::Metres(vec![2.0; width_px * height_px]);
        let depth =
            DepthImage::new(stamp, DEPTH_FRAME.to_owned(), (width_px, height_px), metres).unwrap();
        bag.depth(&depth).unwrap();
        let data = png[..if at_s.is_some() { png.len() } else { 20 }].to_vec();
        let header = Header { stamp: time_from_stamp(stamp), frame_id: frame_id.to_owned() };
        let format = "rgb8; png compressed bgr8".to_owned();
        // Messages are recorded in this order, whatever their stamps are.
        let recorded = Stamp::from_secs_nanos(100, 0).plus_seconds(0.1 * (index + 1) as f64);
        bag.colour(recorded, &CompressedImage { header, format, data }).unwrap();
    }
    bag.finish().unwrap();
}

/// What the nodes say of a bag.
fn tracked(bag: &Path) -> Tracking {
    let bag = open_bag(bag).unwrap();
    let info = bag.info().unwrap();
    let offer = Offer::of_bag(&info);
    let depth = visual::depth_topic(None, &offer).unwrap();
    let depth_info = visual::depth_info_topic(&depth);
    let topics =
        VisualTopics::choose(&VisualTopicArgs::default(), &depth, &depth_info, &offer).unwrap();
    let mut tracking = Tracking::new(topics, &depth_info, &PoseParameters::default()).unwrap();
    for message in bag.messages(&Selection::default()).unwrap() {
        tracking.take(&message.unwrap()).unwrap();
    }
    tracking
}

fn told(findings: &[Failure]) -> String {
    findings.iter().map(ToString::to_string).collect()
}

/// Regression: a former trajectory was replaced by a file of one comment line.
#[test]
fn a_bag_without_any_pose_writes_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (bag, poses) = (path("white.mcap"), path("poses.txt"));
    write_bag(Path::new(&bag), &[Some(0.0), Some(0.1), Some(0.2)], DEPTH_FRAME);
    let failed = |more: &[&str]| {
        let line = Line::parse_from([&["odometry", &bag, "-o", &poses], more].concat());
        run(&line.odometry).unwrap_err().to_string()
    };
    assert!(failed(&[]).contains("no image has a pose"));
    assert!(!Path::new(&poses).exists());
    std::fs::write(&poses, "1 0 0 0 0 0 0 1\n").unwrap();
    failed(&["--overwrite"]);
    assert_eq!(std::fs::read_to_string(&poses).unwrap(), "1 0 0 0 0 0 0 1\n");
}

/// Regression: an image that was cut off had the node's own topic for a name, and exit code 0.
#[test]
fn a_picture_that_cannot_be_read_is_a_finding_with_its_topic_in_the_bag() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("cut.mcap");
    write_bag(&bag, &[Some(0.0), None, Some(0.2)], DEPTH_FRAME);
    let told = told(&findings(&tracked(&bag).odometry, 2, &PoseParameters::default()));
    assert!(told.contains(&format!("{COLOUR}: 1 messages cannot be used")), "{told}");
}

/// Regression: the reasons that the node gives were not told.
#[test]
fn the_first_reason_of_a_cause_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("white.mcap");
    write_bag(&bag, &[Some(0.0), Some(0.1)], DEPTH_FRAME);
    let tracking = tracked(&bag);
    let summary = OdometrySummary::of(&tracking.odometry, &[]);
    let causes: Vec<String> = summary.causes().collect();
    assert!(
        !causes.is_empty() && causes.iter().all(|cause| cause.contains("; the first: 0 corners")),
        "{causes:?}"
    );
}

/// Regression: two recordings in one bag were put upon each other, without a word.
#[test]
fn stamps_that_go_back_end_the_recording_with_a_loss() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("twice.mcap");
    let seconds = [50.0, 50.1, 50.2, 0.0, 0.1, 0.2, 0.3];
    write_bag(&bag, &seconds.map(Some), DEPTH_FRAME);
    let tracking = tracked(&bag);
    let told = told(&findings(&tracking.odometry, 3, &PoseParameters::default()));
    assert!(told.contains("go back by 50.1 s") && told.contains("4 images of another"), "{told}");
    assert!(tracking.odometry.has_ended());
}

/// Regression: depth images of a camera beside, said by the node over DDS, were no word here.
#[test]
fn depth_images_of_another_frame_are_doubtful() {
    let folder = tempfile::tempdir().unwrap();
    for (frame_id, is_doubtful) in [("camera_rgb_optical_frame", true), (DEPTH_FRAME, false)] {
        let bag = folder.path().join(format!("{frame_id}.mcap"));
        write_bag(&bag, &[Some(0.0), Some(0.1)], frame_id);
        let tracking = tracked(&bag);
        assert_eq!(tracking.odometry.registration_doubt().is_some(), is_doubtful);
    }
}
