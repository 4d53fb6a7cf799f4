//! `/rosout`: the lines of a node's log as messages, for those who read the logs of a whole graph in one place.
//!
//! A line may be written anywhere, also where a publisher's own locks are held. So it only joins a queue there, and a task
//! of the node publishes it.

#[cfg(test)]
mod tests;

use std::fmt::{Debug, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use msgs::rcl_interfaces::Log;
use tokio::sync::mpsc;
use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::Context;
use tracing_subscriber::registry::LookupSpan;

use super::loggers::logger_of;

/// Lines that may wait to be published; more at a time than any node writes. Those beyond are on stderr alone.
const LINES_WAITING: usize = 256;

/// The process' log, as far as it is for `/rosout`; none before it is started.
static LINES: Mutex<Option<Lines>> = Mutex::new(None);

/// The node that gets the lines.
#[derive(Debug)]
struct Lines {
    /// The logger of what is written outside of any node's span.
    logger: String,
    nodes: Vec<Weak<Inbox>>,
}

/// A node that publishes its lines.
#[derive(Debug)]
struct Inbox {
    logger: String,
    lines: mpsc::Sender<Log>,
}

/// The lines of one node. They end with it.
#[derive(Debug)]
pub(crate) struct NodeLines {
    _inbox: Arc<Inbox>,
    waiting: mpsc::Receiver<Log>,
}

impl NodeLines {
    /// From now on the lines of the node with this logger; none where the process' log is not the suite's own.
    pub(crate) fn of(logger: &str) -> Option<Self> {
        let mut lines = lock();
        let lines = lines.as_mut()?;
        let (sender, waiting) = mpsc::channel(LINES_WAITING);
        let inbox = Arc::new(Inbox { logger: logger.to_owned(), lines: sender });
        lines.nodes.retain(|other| other.strong_count() > 0);
        lines.nodes.push(Arc::downgrade(&inbox));
        Some(Self { _inbox: inbox, waiting })
    }

    /// Waits for the next line. May be dropped while it waits: no line is lost by that.
    pub(crate) async fn next(&mut self) -> Option<Log> {
        self.waiting.recv().await
    }
}

/// Hands the lines of the process on.
pub(crate) struct RosoutLayer;

impl RosoutLayer {
    /// The layer of a process with this logger.
    pub(crate) fn start(logger: &str) -> Self {
        lock().get_or_insert(Lines { logger: logger.to_owned(), nodes: Vec::new() });
        Self
    }
}

impl<S> Layer<S> for RosoutLayer
where
    S: Subscriber + for<'a> LookupSpan<'a>,
{
    fn on_event(&self, event: &Event<'_>, context: Context<'_, S>) {
        let logger = logger_of(context.event_span(event));
        let mut lines = lock();
        let Some(lines) = lines.as_mut() else { return };
        let inboxes: Vec<Arc<Inbox>> = lines.nodes.iter().filter_map(Weak::upgrade).collect();
        // Lines outside of any node's span are published by the first node.
        let its_own = inboxes.iter().find(|inbox| Some(inbox.logger.as_str()) == logger.as_deref());
        if let Some(inbox) = its_own.or(inboxes.first()) {
            let name = logger.as_deref().unwrap_or(&lines.logger).to_owned();
            // When too many lines wait, the line is on stderr alone.
            let _ = inbox.lines.try_send(line(event, name));
        }
    }
}

fn line(event: &Event<'_>, name: String) -> Log {
    let metadata = event.metadata();
    let mut text = Text::default();
    event.record(&mut text);
    Log {
        level: level(*metadata.level()),
        name,
        msg: text.0,
        file: metadata.file().unwrap_or_default().to_owned(),
        function: metadata.module_path().unwrap_or_default().to_owned(),
        line: metadata.line().unwrap_or_default(),
        ..Log::default()
    }
}

fn level(level: Level) -> u8 {
    match level {
        Level::ERROR => Log::ERROR,
        Level::WARN => Log::WARN,
        Level::INFO => Log::INFO,
        Level::DEBUG | Level::TRACE => Log::DEBUG,
    }
}

/// The message of an event, and behind it its fields.
#[derive(Default)]
struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        let written = if field.name() == "message" {
            write!(self.0, "{value:?}")
        } else {
            write!(self.0, " {}={value:?}", field.name())
        };
        // Writing to a text does not fail.
        written.unwrap_or(())
    }
}

fn lock() -> MutexGuard<'static, Option<Lines>> {
    LINES.lock().unwrap_or_else(PoisonError::into_inner)
}
