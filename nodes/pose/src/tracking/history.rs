//! Where the camera was, and where that leads to.

use geometry::Stamp;

use super::{Hints, Trouble};
use crate::frame::Twist;
use crate::motion::{KnownPose, MotionConfig, NoPrediction, by_wheels, constant_velocity, turned};
use crate::solve::PoseGuess;

/// The last poses, with covariances within the map.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct History {
    before: Option<KnownPose>,
    last: Option<KnownPose>,
}

impl History {
    pub(super) fn last(&self) -> Option<&KnownPose> {
        self.last.as_ref()
    }

    /// The next pose. One of too long ago, or of a time to come, says nothing of how the camera moves now.
    pub(super) fn append(&mut self, pose: KnownPose, max_gap_s: f64) {
        let says = |last: &KnownPose| {
            let since_s = pose.stamp.seconds_since(last.stamp);
            since_s > 0.0 && since_s <= max_gap_s
        };
        self.before = self.last.replace(pose).filter(says);
    }

    /// The last pose is known, but not how the camera moves.
    pub(super) fn forget_motion(&mut self) {
        self.before = None;
    }

    /// Where the camera should be, by the best that there is: its own motion, wheels in place of it, a gyroscope for the
    /// turn. Without any of these it is taken to be where it was, and the trouble says why that may be wrong.
    pub(super) fn prediction(
        &self,
        at: Stamp,
        hints: &Hints<'_>,
        config: &MotionConfig,
    ) -> Option<(PoseGuess, Option<Trouble>)> {
        let last = self.last()?;
        let by_motion = || constant_velocity(self.before.as_ref(), last, at, config);
        let predicted = match &hints.wheels {
            Some(step) => by_wheels(last, step, at, config).or_else(|_| by_motion()),
            None => by_motion(),
        };
        let (mut guess, trouble) = match predicted {
            Ok(guess) => (guess, None),
            Err(reason) => (
                PoseGuess { camera_from_map: last.camera_from_map, covariance: None },
                trouble(reason),
            ),
        };
        if let Some(turn) = &hints.turn
            && let Ok(with_turn) = turned(&guess, last, turn)
            && trouble.is_none()
        {
            // Without a covariance before, the translation has none now.
            guess =
                PoseGuess { covariance: guess.covariance.and(with_turn.covariance), ..with_turn };
        }
        Some((guess, trouble))
    }

    /// How fast the camera moves, were it at this pose now: over the last two intervals, since stamps are noisy.
    pub(super) fn twist(&self, now: &KnownPose) -> Twist {
        let since = |pose: &KnownPose| now.stamp.seconds_since(pose.stamp);
        let from = self.before.as_ref().or(self.last.as_ref()).filter(|pose| since(pose) > 0.0);
        from.map_or_else(Twist::default, |from| {
            Twist::between(&from.camera_from_map, &now.camera_from_map, since(from))
        })
    }
}

fn trouble(reason: NoPrediction) -> Option<Trouble> {
    match reason {
        NoPrediction::TimeWentBack { by_s } => Some(Trouble::TimeWentBack { by_s }),
        NoPrediction::Gap { gap_s, .. } => Some(Trouble::Gap { gap_s }),
        // Every camera has been seen once only at first.
        NoPrediction::NoVelocity | NoPrediction::NotCovered { .. } | NoPrediction::NotFinite => {
            None
        }
    }
}
