//! The rules about a bag.

mod clock_steps;

use bag_player::Loss;
use detection::DetectionConfig;
use estimation::quantile::upper_median;
use geometry::Stamp;
use msgs::RosMessage;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::CameraInfo;

use super::reading::{BagFacts, Chosen, TopicFacts};
use crate::doctor::checks::Check;
use crate::doctor::content::{Subject, stamps};
use crate::doctor::finding::Finding;
use crate::doctor::machine::ReceiveBuffer;
use crate::doctor::sizes::kb;
use crate::run::SOUND_SHARE;
use crate::run::inputs::ViewTopics;

/// Losses that are reported one by one; further ones are counted.
const MOST_LOSSES: usize = 5;
/// How many times longer than the usual time between two stamps a gap is.
const GAP_PERIODS: f64 = 3.0;

/// Parts of the bag that could not be read.
pub(super) fn losses(facts: &BagFacts) -> Vec<Finding> {
    const CHECK: Check = Check::Damage;
    const FIX: &str =
        "record or copy it again; what is left: stillmap import bag BAG -o recovered.mcap";
    if facts.losses.is_empty() {
        let what = format!("all of {} messages could be read", facts.info.message_count);
        return vec![Finding::ok(CHECK, what)];
    }
    // A topic that has no form in ROS 2 is missed only by those that would read it.
    let is_unread = |loss: &&Loss| {
        let inputs = facts.choice.as_ref().ok();
        loss.topic_left_out().zip(inputs).is_some_and(|(topic, inputs)| !inputs.is_of(topic))
    };
    let (left_out, losses): (Vec<&Loss>, Vec<&Loss>) = facts.losses.iter().partition(is_unread);
    let unread = left_out
        .iter()
        .map(|loss| Finding::ok(CHECK, format!("{loss}; nothing of the suite reads it")));
    let one = |loss: &&Loss| Finding::grave_if(loss.costs_messages(), CHECK, loss.to_string(), FIX);
    let mut findings: Vec<_> = losses.iter().take(MOST_LOSSES).map(one).collect();
    findings.extend(unread.take(MOST_LOSSES));
    let more = losses.len().saturating_sub(MOST_LOSSES);
    if more > 0 {
        findings.push(Finding::error(CHECK, format!("{more} more parts could not be read"), FIX));
    }
    findings
}

/// The topics that `stillmap run` would read.
pub(super) fn choice(facts: &BagFacts) -> Finding {
    const CHECK: Check = Check::Inputs;
    match &facts.choice {
        Ok(inputs) => {
            let view = match &inputs.view {
                ViewTopics::Depth { image, camera_info } => format!("{image} with {camera_info}"),
                ViewTopics::Points(points) => points.clone(),
            };
            let scan = if facts.cuts_scans {
                "scans that it cuts out of the depth images"
            } else {
                &inputs.scan
            };
            let what = format!("`stillmap run` reads {scan}, {view}, {}", inputs.pose.name());
            Finding::ok(CHECK, what)
        }
        Err(failure) => {
            let text = failure.to_string();
            let (what, fix) = text.split_once('\n').unwrap_or((&text, "record it, too"));
            Finding::error(CHECK, format!("`stillmap run` cannot start: {what}"), fix.trim())
        }
    }
}

/// The findings about one topic alone.
pub(super) fn topic(name: &str, facts: &TopicFacts) -> Vec<Finding> {
    let mut findings = Vec::new();
    if facts.unusable > 0 {
        let reason = facts.first_reason.as_deref().unwrap_or("damaged");
        findings.push(Finding::grave_if(
            facts.unusable == facts.messages,
            Check::Messages,
            format!(
                "{name}: {} of {} messages cannot be used; the first: {reason}",
                facts.unusable, facts.messages
            ),
            "fix the driver as the reason says and record again, or choose another topic (--scan, \
             --depth, --points, --pose)",
        ));
    }
    let mut sorted = facts.sorted_stamps();
    sorted.retain(|stamp| !stamps::is_zero(stamp));
    let period_s = stamps::period_s(&sorted);
    let subject = Subject { topic: name, is_read: facts.is_chosen, period_s };
    findings.extend(facts.content.findings(&subject));
    findings.extend(stamps::findings(name, facts.is_chosen, &facts.stamps));
    if sorted.first() == sorted.last() {
        return findings;
    }
    findings.extend(gaps(name, facts, &sorted));
    let gap_s = period_s.map(|period_s| GAP_PERIODS * period_s).filter(|_| facts.is_chosen);
    findings.extend(gap_s.and_then(|gap_s| clock_steps::finding(name, facts, gap_s)));
    findings
}

/// Periods without messages.
fn gaps(name: &str, facts: &TopicFacts, sorted: &[Stamp]) -> Option<Finding> {
    const CHECK: Check = Check::Gaps;
    let mut steps_s: Vec<f64> =
        sorted.windows(2).map(|pair| pair[1].seconds_since(pair[0])).collect();
    let (at, longest_s) =
        steps_s.iter().copied().enumerate().max_by(|(_, one), (_, other)| one.total_cmp(other))?;
    let usual_s = upper_median(&mut steps_s)?;
    let bound_s = match facts.type_name.as_str() {
        // One message is enough, and a rate of 1 Hz is usual.
        CameraInfo::TYPE_NAME => f64::INFINITY,
        // Poses are interpolated.
        PoseStamped::TYPE_NAME => DetectionConfig::default().max_pose_gap_s,
        _ => GAP_PERIODS * usual_s,
    };
    let rate = if usual_s > 0.0 {
        format!("{:.1} Hz", 1.0 / usual_s)
    } else {
        "no steady rate".to_owned()
    };
    if longest_s <= bound_s {
        return Some(Finding::ok(
            CHECK,
            format!(
                "{name}: {} messages at {rate}, at most {longest_s:.3} s apart",
                facts.messages
            ),
        ));
    }
    let gaps = sorted.windows(2).filter(|pair| pair[1].seconds_since(pair[0]) > bound_s).count();
    let into_s = sorted[at].seconds_since(sorted[0]);
    Some(Finding::warn(
        CHECK,
        format!(
            "{name}: {gaps} gaps among {} messages at {rate}; the longest of {longest_s:.3} s is \
             {into_s:.1} s after the first (usual are {usual_s:.3} s)",
            facts.messages
        ),
        "record on the machine of the driver, with a larger cache: ros2 bag record \
         --max-cache-size 500000000; and see `stillmap doctor` there",
    ))
}

/// Whether scans, images and poses belong together.
pub(super) fn together(facts: &BagFacts, config: &DetectionConfig) -> Vec<Finding> {
    let Some(Chosen { scans, view, poses }) = facts.chosen() else { return Vec::new() };
    let sorted = |facts: &TopicFacts| facts.sorted_stamps();
    let view = sorted(view);
    let offsets = scans.and_then(|scans| offsets(&sorted(scans), &view, config.max_cloud_offset_s));
    let coverage = match poses {
        Some(poses) => coverage(&view, &sorted(poses), config.max_pose_gap_s),
        None => Some(Finding::ok(
            Check::Poses,
            "not checked: the poses are on no topic; `stillmap run` says how many scans have none",
        )),
    };
    offsets.into_iter().chain(coverage).collect()
}

/// How far the nearest image is from each scan.
fn offsets(scans: &[Stamp], view: &[Stamp], most_s: f64) -> Option<Finding> {
    const CHECK: Check = Check::Offsets;
    let mut offsets_s: Vec<f64> =
        scans.iter().filter_map(|scan| Some(nearest(view, *scan)?.seconds_since(*scan))).collect();
    let near = offsets_s.iter().filter(|offset_s| offset_s.abs() <= most_s).count();
    let share = near as f64 / scans.len().max(1) as f64;
    let middle_s = upper_median(&mut offsets_s)?;
    let what = format!(
        "{near} of {} scans have an image or cloud within {most_s:.3} s; the median of the \
         nearest ones is {middle_s:+.3} s after its scan",
        scans.len()
    );
    if share >= SOUND_SHARE {
        return Some(Finding::ok(CHECK, what));
    }
    let fix = if middle_s.abs() > most_s {
        "set the clocks of scanner and camera alike (chrony or PTP between their hosts) and record \
         again; where the offset is known to be harmless, a --params-file with \
         `max_cloud_offset_s` under detection: ros__parameters:"
    } else {
        "record both at their full rates (ros2 bag record --max-cache-size 500000000), or allow more by \
         a --params-file with `max_cloud_offset_s` under detection: ros__parameters:"
    };
    Some(Finding::grave_if(near == 0, CHECK, what, fix))
}

/// For how many images the rig's pose is known.
fn coverage(view: &[Stamp], poses: &[Stamp], most_gap_s: f64) -> Option<Finding> {
    const CHECK: Check = Check::Poses;
    let (first, last) = (poses.first()?, poses.last()?);
    if view.is_empty() {
        return None;
    }
    let covered = view.iter().filter(|stamp| is_bracketed(poses, **stamp, most_gap_s)).count();
    let what = format!(
        "{covered} of {} images or clouds lie between two poses at most {most_gap_s:.1} s apart",
        view.len()
    );
    if covered as f64 >= SOUND_SHARE * view.len() as f64 {
        return Some(Finding::ok(CHECK, what));
    }
    let what = format!(
        "{what}; poses reach from {:+.1} s to {:+.1} s after the first image",
        first.seconds_since(view[0]),
        last.seconds_since(view[0])
    );
    let fix = "start the odometry before the recording and stop it after; where the poses belong to \
                another time, set the clocks of both hosts alike (chrony)";
    Some(Finding::grave_if(covered == 0, CHECK, what, fix))
}

fn is_bracketed(poses: &[Stamp], stamp: Stamp, most_gap_s: f64) -> bool {
    let after = poses.partition_point(|pose| *pose < stamp);
    match poses.get(after) {
        Some(next) if *next == stamp => true,
        Some(next) if after > 0 => next.seconds_since(poses[after - 1]) <= most_gap_s,
        _ => false,
    }
}

/// Whether the messages would cross DDS on this machine.
pub(super) fn sizes(facts: &BagFacts, buffer: &ReceiveBuffer) -> Vec<Finding> {
    const CHECK: Check = Check::Sizes;
    let safe = buffer.largest_safe_bytes;
    let mut large: Vec<_> = facts
        .topics
        .iter()
        .filter(|(_, topic)| topic.largest_bytes > safe)
        .map(|(name, topic)| (topic.is_chosen, name, topic.largest_bytes))
        .collect();
    large.sort_unstable();
    if large.is_empty() {
        let largest = facts.topics.values().map(|topic| topic.largest_bytes).max().unwrap_or(0);
        let what = format!(
            "messages of up to {} would all cross DDS here, where up to {} arrive complete",
            kb(largest),
            kb(safe)
        );
        return vec![Finding::ok(CHECK, what)];
    }
    let one = |(_, name, bytes): (bool, &String, usize)| {
        Finding::warn(
            CHECK,
            format!(
                "{name}: messages of {} are more than the {} that arrive complete here, so `stillmap play` \
                 and `run --transport dds` lose most of them; `run --transport local` loses none",
                kb(bytes),
                kb(safe)
            ),
            format!("{}; or play depth images with --compress-depth {name}", buffer.fix()),
        )
    };
    large.into_iter().rev().map(one).collect()
}

/// The stamp nearest to another one; of two at equal distance the earlier.
fn nearest(sorted: &[Stamp], wanted: Stamp) -> Option<Stamp> {
    let after = sorted.partition_point(|stamp| *stamp < wanted);
    let candidates = [after.checked_sub(1), Some(after)];
    candidates.into_iter().flatten().filter_map(|place| sorted.get(place).copied()).min_by(
        |one, other| {
            let distance = |stamp: &Stamp| stamp.seconds_since(wanted).abs();
            distance(one).total_cmp(&distance(other))
        },
    )
}

#[cfg(test)]
mod tests;
