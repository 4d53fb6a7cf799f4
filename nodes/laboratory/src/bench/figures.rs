//! The output of a benchmark's results.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::transport::machine::Machine;
use super::transport::table;
use robot::console;
use robot::{Failure, refuse_to_replace};

/// The output of the results.
#[derive(Args, Debug, Default)]
pub(super) struct FigureArgs {
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Write the JSON to a file as well
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace an existing file
    #[arg(long, requires = "output")]
    overwrite: bool,
}

impl FigureArgs {
    /// Refuses to replace a file, before the benchmark starts.
    pub(super) fn check(&self) -> Result<(), Failure> {
        refuse_to_replace(self.output.iter().cloned(), self.overwrite, "-o")
    }

    /// Prints `report`, measured on `machine`: as JSON, or as these tables.
    pub(super) fn tell(
        &self,
        report: &impl Serialize,
        machine: &Machine,
        tables: impl IntoIterator<Item = String>,
    ) -> Result<(), Failure> {
        let json = serde_json::to_string_pretty(report)
            .map_err(|error| Failure::new(format!("cannot write the figures: {error}")))?;
        if let Some(path) = &self.output {
            std::fs::write(path, format!("{json}\n")).map_err(|error| {
                Failure::new(format!("cannot write {}: {error}", path.display()))
            })?;
        }
        if self.json {
            return console::print(json);
        }
        console::print(table::of_machine(machine))?;
        tables.into_iter().try_for_each(|table| console::print(table.trim_end()))
    }
}
