use tracing_subscriber::EnvFilter;
use tracing_subscriber::layer::SubscriberExt;

use super::*;
use crate::process::log::tests::Kept;
use crate::process::log::{QUIET_LIBRARIES, RosFormat, filter_text};

fn directive(logger: Option<&str>, level: LogLevel) -> LogDirective {
    LogDirective { logger: logger.map(str::to_owned), level }
}

/// The lines, from the logger on, of a process with the logger `stillmap` and these directives.
fn lines(directives: &[LogDirective], write: impl FnOnce()) -> Vec<String> {
    let kept = Kept::default();
    let writer = kept.clone();
    let loggers = Loggers::new("stillmap", directives);
    let layer = tracing_subscriber::fmt::layer()
        .with_writer(move || writer.clone())
        .with_ansi(false)
        .event_format(RosFormat::of("stillmap", false));
    let subscriber = tracing_subscriber::registry()
        .with(EnvFilter::new(filter_text(&loggers)))
        .with(loggers)
        .with(layer);
    tracing::subscriber::with_default(subscriber, write);
    let text = String::from_utf8(kept.0.lock().unwrap().clone()).unwrap();
    text.lines().map(|line| line.splitn(3, "] [").nth(2).unwrap().to_owned()).collect()
}

/// Regression: the lines of the nodes of `up` had the names that the program gives them, whatever `__ns` and `__node` said.
#[test]
fn a_line_has_the_logger_of_the_node_in_whose_span_it_is_written() {
    let written = lines(&[], || {
        tracing::info!("of the process");
        span_of("robot1.segmentation").in_scope(|| {
            tracing::info!("of the node");
            tracing::info_span!("of a library").in_scope(|| tracing::warn!("within"));
        });
    });
    assert_eq!(
        written,
        [
            "stillmap]: of the process",
            "robot1.segmentation]: of the node",
            "robot1.segmentation]: within"
        ]
    );
}

/// Regression: `--log-level robot1.detection:=debug` had no effect on the nodes of `up`, and `detection:=error` neither.
#[test]
fn the_level_of_a_node_goes_by_its_logger_its_namespace_or_its_name() {
    let write = || {
        for logger in ["robot1.detection", "robot1.pose", "robot2.pose"] {
            span_of(logger).in_scope(|| {
                tracing::debug!("debug");
                tracing::info!("info");
            });
        }
        tracing::debug!("debug");
    };
    let of = |named: &[(Option<&str>, LogLevel)]| {
        let directives: Vec<LogDirective> =
            named.iter().map(|(logger, level)| directive(*logger, *level)).collect();
        lines(&directives, write).join(" ")
    };
    let (d, p1, p2) = ("robot1.detection]: info", "robot1.pose]: info", "robot2.pose]: info");
    assert_eq!(of(&[]), format!("{d} {p1} {p2}"));
    let (debug, error) = (LogLevel::Debug, LogLevel::Error);
    for name in ["robot1.detection", "detection"] {
        assert_eq!(
            of(&[(Some(name), debug)]),
            format!("robot1.detection]: debug {d} {p1} {p2}"),
            "{name}"
        );
        assert_eq!(of(&[(Some(name), error)]), format!("{p1} {p2}"), "{name}");
    }
    assert_eq!(of(&[(Some("robot1"), error)]), p2);
    assert_eq!(of(&[(Some("robot1.pose"), LogLevel::Info), (None, error)]), p1);
    assert_eq!(of(&[(Some("robot"), error)]), format!("{d} {p1} {p2}"), "no part of a name");
    assert_eq!(of(&[(Some("stillmap"), debug)]), format!("{d} {p1} {p2} stillmap]: debug"));
    let twice = [(Some("robot1.pose"), error), (Some("robot1.pose"), debug), (None, error)];
    assert_eq!(of(&twice), format!("robot1.pose]: debug {p1}"), "the later of both");
}

#[test]
fn libraries_are_quiet_unless_they_are_named() {
    let loggers = |directives: &[LogDirective]| Loggers::new("robot.detection", directives);
    assert_eq!(filter_text(&loggers(&[])), format!("info,{QUIET_LIBRARIES}"));
    let for_all = directive(None, LogLevel::Debug);
    let for_library = directive(Some("rustdds.rtps"), LogLevel::Debug);
    let filter = filter_text(&loggers(&[for_all, for_library.clone()]));
    assert!(filter.starts_with("debug,") && filter.ends_with(",rustdds::rtps=debug"), "{filter}");
    assert!(EnvFilter::try_new(filter).is_ok());
    let written = lines(&[for_library], || {
        tracing::debug!(target: "rustdds::rtps::reader", "named");
        tracing::debug!(target: "rustdds::network", "not named");
        tracing::debug!(target: "mio", "not named");
    });
    assert_eq!(written, ["stillmap]: named"]);
}
