//! Loggers, by the names that ROS 2 gives them: which one a line is of, and the least level of its lines.

#[cfg(test)]
mod tests;

use std::fmt::Debug;
use std::sync::Arc;

use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id};
use tracing::{Event, Level, Span, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::Context;
use tracing_subscriber::registry::{LookupSpan, SpanRef};

use super::{LogDirective, LogLevel};

/// The field of a node's span that names its logger, as [`span_of`] writes it.
const FIELD: &str = "logger";

/// The span within which a node works: what is written within it is of this logger. At the level error it passes every filter.
pub(crate) fn span_of(logger: &str) -> Span {
    tracing::error_span!("node", logger)
}

/// The logger of what is written within a span, or in one within it.
struct Logger(Arc<str>);

/// The logger of what is written within a span; none outside of any node's.
pub(super) fn logger_of<S>(span: Option<SpanRef<'_, S>>) -> Option<Arc<str>>
where
    S: for<'a> LookupSpan<'a>,
{
    let logger = |span: SpanRef<'_, S>| Some(Arc::clone(&span.extensions().get::<Logger>()?.0));
    span?.scope().find_map(logger)
}

/// Notes the loggers of spans, and holds back what is below the level of its logger.
pub(super) struct Loggers {
    process: String,
    directives: Vec<LogDirective>,
}

impl Loggers {
    /// `process` is the logger of what no node writes.
    pub(super) fn new(process: &str, directives: &[LogDirective]) -> Self {
        Self { process: process.to_owned(), directives: directives.to_vec() }
    }

    pub(super) fn directives(&self) -> &[LogDirective] {
        &self.directives
    }

    /// The least level that any logger has.
    pub(super) fn least(&self) -> LogLevel {
        let of_all = self.level("");
        self.directives.iter().map(|one| one.level).fold(of_all, LogLevel::min)
    }

    /// The least level of a logger's lines, as ROS 2 has it: that of the logger itself, or of the nearest namespace above it,
    /// or of all; of several for the same name the last. A node goes by its name alone, too.
    fn level(&self, logger: &str) -> LogLevel {
        let fit = |name: Option<&str>| match name {
            None => Some(0),
            Some(name) if name == logger || logger.rsplit('.').next() == Some(name) => {
                Some(usize::MAX)
            }
            Some(name) => {
                logger.strip_prefix(name).filter(|rest| rest.starts_with('.')).map(|_| name.len())
            }
        };
        let fitting = |one: &LogDirective| Some((fit(one.logger.as_deref())?, one.level));
        let fitting = self.directives.iter().filter_map(fitting);
        fitting.max_by_key(|(fit, _)| *fit).map_or(LogLevel::Info, |(_, level)| level)
    }

    /// Whether a directive is for the code that has this path, be it a library or a part of the suite.
    fn names_code(&self, path: &str) -> bool {
        self.directives.iter().filter_map(LogDirective::path).any(|named| {
            path.strip_prefix(&named).is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
        })
    }
}

impl<S> Layer<S> for Loggers
where
    S: Subscriber + for<'a> LookupSpan<'a>,
{
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, context: Context<'_, S>) {
        let mut named = Named::default();
        attributes.record(&mut named);
        if let (Some(logger), Some(span)) = (named.0, context.span(id)) {
            span.extensions_mut().replace(Logger(logger));
        }
    }

    fn event_enabled(&self, event: &Event<'_>, context: Context<'_, S>) -> bool {
        let metadata = event.metadata();
        if self.names_code(metadata.target()) {
            return true;
        }
        let logger = logger_of(context.event_span(event));
        let least = self.level(logger.as_deref().unwrap_or(&self.process));
        *metadata.level() <= Level::from(least)
    }
}

/// The logger that a span's fields name.
#[derive(Default)]
struct Named(Option<Arc<str>>);

impl Visit for Named {
    fn record_str(&mut self, field: &Field, value: &str) {
        if field.name() == FIELD {
            self.0 = Some(value.into());
        }
    }

    fn record_debug(&mut self, _field: &Field, _value: &dyn Debug) {}
}
