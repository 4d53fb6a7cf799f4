use tracing_subscriber::layer::SubscriberExt;

use super::*;
use crate::process::log::loggers::{Loggers, span_of};

fn with_lines(logger: &str) -> impl Subscriber + Send + Sync {
    let loggers = Loggers::new(logger, &[]);
    tracing_subscriber::registry().with(loggers).with(RosoutLayer::start(logger))
}

/// One test alone: the process has one log.
#[test]
fn a_line_goes_to_the_node_in_whose_span_it_is_written() {
    assert!(NodeLines::of("early").is_none(), "the log has not been started");
    let subscriber = with_lines("stillmap");
    let mut detection = NodeLines::of("robot1.detection").unwrap();
    let mut segmentation = NodeLines::of("robot1.segmentation").unwrap();
    tracing::subscriber::with_default(subscriber, || {
        span_of("robot1.segmentation").in_scope(|| tracing::warn!("of {}", "segmentation"));
        tracing::info!(beams = 3, "of no node");
    });
    let line = segmentation.waiting.try_recv().unwrap();
    assert_eq!(
        (line.level, line.name.as_str(), line.msg.as_str()),
        (Log::WARN, "robot1.segmentation", "of segmentation")
    );
    assert!(line.file.ends_with("tests.rs") && line.line > 0, "{line:?}");
    assert!(line.function.ends_with("rosout_lines::tests"), "{line:?}");
    assert!(segmentation.waiting.try_recv().is_err());
    let line = detection.waiting.try_recv().unwrap();
    assert_eq!(
        (line.level, line.name.as_str(), line.msg.as_str()),
        (Log::INFO, "stillmap", "of no node beams=3")
    );

    // A closed receiver gets nothing; many lines at a time cost lines, not memory.
    drop(detection);
    let subscriber = with_lines("other");
    tracing::subscriber::with_default(subscriber, || {
        for _ in 0..2 * LINES_WAITING {
            tracing::info!("many");
        }
    });
    let mut count = 0;
    while segmentation.waiting.try_recv().is_ok() {
        count += 1;
    }
    assert_eq!(count, LINES_WAITING);
}
