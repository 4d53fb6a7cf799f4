use super::*;

fn interface(name: &str, index: u32, address: [u8; 4]) -> Interface {
    Interface {
        name: name.to_owned(),
        index,
        addresses: vec![address.into()],
        multicast: name != "lo",
    }
}

fn machine(wlan_index: u32, wlan: [u8; 4]) -> Vec<Interface> {
    vec![
        interface("lo", 1, [127, 0, 0, 1]),
        interface("eth0", 2, [10, 0, 0, 2]),
        interface("wlan0", wlan_index, wlan),
    ]
}

fn change(transport: &Transport, before: &[Interface], now: &[Interface]) -> NetworkChange {
    NetworkChange::between(&transport.addresses(before), &transport.addresses(now))
}

/// Regression: nodes went on with the addresses of their start, deaf and without a word.
#[test]
fn another_address_and_an_interface_that_is_plugged_in_again_are_changes() {
    let all = Transport::on_domain(0).unwrap();
    let before = machine(3, [192, 168, 1, 7]);
    let same = change(&all, &before, &before);
    assert!(same.is_none() && !same.has_new() && !same.has_gone());
    for now in [machine(3, [192, 168, 1, 8]), machine(4, [192, 168, 1, 7])] {
        let change = change(&all, &before, &now);
        assert!(change.has_new() && change.has_gone(), "{change:?}");
    }
    let wlan_gone = change(&all, &before, &before[..2]);
    assert!(wlan_gone.has_gone() && !wlan_gone.has_new());
    assert_eq!(wlan_gone.to_string(), "the network has changed: wlan0 (192.168.1.7) has gone");
    assert_eq!(
        change(&all, &before, &machine(3, [192, 168, 1, 8])).to_string(),
        "the network has changed: wlan0 (192.168.1.7) has gone; wlan0 (192.168.1.8) has come, and is used from the next start of the \
         node on"
    );
    let late = change(&all, &before[..1], &before);
    assert!(late.has_new() && !late.has_gone());
}

#[test]
fn only_interfaces_that_are_used_count() {
    let (before, now) = (machine(3, [192, 168, 1, 7]), machine(3, [192, 168, 1, 8]));
    let of =
        |names: &[&str]| Transport::on_domain(0).unwrap().with_interfaces(names.iter().copied());
    assert!(change(&of(&["eth0"]), &before, &now).is_none());
    assert!(change(&of(&["10.0.0.2", "lo"]), &before, &now).is_none());
    assert!(change(&of(&["wlan0"]), &before, &now).has_new());
    let by_address = change(&of(&["192.168.1.7"]), &before, &now);
    assert!(by_address.has_gone() && !by_address.has_new());
}

#[test]
fn nodes_of_one_machine_do_not_follow_addresses() {
    let machine = machine(3, [192, 168, 1, 7]);
    let all = Transport::on_domain(0).unwrap();
    assert!(all.follows_addresses(&machine) && all.follows_addresses(&[]));
    let local = all.clone().loopback_only();
    assert!(!local.follows_addresses(&machine));
    assert!(local.with_static_peers(["10.0.0.3"]).unwrap().follows_addresses(&machine));
    assert!(!all.clone().with_range(DiscoveryRange::Off).follows_addresses(&machine));
    assert!(!all.with_interfaces(["lo"]).follows_addresses(&machine));
}

#[test]
fn a_change_is_known_until_the_network_is_as_it_was() {
    let watch = NetworkWatch::default();
    let all = Transport::on_domain(0).unwrap();
    let machine = machine(3, [192, 168, 1, 7]);
    watch.note(change(&all, &machine, &machine[..2]));
    assert!(watch.clone().change().has_gone());
    watch.note(NetworkChange::default());
    assert!(watch.change().is_none());
}
