//! Organised clouds that were not computed with a pinhole camera.

use std::fmt::Debug;
use std::sync::Mutex;

use geometry::{Cloud, PinholeFitError};
use msgs::sensor_msgs::PointCloud2;
use nalgebra::Point3;
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Level, Metadata, Subscriber};

use super::super::rendering::RenderingReport;
use super::*;

/// Keeps the messages of warnings.
#[derive(Clone, Default)]
struct Warnings(Arc<Mutex<Vec<String>>>);

impl Visit for Warnings {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            self.0.lock().unwrap().push(format!("{value:?}"));
        }
    }
}

impl Subscriber for Warnings {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() == Level::WARN
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        event.record(&mut self.clone());
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

fn warnings_of(run: impl FnOnce()) -> Vec<String> {
    let warnings = Warnings::default();
    tracing::subscriber::with_default(warnings.clone(), run);
    std::mem::take(&mut *warnings.0.lock().unwrap())
}

/// 20 rows of a LiDAR or of a depth camera: equal steps of the angle, or of the slope.
fn organised(stamp: Stamp, slope: fn(f32) -> f32) -> PointCloud2 {
    let steps = || (-10..10).map(|step| slope(0.1 * step as f32));
    let points = steps().flat_map(|y| steps().map(move |x| Point3::new(2.0 * x, 2.0 * y, 2.0)));
    let (frame_id, points_m) = ("camera_optical_frame".to_owned(), points.collect());
    let message = convert::message_from_cloud(&Cloud { stamp, frame_id, points_m });
    PointCloud2 { height: 20, width: 20, row_step: 20 * message.point_step, ..message }
}

#[test]
fn why_an_organised_cloud_is_rendered_is_logged_once() {
    let host = node_shell::Host::in_process();
    let arguments = RosArguments::parse([] as [String; 0]).unwrap();
    let (own, peer) =
        (host.node("detection", &arguments).unwrap(), host.node("robot", &arguments).unwrap());
    let parameters =
        DetectionParameters { input: CloudInput::Points, ..DetectionParameters::default() };
    let mut stage = Stage::new(&own, &parameters).unwrap();
    let qos = Qos::reliable(20);
    let scans = peer.publisher::<LaserScan>("scan", &qos).unwrap();
    let clouds = peer.publisher::<PointCloud2>("points", &qos).unwrap();
    let poses = peer.publisher::<PoseStamped>("pose", &qos).unwrap();
    let mut cycles = |milliseconds: std::ops::Range<i64>, slope| {
        for stamp in milliseconds.step_by(100).map(at) {
            clouds.publish(organised(stamp, slope)).unwrap();
            poses.publish(pose(stamp, 0.0)).unwrap();
            scans.publish(scan(stamp)).unwrap();
            stage.take_waiting();
        }
        stage.give_up_waiting();
    };
    assert_eq!(warnings_of(|| cycles(1_000..1_500, |slope| slope)), [""; 0]);
    let warnings = warnings_of(|| cycles(2_000..2_500, f32::tan));
    let [warning] = &*warnings else { panic!("{warnings:?}") };
    assert!(warning.contains("rendered from the points of /points"), "{warning}");
    assert!(warning.contains("not computed with a pinhole camera"), "{warning}");
}

#[test]
fn a_residual_that_changes_with_each_cloud_is_no_news() {
    let not_throttled = node_shell::Throttle::new(Duration::ZERO);
    let mut report = RenderingReport::new(node_shell::Counters::default(), not_throttled);
    let mut warnings = |residuals_px: &[Option<f64>]| {
        let error = |residual_px| PinholeFitError::Residual { residual_px };
        let errors = residuals_px.iter().map(|residual_px| residual_px.map(error));
        warnings_of(|| errors.for_each(|error| report.take("/points", error))).len()
    };
    assert_eq!(warnings(&[None, Some(5.0), Some(6.0), Some(5.0)]), 1);
    assert_eq!(warnings(&[None, Some(5.0)]), 1, "it was an image in between");
}
