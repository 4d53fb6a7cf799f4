use std::collections::BTreeMap;

use free_domain::FreeDomain;

use super::*;

fn machine() -> Vec<Interface> {
    let one = |name: &str, octets: [u8; 4], multicast| Interface {
        name: name.to_owned(),
        index: 1,
        addresses: vec![octets.into()],
        multicast,
    };
    vec![one("lo", [127, 0, 0, 1], false), one("eth0", [10, 0, 0, 2], true)]
}

fn plan(transport: Transport) -> Plan {
    transport.plan(&machine()).unwrap()
}

fn on(domain: &FreeDomain) -> Transport {
    Transport::on_domain(domain.number()).unwrap()
}

fn domain() -> Transport {
    Transport::on_domain(7).unwrap()
}

const LOOPBACK: Ipv4Addr = Ipv4Addr::LOCALHOST;
const ETH0: Ipv4Addr = Ipv4Addr::new(10, 0, 0, 2);

#[test]
fn the_range_decides_on_networks_and_multicast() {
    let subnet = plan(domain());
    assert_eq!(subnet.networks, None);
    assert!(subnet.multicast && subnet.this_machine && !subnet.static_peers);
    assert!(subnet.multicast_possible(&machine()) && !subnet.is_loopback_only());

    let localhost = plan(domain().loopback_only());
    assert_eq!(localhost.networks, Some(vec![LOOPBACK]));
    assert!(localhost.is_loopback_only() && !localhost.multicast_possible(&machine()));

    let off =
        plan(domain().with_range(DiscoveryRange::Off).with_static_peers(["10.0.0.3"]).unwrap());
    assert_eq!(off.networks, Some(Vec::new()));
    assert!(!off.this_machine && !off.static_peers && !off.multicast_possible(&machine()));
}

#[test]
fn static_peers_of_a_local_node_are_reached_without_multicast() {
    let peers = plan(domain().loopback_only().with_static_peers(["10.0.0.3"]).unwrap());
    assert_eq!(peers.networks, None);
    assert!(peers.static_peers && !peers.multicast && peers.multicast_possible(&machine()));
    let both = plan(domain().with_static_peers(["10.0.0.3"]).unwrap());
    assert!(both.multicast && !both.offers_multicast, "announced by multicast, sent to directly");
}

#[test]
fn chosen_interfaces_come_with_the_loopback() {
    let chosen = plan(domain().with_interfaces(["eth0"]));
    assert_eq!(chosen.networks, Some(vec![LOOPBACK, ETH0]));
    assert_eq!(plan(domain().with_interfaces(["lo"])).networks, Some(vec![LOOPBACK]));
    assert!(domain().with_interfaces(["eth1"]).plan(&machine()).is_err());
}

#[test]
fn who_joins_knows_its_sockets_and_their_buffer() {
    let domain = FreeDomain::new();
    let joined = on(&domain).with_receive_buffer(128 << 10).join().unwrap();
    assert_eq!(joined.granted.bytes(), 128 << 10);
    assert_eq!(joined.health.granted_buffer(), joined.granted);
    match joined.health.dropped_datagrams() {
        Some(dropped) => {
            assert_eq!(dropped, 0);
            assert_eq!(joined.backlog.is_some(), cfg!(target_os = "linux"), "watched");
        }
        None => println!("skipped in part: the kernel lists no sockets here"),
    }
}

#[test]
fn a_flood_of_datagrams_is_seen_as_dropped() {
    let domain = FreeDomain::new();
    let joined = on(&domain).with_receive_buffer(64 << 10).join().unwrap();
    if joined.health.dropped_datagrams().is_none() {
        println!("skipped: the kernel lists no sockets here, so drops cannot be counted");
        return;
    }
    let port = ports::data_unicast(domain.number(), joined.participant.participant_id()).unwrap();
    let sender = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    let start = std::time::Instant::now();
    while joined.health.dropped_datagrams() == Some(0) {
        assert!(start.elapsed().as_secs() < 20, "nothing was dropped");
        for _ in 0..1000 {
            // Not a DDS message: the library throws it away.
            let _ = sender.send_to(&[0; 60_000], (LOOPBACK, port));
        }
    }
}

#[test]
fn with_static_peers_no_multicast_is_offered() {
    let domain = FreeDomain::new();
    let transport = on(&domain).with_static_peers(["127.0.0.1"]).unwrap();
    let (joined, announced) = transport.join_announcing().unwrap();
    assert!(announced.unwrap().data_multicast.is_empty());
    let data = [ports::data_multicast(domain.number())];
    match sockets::own_at(&data, &BTreeMap::new()) {
        Ok(found) => assert!(found.is_empty(), "{found:?}"),
        Err(error) => println!("skipped: the kernel lists no sockets here ({error})"),
    }
    drop(joined);
    // The port is free again, for all.
    let joined = on(&domain).join().unwrap();
    if let Ok(found) = sockets::own_at(&data, &BTreeMap::new()) {
        assert_eq!(found.len(), 1, "{found:?}");
    }
    drop(joined);
}

#[test]
fn an_interface_that_is_not_there_is_named() {
    let domain = FreeDomain::new();
    let error = on(&domain).with_interfaces(["enp0s99"]).join().err().unwrap().to_string();
    assert!(error.contains("enp0s99") && error.contains("127.0.0.1"), "{error}");
}

#[test]
fn who_comes_upon_barred_ports_tries_again() {
    let domain = FreeDomain::new();
    let possible = on(&domain).plan(&interfaces::of_this_machine()).unwrap();
    if !possible.multicast_possible(&interfaces::of_this_machine()) || sockets::list().is_err() {
        println!("skipped: no multicast on this machine, or its sockets are not listed");
        return;
    }
    let bar = MulticastBar::raise(domain.number()).unwrap();
    let blocked = on(&domain).join_announcing().unwrap().1.unwrap();
    assert!(blocked.discovery_multicast.is_empty(), "what is not heard is not announced");
    drop(bar);
    let free = on(&domain).join_announcing().unwrap().1.unwrap();
    assert_eq!(free.discovery_multicast.len(), 1);
}
