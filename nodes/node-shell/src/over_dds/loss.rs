//! Losses in the kernel are named, with the topics that suffer and the fix.

use std::sync::Arc;
use std::time::Instant;

use super::*;

/// Many times what the listener can receive at once.
const LARGE: usize = 2_000_001;
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_loss_is_reported_while_small_messages_arrive() {
    let mut place = Place::new();
    let (driver, observer) = (place.node("driver"), place.node("observer"));
    place.transport = place.transport.clone().with_receive_buffer(208 << 10);
    let listener = place.node("listener");
    {
        let granted = listener.granted_buffer().unwrap();
        assert_eq!(granted.bytes(), 208 << 10);
        let reports =
            observer.subscription::<DiagnosticArray>("/diagnostics", &Qos::reliable(50)).unwrap();
        let large = driver.publisher::<Image>("depth/image", &Qos::sensor(1)).unwrap();
        let small = driver.publisher::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
        let images = listener.subscription::<Image>("depth/image", &Qos::sensor(5)).unwrap();
        let scans = listener.subscription::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
        matched(&large, &images).await;
        matched(&small, &scans).await;
        let own_name = listener.full_name();
        let image = Arc::new(odd_image(LARGE));
        let mut first_loss = None;
        let reported = soon("the report of a loss", async {
            let mut bursts = tokio::time::interval(Duration::from_millis(500));
            let mut ticks = tokio::time::interval(Duration::from_millis(25));
            loop {
                tokio::select! {
                    _ = bursts.tick() => {
                        large.publish(Arc::clone(&image)).unwrap();
                        first_loss.get_or_insert_with(Instant::now);
                    }
                    _ = ticks.tick() => small.publish(scan(360)).unwrap(),
                    _ = scans.next() => {}
                    received = reports.next() => {
                        let status = received.message.part(&own_name);
                        let loss = status.and_then(|status| Some((status.level, status.value("loss")?)));
                        if let Some((level, loss)) = loss {
                            assert_eq!(level, DiagnosticStatus::WARN);
                            return loss.to_owned();
                        }
                    }
                }
            }
        })
        .await;
        let within = first_loss.unwrap().elapsed();
        // Within two seconds; a busy machine takes its time to send, to lose and to report.
        println!("reported after {within:?}: {reported}");
        for part in
            ["208 KiB", images.topic(), "compressed topics still arrive", "STILLMAP_RECEIVE"]
        {
            assert!(reported.contains(part), "{reported}");
        }
        assert!(scans.received_count() > 0, "small messages arrive");
    }
    for node in [driver, listener, observer] {
        node.close().await;
    }
}
