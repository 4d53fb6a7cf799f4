//! A bag: the topics that the suite reads of it, and what is wrong with them.

mod across;
mod extrinsics;
mod reading;
mod rules;
mod versions;

use bag_player::Bag;
use detection::shell::DetectionParameters;

use super::finding::Finding;
use super::machine::ReceiveBuffer;
use crate::failure::Failure;
use crate::run::inputs::TopicArgs;
use reading::BagFacts;

/// Reads the whole bag and returns the findings about it. `parameters` are those of a run, given by the user or not; `buffer` is what this machine
/// grants, if that is known.
pub(super) fn findings(
    bag: &Bag,
    topics: &TopicArgs,
    (parameters, are_given): (&DetectionParameters, bool),
    buffer: Option<&ReceiveBuffer>,
) -> Result<Vec<Finding>, Failure> {
    let facts = BagFacts::read(bag, topics, parameters)?;
    let mut findings = rules::losses(&facts);
    findings.push(rules::choice(&facts));
    findings.extend(facts.topics.iter().flat_map(|(topic, facts)| rules::topic(topic, facts)));
    findings.extend(rules::together(&facts, &parameters.config));
    findings.extend(across::findings(&facts));
    let extrinsics = extrinsics::finding(bag, &facts, parameters);
    let unknown = || extrinsics::unknown(&facts, parameters, are_given);
    findings.extend(extrinsics.or_else(unknown).or_else(|| extrinsics::not_checked(&facts)));
    findings.extend(buffer.into_iter().flat_map(|buffer| rules::sizes(&facts, buffer)));
    Ok(findings)
}

#[cfg(test)]
mod tests;
