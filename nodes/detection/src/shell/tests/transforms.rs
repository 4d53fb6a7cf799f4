//! The mount of the scanner, from tf over DDS.

use geometry::ExtrinsicsSource;
use geometry::pose_from_vector;
use msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use msgs::geometry_msgs::TransformStamped;
use msgs::std_msgs::Header;
use msgs::tf2_msgs::TFMessage;

use super::*;

/// The QoS of a broadcaster of static transforms, as in tf2. With depth 1 it could not publish a change before all
/// subscribers have acknowledged the first message.
fn broadcaster() -> Qos {
    Qos::new(true, true, 10)
}

/// The pose of a frame on the robot.
fn on_robot(child: &str, pose: [f64; 6]) -> TransformStamped {
    TransformStamped {
        header: Header { frame_id: "base_link".to_owned(), ..Header::default() },
        child_frame_id: child.to_owned(),
        transform: convert::transform_from_isometry(&pose_from_vector(&pose)),
    }
}

fn camera() -> TransformStamped {
    on_robot("camera_optical_frame", DetectionConfig::default().pipeline.rig.rig_from_camera)
}

fn laser(yaw_rad: f64) -> TransformStamped {
    on_robot("laser", [0.0, 0.0, -0.05, yaw_rad, 0.0, 0.0])
}

impl Bench {
    async fn cycle_at(&self, milliseconds: i64) -> Arc<StageReport> {
        self.images.publish(image(at(milliseconds))).unwrap();
        self.poses.publish(pose(at(milliseconds), 0.0)).unwrap();
        self.scans.publish(scan(at(milliseconds))).unwrap();
        loop {
            let report = self.report().await;
            if convert::stamp_from_time(report.header.stamp) == at(milliseconds) {
                return report;
            }
        }
    }
}

/// A node's report of the transform on `/diagnostics`, once it contains this part.
async fn report_of(
    name: &str,
    diagnostics: &Subscription<DiagnosticArray>,
    part: &str,
) -> (DiagnosticStatus, String) {
    soon(part, async {
        loop {
            let message = diagnostics.next().await.message;
            let own = message.part(name);
            let Some(status) = own else { continue };
            let value = status.value("transform from scanner to camera");
            if let Some(value) = value.filter(|value| value.contains(part)) {
                return (status.clone(), value.to_owned());
            }
        }
    })
    .await
}

/// Parameters with the scanner's mount by tf; `max_wait_s` is how long a scan waits for it.
fn by_tf(max_wait_s: f64) -> DetectionParameters {
    let mut config = DetectionConfig { max_wait_s, ..DetectionConfig::default() };
    config.pipeline.rig.extrinsics = ExtrinsicsSource::Tf;
    DetectionParameters { config, ..DetectionParameters::default() }
}

/// A scan received before its transform waits for it, and is not dropped.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_scan_waits_for_its_transform() {
    let parameters = by_tf(20.0);
    let bench = Bench::start_by("late_tf", parameters).await;
    let diagnostics =
        bench.peer.subscription::<DiagnosticArray>("/diagnostics", &Qos::reliable(50)).unwrap();
    bench.camera_infos.publish(camera_info(4)).unwrap();
    for milliseconds in [1_000, 1_100] {
        bench.images.publish(image(at(milliseconds))).unwrap();
        bench.poses.publish(pose(at(milliseconds), 0.0)).unwrap();
        bench.scans.publish(scan(at(milliseconds))).unwrap();
    }
    report_of(&bench.name, &diagnostics, "waiting for it").await;
    let transforms = bench.peer.publisher::<TFMessage>("/tf_static", &broadcaster()).unwrap();
    transforms.publish(TFMessage { transforms: vec![camera(), laser(0.0)] }).unwrap();
    for milliseconds in [1_000, 1_100] {
        let report = bench.report().await;
        assert!(report.processed, "{report:?}");
        assert_eq!(convert::stamp_from_time(report.header.stamp), at(milliseconds));
    }
    drop((transforms, diagnostics));
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_mount_of_tf_is_used_as_soon_as_it_is_received() {
    // A scan without a transform waits for twice this time.
    let parameters = by_tf(0.1);
    let own = node_with("detection", "tf", LIVE);
    let bench = Bench::start_node(own, "tf", parameters).await;
    let diagnostics =
        bench.peer.subscription::<DiagnosticArray>("/diagnostics", &Qos::reliable(50)).unwrap();
    bench.camera_infos.publish(camera_info(4)).unwrap();
    let report = bench.cycle_at(1_000).await;
    assert!(!report.processed && report.drop_reason.contains("none is known"), "{report:?}");
    let (status, _) = report_of(&bench.name, &diagnostics, "waiting for it").await;
    assert!(status.level >= DiagnosticStatus::WARN, "{status:?}");

    // Two broadcasters publish a part each; that of the scanner is later.
    let static_of_camera = bench.peer.publisher::<TFMessage>("/tf_static", &broadcaster()).unwrap();
    static_of_camera.publish(TFMessage { transforms: vec![camera()] }).unwrap();
    soon("the node", static_of_camera.wait_for_subscribers(1)).await;
    let mut milliseconds = 2_000;
    let mut until = async |bench: &Bench, is_it: &dyn Fn(&StageReport) -> bool| {
        soon("the transform", async {
            loop {
                milliseconds += 1_000;
                let report = bench.cycle_at(milliseconds).await;
                if is_it(&report) {
                    break report;
                }
            }
        })
        .await
    };
    until(&bench, &|report| report.drop_reason.contains("\"laser\"")).await;
    let static_of_laser = bench.peer.publisher::<TFMessage>("/tf_static", &broadcaster()).unwrap();
    static_of_laser.publish(TFMessage { transforms: vec![laser(0.5)] }).unwrap();

    // Of 21 beams from -1 to 1 rad, 13 are within 45 degrees of the rig's x when the scanner is turned by 0.5 rad.
    let report = until(&bench, &|report| report.processed).await;
    assert_eq!((report.cycle, counts(&report).get("beams")), (0, Some(&13)));
    let (_, text) = report_of(&bench.name, &diagnostics, "rig_from_lidar is").await;
    assert!(
        text.contains("laser to camera_optical_frame") && text.contains("-0.050, 0.5000"),
        "{text}"
    );

    // A changed mount is used.
    static_of_laser.publish(TFMessage { transforms: vec![laser(0.0)] }).unwrap();
    let report = until(&bench, &|report| counts(report).get("beams") == Some(&15)).await;
    assert!(report.processed && report.cycle > 0);
    drop((static_of_camera, static_of_laser, diagnostics));
    bench.end().await;
}
