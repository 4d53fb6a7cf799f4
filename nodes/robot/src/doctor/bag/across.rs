//! The rules that compare the topics of a bag with each other.

use bag_player::{Durability, TopicInfo};
use geometry::Stamp;
use msgs::RosMessage;
use msgs::sensor_msgs::CameraInfo;

use super::reading::{BagFacts, TopicFacts};
use super::versions;
use crate::doctor::checks::Check;
use crate::doctor::content::clocks::{self, Clock};
use crate::doctor::content::stamps::period_s;
use crate::doctor::content::{Subject, latching};
use crate::doctor::finding::Finding;
use crate::run::inputs::{TF_STATIC, ViewTopics};

/// A recorder finds the publishers of fixed transforms in this time.
const LONGEST_LATE_S: f64 = 2.0;
/// With fewer messages a clock is not judged.
const LEAST_MESSAGES: usize = 5;
/// If all stamps and times of arrival differ by less, the bag was written with the stamps as times of arrival.
const SAME_TIME_S: f64 = 1e-3;
/// A topic whose clock is wrong begins and ends later or earlier than the others by more than so many of its periods.
const SHIFT_PERIODS: f64 = 3.0;

/// The findings of all these rules.
pub(super) fn findings(facts: &BagFacts) -> Vec<Finding> {
    let mut findings = skews(facts);
    findings.extend(cameras(facts));
    findings.extend(transforms(facts));
    findings.extend(fixed_transforms(&facts.info.topics));
    findings.extend(late_transforms(facts));
    findings.extend(facts.info.topics.iter().filter_map(versions::finding));
    findings
}

/// Whether the stamps of all sensors are of one clock.
fn skews(facts: &BagFacts) -> Vec<Finding> {
    let sensors = || {
        facts.topics.iter().filter(|(_, topic)| {
            topic.stamps.len() >= LEAST_MESSAGES && topic.type_name != CameraInfo::TYPE_NAME
        })
    };
    let by_arrival: Vec<Clock<'_>> = sensors()
        .filter_map(|(name, topic)| {
            let offset_s = -topic.delay_s.median()?;
            Some(Clock { topic: name, is_read: topic.is_chosen, offset_s })
        })
        .collect();
    if by_arrival.iter().any(|clock| clock.offset_s.abs() > SAME_TIME_S) {
        return clocks::findings(&by_arrival, "by their times of arrival");
    }
    let sensors: Vec<(&String, &TopicFacts)> = sensors().collect();
    clocks::findings(
        &shifted(&sensors),
        "both its first and its last stamp differ from theirs by that",
    )
}

/// How much earlier or later than most a topic begins and ends, if that is the same at both ends; else 0.
fn shifted<'a>(sensors: &[(&'a String, &'a TopicFacts)]) -> Vec<Clock<'a>> {
    let ends: Vec<(f64, f64)> = {
        let origin = sensors.iter().filter_map(|(_, facts)| facts.stamps.iter().min()).min();
        let Some(origin) = origin.copied() else { return Vec::new() };
        let since = |stamp: Option<&Stamp>| stamp.map_or(0.0, |stamp| stamp.seconds_since(origin));
        sensors
            .iter()
            .map(|(_, facts)| (since(facts.stamps.iter().min()), since(facts.stamps.iter().max())))
            .collect()
    };
    let period_of = |facts: &TopicFacts| period_s(&facts.sorted_stamps()).unwrap_or_default();
    // The uncertainty of each end.
    let longest_s = sensors.iter().map(|(_, facts)| period_of(facts)).fold(0.0, f64::max);
    let first_s = clocks::typical_offset(ends.iter().map(|(first_s, _)| *first_s));
    let last_s = clocks::typical_offset(ends.iter().map(|(_, last_s)| *last_s));
    sensors
        .iter()
        .zip(ends)
        .map(|((name, facts), ends)| {
            let (begin_s, end_s) = (ends.0 - first_s, ends.1 - last_s);
            let is_shift = begin_s * end_s > 0.0
                && begin_s.abs().min(end_s.abs()) > SHIFT_PERIODS * period_of(facts)
                && (begin_s - end_s).abs() < longest_s;
            let offset_s = if is_shift { 0.5 * (begin_s + end_s) } else { 0.0 };
            Clock { topic: name, is_read: facts.is_chosen, offset_s }
        })
        .collect()
}

/// The sizes of images, compared with the calibration beside them.
fn cameras(facts: &BagFacts) -> Vec<Finding> {
    let chosen = match facts.choice.as_ref().map(|inputs| &inputs.view) {
        Ok(ViewTopics::Depth { image, camera_info }) => Some((image, camera_info)),
        _ => None,
    };
    facts
        .topics
        .iter()
        .filter_map(|(name, topic)| {
            let image = topic.content.image()?;
            let info_name = match chosen {
                Some((chosen, info)) if chosen == name => info.clone(),
                _ => format!("{}/camera_info", name.rsplit_once('/')?.0),
            };
            let camera = facts.topics.get(&info_name)?.content.camera()?;
            let subject = Subject { topic: name, is_read: topic.is_chosen, period_s: None };
            camera.sizes_differ(&info_name, &image.sizes_px, &subject)
        })
        .collect()
}

/// Whether tf is connected, and has the frames of the sensors.
fn transforms(facts: &BagFacts) -> Vec<Finding> {
    facts.transforms.findings(&sensors(facts))
}

/// The topics of the sensors with their frames.
fn sensors(facts: &BagFacts) -> Vec<(&str, &str)> {
    match &facts.choice {
        Ok(inputs) => {
            let view = match &inputs.view {
                ViewTopics::Depth { image, .. } => image,
                ViewTopics::Points(points) => points,
            };
            [&inputs.scan, view]
                .into_iter()
                .filter_map(|topic| {
                    Some((topic.as_str(), facts.topics.get(topic)?.content.frame()?))
                })
                .collect()
        }
        Err(_) => Vec::new(),
    }
}

/// Fixed transforms that say where a sensor is, and were recorded long after its first message: who plays the bag does not know the
/// place until then.
fn late_transforms(facts: &BagFacts) -> Option<Finding> {
    let late = sensors(facts).into_iter().filter_map(|(topic, frame)| {
        let begun = *facts.begun.get(topic)?;
        let above = facts.transforms.above(std::iter::once(frame));
        let of_sensor =
            facts.fixed_since.iter().filter(|(fixed, _)| above.contains(fixed.as_str()));
        let (fixed, since) = of_sensor.max_by_key(|(_, since)| **since)?;
        Some((since.seconds_since(begun), fixed, topic))
    });
    let (late_s, fixed, topic) = late.max_by(|one, other| one.0.total_cmp(&other.0))?;
    (late_s > LONGEST_LATE_S).then(|| {
        Finding::warn(
            Check::Transforms,
            format!("{TF_STATIC}: {fixed} is recorded {late_s:.1} s after the first message on {topic}"),
            "record /tf_static from the start (transient local, as `ros2 bag record` and `stillmap record` take it); `stillmap filter` and \
             `run` (local) read it beforehand, `stillmap play` and `ros2 bag play` do not",
        )
    })
}

/// Static transforms that late subscribers do not receive.
fn fixed_transforms(topics: &[TopicInfo]) -> Option<Finding> {
    let fixed = topics.iter().find(|topic| topic.topic == TF_STATIC)?;
    let is_volatile = fixed.qos?.durability == Durability::Volatile;
    is_volatile.then(|| latching(&format!("{} messages of {TF_STATIC}", fixed.message_count)))
}
