use std::time::Duration;

use free_domain::FreeDomain;
use geometry::{DepthImage, DepthPixels, Stamp};
use node_shell::{RosArguments, Transport};

use super::*;

/// Longer than anything takes on a busy machine; a test that waits so long has failed.
const PATIENCE: Duration = Duration::from_secs(120);

/// A node on the domain of this process.
fn node(name: &str, arguments: &[&str]) -> Node {
    let transport = Transport::on_domain(FreeDomain::of_this_process().number()).unwrap();
    let namespace = ["--ros-args", "-r", "__ns:=/compression_test"];
    let arguments = namespace.into_iter().chain(arguments.iter().copied());
    let arguments = RosArguments::parse(arguments).unwrap();
    Node::start_on(transport, name, &arguments).unwrap()
}

async fn soon<T>(what: &str, wait: impl Future<Output = T>) -> T {
    match tokio::time::timeout(PATIENCE, wait).await {
        Ok(value) => value,
        Err(_) => panic!("waited in vain: {what}"),
    }
}

fn depth() -> DepthImage {
    // It fits the receive buffer that every machine grants.
    let pixels = (0..160 * 120).map(|pixel| (pixel % 160 + 500) as u16).collect();
    let stamp = Stamp::from_nanos(77);
    DepthImage::new(stamp, "camera".into(), (160, 120), DepthPixels::Millimetres(pixels)).unwrap()
}

fn color() -> Image {
    let data = [200, 30, 20].repeat(16 * 16);
    let encoding = "rgb8".to_owned();
    Image { encoding, width: 16, height: 16, step: 48, data, ..Image::default() }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn images_come_out_compressed_below_their_remapped_name() {
    let own = node("compression", &["-r", "depth/image:=/front/raw"]);
    let peer = node("peer", &[]);
    let counters = own.counters();
    let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
    let parameters = CompressionParameters {
        images: Images::Both,
        depth_format: DepthFormat::Rvl,
        ..CompressionParameters::default()
    };
    let served = tokio::spawn(async move {
        let result = tokio::select! {
            result = serve(&own, parameters) => result,
            _ = stopped => Ok(()),
        };
        own.close().await;
        result
    });
    {
        let qos = Qos::sensor(5);
        let raw_depth = peer.publisher::<Image>("/front/raw", &qos).unwrap();
        let raw_color = peer.publisher::<Image>("color/image", &qos).unwrap();
        let depths =
            peer.subscription::<CompressedImage>("/front/raw/compressedDepth", &qos).unwrap();
        let colors = peer.subscription::<CompressedImage>("color/image/compressed", &qos).unwrap();
        soon("the node", async {
            raw_depth.wait_for_subscribers(1).await;
            raw_color.wait_for_subscribers(1).await;
            depths.wait_for_publishers(1).await;
            colors.wait_for_publishers(1).await;
        })
        .await;

        // Until the node knows of its subscribers it compresses nothing.
        let message = convert::message_from_depth(&depth());
        let received = soon("a depth image", async {
            loop {
                raw_depth.publish(message.clone()).unwrap();
                let wait = tokio::time::timeout(Duration::from_millis(100), depths.next());
                if let Ok(received) = wait.await {
                    break received.message;
                }
            }
        })
        .await;
        assert_eq!(received.format, "16UC1; compressedDepth rvl");
        assert_eq!(convert::compressed_depth_from_message(&received), Ok(depth()));

        // What is none is counted and told; what follows comes through.
        raw_color.publish(Image { encoding: "32FC1".to_owned(), ..color() }).unwrap();
        soon("the drop", async {
            while counters.drops().is_empty() {
                raw_color.publish(Image { encoding: "32FC1".to_owned(), ..color() }).unwrap();
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        })
        .await;
        raw_color.publish(color()).unwrap();
        let received = soon("a colour image", colors.next()).await.message;
        let image = convert::image_from_compressed_message(&received).unwrap();
        assert_eq!((image.encoding.as_str(), image.width, image.height), ("rgb8", 16, 16));
    }
    let _ = stop.send(());
    served.await.unwrap().unwrap();
    peer.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn parameters_out_of_their_range_are_named() {
    let own = node("out_of_range", &[]);
    let quality = CompressionParameters { jpeg_quality: 0, ..CompressionParameters::default() };
    let error = serve(&own, quality).await.unwrap_err().to_string();
    assert_eq!(error, "parameter jpeg_quality must be 1 to 100, not 0");
    let metres = CompressionParameters {
        depth_metres: DepthMetres::InverseDepth,
        depth_max_m: 0.0,
        ..CompressionParameters::default()
    };
    let error = serve(&own, metres).await.unwrap_err().to_string();
    assert_eq!(error, "parameter depth_max_m must be 0.001 to 1000000, not 0");
    own.close().await;
}

/// Regression: colour images were taken while no depth image waited, so that none came out where depth took all of the time.
#[tokio::test]
async fn depth_and_colour_take_turns() {
    let host = node_shell::Host::in_process();
    let arguments = RosArguments::parse([""; 0]).unwrap();
    let own = host.node("compression", &arguments).unwrap();
    let camera = host.node("camera", &arguments).unwrap();
    let parameters =
        CompressionParameters { images: Images::Both, ..CompressionParameters::default() };
    let mut lanes = Lanes::new(&own, &parameters).unwrap();
    let qos = Qos::sensor(IMAGES_KEPT);
    let depths = camera.publisher::<Image>(DEPTH_TOPIC, &qos).unwrap();
    let colors = camera.publisher::<Image>(COLOR_TOPIC, &qos).unwrap();
    let mut taken = Vec::new();
    for _ in 0..6 {
        depths.publish(convert::message_from_depth(&depth())).unwrap();
        colors.publish(color()).unwrap();
        let (kind, image) = soon("an image", lanes.next()).await;
        lanes.take(kind, &image.message, |_| unreachable!("nobody wants it compressed"));
        taken.push(kind);
    }
    let (depth, color) = (Kind::Depth, Kind::Color);
    assert_eq!(taken, [depth, color, depth, color, depth, color]);
    drop((lanes, depths, colors));
    camera.close().await;
    own.close().await;
}
