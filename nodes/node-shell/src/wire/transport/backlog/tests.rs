use std::net::UdpSocket;
use std::os::fd::AsRawFd;

use super::*;

#[test]
fn a_socket_in_which_much_waits_is_closed_until_it_is_empty() {
    let start = Instant::now();
    let mut backlog = Backlog::default();
    let mut at = |ms, waiting| backlog.look(start + Duration::from_millis(ms), waiting);
    assert_eq!(at(0, Waiting::Much), None);
    assert_eq!(at(199, Waiting::Much), None);
    assert_eq!(at(200, Waiting::Much), Some(Turn::Close));
    assert_eq!(at(500, Waiting::Much), None, "it is closed once");
    assert_eq!(at(505, Waiting::Some), None, "it is not yet empty");
    assert_eq!(at(510, Waiting::Nothing), Some(Turn::Open));
    assert_eq!(at(520, Waiting::Nothing), None, "it is opened once");
    assert_eq!(at(530, Waiting::Much), None);
    assert_eq!(at(730, Waiting::Much), Some(Turn::Close));
}

/// Regression: a subscriber that kept up with 588 MB/s, its socket hardly ever empty, lost a third of it.
#[test]
fn a_socket_in_which_less_waits_now_and_then_stays_open() {
    let start = Instant::now();
    let mut backlog = Backlog::default();
    for look in 0..1000 {
        let waiting = if look % 15 == 0 { Waiting::Some } else { Waiting::Much };
        assert_eq!(backlog.look(start + look * BUSY_LOOK, waiting), None);
    }
}

/// Regression: on a machine without CPU time the library read on and on, and memory grew by all that was sent.
#[test]
fn a_reader_that_falls_behind_gets_to_the_end_of_its_socket() {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = socket.local_addr().unwrap();
    let watched = match SocketHandle::of(socket.as_raw_fd()) {
        Ok(watched) => watched,
        Err(error) => return println!("skipped: no second handle of a socket here ({error})"),
    };
    let granted = watched.receive_buffer().unwrap();
    let _watch = BacklogWatch::start(vec![watched]).unwrap();
    let (stop, stopped) = channel::<()>();
    let sender = std::thread::spawn(move || {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        while stopped.try_recv() != Err(std::sync::mpsc::TryRecvError::Disconnected) {
            let _ = socket.send_to(&[0; 1000], address);
            std::thread::sleep(Duration::from_micros(200));
        }
    });
    socket.set_nonblocking(true).unwrap();
    // It has the CPU only now and then, and for less than what has come meanwhile.
    const IN_A_TURN: usize = 20;
    const BETWEEN_TURNS: Duration = Duration::from_millis(20);
    let mut read = 0;
    let patience = Instant::now() + Duration::from_secs(20);
    // The first one has yet to come.
    while socket.peek(&mut [0; 1000]).is_err() {
        std::thread::sleep(Duration::from_millis(1));
    }
    while socket.recv(&mut [0; 1000]).is_ok() {
        if read % IN_A_TURN == 0 {
            std::thread::sleep(BETWEEN_TURNS);
        }
        read += 1;
        assert!(Instant::now() < patience, "it never was empty: {read} datagrams read");
    }
    drop(stop);
    sender.join().unwrap();
    let handle = socket2::SockRef::from(&socket);
    let opened = || handle.recv_buffer_size().unwrap() / 2 == granted;
    while socket.recv(&mut [0; 1000]).is_ok() || !opened() {
        std::thread::sleep(Duration::from_millis(1));
        assert!(Instant::now() < patience, "the receive buffer was not restored");
    }
}
