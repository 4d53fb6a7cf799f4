//! The common error of landmarks.
//!
//! A pose that is measured against landmarks has three errors. That of what the frame itself shows is new with each frame. That
//! of the landmarks' places, as the frame that brought them in showed them, stays: to see them again moves each to where
//! the pose has it, which has the same error in the mean. And the pose of that frame had an error of its own.
//!
//! Landmarks of several frames make the mean of their frames' errors. How the places were shown is independent from frame to
//! frame: its variances go with the squares of the shares. The poses were measured against each other's landmarks:
//! whatever their correlation, the convex sum of their covariances bounds that of the mean (Julier and Uhlmann 1997, "A
//! non-divergent estimation algorithm in the presence of unknown correlations").

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Matrix6};

use estimation::perturbation::left::adjoint;

/// The frames that brought landmarks in.
#[derive(Clone, Debug, Default)]
pub(super) struct Arrivals {
    by_frame: BTreeMap<u64, Arrival>,
}

/// A frame's pose, and how sure it was.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    camera_from_map: Isometry3<f64>,
    covariance: Matrix6<f64>,
    /// Of a pose that is measured against all its landmarks, by the error of these alone.
    of_landmarks: Matrix6<f64>,
    landmarks: usize,
}

impl Arrivals {
    /// A frame adds landmarks, this many and from a pose of this covariance. `of_landmarks` is the covariance of a pose that
    /// is measured against them, if they alone had errors.
    pub(super) fn arrive(
        &mut self,
        frame: u64,
        camera_from_map: &Isometry3<f64>,
        covariance: &Matrix6<f64>,
        of_landmarks: &Matrix6<f64>,
        landmarks: usize,
    ) {
        let (camera_from_map, covariance) = (*camera_from_map, *covariance);
        let of_landmarks = *of_landmarks;
        let arrival = Arrival { camera_from_map, covariance, of_landmarks, landmarks };
        self.by_frame.insert(frame, arrival);
    }

    /// Forgets the frames whose landmarks are all forgotten.
    pub(super) fn keep(&mut self, frames: &BTreeSet<u64>) {
        self.by_frame.retain(|frame, _| frames.contains(frame));
    }

    /// The error of a camera's pose here by the landmarks that these frames added, one frame for each landmark.
    pub(super) fn covariance_at(
        &self,
        frames: impl Iterator<Item = u64>,
        camera_from_map: &Isometry3<f64>,
    ) -> Matrix6<f64> {
        let mut counts = BTreeMap::<u64, u32>::new();
        for frame in frames {
            *counts.entry(frame).or_default() += 1;
        }
        let all = f64::from(counts.values().sum::<u32>().max(1));
        let carried = |(frame, count): (&u64, &u32)| {
            let arrival = self.by_frame.get(frame)?;
            let carry = adjoint(&(camera_from_map * arrival.camera_from_map.inverse()));
            let share = f64::from(*count) / all;
            // A part of the landmarks has that much less information.
            let part = arrival.landmarks as f64 / f64::from(*count);
            let whole = share * arrival.covariance + share * share * part * arrival.of_landmarks;
            Some(carry * whole * carry.transpose())
        };
        counts.iter().filter_map(carried).sum()
    }
}
