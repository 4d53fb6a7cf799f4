use super::*;

const DEPTH: &str = "/depth/image";
const SCAN: &str = "/scan";

fn watch(bytes: usize) -> LossWatch {
    let granted = GrantedBuffer::new(bytes, 32 << 20, false);
    LossWatch::new(Arc::new(ReceiveHealth::unseen(granted)))
}

fn matches(topics: &[&str]) -> Vec<Match> {
    topics
        .iter()
        .map(|topic| Match { role: Role::Subscription, topic: (*topic).to_owned(), peers: 1 })
        .collect()
}

fn counted(received: &[(&str, u64)], lost: &[(&str, u64)]) -> Snapshot {
    let map = |counts: &[(&str, u64)]| {
        counts.iter().map(|(topic, count)| ((*topic).to_owned(), *count)).collect()
    };
    Snapshot { received: map(received), lost: map(lost), ..Snapshot::default() }
}

fn seconds(count: f64) -> Duration {
    Duration::from_secs_f64(count)
}

#[test]
fn a_loss_is_named_with_topics_limits_and_fix() {
    let mut watch = watch(208 * 1024);
    let (start, peers) = (Instant::now(), matches(&[DEPTH, SCAN]));
    assert_eq!(watch.take(start, 40, &peers, &counted(&[(SCAN, 7)], &[])), None);
    let now = counted(&[(DEPTH, 2), (SCAN, 14)], &[(DEPTH, 28)]);
    let loss = watch.take(start + seconds(1.0), 1290, &peers, &now).unwrap();
    assert_eq!(loss.datagrams, 1250);
    assert_eq!(loss.lossy, [(DEPTH.to_owned(), 28)]);
    assert!(loss.silent.is_empty());
    let text = loss.to_string();
    for part in [
        "1250 datagrams",
        "208 KiB",
        "/depth/image lost 28 messages",
        "212 kB",
        "compressed topics still arrive",
        "sudo sysctl -w net.core.rmem_max=33554432",
    ] {
        assert!(text.contains(part), "{text}");
    }
}

#[test]
fn a_topic_of_which_nothing_arrives_is_named() {
    let mut watch = watch(208 * 1024);
    let (start, peers) = (Instant::now(), matches(&[DEPTH, SCAN]));
    watch.take(start, 0, &peers, &counted(&[], &[]));
    let loss = watch.take(start + seconds(1.0), 5, &peers, &counted(&[(SCAN, 7)], &[])).unwrap();
    assert_eq!(loss.silent, [DEPTH]);
    assert!(loss.to_string().contains("/depth/image is silent"));
}

#[test]
fn a_topic_that_was_silent_long_before_is_not_named() {
    let mut watch = watch(208 * 1024);
    let (start, peers) = (Instant::now(), matches(&["/static_map"]));
    let once = counted(&[("/static_map", 1)], &[]);
    watch.take(start, 0, &peers, &counted(&[], &[]));
    watch.take(start + seconds(1.0), 0, &peers, &once);
    let soon = watch.take(start + seconds(2.0), 5, &peers, &once).unwrap();
    assert_eq!(soon.silent, ["/static_map"]);
    let late = watch.take(start + seconds(30.0), 10, &peers, &once).unwrap();
    assert!(late.silent.is_empty());
}

#[test]
fn without_drops_there_is_no_loss_and_an_old_one_is_forgotten() {
    let mut watch = watch(208 * 1024);
    let (start, nothing) = (Instant::now(), counted(&[], &[]));
    let mut look = |at, dropped| {
        let new = watch.take(start + seconds(at), dropped, &[], &nothing).is_some();
        (new, watch.loss.is_some())
    };
    assert_eq!(look(0.0, 10), (false, false));
    assert_eq!(look(1.0, 10), (false, false));
    assert_eq!(look(1.2, 20), (false, false), "too early to decide");
    assert_eq!(look(2.0, 20), (true, true));
    assert_eq!(look(3.0, 20), (false, true));
    assert_eq!(look(7.0, 20), (false, true));
    assert_eq!(look(7.1, 20), (false, false));
}

#[test]
fn a_full_buffer_of_full_size_has_another_fix() {
    let mut watch = watch(32 << 20);
    let (start, nothing) = (Instant::now(), counted(&[], &[]));
    watch.take(start, 0, &[], &nothing);
    let text = watch.take(start + seconds(1.0), 1, &[], &nothing).unwrap().to_string();
    assert!(!text.contains("sysctl") && text.contains("reduce the load"), "{text}");
}
