//! The diagnostics of the running nodes whose level is not OK.

use msgs::diagnostic_msgs::DiagnosticStatus;

use super::{Check, Finding};

const CHECK: Check = Check::Diagnostics;
/// Prefixes of the keys whose values say what is wrong and what fixes it.
const FIX_KEYS: [&str; 2] = ["trouble ", "loss"];

/// The reports whose level is not OK, with the fix that they name.
pub(super) fn findings(reports: &[DiagnosticStatus]) -> Vec<Finding> {
    let mut found: Vec<_> = reports.iter().filter_map(one).collect();
    if found.is_empty() && !reports.is_empty() {
        let nodes = if reports.len() == 1 { "one part" } else { "all parts" };
        found.push(Finding::ok(
            CHECK,
            format!("{nodes} that report on /diagnostics ({}) are OK", reports.len()),
        ));
    }
    found
}

fn one(report: &DiagnosticStatus) -> Option<Finding> {
    if report.level == DiagnosticStatus::OK {
        return None;
    }
    let fixes: Vec<_> = report
        .values
        .iter()
        .filter(|value| FIX_KEYS.iter().any(|key| value.key.starts_with(key)))
        .map(|value| match value.key.strip_prefix("trouble ") {
            Some(topic) => format!("{topic}: {}", value.value),
            None => value.value.clone(),
        })
        .collect();
    let fix = if fixes.is_empty() {
        format!("read the log of {}", report.name)
    } else {
        fixes.join("; ")
    };
    let is_error = report.level != DiagnosticStatus::WARN;
    let stale = if report.level == DiagnosticStatus::STALE { " (stale)" } else { "" };
    let what = format!("{} reports{stale}: {}", report.name, report.message);
    Some(Finding::grave_if(is_error, CHECK, what, fix))
}

#[cfg(test)]
mod tests {
    use msgs::diagnostic_msgs::KeyValue;

    use super::super::synthetic::assert_finding;
    use super::*;
    use crate::doctor::finding::Severity;

    fn report(level: u8, values: &[(&str, &str)]) -> DiagnosticStatus {
        DiagnosticStatus {
            level,
            name: "/detection".to_owned(),
            message: "waiting for /scan".to_owned(),
            hardware_id: String::new(),
            values: values
                .iter()
                .map(|(key, value)| KeyValue { key: (*key).to_owned(), value: (*value).to_owned() })
                .collect(),
        }
    }

    #[test]
    fn a_warning_is_repeated_with_its_fix() {
        let values =
            [("cycles", "3"), ("trouble /scan", "another type"), ("loss", "sudo sysctl -w x")];
        let findings = findings(&[report(DiagnosticStatus::WARN, &values)]);
        assert_eq!(findings.len(), 1);
        let parts = ["/detection reports: waiting", "->  /scan: another type; sudo sysctl -w x"];
        assert_finding(&findings[0], Severity::Warn, &parts);
        assert!(!findings[0].line(false).contains("cycles"));
    }

    #[test]
    fn reports_of_errors_and_stale_reports_are_errors() {
        let findings = findings(&[
            report(DiagnosticStatus::ERROR, &[]),
            report(DiagnosticStatus::STALE, &[]),
            report(DiagnosticStatus::OK, &[]),
        ]);
        assert_eq!(findings.len(), 2);
        assert_finding(&findings[0], Severity::Error, &["read the log of /detection"]);
        assert_finding(&findings[1], Severity::Error, &["(stale)"]);
    }

    #[test]
    fn a_report_that_is_ok_is_ok() {
        assert!(findings(&[]).is_empty());
        assert_finding(
            &findings(&[report(DiagnosticStatus::OK, &[])])[0],
            Severity::Ok,
            &["(1) are OK"],
        );
    }
}
