//! A bag: the topics that the suite reads of it, and what is wrong with them.

mod across;
mod extrinsics;
mod reading;
mod rules;
mod seen_depths;
mod versions;

use bag_player::Bag;

use super::checks::Check;
use super::finding::{Finding, Severity};
use super::machine::ReceiveBuffer;
use crate::failure::Failure;
use crate::run::choose_inputs;
use crate::run::inputs::TopicArgs;
use crate::run::parameters::PipelineParameters;
use reading::BagFacts;

/// Reads the whole bag and returns the findings about it. `parameters` are those of a run, given by the user or not; `buffer` is what this machine
/// grants, if that is known.
pub(super) fn findings(
    bag: &Bag,
    topics: &TopicArgs,
    (mut parameters, are_given): (PipelineParameters, bool),
    buffer: Option<&ReceiveBuffer>,
) -> Result<Vec<Finding>, Failure> {
    let node = parameters.detection_node();
    let facts = BagFacts::read(bag, topics, node)?;
    let mut findings = rules::losses(&facts);
    findings.push(rules::choice(&facts));
    findings.extend(facts.topics.iter().flat_map(|(topic, facts)| rules::topic(topic, facts)));
    findings.extend(rules::together(&facts, &node.config));
    findings.extend(across::findings(&facts));
    let unknown = extrinsics::unknown(&facts, node, are_given);
    // Where the mounts are those of tf in a run, the parameters say so now. What a run cannot do is said above.
    let _placed = choose_inputs(bag, &facts.info, topics, &mut parameters);
    let is_clock = |one: &Finding| one.check == Check::Clocks && one.severity == Severity::Error;
    let clocks_agree = !findings.iter().any(is_clock);
    let node = parameters.detection_node();
    let of_mount = extrinsics::finding(bag, &facts, node, (unknown, clocks_agree));
    // What the unit of one sensor or a wrong calibration explains is not told once more.
    let is_unit = |one: &Finding| one.check == Check::Units && one.severity == Severity::Error;
    let is_calibration =
        |one: &Finding| one.check == Check::Calibration && one.severity != Severity::Ok;
    let is_explained = findings.iter().any(|one| is_unit(one) || is_calibration(one));
    findings.extend(of_mount.filter(|one| !(is_explained && is_unit(one))));
    findings.extend(buffer.into_iter().flat_map(|buffer| rules::sizes(&facts, buffer)));
    Ok(findings)
}

#[cfg(test)]
mod tests;
