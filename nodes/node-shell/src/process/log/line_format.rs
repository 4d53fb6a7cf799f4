//! The form of a line: ROS 2's own, or the one that `RCUTILS_CONSOLE_OUTPUT_FORMAT` gives it.

#[cfg(test)]
mod tests;

use std::fmt::{self, Write};
use std::time::Duration;

use chrono::{Local, TimeZone};

/// Text with the names of tokens in braces.
const FORMAT: &str = "RCUTILS_CONSOLE_OUTPUT_FORMAT";
/// What it is where the variable is not set.
const BY_DEFAULT: &str = "[{severity}] [{time}] [{name}]: {message}";

/// What a line says.
pub(super) struct Line<'a> {
    pub(super) severity: &'static str,
    /// The logger.
    pub(super) name: &'a str,
    pub(super) message: &'a str,
    /// Since 1970.
    pub(super) time: Duration,
    pub(super) function_name: &'a str,
    pub(super) file_name: &'a str,
    pub(super) line_number: u32,
}

/// A form of lines.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct LineFormat(Vec<Part>);

#[derive(Clone, PartialEq, Eq, Debug)]
enum Part {
    Text(String),
    Severity,
    Name,
    Message,
    Time,
    TimeAsNanoseconds,
    DateTimeWithMs,
    FunctionName,
    FileName,
    LineNumber,
}

impl LineFormat {
    /// That of the environment.
    pub(super) fn from_environment() -> Self {
        let given = std::env::var(FORMAT).ok().filter(|format| !format.is_empty());
        Self::parse(given.as_deref().unwrap_or(BY_DEFAULT))
    }

    /// What is no token stays as it is.
    fn parse(format: &str) -> Self {
        let (mut parts, mut text, mut rest) = (Vec::new(), String::new(), format);
        while let Some((before, after)) = rest.split_once('{') {
            text.push_str(before);
            let token = after.split_once('}');
            match token.and_then(|(name, tail)| Some((Part::of_token(name)?, tail))) {
                Some((part, tail)) => {
                    if !text.is_empty() {
                        parts.push(Part::Text(std::mem::take(&mut text)));
                    }
                    parts.push(part);
                    rest = tail;
                }
                None => {
                    text.push('{');
                    rest = after;
                }
            }
        }
        text.push_str(rest);
        if !text.is_empty() {
            parts.push(Part::Text(text));
        }
        Self(parts)
    }

    /// Writes a line, without its end.
    pub(super) fn write(&self, line: &Line<'_>, to: &mut impl Write) -> fmt::Result {
        let (seconds, nanoseconds) = (line.time.as_secs(), line.time.subsec_nanos());
        self.0.iter().try_for_each(|part| match part {
            Part::Text(text) => to.write_str(text),
            Part::Severity => to.write_str(line.severity),
            Part::Name => to.write_str(line.name),
            Part::Message => to.write_str(line.message),
            Part::Time => write!(to, "{seconds}.{nanoseconds:09}"),
            Part::TimeAsNanoseconds => write!(to, "{}", line.time.as_nanos()),
            Part::DateTimeWithMs => {
                let at = Local.timestamp_opt(seconds.cast_signed(), nanoseconds).single();
                at.map_or(Ok(()), |at| write!(to, "{}", at.format("%Y-%m-%d %H:%M:%S%.3f")))
            }
            Part::FunctionName => to.write_str(line.function_name),
            Part::FileName => to.write_str(line.file_name),
            Part::LineNumber => write!(to, "{}", line.line_number),
        })
    }
}

impl Part {
    fn of_token(name: &str) -> Option<Self> {
        match name {
            // The file has the same line: no colours.
            "severity" | "severity_with_color" => Some(Self::Severity),
            "name" => Some(Self::Name),
            "message" => Some(Self::Message),
            "time" => Some(Self::Time),
            "time_as_nanoseconds" => Some(Self::TimeAsNanoseconds),
            "date_time_with_ms" => Some(Self::DateTimeWithMs),
            "function_name" => Some(Self::FunctionName),
            "file_name" => Some(Self::FileName),
            "line_number" => Some(Self::LineNumber),
            _ => None,
        }
    }
}
