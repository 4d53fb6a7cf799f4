//! The messages that subscribers of the map get over DDS.

use msgs::std_srvs::{TriggerRequest, TriggerResponse};
use ros2_client::dds::{Client, Context, ContextOptions, ServiceMapping};
use ros2_client::qos::{History, Reliability, WhenFull};
use ros2_client::{Name, NodeName, NodeOptions, QosProfile, ServiceTypeName};
use serde::{Deserialize, Serialize};

use super::*;

/// A period so long that it does not pass in a test.
const NEVER_S: f64 = 1e6;

fn parameters() -> ReconstructionParameters {
    ReconstructionParameters {
        map_publish_period_s: NEVER_S,
        config: ReconstructionConfig { pipeline: pipeline(), ..ReconstructionConfig::default() },
        ..ReconstructionParameters::default()
    }
}

/// The points of a message, and the stamp that it has.
fn points_of(message: &PointCloud2) -> (i64, Vec<[f32; 3]>) {
    let cloud = convert::cloud_from_message(message).unwrap();
    let points = cloud.points_m.iter().map(|point| [point.x, point.y, point.z]).collect();
    (cloud.stamp.as_nanos(), points)
}

/// A point in the middle of a voxel.
fn at(x: f32) -> [f32; 3] {
    [x + 0.5, 0.5, 0.5]
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_subscriber_gets_the_map_and_then_updates_in_parts() {
    let test = Place::new("updates");
    let host = test.host();
    let (own, peer) = (test.node(&host, "reconstruction"), test.node(&test.host(), "peer"));
    let most_points = 2;
    let parameters = ReconstructionParameters {
        map_update_period_s: 0.05,
        map_update_max_points: most_points,
        ..parameters()
    };
    let served = serving(own, parameters);
    {
        let clouds =
            peer.publisher::<SegmentedCloud>("segmented_cloud", &Qos::reliable(5)).unwrap();
        soon("the node", clouds.wait_for_subscribers(1)).await;
        // Before there is a subscriber.
        clouds.publish(cloud(1, "map", &[at(0.0), at(1.0)])).unwrap();
        let updates =
            peer.subscription::<PointCloud2>("static_map_updates", &Qos::reliable(50)).unwrap();
        let maps = peer.subscription::<PointCloud2>("static_map", &Qos::latched()).unwrap();
        let map = soon("the map at once", maps.next()).await.message;
        assert_eq!(points_of(&map), (1, vec![at(0.0), at(1.0)]));

        // The node records changes once it has discovered the subscriber. Each cloud has a voxel far away.
        let mut knocks = 0.0;
        let mut next_update = tokio::time::timeout(Duration::ZERO, updates.next()).await;
        while next_update.is_err() {
            assert!(knocks < 100.0, "timed out: the first update");
            clouds.publish(cloud(2, "map", &[at(100.0 + knocks)])).unwrap();
            knocks += 1.0;
            next_update = tokio::time::timeout(Duration::from_millis(200), updates.next()).await;
        }

        // The mean of the first voxel moves by 0.2, that of the second one stays; three are new.
        let seen = [at(7.0), [0.9, 0.5, 0.5], at(1.0), at(5.0), at(6.0)];
        clouds.publish(cloud(3, "map", &seen)).unwrap();
        let mut told = Vec::new();
        while told.len() < 4 {
            let update = soon("an update", updates.next()).await.message;
            let (stamp_ns, points) = points_of(&update);
            assert!(points.len() <= most_points, "{} points", points.len());
            told.extend(points.into_iter().filter(|point| point[0] < 100.0));
            assert!(told.is_empty() || stamp_ns == 3);
        }
        assert_eq!(told, [at(7.0), [0.7, 0.5, 0.5], at(5.0), at(6.0)]);

        // The input pauses, and the whole map is published.
        let whole = soon("the map after the last cloud", async {
            loop {
                let (stamp_ns, points) = points_of(&maps.next().await.message);
                if stamp_ns == 3 {
                    return points;
                }
            }
        })
        .await;
        let mut expected = vec![[0.7, 0.5, 0.5], at(1.0), at(5.0), at(6.0), at(7.0)];
        expected.extend((0..knocks as usize).map(|knock| at(100.0 + knock as f32)));
        assert_eq!(whole, expected);
    }
    host.shutdown_signal().trigger();
    soon("the end", served).await.unwrap().unwrap();
    peer.close().await;
}

#[derive(Clone, Serialize, Deserialize)]
struct Ask(TriggerRequest);
impl ros2_client::Message for Ask {}

#[derive(Clone, Serialize, Deserialize)]
struct Answer(TriggerResponse);
impl ros2_client::Message for Answer {}

/// Asks for the map as a ROS 2 client does, until there is an answer.
async fn ask_for_the_map(client: &Client<Ask, Answer>) -> TriggerResponse {
    let mut wait = AGAIN;
    while wait < PATIENCE {
        let id = client.async_send_request(Ask(TriggerRequest::default())).await.unwrap();
        let answer = client.async_receive_response(id);
        if let Ok(answer) = tokio::time::timeout(wait, answer).await {
            return answer.unwrap().0;
        }
        wait *= 2;
    }
    panic!("timed out: an answer");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_service_publishes_the_map() {
    let test = Place::new("request");
    let host = test.host();
    let (own, peer) = (test.node(&host, "reconstruction"), test.node(&test.host(), "peer"));
    let service = format!("{}/publish_map", own.full_name());
    let served = serving(own, parameters());
    {
        let domain_id = test.transport.domain_id();
        let context = Context::with_options(ContextOptions::new().domain_id(domain_id)).unwrap();
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let mut asker = context.new_node(NodeName::new("/", "asker").unwrap(), options).unwrap();
        let qos = QosProfile::default()
            .reliability(Reliability::Reliable { when_full: WhenFull::DEFAULT })
            .history(History::KeepLast { depth: 10 });
        let client = asker
            .create_client::<Ask, Answer>(
                ServiceMapping::Enhanced,
                &Name::parse(&service).unwrap(),
                &ServiceTypeName::new("std_srvs", "Trigger"),
                qos.clone(),
                qos,
            )
            .unwrap();
        let answer = ask_for_the_map(&client).await;
        assert!(!answer.success && answer.message.contains("no static cloud"), "{answer:?}");

        let clouds =
            peer.publisher::<SegmentedCloud>("segmented_cloud", &Qos::reliable(5)).unwrap();
        soon("the node", clouds.wait_for_subscribers(1)).await;
        clouds.publish(cloud(1, "map", &[at(0.0), at(1.0)])).unwrap();
        let mut answer = ask_for_the_map(&client).await;
        while !answer.success {
            answer = ask_for_the_map(&client).await;
        }
        assert_eq!(answer.message, "published the map of 2 points");
        // It had no subscriber then; it is latched for later ones.
        let maps = peer.subscription::<PointCloud2>("static_map", &Qos::latched()).unwrap();
        let map = soon("the map", maps.next()).await.message;
        assert_eq!(points_of(&map), (1, vec![at(0.0), at(1.0)]));
    }
    host.shutdown_signal().trigger();
    soon("the end", served).await.unwrap().unwrap();
    peer.close().await;
}

/// The points of a map of 4 MB.
const MANY_POINTS: usize = 333_000;

/// Joins the network as a process of its own; returns how long it takes until it has a map of so many points.
/// The DDS library may send it the map before the last one first.
async fn new_subscriber(test: &Place, points: usize) -> Duration {
    let node = test.node(&test.host(), "new_subscriber");
    let subscribed = Instant::now();
    let maps = node.subscription::<PointCloud2>("static_map", &Qos::latched()).unwrap();
    let what = format!("a map of {points} points");
    while soon(&what, maps.next()).await.message.width as usize != points {}
    let waited = subscribed.elapsed();
    drop(maps);
    node.close().await;
    waited
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_late_subscriber_has_a_map_of_four_megabytes() {
    let test = Place::new("late");
    let host = test.host();
    let (own, feeder) = (test.node(&host, "reconstruction"), test.node(&host, "feeder"));
    let fits = own.granted_buffer().map(|granted| granted.check("static_map", MANY_POINTS * 12));
    if let Some(Err(too_large)) = fits {
        eprintln!("skipped: a late subscriber cannot get the map; {too_large}");
        return;
    }
    let served = serving(own, parameters());
    {
        let clouds =
            feeder.publisher::<SegmentedCloud>("segmented_cloud", &Qos::reliable(5)).unwrap();
        let reports =
            feeder.subscription::<StageReport>("reconstruction/report", &Qos::reliable(5)).unwrap();
        soon("the node", clouds.wait_for_subscribers(1)).await;
        let points: Vec<_> = (0..MANY_POINTS).map(|x| [x as f32, 0.5, 0.5]).collect();
        clouds.publish(cloud(1, "map", &points)).unwrap();
        soon("the first cycle", reports.next()).await;
        // For the first subscriber the map is encoded; the second one gets the latched map.
        let made = new_subscriber(&test, MANY_POINTS).await;
        let found = new_subscriber(&test, MANY_POINTS).await;
        // The third one gets a map with the new cloud, although the period is not over.
        clouds.publish(cloud(2, "map", &[[0.0, 10.5, 0.5]])).unwrap();
        soon("the second cycle", reports.next()).await;
        let renewed = new_subscriber(&test, MANY_POINTS + 1).await;
        eprintln!("a map of 4 MB: made {made:?}, found {found:?}, renewed {renewed:?}");
    }
    host.shutdown_signal().trigger();
    soon("the end", served).await.unwrap().unwrap();
    feeder.close().await;
}
