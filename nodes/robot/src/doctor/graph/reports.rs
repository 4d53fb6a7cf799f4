//! What running nodes say of themselves on `/diagnostics`, where it is not well.

use msgs::diagnostic_msgs::DiagnosticStatus;

use super::{Check, Finding};

const CHECK: Check = Check::Diagnostics;
/// What the keys begin with that say what is wrong, and what fixes it.
const TELLING_KEYS: [&str; 2] = ["trouble ", "loss"];

/// The reports that are no OK, with what they tell of it.
pub(super) fn repeated(reports: &[DiagnosticStatus]) -> Vec<Finding> {
    let mut findings: Vec<_> = reports.iter().filter_map(one).collect();
    if findings.is_empty() && !reports.is_empty() {
        let nodes = if reports.len() == 1 { "one part" } else { "all parts" };
        findings.push(Finding::ok(
            CHECK,
            format!("{nodes} that report on /diagnostics ({}) are well", reports.len()),
        ));
    }
    findings
}

fn one(report: &DiagnosticStatus) -> Option<Finding> {
    if report.level == DiagnosticStatus::OK {
        return None;
    }
    let told: Vec<_> = report
        .values
        .iter()
        .filter(|value| TELLING_KEYS.iter().any(|key| value.key.starts_with(key)))
        .map(|value| match value.key.strip_prefix("trouble ") {
            Some(topic) => format!("{topic}: {}", value.value),
            None => value.value.clone(),
        })
        .collect();
    let fix =
        if told.is_empty() { format!("read the log of {}", report.name) } else { told.join("; ") };
    let is_error = report.level != DiagnosticStatus::WARN;
    let stale = if report.level == DiagnosticStatus::STALE { " (stale)" } else { "" };
    let what = format!("{} reports{stale}: {}", report.name, report.message);
    Some(Finding::grave_if(is_error, CHECK, what, fix))
}

#[cfg(test)]
mod tests {
    use msgs::diagnostic_msgs::KeyValue;

    use super::super::synthetic::tells;
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
    fn a_warning_is_repeated_with_what_it_tells() {
        let values =
            [("cycles", "3"), ("trouble /scan", "another type"), ("loss", "sudo sysctl -w x")];
        let findings = repeated(&[report(DiagnosticStatus::WARN, &values)]);
        assert_eq!(findings.len(), 1);
        let parts = ["/detection reports: waiting", "->  /scan: another type; sudo sysctl -w x"];
        tells(&findings[0], Severity::Warn, &parts);
        assert!(!findings[0].line(false).contains("cycles"));
    }

    #[test]
    fn errors_and_silent_parts_are_errors() {
        let findings = repeated(&[
            report(DiagnosticStatus::ERROR, &[]),
            report(DiagnosticStatus::STALE, &[]),
            report(DiagnosticStatus::OK, &[]),
        ]);
        assert_eq!(findings.len(), 2);
        tells(&findings[0], Severity::Error, &["read the log of /detection"]);
        tells(&findings[1], Severity::Error, &["(stale)"]);
    }

    #[test]
    fn well_is_ok() {
        assert!(repeated(&[]).is_empty());
        tells(&repeated(&[report(DiagnosticStatus::OK, &[])])[0], Severity::Ok, &["(1) are well"]);
    }
}
