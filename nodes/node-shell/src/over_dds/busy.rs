//! Readers of nodes that have much to do.

use super::*;
use crate::process::memory::resident_bytes;

/// More than a reader that is silent may let the process grow by.
const GROWTH: usize = 40 << 20;
/// Longer than a reader may be silent, and than it waits between two looks at the memory.
const LONG: Duration = Duration::from_millis(400);

async fn nothing_comes(subscription: &Subscription<Image>) {
    let waited = tokio::time::timeout(LONG / 2, subscription.next()).await;
    assert!(waited.is_err());
}

/// Regression: a node that always found messages waiting was taken to receive nothing. While its memory
/// grew by its own work its readers were created again, and messages in between were lost.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_reader_whose_messages_wait_for_a_busy_node_is_not_created_again() {
    let place = Place::new();
    let (driver, listener) = (place.node("driver"), place.node("listener"));
    {
        let images = driver.publisher::<Image>("image", &Qos::reliable(5)).unwrap();
        let heard = listener.subscription::<Image>("image", &Qos::sensor(5)).unwrap();
        // All readers of a topic read what the participant has received once.
        let prompt = listener.subscription::<Image>("image", &Qos::sensor(5)).unwrap();
        matched(&images, &heard).await;
        matched(&images, &prompt).await;
        soon("both matches", images.wait_for_subscribers(2)).await;
        images.publish(Image::default()).unwrap();
        soon("the first image", heard.next()).await;
        soon("the first image", prompt.next()).await;
        nothing_comes(&heard).await;
        let reader = heard.reader_in_use();
        images.publish(Image::default()).unwrap();
        // The node works.
        soon("the second image", prompt.next()).await;
        tokio::time::sleep(LONG).await;
        let work = std::hint::black_box(vec![1_u8; GROWTH]);
        assert!(heard.try_next().is_some());
        let before = resident_bytes();
        nothing_comes(&heard).await;
        // Another test of this process that takes memory meanwhile is a reason.
        if resident_bytes() < before.map(|bytes| bytes + GROWTH as u64 / 2) {
            assert_eq!(heard.reader_in_use(), reader);
        }
        drop(work);
    }
    driver.close().await;
    listener.close().await;
}
