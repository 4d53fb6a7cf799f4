//! A finding of the doctor: its severity, what is wrong with the numbers that show it, its consequence, and the fix.

use std::fmt;

use serde::Serialize;

use super::checks::Check;

/// The severity of a finding.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Severity {
    /// As it should be.
    Ok,
    /// Something is, or may soon be, lost or late.
    Warn,
    /// Something does not work.
    Error,
}

impl Severity {
    fn word(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Warn => "warn",
            Self::Error => "error",
        }
    }

    /// The escape sequence of its colour on a terminal.
    fn colour(self) -> &'static str {
        match self {
            Self::Ok => "\x1b[32m",
            Self::Warn => "\x1b[33m",
            Self::Error => "\x1b[31m",
        }
    }
}

/// Ends a colour on a terminal.
const PLAIN: &str = "\x1b[0m";
/// The width of the longest severity.
const WORD_WIDTH: usize = 5;

/// One finding.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub(crate) struct Finding {
    pub(crate) severity: Severity,
    /// Which check made it.
    pub(crate) check: Check,
    /// What was found, with the numbers that show it.
    pub(crate) what: String,
    /// The consequence; `None` for a finding that is ok.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) consequence: Option<&'static str>,
    /// The command or the setting that fixes it; `None` for a finding that is ok.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) fix: Option<String>,
}

impl Finding {
    pub(crate) fn ok(check: Check, what: impl Into<String>) -> Self {
        Self { severity: Severity::Ok, check, what: what.into(), consequence: None, fix: None }
    }

    pub(crate) fn warn(check: Check, what: impl Into<String>, fix: impl Into<String>) -> Self {
        Self::new(Severity::Warn, check, what.into(), fix.into())
    }

    pub(crate) fn error(check: Check, what: impl Into<String>, fix: impl Into<String>) -> Self {
        Self::new(Severity::Error, check, what.into(), fix.into())
    }

    fn new(severity: Severity, check: Check, what: String, fix: String) -> Self {
        let consequence = Some(check.consequence());
        Self { severity, check, what, consequence, fix: Some(fix) }
    }

    /// An error when `grave`, or else a warning.
    pub(crate) fn grave_if(
        grave: bool,
        check: Check,
        what: impl Into<String>,
        fix: impl Into<String>,
    ) -> Self {
        if grave { Self::error(check, what, fix) } else { Self::warn(check, what, fix) }
    }

    /// The finding as a line; in colour for a terminal.
    pub(crate) fn line(&self, in_colour: bool) -> String {
        let word = self.severity.word();
        let padding = " ".repeat(WORD_WIDTH - word.len());
        let word = if in_colour {
            format!("{}{word}{PLAIN}", self.severity.colour())
        } else {
            word.to_owned()
        };
        let mut line = format!("{word}{padding}  {}", self.what);
        if let Some(consequence) = self.consequence {
            line += &format!("; {consequence}");
        }
        if let Some(fix) = &self.fix {
            line += &format!("  ->  {fix}");
        }
        line
    }
}

/// How many findings there are of each severity.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub(crate) struct Tally {
    pub(crate) errors: usize,
    pub(crate) warnings: usize,
    pub(crate) ok: usize,
}

impl Tally {
    pub(crate) fn of(findings: &[Finding]) -> Self {
        let count =
            |severity| findings.iter().filter(|finding| finding.severity == severity).count();
        Self {
            errors: count(Severity::Error),
            warnings: count(Severity::Warn),
            ok: count(Severity::Ok),
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = |count: usize| if count == 1 { "" } else { "s" };
        let Self { errors, warnings, ok } = self;
        write!(
            formatter,
            "{errors} error{}, {warnings} warning{}, {ok} ok",
            plural(*errors),
            plural(*warnings)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_is_a_line_with_its_fix() {
        let finding = Finding::warn(Check::Motion, "/pose jumps by 2.0 m", "record again");
        let expected = "warn   /pose jumps by 2.0 m; the map is torn there  ->  record again";
        assert_eq!(finding.line(false), expected);
        assert_eq!(Finding::ok(Check::Gaps, "no gap").line(false), "ok     no gap");
        assert!(finding.line(true).starts_with("\x1b[33mwarn\x1b[0m "));
    }

    #[test]
    fn findings_are_counted_by_severity() {
        let findings = [
            Finding::ok(Check::Gaps, "x"),
            Finding::error(Check::Gaps, "x", "y"),
            Finding::grave_if(false, Check::Gaps, "x", "y"),
        ];
        let tally = Tally::of(&findings);
        assert_eq!(tally, Tally { errors: 1, warnings: 1, ok: 1 });
        assert_eq!(tally.to_string(), "1 error, 1 warning, 1 ok");
    }

    #[test]
    fn a_finding_as_json_has_the_same_parts() {
        let json = serde_json::to_value(Finding::error(Check::Motion, "what", "fix")).unwrap();
        let expected = serde_json::json!({
            "severity": "error", "check": "motion", "what": "what",
            "consequence": "the map is torn there", "fix": "fix"
        });
        assert_eq!(json, expected);
    }
}
