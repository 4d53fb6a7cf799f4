//! The figures of a run: `summary.json`.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use geometry::{VoxelEdgeError, VoxelGrid, ZoneSource};
use serde::{Deserialize, Serialize};

use crate::kept_out::kept_out;
use crate::{CycleRecord, DynamicScore, KeptOut, KeptOutCause, RunRecord, Timing, Transport};

/// The figures of a run. Its keys come in the order of these fields, and but for `timing` two runs of the
/// same input give the same bytes.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Summary {
    /// The bag's name.
    pub bag: String,
    /// How the stages were connected.
    pub transport: Transport,
    /// The method by its parameter's name.
    pub method: String,
    /// Edge of the voxels of the reduction and of the map.
    pub voxel_edge_m: f64,
    /// From the first cycle's scan to the last one's.
    pub duration_s: f64,
    /// How many cycles, and how many with what kind of zone.
    pub cycles: CycleCounts,
    /// Points of each stage.
    pub points: StagePoints,
    /// Shares of the reduced cloud that the two stages of segmentation take (Rec-HV Table 5).
    pub zone_shares: ZoneShares,
    /// The map at the end.
    pub map: MapSummary,
    /// The drops, by topic or stage and then by reason.
    pub drops: Vec<DropSummary>,
    /// The voxels that the map does not hold, for the pictures; the file has their counts.
    #[serde(skip)]
    pub kept_out: Vec<KeptOut>,
    /// The score against the truth, where there is one.
    pub truth: Option<DynamicScore>,
    /// How long the steps took; left out when it was not measured or not requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<Timing>,
}

/// Cycles by what detection found in them.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct CycleCounts {
    /// Cycles that went through all three stages.
    pub total: usize,
    /// Cycles with at least one measured zone: their own scan bounds it.
    pub with_measured_zone: usize,
    /// Cycles whose zones are all held over from an earlier cycle.
    pub with_held_zone_only: usize,
    /// Cycles without a zone.
    pub without_zone: usize,
    /// Measured zones over all cycles.
    pub detections: usize,
}

/// Points a cycle, stage by stage.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct StagePoints {
    /// The cloud as it came.
    pub before_reduction: Option<PointStatistics>,
    /// The reduced cloud.
    pub reduced: Option<PointStatistics>,
    /// Reduced points within a zone (PCL_ZD).
    pub in_zone: Option<PointStatistics>,
    /// Of these, points taken for moving (PCL_Din).
    pub dynamic: Option<PointStatistics>,
    /// Points that the cycle added to the map.
    pub map_growth: Option<PointStatistics>,
}

/// A count over the cycles. There is none when there is no cycle.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct PointStatistics {
    /// The middle one; the mean of the two middle ones of an even number.
    pub median: f64,
    /// The least.
    pub min: i64,
    /// The most.
    pub max: i64,
}

/// The points of the reduced cloud that the two stages of segmentation take, over the cycles with a zone.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ZoneShares {
    /// Points within a zone over all points (the angle stage); none without a zone.
    pub in_zone: Option<f64>,
    /// Points taken for moving over all points (the depth stage); none without a zone.
    pub dynamic: Option<f64>,
}

/// The map at the end of the run.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct MapSummary {
    /// Points after the first cycle.
    pub points_after_first_cycle: usize,
    /// Points at the end.
    pub points: usize,
    /// Points of the map that the same clouds give when nothing is removed.
    pub points_without_removal: usize,
    /// Voxels of the map without removal that hold no point of the map.
    pub voxels_kept_out: usize,
    /// The same by their causes.
    #[serde(default)]
    pub kept_out: KeptOutCounts,
    /// Blocks of 8 voxels an axis that the map dropped to make room for others.
    #[serde(default)]
    pub dropped_blocks: usize,
}

/// Voxels that are not in the map, by the cause.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct KeptOutCounts {
    /// [`KeptOutCause::Moved`].
    pub moved: usize,
    /// [`KeptOutCause::BesideSurface`].
    pub beside_surface: usize,
    /// [`KeptOutCause::SeenThrough`].
    pub seen_through: usize,
    /// [`KeptOutCause::NoRoom`].
    #[serde(default)]
    pub no_room: usize,
    /// [`KeptOutCause::NoReturn`].
    pub no_return: usize,
    /// [`KeptOutCause::SeenOnce`].
    pub seen_once: usize,
    /// [`KeptOutCause::Uncertain`].
    pub uncertain: usize,
}

impl KeptOutCounts {
    fn of_voxels(voxels: &[KeptOut]) -> Self {
        let of = |cause| voxels.iter().filter(|voxel| voxel.cause == cause).count();
        Self {
            moved: of(KeptOutCause::Moved),
            beside_surface: of(KeptOutCause::BesideSurface),
            seen_through: of(KeptOutCause::SeenThrough),
            no_room: of(KeptOutCause::NoRoom),
            no_return: of(KeptOutCause::NoReturn),
            seen_once: of(KeptOutCause::SeenOnce),
            uncertain: of(KeptOutCause::Uncertain),
        }
    }

    /// The voxels of one cause.
    #[must_use]
    pub fn of(&self, cause: KeptOutCause) -> usize {
        match cause {
            KeptOutCause::Moved => self.moved,
            KeptOutCause::BesideSurface => self.beside_surface,
            KeptOutCause::SeenThrough => self.seen_through,
            KeptOutCause::NoRoom => self.no_room,
            KeptOutCause::NoReturn => self.no_return,
            KeptOutCause::SeenOnce => self.seen_once,
            KeptOutCause::Uncertain => self.uncertain,
        }
    }
}

/// How often one thing was dropped for one reason.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct DropSummary {
    /// The topic or the stage that lost it.
    pub topic_or_stage: String,
    /// Why, in words.
    pub reason: String,
    /// How often.
    pub count: u64,
}

impl Summary {
    /// The figures of `run`, with the score against the truth where there is one. `with_timing` says whether
    /// the durations are wanted.
    ///
    /// # Errors
    /// When the run's voxel edge is not a positive number.
    pub fn of_run(
        run: &RunRecord,
        truth: Option<DynamicScore>,
        with_timing: bool,
    ) -> Result<Self, VoxelEdgeError> {
        let grid = VoxelGrid::new(run.voxel_edge_m)?;
        let kept_out = kept_out(run, &grid);
        let duration_s = match (run.cycles.first(), run.cycles.last()) {
            (Some(first), Some(last)) => last.scan_stamp.seconds_since(first.scan_stamp),
            _ => 0.0,
        };
        Ok(Self {
            bag: run.bag_name.clone(),
            transport: run.transport,
            method: run.method.clone(),
            voxel_edge_m: run.voxel_edge_m,
            duration_s,
            cycles: CycleCounts::of_cycles(&run.cycles),
            points: StagePoints::of_cycles(&run.cycles),
            zone_shares: ZoneShares::of_cycles(&run.cycles),
            map: MapSummary {
                points_after_first_cycle: run.cycles.first().map_or(0, |cycle| cycle.map_points),
                points: run.static_map.len(),
                points_without_removal: run.unfiltered_map.len(),
                voxels_kept_out: kept_out.len(),
                kept_out: KeptOutCounts::of_voxels(&kept_out),
                dropped_blocks: run.dropped_blocks,
            },
            drops: merged_drops(run),
            kept_out,
            truth,
            timing: if with_timing { Timing::of_cycles(&run.cycles) } else { None },
        })
    }

    /// The content of `summary.json`, with a newline at its end.
    ///
    /// # Errors
    /// Only if serde cannot write one of the fields, which none of their types gives cause for.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        let mut json = serde_json::to_string_pretty(self)?;
        json.push('\n');
        Ok(json)
    }

    /// How many things were dropped.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.drops.iter().map(|drop| drop.count).sum()
    }
}

impl CycleCounts {
    fn of_cycles(cycles: &[CycleRecord]) -> Self {
        let measured = |cycle: &CycleRecord| {
            cycle.zones.iter().filter(|zone| zone.source == ZoneSource::Measured).count()
        };
        let with_measured_zone = cycles.iter().filter(|cycle| measured(cycle) > 0).count();
        let without_zone = cycles.iter().filter(|cycle| cycle.zones.is_empty()).count();
        Self {
            total: cycles.len(),
            with_measured_zone,
            with_held_zone_only: cycles.len() - with_measured_zone - without_zone,
            without_zone,
            detections: cycles.iter().map(measured).sum(),
        }
    }
}

impl StagePoints {
    fn of_cycles(cycles: &[CycleRecord]) -> Self {
        let of = |count: fn(&CycleRecord) -> usize| {
            PointStatistics::of_counts(cycles.iter().map(|cycle| count(cycle) as i64).collect())
        };
        let mut before = 0;
        let growth = cycles
            .iter()
            .map(|cycle| {
                let after = cycle.map_points as i64;
                let added = after - before;
                before = after;
                added
            })
            .collect();
        Self {
            before_reduction: of(|cycle| cycle.points_in),
            reduced: of(|cycle| cycle.counts.reduced),
            in_zone: of(|cycle| cycle.counts.in_zone),
            dynamic: of(|cycle| cycle.counts.dynamic),
            map_growth: PointStatistics::of_counts(growth),
        }
    }
}

impl PointStatistics {
    fn of_counts(mut counts: Vec<i64>) -> Option<Self> {
        counts.sort_unstable();
        let median = estimation::quantile::median(counts.iter().map(|count| *count as f64))?;
        Some(Self { median, min: *counts.first()?, max: *counts.last()? })
    }
}

impl ZoneShares {
    fn of_cycles(cycles: &[CycleRecord]) -> Self {
        let with_zone = || cycles.iter().filter(|cycle| !cycle.zones.is_empty());
        let reduced: usize = with_zone().map(|cycle| cycle.counts.reduced).sum();
        let share = |points: usize| (reduced > 0).then(|| points as f64 / reduced as f64);
        Self {
            in_zone: share(with_zone().map(|cycle| cycle.counts.in_zone).sum()),
            dynamic: share(with_zone().map(|cycle| cycle.counts.dynamic).sum()),
        }
    }
}

/// The drops of a run, one entry for each place and reason, in alphabetical order.
fn merged_drops(run: &RunRecord) -> Vec<DropSummary> {
    let mut counts: BTreeMap<(&str, &str), u64> = BTreeMap::new();
    for drop in run.drops.iter().filter(|drop| drop.count > 0) {
        *counts.entry((&drop.topic_or_stage, &drop.reason)).or_default() += drop.count;
    }
    counts
        .into_iter()
        .map(|((topic_or_stage, reason), count)| DropSummary {
            topic_or_stage: topic_or_stage.to_owned(),
            reason: reason.to_owned(),
            count,
        })
        .collect()
}
