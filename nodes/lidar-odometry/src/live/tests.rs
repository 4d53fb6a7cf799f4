use std::time::Instant;

use super::*;
use crate::packets::encoder::Encoder;
use crate::packets::{Continuity, DecoderConfig, Model, PacketDecoder, ReturnMode};

fn on_loopback() -> LiveConfig {
    LiveConfig {
        address: IpAddr::V4(Ipv4Addr::LOCALHOST),
        data_port: 0,
        position_port: None,
        ..LiveConfig::default()
    }
}

fn sender() -> UdpSocket {
    UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap()
}

/// Long enough for whatever else the machine does.
const PATIENCE: Duration = Duration::from_secs(120);

/// Waits until a condition holds.
fn wait_until(mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "waited in vain");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn nothing_is_lost_at_the_rate_of_an_hdl_64e() {
    let encoder = Encoder::new(Model::Hdl64e, ReturnMode::Strongest);
    let packets = encoder.packets(1736, |_, _| [Some((5.0, 7)), None]);
    let source = LiveSource::open(&on_loopback()).unwrap();
    let socket = sender();
    let (shared, address) = (Arc::clone(&source.shared), source.data_address());
    let (packets, start) = (&packets, Instant::now());
    let period = Duration::from_secs_f64(Model::Hdl64e.packet_period_s(ReturnMode::Strongest));
    std::thread::scope(|scope| {
        scope.spawn(move || {
            for (index, packet) in packets.iter().enumerate() {
                let due = start + period * index as u32;
                std::thread::sleep(due.saturating_duration_since(Instant::now()));
                // The smallest buffer that a kernel gives holds more than these: a listener that the machine lets
                // wait for long is no loss of this program's making.
                wait_until(|| shared.received.load(Ordering::Relaxed) + 64 > index as u64);
                socket.send_to(packet, address).unwrap();
            }
        });
        let mut decoder = PacketDecoder::new(DecoderConfig::default()).unwrap();
        let mut continuity = Continuity::default();
        for expected in packets {
            let datagram = source.next_within(PATIENCE).expect("a packet that was sent");
            assert_eq!(&datagram.payload, expected);
            continuity.push(&decoder.decode(&datagram.payload).unwrap());
        }
        let counts = continuity.counts();
        assert_eq!((counts.packets, counts.lost, counts.out_of_order), (1736, 0, 0));
    });
    let rate_hz = packets.len() as f64 / start.elapsed().as_secs_f64();
    println!("{} packets at {rate_hz:.0} a second", packets.len());
    let expected = LiveCounts { received: 1736, ..LiveCounts::default() };
    assert_eq!(source.counts(), expected);
}

#[test]
fn datagrams_not_read_in_time_are_dropped_and_counted() {
    let config = LiveConfig { queue_datagrams: 3, ..on_loopback() };
    let source = LiveSource::open(&config).unwrap();
    let socket = sender();
    for byte in 0..10 {
        socket.send_to(&[byte], source.data_address()).unwrap();
        wait_until(|| source.counts().received == u64::from(byte) + 1);
    }
    wait_until(|| source.counts().dropped == 7);
    let kept: Vec<u8> = (0..3).map(|_| source.next_within(PATIENCE).unwrap().payload[0]).collect();
    assert_eq!(kept, [0, 1, 2]);
    assert_eq!(source.next_within(Duration::ZERO), None);
}

#[test]
fn other_hosts_are_not_heard_where_the_scanner_is_known() {
    let scanner = Some(IpAddr::V4(Ipv4Addr::new(192, 168, 1, 201)));
    let source = LiveSource::open(&LiveConfig { scanner, ..on_loopback() }).unwrap();
    sender().send_to(b"of this host", source.data_address()).unwrap();
    wait_until(|| source.counts().of_others == 1);
    assert_eq!(source.counts().received, 0);
}

#[test]
fn a_port_that_is_taken_is_named_and_a_dropped_source_gives_it_back() {
    let source = LiveSource::open(&on_loopback()).unwrap();
    let config = LiveConfig { data_port: source.data_address().port(), ..on_loopback() };
    let error = LiveSource::open(&config).unwrap_err().to_string();
    assert!(error.contains(&format!("cannot listen on {}", source.data_address())), "{error}");
    drop(source);
    LiveSource::open(&config).unwrap();
    let error = LiveSource::open(&LiveConfig { queue_datagrams: 0, ..config }).unwrap_err();
    assert_eq!(error.to_string(), "queue_datagrams is 0");
}
