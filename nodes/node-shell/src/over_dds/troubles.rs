//! Peers that do not fit are in the diagnostics as long as they are there.

use super::*;

/// The next report of `node` that `accept` takes.
async fn report(
    reports: &Subscription<DiagnosticArray>,
    node: &str,
    accept: impl Fn(&DiagnosticStatus) -> bool,
) -> DiagnosticStatus {
    soon("the report", async {
        loop {
            let array = reports.next().await.message;
            let status = array.part(node).filter(|one| accept(one));
            if let Some(status) = status {
                return status.clone();
            }
        }
    })
    .await
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_peer_that_does_not_fit_is_in_the_diagnostics_until_it_goes() {
    let place = Place::new();
    let (driver, listener, observer) =
        (place.node("driver"), place.node("listener"), place.node("observer"));
    {
        let reports =
            observer.subscription::<DiagnosticArray>("/diagnostics", &Qos::reliable(50)).unwrap();
        let scans = listener.subscription::<LaserScan>("scan", &Qos::reliable(5)).unwrap();
        let points = listener.subscription::<Image>("points", &Qos::sensor(5)).unwrap();
        let own_name = listener.full_name();
        let key = |topic: &str| format!("trouble {topic}");
        let (of_scan, of_points) = (key(scans.topic()), key(points.topic()));
        {
            let _best_effort = driver.publisher::<LaserScan>("scan", &Qos::sensor(5)).unwrap();
            let _other_type = driver.publisher::<LaserScan>("points", &Qos::sensor(5)).unwrap();
            let who = format!("node {}", driver.full_name());
            let status = report(&reports, &own_name, |status| {
                [&of_scan, &of_points]
                    .iter()
                    .all(|key| status.value(key).is_some_and(|text| text.contains(&who)))
            })
            .await;
            assert_eq!(status.level, DiagnosticStatus::ERROR);
            let scan = status.value(&of_scan).unwrap();
            assert!(scan.contains("set the publisher's reliability to reliable"), "{scan}");
            let points = status.value(&of_points).unwrap();
            assert!(points.contains("sensor_msgs/msg/LaserScan") && points.contains("-r /"));
            assert_eq!(scans.publisher_count(), 0);
        }
        driver.close().await;
        let status = report(&reports, &own_name, |status| {
            status.value(&of_scan).is_none() && status.value(&of_points).is_none()
        })
        .await;
        assert_eq!(status.level, DiagnosticStatus::WARN);
        assert!(status.message.starts_with("waiting for"), "{}", status.message);
    }
    listener.close().await;
    observer.close().await;
}
