use proptest::prelude::*;

use super::*;
use crate::wire::transport::WANTED_RECEIVE_BUFFER;

fn read_from(variables: &[(&str, &str)]) -> Result<Transport, TransportError> {
    read(|name| {
        variables.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned())
    })
}

#[test]
fn without_variables_all_networks_of_domain_0_are_used() {
    let transport = read_from(&[]).unwrap();
    assert_eq!(transport, Transport::on_domain(0).unwrap());
    assert_eq!(transport.receive_buffer, WANTED_RECEIVE_BUFFER);
    assert_eq!(
        read_from(&[("ROS_DOMAIN_ID", ""), ("ROS_STATIC_PEERS", " ; ")]).unwrap(),
        transport
    );
}

#[test]
fn the_domain_is_read() {
    assert_eq!(read_from(&[("ROS_DOMAIN_ID", " 42 ")]).unwrap().domain_id(), 42);
    assert_eq!(read_from(&[("ROS_DOMAIN_ID", "232")]).unwrap().domain_id(), 232);
}

#[test]
fn the_range_is_read() {
    let range = |variables: &[(&str, &str)]| read_from(variables).unwrap().range;
    assert_eq!(range(&[]), DiscoveryRange::Subnet);
    for (value, expected) in [
        ("SUBNET", DiscoveryRange::Subnet),
        ("SYSTEM_DEFAULT", DiscoveryRange::Subnet),
        ("LOCALHOST", DiscoveryRange::Localhost),
        ("OFF", DiscoveryRange::Off),
    ] {
        assert_eq!(range(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", value)]), expected);
    }
    assert_eq!(range(&[("ROS_LOCALHOST_ONLY", "0")]), DiscoveryRange::Subnet);
}

#[test]
fn the_older_variable_for_localhost_wins_over_range_and_peers() {
    for range in ["SUBNET", "OFF", "LOCALHOST"] {
        let transport = read_from(&[
            ("ROS_LOCALHOST_ONLY", "1"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", range),
            ("ROS_STATIC_PEERS", "10.0.0.2"),
        ])
        .unwrap();
        assert_eq!(transport, Transport::on_domain(0).unwrap().loopback_only());
    }
}

#[test]
fn peers_interfaces_and_the_buffer_are_read() {
    let transport = read_from(&[
        ("ROS_STATIC_PEERS", "10.0.0.2; robot-1.local ;;_driver"),
        ("STILLMAP_INTERFACES", "eth0, 192.168.1.7"),
        ("STILLMAP_RECEIVE_BUFFER_KIB", "208"),
    ])
    .unwrap();
    let expected = Transport::on_domain(0)
        .unwrap()
        .with_static_peers(["10.0.0.2", "robot-1.local", "_driver"])
        .unwrap()
        .with_interfaces(["eth0", "192.168.1.7"])
        .with_receive_buffer(208 * 1024);
    assert_eq!(transport, expected);
}

#[test]
fn what_is_not_understood_is_named_with_what_is_accepted() {
    for (name, value, accepted) in [
        ("ROS_DOMAIN_ID", "233", "0 to 232"),
        ("ROS_DOMAIN_ID", "-1", "0 to 232"),
        ("ROS_DOMAIN_ID", "a", "0 to 232"),
        ("ROS_LOCALHOST_ONLY", "yes", "0 or 1"),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "NEAR", "SYSTEM_DEFAULT"),
        ("ROS_STATIC_PEERS", "10.0.0.256", "semicolons"),
        ("ROS_STATIC_PEERS", "10.0.0.1,10.0.0.2", "semicolons"),
        ("ROS_STATIC_PEERS", "0.0.0.0", "semicolons"),
        ("ROS_STATIC_PEERS", "fe80::1", "semicolons"),
        ("STILLMAP_RECEIVE_BUFFER_KIB", "63", "64 to 1048575"),
        ("STILLMAP_RECEIVE_BUFFER_KIB", "32MiB", "64 to 1048575"),
    ] {
        let error = read_from(&[(name, value)]).unwrap_err().to_string();
        assert!(error.starts_with(&format!("{name}={value}: accepted is")), "{error}");
        assert!(error.contains(accepted), "{error}");
    }
}

#[test]
fn more_peers_than_ros_takes_are_refused() {
    let peers = |count: u8| (1..=count).map(|last| format!("10.0.0.{last}")).collect::<Vec<_>>();
    let value = |count| peers(count).join(";");
    assert!(read_from(&[("ROS_STATIC_PEERS", &value(32))]).is_ok());
    assert!(read_from(&[("ROS_STATIC_PEERS", &value(33))]).is_err());
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused_by_its_name(
        at in 0_usize..6, value in "[ -~]{0,40}|[0-9.;,]{0,40}|\\PC{0,10}"
    ) {
        let name = [
            "ROS_DOMAIN_ID", "ROS_LOCALHOST_ONLY", "ROS_AUTOMATIC_DISCOVERY_RANGE",
            "ROS_STATIC_PEERS", "STILLMAP_INTERFACES", "STILLMAP_RECEIVE_BUFFER_KIB",
        ][at];
        match read_from(&[(name, &value)]) {
            Ok(transport) => {
                prop_assert!(transport.domain_id() <= 232);
                prop_assert!((64 << 10..1 << 30).contains(&transport.receive_buffer));
                prop_assert!(transport.static_peers.len() <= 32);
            }
            Err(error) => prop_assert_eq!(error.variable, name),
        }
    }

    #[test]
    fn addresses_come_back_as_they_were_given(addresses in prop::collection::vec(1_u32..0xdfff_ffff, 1..32)) {
        let addresses: Vec<_> = addresses.into_iter().map(Ipv4Addr::from).collect();
        let value = addresses.iter().map(ToString::to_string).collect::<Vec<_>>().join(";");
        let expected: Vec<_> = addresses.into_iter().map(StaticPeer::Address).collect();
        prop_assert_eq!(read_from(&[("ROS_STATIC_PEERS", &value)]).unwrap().static_peers, expected);
    }
}
