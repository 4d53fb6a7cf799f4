//! When a frame becomes a keyframe.

use super::KeyframingConfig;

/// The state of tracking at a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FollowedFrame {
    /// Frames since the camera was found again after it was lost; `None` if it never was.
    pub since_relocalisation: Option<u64>,
    /// Frames since the last keyframe.
    pub since_keyframe: u64,
    /// Whether local mapping waits for work.
    pub is_mapping_idle: bool,
    /// Points of the map that the frame shows.
    pub tracked_points: usize,
    /// Points that the reference keyframe sees: the one that shares most with the frame.
    pub reference_points: usize,
}

/// Why a frame does not become a keyframe.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NotYet {
    /// The camera was lost this many frames ago.
    Relocalised(u64),
    /// Mapping is busy, and the last keyframe is only this many frames old.
    Busy(u64),
    /// It shows too few points: its pose may not be good.
    TooFewPoints(usize),
    /// It shows most of what the reference keyframe does.
    NothingNew,
}

/// Whether a frame becomes a keyframe: all four conditions of the seed must hold.
///
/// # Errors
/// The first condition that does not hold.
pub fn decide(frame: &FollowedFrame, config: &KeyframingConfig) -> Result<(), NotYet> {
    let lost = frame.since_relocalisation;
    if let Some(since) = lost.filter(|since| *since <= config.frames_after_relocalisation) {
        return Err(NotYet::Relocalised(since));
    }
    if !frame.is_mapping_idle && frame.since_keyframe <= config.frames_after_keyframe {
        return Err(NotYet::Busy(frame.since_keyframe));
    }
    if frame.tracked_points < config.least_points {
        return Err(NotYet::TooFewPoints(frame.tracked_points));
    }
    let least = config.max_tracked_share * frame.reference_points as f64;
    if frame.tracked_points as f64 >= least { Err(NotYet::NothingNew) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_kept_when_all_four_conditions_hold() {
        let config = KeyframingConfig::default();
        let good = FollowedFrame {
            since_relocalisation: Some(21),
            since_keyframe: 5,
            is_mapping_idle: true,
            tracked_points: 89,
            reference_points: 100,
        };
        assert_eq!(decide(&good, &config), Ok(()));
        let with = |change: fn(&mut FollowedFrame)| {
            let mut frame = good;
            change(&mut frame);
            decide(&frame, &config)
        };
        assert_eq!(with(|frame| frame.since_relocalisation = None), Ok(()));
        let lost = with(|frame| frame.since_relocalisation = Some(20));
        assert_eq!(lost, Err(NotYet::Relocalised(20)));
        assert_eq!(with(|frame| frame.is_mapping_idle = false), Err(NotYet::Busy(5)));
        let late = with(|frame| (frame.is_mapping_idle, frame.since_keyframe) = (false, 21));
        assert_eq!(late, Ok(()));
        assert_eq!(with(|frame| frame.tracked_points = 49), Err(NotYet::TooFewPoints(49)));
        assert_eq!(with(|frame| frame.tracked_points = 90), Err(NotYet::NothingNew));
    }
}
