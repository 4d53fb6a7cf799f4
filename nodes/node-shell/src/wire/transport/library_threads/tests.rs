use std::io::Read;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;

use super::*;
use free_domain::FreeDomain;
use msgs::std_msgs::Bool;

use crate::{Node, Publisher, Qos, RosArguments, Subscription, Transport};

/// No test needs this long, on the busiest of machines.
const PATIENCE: Duration = Duration::from_secs(600);

const STATUS: &str = "Name:\tRustDDS discove\nUmask:\t0022\nState:\tS (sleeping)\nTgid:\t2409\nThreads:\t7\n\
                      voluntary_ctxt_switches:\t310\nnonvoluntary_ctxt_switches:\t12\n";

#[test]
fn a_thread_is_known_by_its_name_and_its_state() {
    let idles = Some(Look { idles: true, switches: 322 });
    let busy = Some(Look { idles: false, switches: 322 });
    assert_eq!(parse(STATUS, "ep_poll"), idles);
    assert_eq!(parse(STATUS, ""), idles, "a kernel that does not tell");
    let runs = STATUS.replace("S (sleeping)", "R (running)");
    assert_eq!(parse(&runs, "0"), busy);
    assert_eq!(parse(&STATUS.replace("RustDDS", "tokio"), "ep_poll"), None);
    assert_eq!(parse("Name:\tRustDDS discove\n", "ep_poll"), None, "it says too little");
}

/// It once counted as idle: an endpoint was made while the library's thread still had work, and both waited for ever.
#[test]
fn a_thread_that_waits_for_a_lock_does_not_idle() {
    for waits_in in ["futex_do_wait", "futex_wait_queue", "futex_wait_queue_me"] {
        assert_eq!(parse(STATUS, waits_in), Some(Look { idles: false, switches: 322 }));
    }
}

#[test]
fn a_thread_that_runs_is_not_at_rest() {
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    let (send, number) = mpsc::channel();
    let (mut waits, end) = UnixStream::pair().unwrap();
    let thread = std::thread::Builder::new().name("RustDDS test".to_owned());
    let thread = thread.spawn(move || {
        send.send(rustix::thread::gettid().as_raw_nonzero().get().unsigned_abs()).unwrap();
        while !stopped.load(Ordering::Relaxed) {
            std::hint::spin_loop();
        }
        // It waits for the other end to close, as the library's threads for events: not for a lock.
        waits.read(&mut [0]).unwrap()
    });
    let thread = thread.unwrap();
    let numbers = BTreeSet::from([number.recv().unwrap()]);
    let threads = LibraryThreads { numbers, reception: Reception::of(&[]) };
    assert!(!threads.rest());
    stop.store(true, Ordering::Relaxed);
    let soon_at_rest = |when: &str| {
        let begun = Instant::now();
        while !threads.rest() {
            assert!(begun.elapsed() < PATIENCE, "{when}");
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    soon_at_rest("it sleeps");
    let _at_rest = threads.at_rest();
    drop(end);
    thread.join().unwrap();
    // Its entry may be there for a moment longer.
    soon_at_rest("it has ended");
}

#[test]
fn a_thread_that_ended_is_missed() {
    let (ends, waits): (Vec<_>, Vec<_>) = (0..2).map(|_| mpsc::channel::<()>()).unzip();
    let (send, number) = mpsc::channel();
    let start = |wait: mpsc::Receiver<()>| {
        let send = send.clone();
        let thread = std::thread::Builder::new().name("RustDDS test".to_owned());
        let body = move || {
            send.send(rustix::thread::gettid().as_raw_nonzero().get().unsigned_abs()).unwrap();
            let _ = wait.recv();
        };
        thread.spawn(body).unwrap()
    };
    let mut threads: Vec<_> = waits.into_iter().map(start).collect();
    let numbers: BTreeSet<u32> = number.iter().take(threads.len()).collect();
    let of = |numbers: BTreeSet<u32>| LibraryThreads { numbers, reception: Reception::of(&[]) };
    let one_more = numbers.iter().copied().chain([std::process::id()]).collect();
    let (known, unsure) = (of(numbers), of(one_more));
    assert!(!known.have_ended());
    let mut ends = ends.into_iter();
    drop(ends.next());
    threads.remove(0).join().unwrap();
    let begun = Instant::now();
    // Its entry may be there for a moment longer.
    while !known.have_ended() {
        assert!(begun.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(!unsure.have_ended(), "others began at the same moment");
    drop(ends);
    threads.remove(0).join().unwrap();
}

/// The library's two threads and the one that made the endpoints once waited for each other for ever.
#[test]
fn nodes_that_start_together_all_find_each_other() {
    const NODES: usize = 24;

    let domain = FreeDomain::new();
    let over = Arc::new(AtomicBool::new(false));
    let (sender, receiver) = mpsc::channel();
    let start = |number: usize| {
        let (transport, over, sender) =
            (Transport::on_domain(domain.number()).unwrap(), Arc::clone(&over), sender.clone());
        std::thread::spawn(move || {
            let runtime =
                tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
            runtime.unwrap().block_on(async {
                let arguments = RosArguments::parse(std::iter::empty::<&str>()).unwrap();
                let name = format!("node_{number}");
                let node = Node::start_on(transport, &name, &arguments).unwrap();
                let ends = ends(&node);
                for (_, subscription) in &ends {
                    subscription.wait_for_publishers(NODES - 1).await;
                }
                sender.send(()).unwrap();
                while !over.load(Ordering::Relaxed) {
                    tokio::time::sleep(Duration::from_millis(20)).await;
                }
                drop(ends);
                node.close().await;
            });
        })
    };
    let threads: Vec<_> = (0..NODES).map(start).collect();
    let begun = Instant::now();
    for met in 0..NODES {
        let left = PATIENCE.saturating_sub(begun.elapsed());
        assert!(receiver.recv_timeout(left).is_ok(), "{met} of {NODES} have found all the others");
    }
    over.store(true, Ordering::Relaxed);
    threads.into_iter().for_each(|thread| thread.join().unwrap());
}

/// Both ends of some topics, by the same names for every node.
fn ends(node: &Node) -> Vec<(Publisher<Bool>, Subscription<Bool>)> {
    let qos = Qos::reliable(1);
    let both = |topic: usize| {
        let name = format!("/topic_{topic}");
        let publisher = node.publisher(&name, &qos).unwrap();
        (publisher, node.subscription(&name, &qos).unwrap())
    };
    (0..8).map(both).collect()
}
