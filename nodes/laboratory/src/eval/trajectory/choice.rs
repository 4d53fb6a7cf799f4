//! The arguments for the score of a trajectory.

use clap::{Args, ValueEnum};
use evaluation::trajectory::{
    Alignment, AssociationConfig, Delta, DeltaUnit, Pairs, PairsFrom, Plane, RelativeConfig,
    SegmentConfig, SegmentLengths, TrajectoryScoreConfig,
};

/// The rules of the score.
#[derive(Args, Debug)]
pub(super) struct ScoreArgs {
    /// The alignment of the estimate: none, of the first poses, by yaw and translation,
    /// by rotation and translation, or with scale as well
    #[arg(long, value_enum, default_value_t = Align::Se3)]
    align: Align,
    /// The largest time difference of matched poses (evo has 0.01, the TUM tools 0.02)
    #[arg(long, value_name = "SECONDS", default_value_t = AssociationConfig::default().max_difference_s)]
    max_difference: f64,
    /// Offset that is added to the stamps of the estimate
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true)]
    offset: f64,
    /// Relative errors over intervals of this length, such as 1s, 10m, 5deg or 30frames; may be given several
    /// times [default: 1s and 1m]
    #[arg(long = "rpe", value_name = "LENGTH", value_parser = parse_delta)]
    deltas: Vec<Delta>,
    /// The choice of the intervals
    #[arg(long, value_enum, default_value_t = RpePairs::All)]
    rpe_pairs: RpePairs,
    /// The trajectory by which the length of an interval is measured (evo takes the estimate)
    #[arg(long, value_enum, default_value_t = RpeFrom::Reference)]
    rpe_from: RpeFrom,
    /// The relative tolerance of an interval's length
    #[arg(long, value_name = "SHARE", default_value_t = RelativeConfig::default().tolerance)]
    rpe_tolerance: f64,
    /// Segments of the KITTI measure: kitti (100 to 800 m), scaled (one to eight tenths of the path), or metres as
    /// 10,20,50
    #[arg(long, value_name = "LENGTHS", default_value = "kitti", value_parser = parse_segments)]
    segments: SegmentLengths,
    /// The number of poses from the start of one segment to that of the next
    #[arg(long, value_name = "POSES", default_value_t = SegmentConfig::default().step_poses)]
    segment_step: usize,
    /// Gaps between poses longer than this count as not covered
    #[arg(long, value_name = "SECONDS", default_value_t = TrajectoryScoreConfig::default().max_gap_s)]
    max_gap: f64,
    /// The plane of the plan on the page [default: the one in which the reference extends most]
    #[arg(long, value_enum)]
    plane: Option<PlanPlane>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Align {
    None,
    Origin,
    Yaw,
    Se3,
    Sim3,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum RpePairs {
    /// One interval from every pose
    All,
    /// Each interval begins where the one before ends
    Consecutive,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum RpeFrom {
    Reference,
    Estimate,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum PlanPlane {
    Xy,
    Xz,
    Yz,
}

impl ScoreArgs {
    /// The configuration of the score.
    pub(super) fn config(&self) -> TrajectoryScoreConfig {
        let RelativeConfig { deltas, .. } = RelativeConfig::default();
        TrajectoryScoreConfig {
            association: AssociationConfig {
                max_difference_s: self.max_difference,
                offset_s: self.offset,
            },
            alignment: match self.align {
                Align::None => Alignment::None,
                Align::Origin => Alignment::Origin,
                Align::Yaw => Alignment::Yaw,
                Align::Se3 => Alignment::Se3,
                Align::Sim3 => Alignment::Sim3,
            },
            relative: RelativeConfig {
                deltas: if self.deltas.is_empty() { deltas } else { self.deltas.clone() },
                pairs: match self.rpe_pairs {
                    RpePairs::All => Pairs::All,
                    RpePairs::Consecutive => Pairs::Consecutive,
                },
                pairs_from: match self.rpe_from {
                    RpeFrom::Reference => PairsFrom::Reference,
                    RpeFrom::Estimate => PairsFrom::Estimate,
                },
                tolerance: self.rpe_tolerance,
            },
            segments: SegmentConfig {
                lengths: self.segments.clone(),
                step_poses: self.segment_step,
            },
            max_gap_s: self.max_gap,
        }
    }

    /// The plane of the plans, if one was chosen.
    pub(super) fn plane(&self) -> Option<Plane> {
        self.plane.map(|plane| match plane {
            PlanPlane::Xy => Plane::Xy,
            PlanPlane::Xz => Plane::Xz,
            PlanPlane::Yz => Plane::Yz,
        })
    }
}

/// A number with its unit, without a space.
pub(super) fn parse_delta(text: &str) -> Result<Delta, String> {
    let digits = text.find(|symbol: char| symbol.is_ascii_alphabetic()).unwrap_or(text.len());
    let (value, unit) = text.split_at(digits);
    let unit = match unit {
        "s" => DeltaUnit::Seconds,
        "m" => DeltaUnit::Metres,
        "deg" => DeltaUnit::Degrees,
        "f" | "frame" | "frames" => DeltaUnit::Frames,
        _ => return Err("a length is a number with s, m, deg or frames behind it".to_owned()),
    };
    let value = value.trim().parse().map_err(|_| format!("'{value}' is not a number"))?;
    Ok(Delta { value, unit })
}

/// `kitti`, `scaled`, or metres separated by commas.
pub(super) fn parse_segments(text: &str) -> Result<SegmentLengths, String> {
    match text {
        "kitti" => Ok(SegmentLengths::Kitti),
        "scaled" => Ok(SegmentLengths::Scaled),
        list => list
            .split(',')
            .map(|length| length.trim().parse().map_err(|_| format!("'{length}' is not a number")))
            .collect::<Result<_, _>>()
            .map(SegmentLengths::Metres),
    }
}
