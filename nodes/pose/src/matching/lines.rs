//! Which line segment of one image is which of another.

mod config;
mod direction_bins;
mod hamming;
mod projected;
#[cfg(test)]
mod tests;

pub use config::{LineMatchConfig, ProjectedLineConfig};
pub use direction_bins::DirectionBins;
pub use hamming::match_lines;
pub use projected::{ProjectedLine, match_projected_lines};

/// Two segments that are held to be one line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LineMatch {
    /// Which of those that something was sought for.
    pub from: usize,
    /// Which of those that it was sought among.
    pub to: usize,
    /// By how many bits their descriptors differ.
    pub distance_bits: u32,
}

/// The best of several candidates, and how good the next is that is another line.
#[derive(Clone, Copy, Debug)]
struct Best {
    to: usize,
    distance_bits: u32,
    rival_bits: Option<u32>,
}

impl Best {
    /// Whether it is alike enough, and more so than its rival.
    fn passes(&self, config: &LineMatchConfig) -> bool {
        let stands_out = self.rival_bits.is_none_or(|rival| {
            f64::from(self.distance_bits) <= config.max_ratio * f64::from(rival)
        });
        self.distance_bits <= config.max_distance_bits && stands_out
    }
}

/// Of those that lead to the same segment the one that is most alike, and of equals the first; in the order of `from`.
fn each_taken_once(matches: Vec<LineMatch>, segments: usize) -> Vec<LineMatch> {
    let mut best: Vec<Option<LineMatch>> = vec![None; segments];
    for &found in &matches {
        let best = &mut best[found.to];
        if best.is_none_or(|best| found.distance_bits < best.distance_bits) {
            *best = Some(found);
        }
    }
    matches.into_iter().filter(|found| best[found.to] == Some(*found)).collect()
}
