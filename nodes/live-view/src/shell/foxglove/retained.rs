//! What a viewer gets of a topic that it subscribes to after others have.

use std::collections::BTreeMap;

use msgs::geometry_msgs::TransformStamped;
use msgs::tf2_msgs::TFMessage;

/// The static transforms that are kept at most: a robot has some dozens.
const MOST_TRANSFORMS: usize = 1_000;

/// What is kept of a topic's messages for viewers that come later.
pub(super) trait Retention<M>: Default + Send + 'static {
    /// What is kept after this message.
    fn after(&mut self, message: &M) -> Retained<M>;
}

/// What is kept after a message.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Retained<M> {
    /// Nothing of it, or what was kept before.
    Nothing,
    /// The message.
    Message,
    /// This one.
    Merged(M),
}

/// Of a topic that is not latched.
#[derive(Default)]
pub(super) struct Nothing;

/// Of a latched topic each of whose messages replaces the one before.
#[derive(Default)]
pub(super) struct LastMessage;

/// Of the static transforms: each broadcaster has a message of its own, and the last transform of each child frame holds, as
/// in tf2.
#[derive(Default)]
pub(super) struct AllTransforms(BTreeMap<String, TransformStamped>);

impl<M> Retention<M> for Nothing {
    fn after(&mut self, _: &M) -> Retained<M> {
        Retained::Nothing
    }
}

impl<M> Retention<M> for LastMessage {
    fn after(&mut self, _: &M) -> Retained<M> {
        Retained::Message
    }
}

impl Retention<TFMessage> for AllTransforms {
    fn after(&mut self, message: &TFMessage) -> Retained<TFMessage> {
        for transform in &message.transforms {
            let child = &transform.child_frame_id;
            if self.0.len() < MOST_TRANSFORMS || self.0.contains_key(child) {
                self.0.insert(child.clone(), transform.clone());
            }
        }
        Retained::Merged(TFMessage { transforms: self.0.values().cloned().collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transform(child: &str, x_m: f64) -> TransformStamped {
        let mut transform =
            TransformStamped { child_frame_id: child.to_owned(), ..TransformStamped::default() };
        transform.transform.translation.x = x_m;
        transform
    }

    /// Regression: a second viewer got the transforms of the last broadcaster alone.
    #[test]
    fn the_transforms_of_all_broadcasters_are_kept_and_the_last_of_each_frame_holds() {
        let mut all = AllTransforms::default();
        let message = |transforms| TFMessage { transforms };
        all.after(&message(vec![transform("laser", 0.0), transform("camera", 1.0)]));
        let merged = all.after(&message(vec![transform("imu", 2.0), transform("laser", 3.0)]));
        let expected =
            vec![transform("camera", 1.0), transform("imu", 2.0), transform("laser", 3.0)];
        assert_eq!(merged, Retained::Merged(message(expected)));
    }

    #[test]
    fn endless_frames_are_not_kept() {
        let mut all = AllTransforms::default();
        for frame in 0..2 * MOST_TRANSFORMS {
            all.after(&TFMessage { transforms: vec![transform(&frame.to_string(), 0.0)] });
        }
        assert_eq!(all.0.len(), MOST_TRANSFORMS);
    }
}
