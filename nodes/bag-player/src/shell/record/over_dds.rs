//! Tests of the recorder over DDS: recorder and publishers are participants in one process.

use std::sync::Arc;
use std::time::Duration;

use free_domain::FreeDomain;
use geometry::Stamp;
use msgs::diagnostic_msgs::DiagnosticStatus;
use msgs::rosgraph_msgs::Clock;
use msgs::sensor_msgs::{LaserScan, PointCloud2};
use msgs::std_msgs::String as Text;
use msgs::{RosMessage, convert};
use node_shell::{Node, Publisher, Qos, RosArguments, Transport};
use tokio::sync::watch;
use tokio::task::JoinHandle;

use super::{RecordError, RecordOptions, RecordSummary, record};
use crate::{Bag, BagMessage, OfferedQos, Selection};

/// What the recorder says of itself.
type Reports = watch::Receiver<Option<Arc<DiagnosticStatus>>>;

/// Longer than anything takes on a busy machine; a test that waits this long has failed.
const PATIENCE: Duration = Duration::from_secs(120);

/// A separate graph with a recorder and a node that publishes.
struct Graph {
    recorder: Node,
    driver: Node,
    _domain: FreeDomain,
}

impl Graph {
    fn new(arguments: &[&str]) -> Self {
        let domain = FreeDomain::new();
        let transport = Transport::on_domain(domain.number()).unwrap();
        let start = |name: &str, arguments: &[&str]| {
            let arguments = RosArguments::parse(arguments.iter().copied()).unwrap();
            Node::start_on(transport.clone(), name, &arguments).unwrap()
        };
        Self {
            recorder: start("bag_recorder", arguments),
            driver: start("driver", &[]),
            _domain: domain,
        }
    }

    fn publisher<M: RosMessage>(&self, topic: &str, qos: &Qos) -> Publisher<M> {
        self.driver.publisher(topic, qos).unwrap()
    }
}

/// Starts the recording, which ends with the recorder's node.
fn recording(recorder: Node, options: RecordOptions) -> JoinHandle<RecordSummary> {
    tokio::spawn(async move {
        let summary = record(&options, &recorder).await.unwrap();
        recorder.close().await;
        summary
    })
}

/// Waits until the recorder's report says that so many messages of a topic have come.
async fn has_received(reports: &mut Reports, topic: &str, count: u32) {
    let (key, value) = (format!("received {topic}"), count.to_string());
    let says = |report: &Option<Arc<DiagnosticStatus>>| {
        report.as_ref().and_then(|report| report.value(&key)) == Some(&value)
    };
    tokio::time::timeout(PATIENCE, reports.wait_for(says)).await.unwrap().unwrap();
}

async fn is_heard<M: RosMessage>(publisher: &Publisher<M>) {
    tokio::time::timeout(PATIENCE, publisher.wait_for_subscribers(1)).await.unwrap();
}

fn scan(index: u32) -> LaserScan {
    LaserScan { ranges: (0..index).map(|beam| beam as f32).collect(), ..LaserScan::default() }
}

fn cloud(bytes: usize) -> PointCloud2 {
    let data = (0..bytes).map(|at| (at * 7 % 251) as u8).collect();
    PointCloud2 { data, is_dense: true, ..PointCloud2::default() }
}

fn messages(bag: &Bag) -> Vec<BagMessage> {
    let all = bag.messages(&Selection::default()).unwrap();
    all.map(|message| message.unwrap()).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_recorded_is_what_was_sent() {
    let graph = Graph::new(&[]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let shutdown = graph.recorder.shutdown_signal();
    // Before the recorder: latched messages.
    let texts = graph.publisher::<Text>("/map_name", &Qos::latched());
    texts.publish(Text { data: "hall".into() }).unwrap();
    let hidden = graph.publisher::<Text>("/hidden", &Qos::reliable(5));
    let scans = graph.publisher::<LaserScan>("/scan", &Qos::reliable(10));
    let clouds = graph.publisher::<PointCloud2>("/points", &Qos::sensor(5));
    let exclude =
        ["hidden", "/rosout", "/diagnostics", "/parameter_events"].map(str::to_owned).to_vec();
    let options = RecordOptions { exclude, ..RecordOptions::new(path.clone()) };
    // The definition of its type is unknown here.
    let thing = [0, 1, 0, 0, 7, 6, 5, 4, 3, 2, 1, 0];
    let things =
        graph.driver.raw_publisher("/thing", "other_msgs/msg/Thing", &Qos::reliable(5)).unwrap();
    let Graph { recorder, driver, _domain } = graph;
    let mut reports = recorder.reports();
    let recording = recording(recorder, options);
    is_heard(&scans).await;
    is_heard(&clouds).await;
    tokio::time::timeout(PATIENCE, things.wait_for_subscribers(1)).await.unwrap();
    things.publish(&thing).unwrap();
    is_heard(&texts).await;
    for index in 0..20 {
        scans.publish(scan(index)).unwrap();
        hidden.publish(Text::default()).unwrap();
    }
    clouds.publish(cloud(200_003)).unwrap();
    for (topic, count) in [("/map_name", 1), ("/points", 1), ("/scan", 20), ("/thing", 1)] {
        has_received(&mut reports, topic, count).await;
    }
    assert!(!path.exists(), "a bag that is not closed must not have the name of a whole one");
    shutdown.trigger();
    let summary = tokio::time::timeout(PATIENCE, recording).await.unwrap().unwrap();
    let names: Vec<_> = summary.topics.iter().map(|one| one.topic.as_str()).collect();
    assert_eq!(names, ["/map_name", "/points", "/scan", "/thing"], "{summary}");
    let is_defined: Vec<_> = summary.topics.iter().map(|one| one.is_defined).collect();
    assert_eq!(is_defined, [true, true, true, false]);
    assert!(summary.is_complete(), "{summary}");

    let bag = Bag::open(&path).unwrap();
    let messages = messages(&bag);
    let of = |topic: &str| messages.iter().filter(|one| *one.topic == *topic).collect::<Vec<_>>();
    let texts_back: Vec<Text> = of("/map_name").iter().map(|one| one.decode().unwrap()).collect();
    assert_eq!(texts_back, [Text { data: "hall".into() }]);
    let scans_back: Vec<LaserScan> = of("/scan").iter().map(|one| one.decode().unwrap()).collect();
    assert_eq!(scans_back, (0..20).map(scan).collect::<Vec<_>>());
    assert_eq!(of("/points")[0].decode::<PointCloud2>().unwrap(), cloud(200_003));
    assert_eq!(
        (of("/thing")[0].data.as_slice(), &*of("/thing")[0].type_name),
        (&thing[..], "other_msgs/msg/Thing")
    );
    for message in &messages {
        let delay_s = message.log_time.seconds_since(message.publish_time);
        assert!((-0.1..PATIENCE.as_secs_f64()).contains(&delay_s), "{} {delay_s} s", message.topic);
    }
    let info = bag.info().unwrap();
    let qos = |topic: &str| info.topics.iter().find(|one| one.topic == topic).unwrap().qos;
    assert_eq!(qos("/map_name"), Some(OfferedQos::latched()));
    assert_eq!(qos("/scan"), Some(OfferedQos::reliable(10)));
    assert_eq!(qos("/points"), Some(OfferedQos::sensor(5)));
    drop((texts, hidden, scans, clouds, things));
    driver.close().await;
}

/// Regression: the subscription asked for what the first publisher offers, and a later one that offers less was not recorded.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_later_publisher_that_is_best_effort_is_recorded_beside_a_reliable_one() {
    let graph = Graph::new(&[]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let shutdown = graph.recorder.shutdown_signal();
    let reliable = graph.publisher::<LaserScan>("/scan", &Qos::reliable(10));
    let topics = vec!["/scan".to_owned()];
    let options = RecordOptions { topics, ..RecordOptions::new(path.clone()) };
    let Graph { recorder, driver, _domain } = graph;
    let mut reports = recorder.reports();
    let recording = recording(recorder, options);
    is_heard(&reliable).await;
    (0..3).for_each(|beams| reliable.publish(scan(beams)).unwrap());
    has_received(&mut reports, "/scan", 3).await;
    let best_effort = driver.publisher::<LaserScan>("/scan", &Qos::sensor(10)).unwrap();
    is_heard(&best_effort).await;
    // Even ones are reliable, odd ones are not.
    let has_enough = |report: &Option<Arc<DiagnosticStatus>>| {
        let value = report.as_ref().and_then(|report| report.value("received /scan"));
        value.is_some_and(|value| value.parse::<u32>().unwrap() >= 60)
    };
    let mut index = 4;
    let until_enough = async {
        while tokio::time::timeout(Duration::from_millis(10), reports.wait_for(has_enough))
            .await
            .is_err()
        {
            reliable.publish(scan(index)).unwrap();
            best_effort.publish(scan(index + 1)).unwrap();
            index += 2;
        }
    };
    tokio::time::timeout(PATIENCE, until_enough).await.unwrap();
    shutdown.trigger();
    let summary = tokio::time::timeout(PATIENCE, recording).await.unwrap().unwrap();
    let recorded = messages(&Bag::open(&path).unwrap());
    let mut beams: Vec<usize> =
        recorded.iter().map(|one| one.decode::<LaserScan>().unwrap().ranges.len()).collect();
    beams.sort_unstable();
    // Each once, though both subscriptions had the reliable publisher for a moment.
    assert!(beams.windows(2).all(|pair| pair[0] < pair[1]), "{beams:?}");
    assert_eq!(beams[..3], [0, 1, 2], "{summary}");
    assert!(beams.iter().filter(|beams| *beams % 2 == 1).count() > 5, "{beams:?}");
    assert!(beams.iter().filter(|beams| *beams % 2 == 0).count() > 5, "{beams:?}");
    drop((reliable, best_effort));
    driver.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn simulated_time_is_that_of_the_clock() {
    let graph = Graph::new(&["--ros-args", "-p", "use_sim_time:=true"]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let shutdown = graph.recorder.shutdown_signal();
    let clock = graph.publisher::<Clock>("/clock", &Qos::reliable(10));
    let scans = graph.publisher::<LaserScan>("/scan", &Qos::reliable(10));
    let topics = vec!["scan".to_owned(), "never".to_owned()];
    let options = RecordOptions { topics, ..RecordOptions::new(path.clone()) };
    let Graph { recorder, driver, _domain } = graph;
    let (mut reports, now) = (recorder.reports(), recorder.clock());
    let recording = recording(recorder, options);
    is_heard(&scans).await;
    is_heard(&clock).await;
    scans.publish(scan(1)).unwrap();
    has_received(&mut reports, "/scan", 1).await;
    let times = [Stamp::from_secs_nanos(70, 5), Stamp::from_secs_nanos(60, 0)];
    for (time, beams) in times.into_iter().zip(2..) {
        clock.publish(Clock { clock: convert::time_from_stamp(time) }).unwrap();
        let is_told = async {
            while now.now() != convert::time_from_stamp(time) {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        tokio::time::timeout(PATIENCE, is_told).await.unwrap();
        scans.publish(scan(beams)).unwrap();
        has_received(&mut reports, "/scan", beams).await;
    }
    shutdown.trigger();
    let summary = tokio::time::timeout(PATIENCE, recording).await.unwrap().unwrap();
    assert_eq!(summary.not_recorded, ["/never"]);
    assert!(!summary.is_complete());
    assert_eq!((summary.topics[0].recorded, summary.topics[0].before_clock), (2, 1), "{summary}");
    let mut logged: Vec<(Stamp, usize)> = messages(&Bag::open(&path).unwrap())
        .iter()
        .map(|one| (one.log_time, one.decode::<LaserScan>().unwrap().ranges.len()))
        .collect();
    logged.sort_unstable();
    assert_eq!(logged, [(times[1], 3), (times[0], 2)]);
    drop((clock, scans));
    driver.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_cannot_be_recorded_is_refused_in_words() {
    let Graph { recorder, driver, _domain } = Graph::new(&[]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    std::fs::write(&path, "a bag").unwrap();
    let refused = async |options: RecordOptions| record(&options, &recorder).await.unwrap_err();
    let exists = refused(RecordOptions::new(path.clone())).await;
    assert!(matches!(exists, RecordError::Exists { .. }) && exists.to_string().contains("-o"));
    assert_eq!(std::fs::read(&path).unwrap(), b"a bag");
    // Regression: a recording that was cut off was destroyed by the next of the same name, and two at once destroyed each other.
    let (cut_off, left) = (folder.path().join("cut.mcap"), folder.path().join("cut.mcap.tmp"));
    std::fs::write(&left, "what was recorded").unwrap();
    let error = refused(RecordOptions::new(cut_off.clone())).await;
    assert!(matches!(error, RecordError::CutOff { .. }), "{error}");
    assert_eq!(std::fs::read(&left).unwrap(), b"what was recorded");
    let goes_on = crate::BagWriter::create(&cut_off).unwrap();
    let error = refused(RecordOptions { overwrite: true, ..RecordOptions::new(cut_off) }).await;
    assert!(error.to_string().contains("another process"), "{error}");
    drop(goes_on);
    for duration_s in [0.0, -1.0, f64::NAN] {
        let options = RecordOptions {
            duration_s: Some(duration_s),
            ..RecordOptions::new(folder.path().join("other.mcap"))
        };
        let duration = refused(options).await.to_string();
        assert!(duration.starts_with("--duration must be"), "{duration}");
    }
    let nowhere = refused(RecordOptions::new(folder.path().join("no/bag.mcap"))).await.to_string();
    assert!(nowhere.contains("no/bag.mcap.tmp"), "{nowhere}");
    recorder.close().await;
    driver.close().await;
}
