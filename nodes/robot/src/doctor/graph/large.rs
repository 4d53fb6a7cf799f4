//! Topics whose messages are larger than the largest message that arrives complete.

use std::collections::BTreeMap;

use msgs::RosMessage;
use msgs::sensor_msgs::{Image, PointCloud2};
use node_shell::{DiscoveredEndpoint, Role};

use super::{Check, Finding, GraphView, Machine, ReceiveBuffer};
use crate::doctor::machine;
use crate::doctor::sizes::kb;

const CHECK: Check = Check::Sizes;
/// Bytes of a pixel of a depth image in millimetres (16UC1), the smaller of the two encodings.
const DEPTH_PIXEL_BYTES: usize = 2;
/// Bytes of a pixel in colour (rgb8).
const COLOUR_PIXEL_BYTES: usize = 3;
/// Bytes of a point with x, y, z and one more field; drivers that pad send 32.
const POINT_BYTES: usize = 16;

/// The size of the images beside a topic of camera calibrations.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct CameraSize {
    pub(super) width_px: u32,
    pub(super) height_px: u32,
    /// The rate of its messages; `None` below two of them.
    pub(super) rate_hz: Option<f64>,
}

/// What was received on a large topic.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Measured {
    pub(super) messages: u64,
    pub(super) largest_bytes: usize,
    pub(super) rate_hz: Option<f64>,
}

/// How large the messages of a topic are, and how that is known.
struct Size {
    bytes: usize,
    evidence: String,
}

/// The sizes of large topics, compared with the largest message that arrives complete.
pub(super) fn sizes(view: &GraphView, buffer: &ReceiveBuffer) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut unknown = Vec::new();
    for type_name in [Image::TYPE_NAME, PointCloud2::TYPE_NAME] {
        for topic in view.published(type_name) {
            match view.measured.get(topic) {
                Some(measured) if measured.messages == 0 => {
                    findings.push(silent(view, topic, buffer));
                }
                _ => match size_of(view, topic, type_name) {
                    Some(size) => findings.push(finding(view, topic, &size, buffer)),
                    None => unknown.push(topic),
                },
            }
        }
    }
    if !unknown.is_empty() {
        findings.push(Finding::ok(
            CHECK,
            format!(
                "the sizes of the messages of {} are unknown without --measure",
                unknown.join(", ")
            ),
        ));
    }
    findings
}

/// Nothing was received on a topic, although it is published.
fn silent(view: &GraphView, topic: &str, buffer: &ReceiveBuffer) -> Finding {
    let safe = kb(buffer.largest_safe_bytes);
    Finding::warn(
        CHECK,
        format!(
            "nothing of {topic} arrived within {:.1} s, although it is published; messages up to {safe} \
             arrive complete here",
            view.listened_s
        ),
        format!(
            "check with `stillmap doctor --measure --seconds 10` whether its rate is low; if its messages are larger \
             than {safe}: {}",
            buffer.fix()
        ),
    )
}

fn finding(view: &GraphView, topic: &str, size: &Size, buffer: &ReceiveBuffer) -> Finding {
    let Size { bytes, evidence } = size;
    let safe = buffer.largest_safe_bytes;
    if *bytes <= safe {
        return Finding::ok(CHECK, format!("{topic}: {} fit ({evidence})", kb(*bytes)));
    }
    let compressed = view
        .endpoints
        .iter()
        .filter(|one| one.role == Role::Publisher && one.topic != topic)
        .find_map(|one| {
            one.topic.strip_prefix(topic).filter(|rest| rest.starts_with("/compressed"))?;
            Some(one.topic.as_str())
        });
    let mut fix = buffer.fix();
    if let Some(compressed) = compressed {
        fix += &format!("; or subscribe to {compressed}");
    }
    let is_read = view.at(Role::Subscription, topic).next().is_some();
    Finding::grave_if(
        is_read,
        CHECK,
        format!(
            "{topic}: {} are more than the {} that arrive complete here, so most are lost ({evidence}; {})",
            kb(*bytes),
            kb(safe),
            if is_read { "it has subscribers" } else { "no subscribers yet" }
        ),
        fix,
    )
}

fn size_of(view: &GraphView, topic: &str, type_name: &str) -> Option<Size> {
    let rate = |rate_hz: Option<f64>| {
        rate_hz.map_or_else(String::new, |rate_hz| format!(" at {rate_hz:.1} Hz"))
    };
    if let Some(measured) = view.measured.get(topic) {
        let evidence =
            format!("measured, {} messages{}", measured.messages, rate(measured.rate_hz));
        return Some(Size { bytes: measured.largest_bytes, evidence });
    }
    let (info, camera) = camera_of(&view.cameras, topic)?;
    let (of_each, what) = if type_name == PointCloud2::TYPE_NAME {
        (POINT_BYTES, "points of 16 bytes")
    } else if topic.contains("depth") {
        (DEPTH_PIXEL_BYTES, "pixels of 16UC1")
    } else {
        (COLOUR_PIXEL_BYTES, "pixels of rgb8")
    };
    let pixels = (camera.width_px as usize).checked_mul(camera.height_px as usize)?;
    Some(Size {
        bytes: pixels.checked_mul(of_each)?,
        evidence: format!(
            "{}x{} {what} by {info}{}",
            camera.width_px,
            camera.height_px,
            rate(camera.rate_hz)
        ),
    })
}

/// The calibration that is nearest above a topic: drivers publish it beside the image, and clouds beside
/// it or below.
fn camera_of<'a>(
    cameras: &'a BTreeMap<String, CameraSize>,
    topic: &str,
) -> Option<(&'a str, &'a CameraSize)> {
    cameras
        .iter()
        .filter(|(info, _)| {
            let folder = info.rsplit_once('/').map_or("", |(folder, _)| folder);
            // A calibration at the root is beside every topic.
            !folder.is_empty()
                && topic.strip_prefix(folder).is_some_and(|rest| rest.starts_with('/'))
        })
        .max_by_key(|(info, _)| info.len())
        .map(|(info, camera)| (info.as_str(), camera))
}

/// Large topics that cross from one machine to another.
pub(super) fn across_machines(view: &GraphView, machine: &Machine) -> Vec<Finding> {
    let is_large = |one: &&DiscoveredEndpoint| {
        one.type_name == Image::TYPE_NAME || one.type_name == PointCloud2::TYPE_NAME
    };
    let publishers =
        || view.endpoints.iter().filter(is_large).filter(|o| o.role == Role::Publisher);
    // RustDDS sends datagrams that need no fragments; others send up to 64 kB.
    let mut sources: Vec<_> = publishers()
        .filter(|one| machine.is_elsewhere(&one.addresses) && one.participant.vendor() != "RustDDS")
        .map(|one| {
            let address = one.addresses.first().map_or_else(String::new, ToString::to_string);
            format!("{} comes from {address} ({})", one.topic, one.participant.vendor())
        })
        .collect();
    sources.dedup();
    let mut leaving: Vec<_> = publishers()
        .filter(|one| !machine.is_elsewhere(&one.addresses))
        .filter(|one| {
            view.at(Role::Subscription, &one.topic).any(|end| machine.is_elsewhere(&end.addresses))
        })
        .map(|one| one.topic.as_str())
        .collect();
    leaving.dedup();
    machine::fragments(&machine.limits, &sources)
        .into_iter()
        .chain(machine::send_buffer(&machine.limits, &leaving))
        .collect()
}

#[cfg(test)]
mod tests;
