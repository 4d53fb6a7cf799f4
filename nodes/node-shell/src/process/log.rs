//! The log of a node: lines on stderr in the form that ROS 2 tools know; nodes on a network publish them on `/rosout`, too,
//! and a file contains them where `ROS_LOG_DIR` is set.
//!
//! `[INFO] [1731140000.123456789] [detection]: text`

mod outputs;
mod rosout_lines;

use std::fmt;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{SystemTime, UNIX_EPOCH};

use tracing::{Event, Level, Subscriber};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::util::SubscriberInitExt;

use super::status_line::LogLines;
pub use outputs::LogOutputs;
pub(crate) use rosout_lines::NodeLines;
use rosout_lines::RosoutLayer;

/// The DDS library warns once a datagram above 1500 bytes, some 80 lines a cloud; the client library
/// logs every topic that it creates. On a machine without a default route the DDS library calls it an
/// error, at its end, that there is no multicast group to leave.
const QUIET_LIBRARIES: &str =
    "rustdds=error,rustdds::network::udp_listener=off,ros2_client=error,mio=error,zenoh=error";

/// How grave a message is, by the names that ROS 2 has for it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LogLevel {
    /// For those who look for a fault.
    Debug,
    /// Normal operation.
    Info,
    /// Possible problems.
    Warn,
    /// Errors.
    Error,
    /// Errors that end the program; ROS 2 distinguishes them from [`LogLevel::Error`], this suite does not.
    Fatal,
}

impl LogLevel {
    /// The level of that name, in any case.
    #[must_use]
    pub fn parse(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().as_str() {
            "debug" => Some(Self::Debug),
            "info" => Some(Self::Info),
            "warn" | "warning" => Some(Self::Warn),
            "error" => Some(Self::Error),
            "fatal" => Some(Self::Fatal),
            _ => None,
        }
    }

    fn filter(self) -> &'static str {
        match self {
            Self::Debug => "debug",
            Self::Info => "info",
            Self::Warn => "warn",
            Self::Error | Self::Fatal => "error",
        }
    }
}

/// One `--log-level [logger:=]level`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LogDirective {
    /// The node or library that it is for; the suite's own code where it is absent.
    pub logger: Option<String>,
    /// The least level to print.
    pub level: LogLevel,
}

/// Starts printing as a process of which `logger` is the logger (as `robot.detection`, for a node of this name); does
/// nothing when the process prints already.
pub fn start(logger: &str, directives: &[LogDirective], outputs: &LogOutputs) {
    let filter = filter_text(logger, directives);
    let format = |to_journal| RosFormat { logger: logger.to_owned(), to_journal };
    let lines = outputs.stderr.then(|| {
        tracing_subscriber::fmt::layer()
            .with_writer(|| LogLines)
            .with_ansi(outputs::has_colours(std::io::stderr().is_terminal()))
            .event_format(format(outputs::go_to_journal()))
    });
    let (file, failed) = match outputs.open_file(logger) {
        Ok(file) => (file, None),
        Err(error) => (None, Some(error)),
    };
    let (path, file) = file.unzip();
    let file = file.map(|file| {
        tracing_subscriber::fmt::layer()
            .with_writer(Mutex::new(file))
            .with_ansi(false)
            .event_format(format(false))
    });
    // An error means that somebody else has set up logging: theirs it is, then.
    let _ = tracing_subscriber::registry()
        .with(EnvFilter::new(filter))
        .with(lines)
        .with(file)
        .with(RosoutLayer::start(logger))
        .try_init();
    if let Some(path) = path {
        tracing::debug!("the log goes to {}, too", path.display());
    }
    if let Some(error) = failed {
        tracing::warn!("no log file can be written into ROS_LOG_DIR: {error}");
    }
}

/// The filter for the directives; a later one wins over an earlier one for the same logger. The process' own logger goes
/// by its whole name or by the node's alone. Other loggers are libraries, by their paths, and the nodes that share the
/// process, by their names: each works within a span of that name.
fn filter_text(logger: &str, directives: &[LogDirective]) -> String {
    let is_own = |name: &str| name == logger || logger.rsplit('.').next() == Some(name);
    let level = directives
        .iter()
        .rev()
        .find(|one| one.logger.as_deref().is_none_or(is_own))
        .map_or(LogLevel::Info, |one| one.level);
    let mut filter = format!("{},{QUIET_LIBRARIES}", level.filter());
    for one in directives {
        if let Some(name) = one.logger.as_deref().filter(|name| !is_own(name)) {
            let level = one.level.filter();
            filter.push_str(&format!(",{}={level}", name.replace('.', "::")));
            if !name.contains(['.', ':']) {
                filter.push_str(&format!(",[{name}]={level}"));
            }
        }
    }
    filter
}

struct RosFormat {
    logger: String,
    /// Each line begins with how grave it is, by syslog's numbers, as the journal of systemd wants it.
    to_journal: bool,
}

impl<S, N> FormatEvent<S, N> for RosFormat
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        let (name, colour, priority) = match *event.metadata().level() {
            Level::ERROR => ("ERROR", "\x1b[31m", 3),
            Level::WARN => ("WARN", "\x1b[33m", 4),
            Level::INFO => ("INFO", "", 6),
            Level::DEBUG => ("DEBUG", "\x1b[32m", 7),
            Level::TRACE => ("TRACE", "\x1b[32m", 7),
        };
        // Several nodes may share a process: each works within a span of its own name.
        let span = context.lookup_current();
        let logger = span.as_ref().map_or(self.logger.as_str(), |span| span.name());
        let coloured = writer.has_ansi_escapes() && !colour.is_empty();
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        if self.to_journal {
            write!(writer, "<{priority}>")?;
        }
        if coloured {
            writer.write_str(colour)?;
        }
        write!(writer, "[{name}] [{}.{:09}] [{}]: ", now.as_secs(), now.subsec_nanos(), logger)?;
        context.field_format().format_fields(writer.by_ref(), event)?;
        if coloured {
            writer.write_str("\x1b[0m")?;
        }
        writeln!(writer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn directive(logger: Option<&str>, level: LogLevel) -> LogDirective {
        LogDirective { logger: logger.map(str::to_owned), level }
    }

    /// What is kept of lines that were written.
    #[derive(Clone, Default)]
    struct Kept(std::sync::Arc<Mutex<Vec<u8>>>);

    impl std::io::Write for Kept {
        fn write(&mut self, lines: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().write(lines)
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    /// Regression: warnings and errors were information in the journal, so that `journalctl -p warning` showed nothing.
    #[test]
    fn the_journal_is_told_how_grave_a_line_is() {
        for (to_journal, starts) in [
            (true, ["<4>[WARN] [", "<3>[ERROR] [", "<6>[INFO] ["]),
            (false, ["[WARN] [", "[ERROR] [", "[INFO] ["]),
        ] {
            let kept = Kept::default();
            let writer = kept.clone();
            let format = RosFormat { logger: "detection".to_owned(), to_journal };
            let layer = tracing_subscriber::fmt::layer()
                .with_writer(move || writer.clone())
                .with_ansi(false)
                .event_format(format);
            let subscriber = tracing_subscriber::registry().with(layer);
            tracing::subscriber::with_default(subscriber, || {
                tracing::warn!("a");
                tracing::error!("b");
                tracing::info!("c");
            });
            let lines = String::from_utf8(kept.0.lock().unwrap().clone()).unwrap();
            let lines: Vec<&str> = lines.lines().collect();
            assert_eq!(lines.len(), 3);
            for (line, start) in lines.iter().zip(starts) {
                assert!(line.starts_with(start), "{line}");
            }
        }
    }

    #[test]
    fn the_default_is_info_with_quiet_libraries() {
        let filter = filter_text("detection", &[]);
        assert_eq!(filter, format!("info,{QUIET_LIBRARIES}"));
        assert!(EnvFilter::try_new(filter).is_ok());
    }

    #[test]
    fn the_node_is_meant_by_its_name_or_by_none() {
        let for_all = directive(None, LogLevel::Debug);
        let for_node = directive(Some("detection"), LogLevel::Warn);
        assert!(filter_text("detection", std::slice::from_ref(&for_all)).starts_with("debug,"));
        assert!(filter_text("detection", &[for_all, for_node]).starts_with("warn,"));
        let for_library = directive(Some("rustdds.rtps"), LogLevel::Debug);
        let filter = filter_text("detection", &[for_library]);
        assert!(filter.starts_with("info,") && filter.ends_with(",rustdds::rtps=debug"));
        assert!(EnvFilter::try_new(filter).is_ok());
    }

    #[test]
    fn a_node_in_a_namespace_has_its_logger_with_dots() {
        for name in ["robot.detection", "detection"] {
            let filter = filter_text("robot.detection", &[directive(Some(name), LogLevel::Error)]);
            assert_eq!(filter, format!("error,{QUIET_LIBRARIES}"));
        }
        let other = directive(Some("arm.detection"), LogLevel::Error);
        assert!(filter_text("robot.detection", &[other]).starts_with("info,"));
    }

    #[test]
    fn a_node_that_shares_the_process_is_meant_by_the_span_of_its_name() {
        let filter = filter_text("stillmap", &[directive(Some("segmentation"), LogLevel::Debug)]);
        assert!(
            filter.starts_with("info,") && filter.ends_with(",[segmentation]=debug"),
            "{filter}"
        );
        assert!(EnvFilter::try_new(filter).is_ok());
    }
}
