//! A made-up graph with its live view, for the test of the page in a browser: `made_up ADDRESS:PORT` serves until SIGINT or SIGTERM.
//!
//! A wall grows, something moves before it, and names are markup.
#![allow(clippy::print_stdout, reason = "the address is for the test that started this")]

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use geometry::{
    CameraModel, Cloud, CycleSetup, CycleTracks, DepthFrame, DepthImage, DepthPixels,
    DetectedCycle, Distortion, DynamicZone, MaskedDepth, MeshPiece, MeshUpdate, SegmentedCycle,
    Stamp, Track, TriangleMesh, ZoneSource,
};
use live_view::shell::{GraphOf, LiveView, NODE, ShownNode};
use msgs::convert;
use msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use msgs::sensor_msgs::PointCloud2;
use msgs::std_srvs::Trigger;
use msgs::visualization_msgs::MarkerArray;
use nalgebra::{Isometry3, Matrix6, Point3, Vector3};
use node_shell::parameters::NodeParameters;
use node_shell::{Host, Node, NodeFailure, Qos, RosArguments, Transport, descriptors};

/// Markup that takes the title of a page whose script takes it for its own.
const MARKUP: &str =
    "\"><img src=x onerror=\"document.title='taken'\"><script>document.title='taken'</script>";
const LONG: usize = 10_000;
const PERIOD: Duration = Duration::from_millis(100);
/// The wall is so high, and grows by a column each period until it is so long: for longer than the test waits for the page to show it.
const HEIGHT_VOXELS: usize = 40;
const LENGTH_VOXELS: usize = 3_000;
const SIZE_PX: (usize, usize) = (64, 48);

geometry::parameters! {
    /// Parameters to be shown and set.
    #[derive(Clone, PartialEq, Debug)]
    struct MadeUp {
        /// A length <b>with markup</b>.
        reach_m: f64 = 8.0, between(0.5, 20.0), changeable;
        /// A text that stays.
        frame: String = MARKUP.to_owned();
    }
}

impl NodeParameters for MadeUp {}

#[tokio::main(flavor = "multi_thread", worker_threads = 2)]
async fn main() -> Result<(), Box<dyn Error>> {
    let address = std::env::args().nth(1).ok_or("made_up ADDRESS:PORT")?.parse()?;
    let view = LiveView::bind(address)?;
    println!("{}", view.url());
    let host = Host::on(Transport::from_environment()?)?;
    let node = |name: &str| host.node(name, &RosArguments::parse([""; 0])?);
    let shown = ShownNode {
        may_be_absent: false,
        name: "detection".to_owned(),
        parameters: descriptors::<MadeUp>().map_err(|error| error.to_string())?,
    };
    let served = view.serve(node(NODE)?, GraphOf::ThisProcess, vec![shown]);
    let (served, published, answered) =
        tokio::join!(served, publish(node("detection")?), answer(node("reconstruction")?));
    served.map_err(text)?;
    published.map_err(text)?;
    answered.map_err(text)?;
    Ok(())
}

fn text(failure: NodeFailure) -> String {
    failure.to_string()
}

/// The services that the buttons call; the other ones are detection's own.
async fn answer(node: Node) -> Result<(), NodeFailure> {
    {
        let (save, reset) =
            (node.service::<Trigger>("~/save_map")?, node.service::<Trigger>("~/reset")?);
        let shutdown = node.shutdown_signal();
        loop {
            tokio::select! {
                () = shutdown.wait() => break,
                request = save.next() => request.answer(Ok(format!("saved {MARKUP}"))),
                request = reset.next() => request.answer(Err("it is <i>not</i> emptied".into())),
            }
        }
    }
    node.close().await;
    Ok(())
}

/// The cycles and the map of all nodes.
async fn publish(node: Node) -> Result<(), NodeFailure> {
    let parameters = MadeUp::default();
    let _live = node.serve_parameters(&parameters)?;
    let mut lifecycle = node.manage()?;
    {
        let detected = node.value_publisher::<DetectedCycle>("reduced_cloud", &Qos::reliable(5))?;
        let segmented =
            node.value_publisher::<SegmentedCycle>("segmented_cloud", &Qos::reliable(5))?;
        let tracks = node.value_publisher::<CycleTracks>("tracks", &Qos::reliable(5))?;
        let maps = node.publisher::<PointCloud2>("static_map", &Qos::latched())?;
        let updates = node.publisher::<PointCloud2>("static_map_updates", &Qos::reliable(10))?;
        let meshes = node.publisher::<MarkerArray>("mesh", &Qos::reliable(10))?;
        let diagnostics = node.publisher::<DiagnosticArray>("/diagnostics", &Qos::reliable(5))?;
        let shutdown = node.shutdown_signal();
        let mut period = tokio::time::interval(PERIOD);
        let mut index = 0;
        loop {
            tokio::select! {
                () = shutdown.wait() => break,
                _reset = lifecycle.reset() => {}
                _now = period.tick() => {}
            }
            index += 1;
            let stamp = Stamp::from_nanos(i64::from(index) * PERIOD.as_nanos() as i64);
            let cycle = cycle(index, stamp);
            detected.publish_or_warn(detected_of(&cycle, stamp));
            tracks.publish_if_awaited(|| CycleTracks {
                index: cycle.index,
                stamp,
                map_frame_id: cycle.static_cloud.frame_id.clone(),
                tracks: vec![track(&cycle)],
            });
            segmented.publish_or_warn(Arc::new(cycle));
            let columns = (index as usize).min(LENGTH_VOXELS);
            if index % 10 == 1 {
                let whole = cloud(stamp, (0..columns).flat_map(column).collect());
                maps.publish_or_warn(convert::message_from_cloud(&whole));
                diagnostics.publish_or_warn(hostile());
                diagnostics.publish_or_warn(paused_elsewhere());
                diagnostics.publish_or_warn(says(if meshes.subscriber_count() > 0 {
                    "the mesh is made"
                } else {
                    "no mesh"
                }));
            } else {
                let newest = cloud(stamp, column(columns - 1).collect());
                updates.publish_or_warn(convert::message_from_cloud(&newest));
            }
            if meshes.subscriber_count() > 0 {
                meshes.publish_or_warn(convert::markers_from_mesh(&newest_triangles(stamp, index)));
            }
        }
    }
    node.close().await;
    Ok(())
}

/// A column of the wall, 3 m ahead.
fn column(number: usize) -> impl Iterator<Item = Point3<f32>> {
    let edge_m = CycleSetup::default().map_edge_m as f32;
    let at_m = move |voxel: usize| (voxel as f32 + 0.5) * edge_m;
    (0..HEIGHT_VOXELS).map(move |height| Point3::new(3.0, at_m(number) - 2.0, at_m(height)))
}

fn cloud(stamp: Stamp, points_m: Vec<Point3<f32>>) -> Cloud {
    Cloud { stamp, frame_id: MARKUP.to_owned(), points_m }
}

fn cycle(index: u32, stamp: Stamp) -> SegmentedCycle {
    let across_m = (index as f32 * 0.05).sin();
    let dynamic: Vec<Point3<f32>> =
        (0..HEIGHT_VOXELS).map(|height| Point3::new(2.0, across_m, height as f32 * 0.02)).collect();
    SegmentedCycle {
        index,
        setup: CycleSetup::default(),
        static_cloud: cloud(stamp, column(50).collect()),
        dynamic_cloud: cloud(stamp, dynamic),
        map_from_rig: Isometry3::translation(f64::from(index) * 0.002, 0.0, 0.5),
        depth: depth(stamp),
        scan_rays: Arc::default(),
        retracted_m: Vec::new(),
    }
}

fn depth(stamp: Stamp) -> Option<MaskedDepth> {
    let (width_px, height_px) = SIZE_PX;
    let pixels = (0..width_px * height_px).map(|pixel| 2_000 + pixel as u16).collect();
    let pixels = DepthPixels::Millimetres(pixels);
    let image = DepthImage::new(stamp, MARKUP.to_owned(), SIZE_PX, pixels).ok()?;
    let camera = CameraModel {
        width_px,
        height_px,
        fx_px: 50.0,
        fy_px: 50.0,
        cx_px: 32.0,
        cy_px: 24.0,
        distortion: Distortion::None,
    };
    let frame = Arc::new(DepthFrame::new(image, camera).ok()?);
    let is_moving = (0..width_px * height_px).map(|pixel| pixel % width_px > 50).collect();
    MaskedDepth::new(frame, is_moving).ok()
}

fn detected_of(cycle: &SegmentedCycle, stamp: Stamp) -> DetectedCycle {
    DetectedCycle {
        index: cycle.index,
        setup: cycle.setup,
        scan_stamp: stamp,
        reduced_cloud: cycle.dynamic_cloud.clone(),
        voxel_points: vec![1; cycle.dynamic_cloud.points_m.len()],
        points_before_reduction: 1_000,
        map_from_rig: cycle.map_from_rig,
        map_from_continuous: None,
        map_frame_id: MARKUP.to_owned(),
        zones: vec![DynamicZone {
            azimuth_min_rad: -0.3,
            azimuth_max_rad: 0.3,
            peak_std_dev_m: 0.5,
            source: ZoneSource::Measured,
            returns: None,
        }],
        moving_beams: Vec::new(),
        depth: None,
        scan_rays: Arc::default(),
    }
}

fn track(cycle: &SegmentedCycle) -> Track {
    let first = cycle.dynamic_cloud.points_m.first().copied().unwrap_or_default();
    Track {
        id: 3,
        position_m: cycle.map_from_rig * first.cast::<f64>(),
        velocity_m_per_s: Vector3::zeros(),
        extent_m: Vector3::repeat(0.5),
        covariance: Matrix6::identity(),
        age_s: 1.0,
        unseen_cycles: 0,
    }
}

/// The newest strip of the wall, a block of its own.
fn newest_triangles(stamp: Stamp, index: u32) -> MeshUpdate {
    let (low_m, high_m) = (0.0, HEIGHT_VOXELS as f32 * 0.02);
    let (from_m, to_m) = (index as f32 * 0.02 - 2.0, index as f32 * 0.02 - 1.98);
    let corner = |y_m, z_m| Point3::new(3.02, y_m, z_m);
    let mesh = TriangleMesh {
        points_m: vec![
            corner(from_m, low_m),
            corner(to_m, low_m),
            corner(to_m, high_m),
            corner(from_m, high_m),
        ],
        triangles: vec![[0, 2, 1], [0, 3, 2]],
        ..TriangleMesh::default()
    };
    let piece = MeshPiece { block: [0, index.cast_signed(), 0], mesh };
    MeshUpdate { stamp, pieces: vec![piece], ..MeshUpdate::default() }
}

/// A node that says something.
fn says(text: &str) -> DiagnosticArray {
    let status = DiagnosticStatus {
        name: "mesh".into(),
        message: text.into(),
        ..DiagnosticStatus::default()
    };
    DiagnosticArray { status: vec![status], ..DiagnosticArray::default() }
}

/// The detection of another robot on the same network, whose name is sorted before that of this one.
fn paused_elsewhere() -> DiagnosticArray {
    let state = KeyValue { key: "state".to_owned(), value: "inactive".to_owned() };
    let status = DiagnosticStatus {
        name: "/another_robot/detection".to_owned(),
        values: vec![state],
        ..DiagnosticStatus::default()
    };
    DiagnosticArray { status: vec![status], ..DiagnosticArray::default() }
}

/// A node whose names are markup, and long.
fn hostile() -> DiagnosticArray {
    let long = format!("{MARKUP}{}", "x".repeat(LONG));
    let status = DiagnosticStatus {
        level: DiagnosticStatus::WARN,
        name: MARKUP.to_owned(),
        message: long.clone(),
        values: vec![KeyValue { key: MARKUP.to_owned(), value: long }],
        ..DiagnosticStatus::default()
    };
    DiagnosticArray { status: vec![status], ..DiagnosticArray::default() }
}
