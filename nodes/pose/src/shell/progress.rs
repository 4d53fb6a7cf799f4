//! The state of tracking, on `/diagnostics` and in the log.

use node_shell::{Counters, Throttle};

use super::follower::InMap;
use crate::slam::MapState;
use crate::tracking::{Tracked, TrackingState};

/// The condition in the diagnostics.
const TRACKING: &str = "tracking";
/// Of these the map's memory has a share in use.
const KEYFRAMES: &str = "keyframes";
/// Its text before the first image.
const WAITING: &str = "initialising: waits for images";

/// Reports the state of the tracking.
pub(super) struct ProgressReporter {
    state: TrackingState,
    counters: Counters,
    troubles: Throttle,
}

impl ProgressReporter {
    /// Reports that no image has come yet.
    pub(super) fn new(counters: Counters) -> Self {
        counters.note_condition(TRACKING, WAITING, true);
        Self { state: TrackingState::default(), counters, troubles: Throttle::for_warnings() }
    }

    /// Resets: no image has come yet.
    pub(super) fn reset(&mut self) {
        self.state = TrackingState::default();
        self.counters.note_condition(TRACKING, WAITING, true);
    }

    /// Reports the state, in the diagnostics and, where it changes, in the log.
    pub(super) fn report(&mut self, tracked: &Tracked, in_map: Option<&InMap>) {
        let state = match tracked.state {
            TrackingState::Initialising => "initialising",
            TrackingState::Tracking => "tracking",
            TrackingState::Lost => "lost",
        };
        let mut text = match &tracked.trouble {
            Some(trouble) => format!("{state}: {trouble}"),
            None => state.to_owned(),
        };
        let mut is_warning = tracked.trouble.is_some() || tracked.state != TrackingState::Tracking;
        if let Some(InMap { state, keyframes, most_keyframes, .. }) = in_map {
            self.counters.note_fill(KEYFRAMES, *keyframes, *most_keyframes);
            if *state == MapState::Unknown {
                text += "; not found in the map yet";
                is_warning = true;
            }
            if keyframes >= most_keyframes {
                text += "; the map is full and grows no more";
                is_warning = true;
            }
        }
        self.counters.note_condition(TRACKING, &text, is_warning);
        if let Some(gap_m) = in_map.and_then(|in_map| in_map.closed_m) {
            tracing::info!("a loop is closed that was open by {gap_m:.3} m");
        }
        if tracked.is_relocalised || in_map.is_some_and(|in_map| in_map.is_found) {
            tracing::info!("relocalised: the camera is at a known place of the map");
        } else if tracked.state != self.state {
            if tracked.state == TrackingState::Tracking {
                tracing::info!("{text}");
            } else {
                tracing::warn!("{text}");
            }
        } else if tracked.trouble.is_some()
            && let Some(held_back) = self.troubles.pass()
        {
            tracing::warn!("{text} ({held_back} more since the last warning)");
        }
        self.state = tracked.state;
    }
}
