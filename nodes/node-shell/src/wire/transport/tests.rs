use super::*;

#[test]
fn the_transport_reports_its_reach() {
    let transport = Transport::on_domain(3).unwrap();
    assert_eq!(transport.to_string(), "domain 3, all networks");
    let local = transport.clone().loopback_only();
    assert_eq!(local.to_string(), "domain 3, this machine only");
    let peers = local.with_static_peers(["10.0.0.2", "robot"]).unwrap().with_interfaces(["eth0"]);
    assert_eq!(
        peers.to_string(),
        "domain 3, this machine only and static peers 10.0.0.2, robot, interfaces eth0"
    );
    let off = peers.with_range(DiscoveryRange::Off);
    assert_eq!(off.to_string(), "domain 3, no other process, interfaces eth0");
    assert_eq!(Transport::on_domain(233), None);
}

#[test]
fn a_receive_buffer_beyond_what_can_be_asked_for_is_brought_in_bounds() {
    let transport = Transport::on_domain(3).unwrap();
    assert_eq!(transport.clone().with_receive_buffer(0).receive_buffer, 64 << 10);
    assert_eq!(transport.with_receive_buffer(usize::MAX).receive_buffer, (1 << 30) - 1024);
}

#[test]
fn a_peer_that_is_none_is_refused() {
    let peers = |texts: &[&'static str]| {
        Transport::on_domain(3).unwrap().with_static_peers(texts.iter().copied())
    };
    assert!(peers(&["10.0.0.2", "robot-1"]).is_ok());
    let error = peers(&["10.0.0.2", "not a host"]).unwrap_err();
    assert!(error.to_string().starts_with("ROS_STATIC_PEERS=10.0.0.2;not a host"), "{error}");
}
