//! The log of a node: lines on stderr in the form that ROS 2 tools know; nodes on a network publish them on `/rosout`, too,
//! and a file contains them where `ROS_LOG_DIR` is set.
//!
//! `[INFO] [1731140000.123456789] [detection]: text`

mod line_format;
mod loggers;
mod outputs;
mod rosout_lines;

use std::fmt;
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
use line_format::{Line, LineFormat};
pub(crate) use loggers::span_of;
use loggers::{Loggers, logger_of};
pub use outputs::LogOutputs;
pub(crate) use rosout_lines::NodeLines;
use rosout_lines::RosoutLayer;

/// The DDS library warns once a datagram above 1500 bytes, some 80 lines a cloud; the client library
/// logs every topic that it creates. On a machine without a default route the DDS library calls it an
/// error, at its end, that there is no multicast group to leave; and on a busy machine, that its own threads have not taken note of each
/// endpoint that is closed (`dds::pubsub`; its other lines say the same of topics that are made, or come back from its functions).
const QUIET_LIBRARIES: &str = "rustdds=error,rustdds::network::udp_listener=off,rustdds::dds::pubsub=off,ros2_client=error,mio=error,zenoh=error";

/// How grave a message is, by the names that ROS 2 has for it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
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

impl From<LogLevel> for Level {
    fn from(level: LogLevel) -> Self {
        match level {
            LogLevel::Debug => Self::DEBUG,
            LogLevel::Info => Self::INFO,
            LogLevel::Warn => Self::WARN,
            LogLevel::Error | LogLevel::Fatal => Self::ERROR,
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

impl LogDirective {
    /// The logger as the path of code, which libraries have for one.
    fn path(&self) -> Option<String> {
        Some(self.logger.as_ref()?.replace('.', "::"))
    }
}

/// Starts printing as a process of which `logger` is the logger (as `robot.detection`, for a node of this name); does
/// nothing when the process prints already.
pub fn start(logger: &str, directives: &[LogDirective], outputs: &LogOutputs) {
    let loggers = Loggers::new(logger, directives);
    let filter = filter_text(&loggers);
    let lines = outputs.stderr.then(|| {
        let stream = LogLines::of_environment();
        tracing_subscriber::fmt::layer()
            .with_writer(move || stream)
            .with_ansi(outputs::has_colours(stream.is_terminal()))
            .event_format(RosFormat::of(logger, outputs::go_to_journal(stream)))
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
            .event_format(RosFormat::of(logger, false))
    });
    // An error means that somebody else has set up logging: theirs it is, then.
    let _ = tracing_subscriber::registry()
        .with(EnvFilter::new(filter))
        .with(loggers)
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

/// A text for stderr that says why the process ends: in the journal of systemd an error, as a line of the log.
#[must_use]
pub fn as_error(text: &str) -> String {
    if !outputs::go_to_journal(LogLines::Stderr) {
        return text.to_owned();
    }
    let lines: Vec<String> = text.lines().map(|line| format!("<3>{line}")).collect();
    lines.join("\n")
}

/// The filter of code, by its paths; that of nodes, by their loggers, is behind it.
fn filter_text(loggers: &Loggers) -> String {
    let mut filter = format!("{},{QUIET_LIBRARIES}", loggers.least().filter());
    for one in loggers.directives() {
        if let Some(path) = one.path() {
            filter.push_str(&format!(",{path}={}", one.level.filter()));
        }
    }
    filter
}

struct RosFormat {
    /// The logger of what no node writes.
    logger: String,
    format: LineFormat,
    /// Each line begins with how grave it is, by syslog's numbers, as the journal of systemd wants it.
    to_journal: bool,
}

impl RosFormat {
    fn of(logger: &str, to_journal: bool) -> Self {
        Self { logger: logger.to_owned(), format: LineFormat::from_environment(), to_journal }
    }
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
        let logger = logger_of(context.lookup_current());
        let coloured = writer.has_ansi_escapes() && !colour.is_empty();
        let mut message = String::new();
        context.format_fields(Writer::new(&mut message), event)?;
        let metadata = event.metadata();
        let line = Line {
            severity: name,
            name: logger.as_deref().unwrap_or(&self.logger),
            message: &message,
            time: SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default(),
            function_name: metadata.module_path().unwrap_or_default(),
            file_name: metadata.file().unwrap_or_default(),
            line_number: metadata.line().unwrap_or_default(),
        };
        if self.to_journal {
            write!(writer, "<{priority}>")?;
        }
        if coloured {
            writer.write_str(colour)?;
        }
        self.format.write(&line, &mut writer)?;
        if coloured {
            writer.write_str("\x1b[0m")?;
        }
        writeln!(writer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is kept of lines that were written.
    #[derive(Clone, Default)]
    pub(super) struct Kept(pub(super) std::sync::Arc<Mutex<Vec<u8>>>);

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
            let format = RosFormat::of("detection", to_journal);
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
}
