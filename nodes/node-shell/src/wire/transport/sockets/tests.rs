use std::net::UdpSocket;
use std::os::fd::AsRawFd;

use proptest::prelude::*;

use super::*;

const LIST: &str = "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  \
                    timeout inode ref pointer drops\n 1218: 00000000:1CF3 00000000:0000 07 \
                    00000000:000002A0 00:00000000 00000000  1000        0 34567 2 0000000000000000 \
                    812\n 9999: 0100007F:0035 00000000:0000 07 00000000:00000000 00:00000000 \
                    00000000     0        0 77 2 ffff9c 0\n";

#[test]
fn the_kernels_list_is_understood() {
    let entries = parse_list(LIST);
    assert_eq!(
        entries,
        [
            UdpSocketEntry { port: 7411, inode: 34_567, dropped: 812 },
            UdpSocketEntry { port: 53, inode: 77, dropped: 0 },
        ]
    );
}

proptest! {
    #[test]
    fn no_list_is_a_fault(list in "\\PC{0,200}", cut in 0_usize..400) {
        parse_list(&list);
        if let Some(part) = LIST.get(..cut) {
            prop_assert!(parse_list(part).len() <= 2);
        }
    }
}

/// The socket of this inode, with so many drops.
fn entry(inode: u64, dropped: u64) -> UdpSocketEntry {
    UdpSocketEntry { port: 7411, inode, dropped }
}

#[test]
fn sockets_that_come_and_go_make_no_other_listed_twice_or_left_out() {
    let readings = [
        vec![entry(1, 0), entry(2, 3), entry(2, 3)],
        vec![entry(2, 3), entry(3, 0)],
        vec![entry(1, 4), entry(2, 5), entry(3, 0)],
        vec![entry(1, 4), entry(2, 5), entry(3, 0)],
    ];
    let mut left = readings.clone().into_iter();
    let list = whole_list(|| Ok(left.next().unwrap())).unwrap();
    assert_eq!(list, [entry(1, 4), entry(2, 5), entry(3, 0)]);
    assert_eq!(left.len(), 0);

    let mut count = 0;
    let list = whole_list(|| {
        count += 1;
        Ok(vec![entry(count, 0)])
    });
    assert_eq!(list.unwrap().len(), MOST_READINGS, "a list that never settles ends");
    assert!(whole_list(|| Err(std::io::ErrorKind::NotFound.into())).is_err());
}

#[test]
fn the_kernel_grants_no_more_than_was_asked() {
    let granted = read_back(64 << 10).unwrap();
    assert!(granted > 0 && granted <= 64 << 10, "{granted}");
}

/// A socket of this process with what the kernel says of it; `None` where the kernel does not.
fn listed_socket() -> Option<(UdpSocket, UdpSocketEntry, i32)> {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = socket.local_addr().unwrap().port();
    match own_at(&[port], &BTreeMap::new()) {
        // Another socket of this process may have the port at another address.
        Ok(found) => {
            let own = found.iter().find(|(_, number)| *number == socket.as_raw_fd());
            let &(entry, number) = own.expect("it is listed");
            Some((socket, entry, number))
        }
        Err(error) => {
            println!(
                "skipped: the kernel lists no sockets ({error}); drops cannot be counted here"
            );
            None
        }
    }
}

#[test]
fn a_socket_that_overflows_counts_what_it_drops() {
    let Some((socket, before, _)) = listed_socket() else { return };
    assert_eq!(before.dropped, 0);
    let address = socket.local_addr().unwrap();
    let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
    let granted = socket2::SockRef::from(&socket).recv_buffer_size().unwrap();
    for _ in 0..granted / 10_000 {
        sender.send_to(&[0; 30_000], address).unwrap();
    }
    let after = own_at(&[address.port()], &BTreeMap::new()).unwrap();
    let after = after.iter().find(|(entry, _)| entry.inode == before.inode).unwrap().0;
    assert!(after.dropped > 0, "{after:?}");
}

#[test]
fn sockets_that_were_there_before_are_left_out() {
    let Some((_socket, entry, _)) = listed_socket() else { return };
    assert!(own_at(&[entry.port], &own().unwrap()).unwrap().is_empty());
}

#[test]
fn a_buffer_is_read_and_grown_where_that_may_be_had() {
    let Some((socket, _, number)) = listed_socket() else { return };
    let socket = socket2::SockRef::from(&socket);
    socket.set_recv_buffer_size(64 << 10).unwrap();
    let beyond_the_limit = 256 << 20;
    let grown = |wanted| SocketHandle::of(number)?.grown_receive_buffer(wanted);
    match grown(beyond_the_limit) {
        Ok(Grown { bytes, forced: true }) => {
            assert_eq!(bytes, beyond_the_limit);
            assert_eq!(socket.recv_buffer_size().unwrap(), 2 * beyond_the_limit);
        }
        Ok(Grown { bytes, forced: false }) => {
            println!("skipped in part: no right to grow a buffer beyond the kernel's limit");
            assert_eq!(bytes, 64 << 10);
        }
        Err(error) => println!("skipped: no second handle of a socket here ({error})"),
    }
    if let Ok(grown) = grown(1) {
        assert!(!grown.forced, "a buffer is never made smaller");
    }
}

#[test]
fn what_waits_is_seen_until_it_is_read_and_a_closed_buffer_takes_no_more() {
    let Some((socket, _, number)) = listed_socket() else { return };
    let handle = match SocketHandle::of(number) {
        Ok(handle) => handle,
        Err(error) => return println!("skipped: no second handle of a socket here ({error})"),
    };
    let granted = handle.receive_buffer().unwrap();
    let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
    let send = |times| {
        for _ in 0..times {
            sender.send_to(&[0; 1000], socket.local_addr().unwrap()).unwrap();
        }
    };
    socket.set_nonblocking(true).unwrap();
    let read_all = || std::iter::from_fn(|| socket.recv(&mut [0; 1000]).ok()).count();
    let waiting_bytes = || handle.waiting_bytes().unwrap();
    assert_eq!(waiting_bytes(), 0);
    send(10);
    assert!(waiting_bytes() >= 10_000);
    handle.set_receive_buffer(0).unwrap();
    send(10);
    assert_eq!(read_all(), 10, "what came before the buffer was closed stays");
    assert_eq!(waiting_bytes(), 0);
    handle.set_receive_buffer(granted).unwrap();
    assert_eq!(handle.receive_buffer().unwrap(), granted);
    send(10);
    assert_eq!(read_all(), 10);
}
