//! Why a transform was not added, or there is none.

use geometry::{PoseLookupError, PosePushError, UnusablePose};

use super::tree::MOST_FRAMES;

/// A transform was not taken in; the tree is as it was.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum TransformRefused {
    /// A frame without a name.
    #[error("a transform from {child:?} to {parent:?} came: a frame must have a name")]
    NoName {
        /// The parent.
        parent: String,
        /// The child.
        child: String,
    },
    /// The parent is already a descendant of the child, or the child itself.
    #[error(
        "a transform from {child:?} to {parent:?} came, and {parent:?} is a descendant of {child:?}: frames form a tree"
    )]
    Loop {
        /// The parent.
        parent: String,
        /// The child.
        child: String,
    },
    /// Too many frames.
    #[error("frame {child:?} came, and {MOST_FRAMES} frames are known: no more are kept")]
    TooManyFrames {
        /// The child.
        child: String,
    },
    /// Its numbers are no rigid motion that can carry a cloud.
    #[error("the transform from {child:?} to {parent:?} is of no use: {source}")]
    Unusable {
        /// The parent.
        parent: String,
        /// The child.
        child: String,
        /// Why.
        source: UnusablePose,
    },
    /// Its stamp is older than all that is kept.
    #[error("the transform from {child:?} to {parent:?} came too late: {source}")]
    Time {
        /// The parent.
        parent: String,
        /// The child.
        child: String,
        /// Why.
        source: PosePushError,
    },
}

/// There is no transform.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum TransformError {
    /// A frame is in no transform.
    #[error("no transform names frame {frame:?}; {}", known(.frames))]
    UnknownFrame {
        /// The one that is missing.
        frame: String,
        /// Those that are known, some of them.
        frames: Vec<String>,
    },
    /// Both are known, and no chain of transforms connects them.
    #[error(
        "frames {target:?} and {source_frame:?} are not connected: the root of the one is {target_root:?}, that of the other \
         {source_root:?}"
    )]
    NotConnected {
        /// The frame to transform to.
        target: String,
        /// Where they are.
        source_frame: String,
        /// The root of the target.
        target_root: String,
        /// The same of the source.
        source_root: String,
    },
    /// The chain contains a transform that is not known for the moment.
    #[error("the transform from {child:?} to {parent:?} is not known for this moment: {source}")]
    Time {
        /// The parent.
        parent: String,
        /// The child.
        child: String,
        /// How far from what is known the moment is.
        source: PoseLookupError,
    },
}

/// This many frames an error names.
pub(super) const FRAMES_NAMED: usize = 12;

fn known(frames: &[String]) -> String {
    if frames.is_empty() {
        "none is known".to_owned()
    } else {
        format!("known are {}", frames.join(", "))
    }
}
