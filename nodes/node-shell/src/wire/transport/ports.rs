//! The port numbers that DDS derives from the domain and the participant's number (RTPS 2.5, section
//! 9.6.2.3).

const BASE: u16 = 7400;
const PER_DOMAIN: u16 = 250;
const PER_PARTICIPANT: u16 = 2;

/// The highest domain for which the first port numbers fit in 16 bits.
pub(crate) const HIGHEST_DOMAIN: u16 = 232;

/// How many participants of one domain a machine can hold: further ones would run into the ports of
/// the next domain.
pub(crate) const PARTICIPANTS_PER_HOST: u16 = 120;

/// Where all participants of a domain hear announcements.
pub(crate) const fn discovery_multicast(domain: u16) -> u16 {
    BASE + PER_DOMAIN * domain
}

/// Where all participants of a domain hear data.
pub(crate) const fn data_multicast(domain: u16) -> u16 {
    discovery_multicast(domain) + 1
}

/// Where one participant hears announcements; `None` for those that the highest domain has no ports
/// left for.
pub(crate) const fn discovery_unicast(domain: u16, participant: u16) -> Option<u16> {
    (discovery_multicast(domain) + 10).checked_add(PER_PARTICIPANT.saturating_mul(participant))
}

/// Where one participant hears data.
pub(crate) const fn data_unicast(domain: u16, participant: u16) -> Option<u16> {
    (discovery_multicast(domain) + 11).checked_add(PER_PARTICIPANT.saturating_mul(participant))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ports_are_those_of_the_specification() {
        assert_eq!((discovery_multicast(0), data_multicast(0)), (7400, 7401));
        assert_eq!((discovery_unicast(0, 0), data_unicast(0, 0)), (Some(7410), Some(7411)));
        assert_eq!((discovery_unicast(1, 3), data_unicast(1, 3)), (Some(7666), Some(7667)));
    }

    #[test]
    fn every_port_stays_in_its_domain_and_in_16_bits() {
        let last = PARTICIPANTS_PER_HOST - 1;
        assert!(data_unicast(0, last) < Some(discovery_multicast(1)));
        assert_eq!(data_unicast(HIGHEST_DOMAIN, 62), Some(65_535));
        assert_eq!(discovery_unicast(HIGHEST_DOMAIN, 63), None);
        assert_eq!(data_unicast(HIGHEST_DOMAIN, last), None);
    }
}
