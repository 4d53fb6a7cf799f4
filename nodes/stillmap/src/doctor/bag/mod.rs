//! A bag: what the suite can use of it, and what is wrong with that.

mod reading;
mod rules;

use bag_player::Bag;

use super::finding::Finding;
use super::machine::ReceiveBuffer;
use crate::failure::Failure;
use crate::run::inputs::TopicArgs;
use reading::BagFacts;

/// Reads the whole bag and says what is to be said of it. `buffer` is what this machine grants, where that
/// is known.
pub(super) fn findings(
    bag: &Bag,
    topics: &TopicArgs,
    buffer: Option<&ReceiveBuffer>,
) -> Result<Vec<Finding>, Failure> {
    let facts = BagFacts::read(bag, topics)?;
    let mut findings = rules::losses(&facts);
    findings.push(rules::choice(&facts));
    findings.extend(facts.topics.iter().flat_map(|(topic, facts)| rules::topic(topic, facts)));
    findings.extend(rules::together(&facts));
    findings.extend(buffer.into_iter().flat_map(|buffer| rules::sizes(&facts, buffer)));
    Ok(findings)
}

#[cfg(test)]
mod tests;
