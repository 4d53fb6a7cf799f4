//! What the user is told and shown at the end of a run.

use std::io::ErrorKind;
use std::process::{Command, Stdio};

use report::Summary;

use super::drawings::Drawings;
use super::output::{self, OutputFolder};
use crate::console;
use crate::failure::Failure;

/// Prints the figures of the run, and where its results are.
pub(super) fn print_summary(
    folder: &OutputFolder,
    summary: &Summary,
    drawings: &Drawings,
    json: bool,
) -> Result<(), Failure> {
    if json {
        let json = summary
            .to_json()
            .map_err(|error| Failure::new(format!("cannot print the summary: {error}")))?;
        return console::print(json.trim_end());
    }
    if drawings.thumbnail.is_empty() {
        report::headline(summary).iter().try_for_each(console::print)?;
    } else {
        drawings.thumbnail.iter().try_for_each(console::print)?;
        console::print("")?;
        report::figures_table(summary).iter().try_for_each(console::print)?;
        console::print("")?;
    }
    let path = folder.path().display();
    let has_map = summary.map.points > 0;
    let map = if has_map { format!("map: {path}/map.ply, map.pcd; ") } else { String::new() };
    console::print(format_args!("{map}removed: {path}/dynamic/; figures: {path}/summary.json"))?;
    if let Some(pictures) = drawings.list(folder.path()) {
        console::print(format_args!("pictures: {pictures}"))?;
    }
    console::print(format_args!("report: {path}/report.html"))
}

/// Opens the report with the desktop's program (xdg-utils). Where there is none, that is said.
pub(super) fn open_report(folder: &OutputFolder) {
    let report = folder.path().join(output::REPORT);
    let opened =
        Command::new("xdg-open").arg(&report).stdin(Stdio::null()).stdout(Stdio::null()).status();
    match opened {
        Ok(status) if status.success() => {}
        Ok(status) => console::note(format_args!("the report was not opened: xdg-open {status}")),
        Err(error) if error.kind() == ErrorKind::NotFound => console::note(format_args!(
            "the report was not opened, since there is no xdg-open here (package xdg-utils): open {} in a browser",
            report.display()
        )),
        Err(error) => console::note(format_args!("the report was not opened: xdg-open: {error}")),
    }
}
