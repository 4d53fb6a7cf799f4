//! Matching by descriptors alone.

use super::direction_bins::DirectionBins;
use super::{Best, LineMatch, LineMatchConfig};
use crate::feature::lines::LineFeature;

/// Which segment of one image is which of another: each the other's most alike among those of about its direction, and
/// clearly more so than the second. In the order of `from`; no segment is taken twice.
#[must_use]
pub fn match_lines(
    from: &[LineFeature],
    to: &[LineFeature],
    config: &LineMatchConfig,
) -> Vec<LineMatch> {
    let (bins_of_from, bins_of_to) = (DirectionBins::new(from), DirectionBins::new(to));
    let there: Vec<Option<Best>> =
        from.iter().map(|feature| most_alike(feature, to, &bins_of_to, config)).collect();
    let back: Vec<Option<Best>> =
        to.iter().map(|feature| most_alike(feature, from, &bins_of_from, config)).collect();
    let matches = there.iter().enumerate().filter_map(|(index, best)| {
        let best = best.filter(|best| best.passes(config))?;
        let is_mutual = back[best.to].is_some_and(|back| back.to == index);
        let found = LineMatch { from: index, to: best.to, distance_bits: best.distance_bits };
        is_mutual.then_some(found)
    });
    matches.collect()
}

/// The most alike of those of about one direction; of equals the first.
fn most_alike(
    feature: &LineFeature,
    among: &[LineFeature],
    bins: &DirectionBins,
    config: &LineMatchConfig,
) -> Option<Best> {
    let direction_rad = feature.segment.direction_rad();
    let mut best: Option<Best> = None;
    for to in bins.near(direction_rad, config.max_turn_rad as f32) {
        let distance_bits = feature.descriptor.distance_bits(&among[to].descriptor);
        match &mut best {
            Some(best) if (best.distance_bits, best.to) <= (distance_bits, to) => {
                best.rival_bits =
                    Some(best.rival_bits.map_or(distance_bits, |rival| rival.min(distance_bits)));
            }
            _ => {
                let rival_bits = best.map(|best| best.distance_bits);
                best = Some(Best { to, distance_bits, rival_bits });
            }
        }
    }
    best
}
