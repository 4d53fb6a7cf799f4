//! Whether the cycles that a node receives were made with its own configuration of the pipeline.

use geometry::{CycleSetup, PipelineConfig, PipelineMismatch};

use crate::endpoints::counters::Counters;

/// The name on `/diagnostics`.
const CONDITION: &str = "pipeline";

/// Checks what each cycle was made with, and reports on `/diagnostics` what does not fit.
pub struct PipelineWatch {
    config: PipelineConfig,
    counters: Counters,
    /// None before the first cycle.
    last: Option<Checked>,
}

/// What the last cycle was made with, and the result of the check.
struct Checked {
    setup: CycleSetup,
    rig_frame_id: String,
    found: Result<(), PipelineMismatch>,
}

impl PipelineWatch {
    /// The cause of a drop, for [`StageReporter::dropped`](crate::StageReporter::dropped): the cycle was made with another
    /// configuration.
    pub const MISMATCH: &'static str = "made with another configuration of the pipeline";

    /// Watches for a node that has this configuration.
    #[must_use]
    pub fn new(config: PipelineConfig, counters: Counters) -> Self {
        counters.note_condition(CONDITION, "no cycle yet", false);
        Self { config, counters, last: None }
    }

    /// Whether a cycle in the rig's frame `rig_frame_id` fits. One that was made with the same as the last fits as that does.
    ///
    /// # Errors
    /// With both values of each parameter that differs.
    pub fn check(
        &mut self,
        setup: &CycleSetup,
        rig_frame_id: &str,
    ) -> Result<(), PipelineMismatch> {
        let last = self.last.as_ref();
        if let Some(last) =
            last.filter(|last| last.setup == *setup && last.rig_frame_id == rig_frame_id)
        {
            return last.found.clone();
        }
        let found = self.config.check(setup, rig_frame_id);
        if last.map(|last| &last.found) != Some(&found) {
            match &found {
                Ok(()) => self.counters.note_condition(CONDITION, "as of the cycles", false),
                Err(mismatch) => {
                    self.counters.note_condition(CONDITION, &mismatch.to_string(), true);
                }
            }
        }
        let rig_frame_id = rig_frame_id.to_owned();
        self.last = Some(Checked { setup: *setup, rig_frame_id, found: found.clone() });
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diagnostics_has_both_values_while_cycles_do_not_fit() {
        let counters = Counters::default();
        let mut watch = PipelineWatch::new(PipelineConfig::default(), counters.clone());
        let mut setup = CycleSetup::default();
        assert_eq!(watch.check(&setup, "rig"), Ok(()));
        assert_eq!(counters.snapshot().warnings, Vec::<String>::new());
        setup.voxel_edge_m = 0.05;
        assert!(watch.check(&setup, "rig").is_err());
        let warnings = counters.snapshot().warnings;
        assert!(
            warnings[0].contains("voxel_edge_m is 0.05 in the cycle and 0.08 here"),
            "{warnings:?}"
        );
        assert!(watch.check(&setup, "rig").is_err(), "the next one no more");
        assert_eq!(counters.snapshot().warnings, warnings);
        assert_eq!(watch.check(&CycleSetup::default(), "rig"), Ok(()));
        assert_eq!(counters.snapshot().warnings, Vec::<String>::new());
        assert!(watch.check(&CycleSetup::default(), "base_link").is_err());
    }
}
