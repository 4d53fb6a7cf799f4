//! An end of a run as a process: start, wait, and its report.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;

use super::pipe::{self, Lines};
use super::place::Place;
use robot::Failure;
use robot::Process;

/// How often a process is checked.
pub(super) const LOOK_AGAIN: Duration = Duration::from_millis(20);

/// An end of this program.
pub(super) struct End {
    process: Process,
    report: Lines<Option<String>>,
    trouble: Lines<VecDeque<String>>,
}

impl End {
    /// Starts an end in a domain and namespace.
    pub(super) fn start(place: &Place, name: &str, arguments: &[String]) -> Result<Self, Failure> {
        let mut process = place.start(name, arguments)?;
        let report = Lines::fold(process.take_stdout(), |last: &mut Option<String>, line| {
            *last = Some(line.to_owned());
        });
        let trouble = pipe::last_lines(process.take_stderr());
        Ok(Self { process, report, trouble })
    }

    /// Its process id.
    pub(super) fn id(&self) -> u32 {
        self.process.id()
    }

    /// Whether it has ended.
    pub(super) fn has_ended(&mut self) -> Result<bool, Failure> {
        Ok(self.process.ended()?.is_some())
    }

    /// Waits until it ends by itself.
    pub(super) fn wait(&mut self, longest: Duration) -> Result<(), Failure> {
        let deadline = Instant::now() + longest;
        while !self.has_ended()? {
            if Instant::now() >= deadline {
                return Err(Failure::new(format!(
                    "{} did not end within {:.0} s",
                    self.process.name(),
                    longest.as_secs_f64()
                ))
                .fix("its peer was not found; see whether a firewall keeps UDP away from this machine"));
            }
            std::thread::sleep(LOOK_AGAIN);
        }
        Ok(())
    }

    /// Stops it and reads its report.
    pub(super) fn finish<R: DeserializeOwned>(mut self) -> Result<R, Failure> {
        let status = self.process.stop()?;
        let (report, trouble) = (self.report.finish(), self.trouble.finish());
        let name = self.process.name();
        if !status.success() {
            let trouble = Vec::from(trouble).join("\n  ");
            return Err(Failure::new(format!("{name} failed ({status}): {trouble}")));
        }
        let report = report.ok_or_else(|| Failure::new(format!("{name} reported nothing")))?;
        serde_json::from_str(&report)
            .map_err(|error| Failure::new(format!("{name} reported `{report}`: {error}")))
    }

    /// Kills it, without a report.
    pub(super) fn kill(self) -> Result<(), Failure> {
        self.process.kill()
    }
}
