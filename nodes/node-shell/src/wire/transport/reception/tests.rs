use std::net::{Ipv4Addr, UdpSocket};
use std::os::fd::AsRawFd;
use std::time::Duration;

use nix::sys::epoll::{Epoll, EpollCreateFlags, EpollEvent, EpollFlags, EpollTimeout};

use super::*;

#[test]
fn a_list_of_the_kernel_is_understood() {
    let list = "pos:\t0\nflags:\t02\nmnt_id:\t15\n\
                tfd:        5 events: 80002019 data:                7  pos:0 ino:61af sdev:7\n\
                tfd:       12 events:       1d data: ffffffffffffffff  pos:0 ino:61b0 sdev:7\n\
                tfd:       12 events:       1d\n";
    let expected = [
        Awaited { instance: 3, socket: 5, events: 0x8000_2019, data: 7 },
        Awaited { instance: 3, socket: 12, events: 0x1d, data: u64::MAX },
    ];
    assert_eq!(parse(3, list), expected);
}

/// An event loop with one socket.
struct Loop {
    socket: UdpSocket,
    epoll: Epoll,
}

impl Loop {
    const DATA: u64 = 0x1234_5678_9abc;

    fn new() -> Self {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let epoll = Epoll::new(EpollCreateFlags::EPOLL_CLOEXEC).unwrap();
        let event = EpollEvent::new(EpollFlags::EPOLLIN | EpollFlags::EPOLLET, Self::DATA);
        epoll.add(&socket, event).unwrap();
        Self { socket, epoll }
    }

    /// Sends it a datagram, and waits until it is there.
    fn send(&self) {
        let sender = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        sender.send_to(b"datagram", self.socket.local_addr().unwrap()).unwrap();
        self.socket.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        self.socket.peek(&mut [0; 16]).unwrap();
    }

    fn events(&self) -> Vec<u64> {
        let mut events = [EpollEvent::empty(); 4];
        let count = self.epoll.wait(&mut events, EpollTimeout::ZERO).unwrap();
        events[..count].iter().map(EpollEvent::data).collect()
    }
}

#[test]
fn what_arrives_in_a_pause_is_there_after_it() {
    let (held, other) = (Loop::new(), Loop::new());
    let reception = Reception::of(&[held.socket.as_raw_fd()]);
    let paused = reception.pause();
    held.send();
    other.send();
    assert!(held.events().is_empty());
    assert_eq!(other.events(), [Loop::DATA], "it is not paused");
    drop(paused);
    assert_eq!(held.events(), [Loop::DATA]);
    assert!(held.events().is_empty(), "it is told once, as before");
    held.send();
    assert_eq!(held.events(), [Loop::DATA]);
}

#[test]
fn what_came_before_a_pause_and_was_not_read_is_there_after_it() {
    let held = Loop::new();
    let reception = Reception::of(&[held.socket.as_raw_fd()]);
    held.send();
    let paused = reception.pause();
    assert!(held.events().is_empty());
    drop(paused);
    assert_eq!(held.events(), [Loop::DATA]);
}

#[test]
fn a_socket_that_nothing_waits_for_cannot_be_paused() {
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    assert_eq!(Reception::of(&[socket.as_raw_fd()]).awaited, []);
    assert_eq!(Reception::of(&[]).awaited, []);
}
