//! The network interfaces of this machine, and the choice among them.

use std::net::Ipv4Addr;

use super::TransportError;

/// The variable that names the interfaces to use.
pub(super) const VARIABLE: &str = "STILLMAP_INTERFACES";

/// One interface. The DDS library speaks IPv4 alone, so other addresses are left out.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Interface {
    pub(crate) name: String,
    /// The kernel's number of it: one that is plugged in again has another.
    pub(crate) index: u32,
    pub(crate) addresses: Vec<Ipv4Addr>,
    pub(crate) multicast: bool,
}

impl Interface {
    pub(crate) fn is_loopback(&self) -> bool {
        self.addresses.contains(&Ipv4Addr::LOCALHOST)
    }

    /// Whether `name` means this address of it: by the interface's name, or as an address.
    pub(super) fn is_meant(&self, address: Ipv4Addr, name: &str) -> bool {
        self.name == name || name.parse() == Ok(address)
    }
}

/// All interfaces with an address, in the order in which the DDS library sees them.
pub(crate) fn of_this_machine() -> Vec<Interface> {
    netdev::get_interfaces()
        .into_iter()
        .map(|one| Interface {
            multicast: one.is_multicast(),
            index: one.index,
            addresses: one.ipv4.iter().map(netdev::ipnet::Ipv4Net::addr).collect(),
            name: one.name,
        })
        .filter(|one| !one.addresses.is_empty())
        .collect()
}

/// The largest datagram that every interface of this machine carries in one piece, but no more than Ethernet does.
pub(crate) fn smallest_mtu_bytes() -> usize {
    /// Of Ethernet.
    const USUAL: u32 = 1500;
    let has_address = |one: &netdev::Interface| !one.ipv4.is_empty();
    let mtus = netdev::get_interfaces().into_iter().filter(has_address).filter_map(|one| one.mtu);
    mtus.fold(USUAL, u32::min) as usize
}

/// The addresses of the interfaces that `wanted` gives by their names or addresses.
///
/// # Errors
/// When one of them is not there; the error names what there is.
pub(crate) fn choose(
    wanted: &[String],
    present: &[Interface],
) -> Result<Vec<Ipv4Addr>, TransportError> {
    let mut chosen = Vec::new();
    for name in wanted {
        let matching: Vec<_> = present
            .iter()
            .flat_map(|one| one.addresses.iter().map(move |address| (one, *address)))
            .filter(|(one, address)| one.is_meant(*address, name))
            .map(|(_, address)| address)
            .collect();
        if matching.is_empty() {
            return Err(TransportError {
                variable: VARIABLE,
                value: wanted.join(","),
                accepted: format!(
                    "names or IPv4 addresses of interfaces of this machine, separated by commas; \
                     there is no {name}, there is {}",
                    in_words(present)
                )
                .into(),
            });
        }
        chosen.extend(matching);
    }
    chosen.sort_unstable();
    chosen.dedup();
    Ok(chosen)
}

fn in_words(present: &[Interface]) -> String {
    let one = |interface: &Interface| {
        let addresses: Vec<_> = interface.addresses.iter().map(ToString::to_string).collect();
        format!("{} ({})", interface.name, addresses.join(", "))
    };
    if present.is_empty() {
        return "none with an IPv4 address".to_owned();
    }
    present.iter().map(one).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine() -> Vec<Interface> {
        let one = |name: &str, addresses: &[[u8; 4]], multicast| Interface {
            name: name.to_owned(),
            index: 1,
            addresses: addresses.iter().map(|octets| Ipv4Addr::from(*octets)).collect(),
            multicast,
        };
        vec![
            one("lo", &[[127, 0, 0, 1]], false),
            one("eth0", &[[10, 0, 0, 2], [10, 0, 1, 2]], true),
            one("wlan0", &[[192, 168, 1, 7]], true),
        ]
    }

    fn chosen(wanted: &[&str]) -> Result<Vec<Ipv4Addr>, TransportError> {
        let wanted: Vec<_> = wanted.iter().map(|name| (*name).to_owned()).collect();
        choose(&wanted, &machine())
    }

    #[test]
    fn interfaces_are_chosen_by_name_and_by_address() {
        assert_eq!(chosen(&["eth0"]).unwrap().len(), 2);
        assert_eq!(chosen(&["10.0.1.2"]).unwrap(), [Ipv4Addr::new(10, 0, 1, 2)]);
        assert_eq!(chosen(&["wlan0", "192.168.1.7", "eth0"]).unwrap().len(), 3);
        assert!(chosen(&[]).unwrap().is_empty());
    }

    #[test]
    fn what_is_not_there_is_named_with_what_is() {
        let error = chosen(&["eth0", "enp3s0"]).unwrap_err().to_string();
        for part in
            ["STILLMAP_INTERFACES=eth0,enp3s0", "no enp3s0", "lo (127.0.0.1)", "10.0.1.2", "wlan0"]
        {
            assert!(error.contains(part), "{error}");
        }
        assert!(chosen(&["10.0.0.3"]).is_err());
    }

    #[test]
    fn this_machine_has_a_loopback() {
        assert!(of_this_machine().iter().any(|one| one.addresses.contains(&Ipv4Addr::LOCALHOST)));
    }
}
