//! From a frame on the wire to the datagram in it: Ethernet with VLAN tags, IPv4 and IPv6.

use etherparse::{EtherType, LaxNetSlice, LaxSlicedPacket, TransportSlice};

/// The header of the frames of an interface.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum LinkLayer {
    Ethernet,
    /// An IP packet at once.
    Raw,
    /// Four bytes with the address family.
    Loopback,
    /// Linux' "any" interface: 16 bytes, the last two of which are an EtherType.
    Cooked,
    /// The same in its second version: 20 bytes, the first two of which are an EtherType.
    Cooked2,
}

/// The contents of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum FrameContents<'a> {
    Udp {
        port: u16,
        payload: &'a [u8],
    },
    /// A part of an IP packet.
    Fragment,
    /// An IP packet that is longer than the frame.
    Cut,
    Other,
}

impl LinkLayer {
    /// By the number of tcpdump's registry (LINKTYPE_*, and DLT_RAW of some systems).
    pub(super) fn of(link_type: i32) -> Option<Self> {
        match link_type {
            1 => Some(Self::Ethernet),
            12 | 14 | 101 | 228 | 229 => Some(Self::Raw),
            0 | 108 => Some(Self::Loopback),
            113 => Some(Self::Cooked),
            276 => Some(Self::Cooked2),
            _ => None,
        }
    }

    pub(super) fn contents(self, frame: &[u8]) -> FrameContents<'_> {
        let by_ether_type = |type_at: usize, header_bytes: usize| {
            let ether_type = frame.get(type_at..type_at + 2)?;
            let ether_type = EtherType(u16::from_be_bytes(ether_type.try_into().ok()?));
            Some(LaxSlicedPacket::from_ether_type(ether_type, frame.get(header_bytes..)?))
        };
        let sliced = match self {
            Self::Ethernet => LaxSlicedPacket::from_ethernet(frame).ok(),
            Self::Raw => LaxSlicedPacket::from_ip(frame).ok(),
            Self::Loopback => frame.get(4..).and_then(|ip| LaxSlicedPacket::from_ip(ip).ok()),
            Self::Cooked => by_ether_type(14, 16),
            Self::Cooked2 => by_ether_type(0, 20),
        };
        sliced.map_or(FrameContents::Other, |packet| datagram_of(&packet))
    }
}

fn datagram_of<'a>(packet: &LaxSlicedPacket<'a>) -> FrameContents<'a> {
    let Some(ip) = packet.net.as_ref().and_then(LaxNetSlice::ip_payload_ref) else {
        return FrameContents::Other;
    };
    if ip.fragmented {
        return FrameContents::Fragment;
    }
    match &packet.transport {
        Some(TransportSlice::Udp(_)) if ip.incomplete => FrameContents::Cut,
        Some(TransportSlice::Udp(udp)) => {
            FrameContents::Udp { port: udp.destination_port(), payload: udp.payload() }
        }
        _ => FrameContents::Other,
    }
}
