use super::super::synthetic::*;
use super::*;
use crate::doctor::finding::Severity;

const SMALL: ReceiveBuffer =
    ReceiveBuffer { granted_bytes: 212_992, asked_bytes: 32 << 20, largest_safe_bytes: 212_992 };
const LARGE: ReceiveBuffer =
    ReceiveBuffer { granted_bytes: 32 << 20, asked_bytes: 32 << 20, largest_safe_bytes: 32 << 20 };

fn with_camera(mut view: GraphView, info: &str) -> GraphView {
    let camera = CameraSize { width_px: 640, height_px: 480, rate_hz: Some(30.0) };
    view.cameras.insert(info.to_owned(), camera);
    view
}

#[test]
fn a_depth_image_beyond_the_buffer_is_an_error_where_it_is_read() {
    let mut view = with_camera(view(healthy()), "/depth/camera_info");
    let findings = sizes(&view, &SMALL);
    assert_eq!(findings.len(), 1);
    let parts = [
        "/depth/image: 614 kB are more than the 212 kB",
        "640x480 pixels of 16UC1 by /depth/camera_info at 30.0 Hz",
        "net.core.rmem_max=33554432",
    ];
    assert_finding(&findings[0], Severity::Error, &parts);
    assert_finding(&sizes(&view, &LARGE)[0], Severity::Ok, &["614 kB fit"]);
    view.endpoints.retain(|one| one.role == Role::Publisher);
    assert_finding(&sizes(&view, &SMALL)[0], Severity::Warn, &["no subscribers yet"]);
}

#[test]
fn a_compressed_topic_beside_a_large_one_is_named() {
    let mut view = with_camera(view(healthy()), "/depth/camera_info");
    let compressed = "sensor_msgs/msg/CompressedImage";
    view.endpoints.push(publisher("/depth/image/compressedDepth", compressed, "/driver"));
    assert_finding(
        &sizes(&view, &SMALL)[0],
        Severity::Error,
        &["subscribe to /depth/image/compressedDepth"],
    );
}

#[test]
fn a_cloud_is_as_large_as_its_camera() {
    let graph = view(vec![publisher("/camera/depth/color/points", POINTS, "/camera")]);
    let unknown = sizes(&graph, &LARGE);
    assert_finding(&unknown[0], Severity::Ok, &["/camera/depth/color/points", "--measure"]);
    let known = with_camera(graph, "/camera/depth/camera_info");
    let buffer = ReceiveBuffer { largest_safe_bytes: 4 << 20, ..SMALL };
    assert_finding(&sizes(&known, &buffer)[0], Severity::Warn, &["4915 kB", "points of 16 bytes"]);
}

#[test]
fn the_nearest_calibration_counts() {
    let mut cameras = BTreeMap::new();
    let camera = |width_px| CameraSize { width_px, height_px: 1, rate_hz: None };
    cameras.insert("/camera/camera_info".to_owned(), camera(1));
    cameras.insert("/camera/depth/camera_info".to_owned(), camera(2));
    cameras.insert("/camera_info".to_owned(), camera(3));
    let width = |topic| camera_of(&cameras, topic).map(|(_, camera)| camera.width_px);
    assert_eq!(width("/camera/depth/image"), Some(2));
    assert_eq!(width("/camera/color/image"), Some(1));
    assert_eq!(width("/camera2/image"), None);
}

#[test]
fn a_measured_size_replaces_the_expected_one_and_silence_is_reported() {
    let mut view = with_camera(view(healthy()), "/depth/camera_info");
    let measured = Measured { messages: 90, largest_bytes: 1_228_800, rate_hz: Some(30.0) };
    view.measured.insert("/depth/image".to_owned(), measured);
    let parts = ["1228 kB", "measured, 90 messages at 30.0 Hz"];
    assert_finding(&sizes(&view, &LARGE)[0], Severity::Ok, &parts);
    view.measured.insert("/depth/image".to_owned(), Measured::default());
    assert_finding(
        &sizes(&view, &SMALL)[0],
        Severity::Warn,
        &["nothing of /depth/image", "212 kB"],
    );
}

fn machine() -> Machine {
    use std::collections::BTreeSet;
    use std::net::Ipv4Addr;

    use crate::doctor::machine::KernelLimits;

    Machine {
        domain_id: 0,
        range: node_shell::DiscoveryRange::Subnet,
        has_static_peers: false,
        transport: String::new(),
        interfaces: Vec::new(),
        own_addresses: BTreeSet::from([Ipv4Addr::new(10, 0, 0, 2)]),
        limits: KernelLimits {
            wmem_max_bytes: Some(212_992),
            ipfrag_high_thresh_bytes: Some(4 << 20),
            ipfrag_time_s: Some(30),
            ..KernelLimits::default()
        },
    }
}

#[test]
fn large_topics_between_machines_are_compared_with_the_kernel_limits() {
    let machine = machine();
    assert!(across_machines(&view(healthy()), &machine).is_empty());
    let coming = view(vec![at(publisher("/points", POINTS, "/camera"), [10, 0, 0, 5])]);
    let findings = across_machines(&coming, &machine);
    assert_eq!(findings.len(), 1);
    assert_finding(&findings[0], Severity::Warn, &["/points comes from 10.0.0.5 (Cyclone DDS)"]);
    let leaving = view(vec![
        publisher("/points", POINTS, "/camera"),
        at(subscription("/points", POINTS, "/viewer"), [10, 0, 0, 5]),
    ]);
    let findings = across_machines(&leaving, &machine);
    assert_eq!(findings.len(), 1);
    assert_finding(&findings[0], Severity::Warn, &["/points goes to another machine", "wmem_max"]);
}
