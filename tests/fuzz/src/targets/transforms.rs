//! The tree of frames, as strangers make it grow.

use msgs::{cdr, convert, tf2_msgs::TFMessage};
use node_shell::TransformTree;

use super::samples::{self, bytes};
use super::{FAST, VALUES};
use crate::Target;

pub(super) const TARGETS: &[Target] = &[Target {
    name: "transforms",
    body,
    seeds: || vec![bytes(&samples::transforms())],
    words: &[b"map\0", b"odom\0", b"base_link\0", b"laser\0"],
    memory: VALUES,
    gate_cases: FAST,
}];

/// The first byte says whether they are fixed, and where the message is parted into two.
fn body(input: &[u8]) {
    let Ok(message) = cdr::decode::<TFMessage>(input) else { return };
    let mut tree = TransformTree::default();
    for are_fixed in [false, true, false] {
        tree.insert_message(&message, are_fixed, drop);
    }
    let frames = message.transforms.iter().take(8);
    for transform in frames {
        let stamp = convert::stamp_from_time(transform.header.stamp);
        for target in ["map", transform.header.frame_id.as_str()] {
            let source = transform.child_frame_id.as_str();
            let found = tree.lookup(target, source, stamp).ok();
            for found in found.into_iter().chain(tree.lookup_latest(target, source).ok()) {
                assert!(found.rotation.coords.norm().is_finite());
            }
        }
    }
}
