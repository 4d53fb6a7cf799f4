//! The messages received from each publisher.

use std::collections::BTreeMap;

use super::sample::Number;

/// The maximum number of distinguished publishers; beyond it the one received least recently is dropped. A benchmark has
/// one or a few, and each restart is a new one.
const MOST_RUNS: usize = 64;

/// The messages received from one publisher.
#[derive(Clone, Copy, Debug)]
struct Run {
    first: u64,
    last: u64,
    received: u64,
    /// When its last message was received, counted in messages.
    heard: u64,
}

impl Run {
    fn lost(&self) -> u64 {
        // A duplicate must not hide a missing message, nor make the number negative.
        (self.last - self.first).saturating_add(1).saturating_sub(self.received)
    }
}

/// Counts messages, the missing ones between them, and those out of order.
#[derive(Debug, Default)]
pub(super) struct Reception {
    runs: BTreeMap<u32, Run>,
    received: u64,
    numbered: u64,
    out_of_order: u64,
    lost_of_forgotten: u64,
}

impl Reception {
    /// Adds a message, with its number if it has one.
    pub(super) fn note(&mut self, number: Option<Number>) {
        self.received += 1;
        let Some(Number { run, count }) = number else { return };
        self.numbered += 1;
        let heard = self.received;
        if let Some(known) = self.runs.get_mut(&run) {
            known.heard = heard;
            if count > known.last {
                known.last = count;
                known.received += 1;
            } else {
                self.out_of_order += 1;
                if count < known.first {
                    known.first = count;
                }
                // A duplicate has the number of the last message; an earlier one fills a gap.
                if count != known.last {
                    known.received += 1;
                }
            }
            return;
        }
        if self.runs.len() >= MOST_RUNS {
            let oldest = self.runs.iter().min_by_key(|(_, run)| run.heard).map(|(run, _)| *run);
            if let Some(gone) = oldest.and_then(|oldest| self.runs.remove(&oldest)) {
                self.lost_of_forgotten += gone.lost();
            }
        }
        self.runs.insert(run, Run { first: count, last: count, received: 1, heard });
    }

    pub(super) fn received(&self) -> u64 {
        self.received
    }

    /// Messages missing between the first and the last received message of each publisher; `None` when no
    /// message had a number, as with other tools.
    pub(super) fn lost(&self) -> Option<u64> {
        let lost = || self.lost_of_forgotten + self.runs.values().map(Run::lost).sum::<u64>();
        (self.received == 0 || self.numbered > 0).then(lost)
    }

    /// Messages received after a later one of their publisher, or twice.
    pub(super) fn out_of_order(&self) -> u64 {
        self.out_of_order
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reception(numbers: &[(u32, u64)]) -> (u64, Option<u64>, u64) {
        let mut reception = Reception::default();
        for &(run, count) in numbers {
            reception.note(Some(Number { run, count }));
        }
        (reception.received(), reception.lost(), reception.out_of_order())
    }

    #[test]
    fn gaps_are_losses_and_late_ones_fill_them() {
        assert_eq!(reception(&[]), (0, Some(0), 0));
        assert_eq!(reception(&[(1, 5), (1, 6), (1, 7)]), (3, Some(0), 0));
        assert_eq!(reception(&[(1, 5), (1, 9)]), (2, Some(3), 0));
        assert_eq!(reception(&[(1, 5), (1, 9), (1, 7)]), (3, Some(2), 1));
        assert_eq!(reception(&[(1, 5), (1, 5), (1, 8)]), (3, Some(2), 1));
        assert_eq!(reception(&[(1, 5), (1, 2)]), (2, Some(2), 1));
    }

    #[test]
    fn publishers_are_told_apart() {
        assert_eq!(reception(&[(1, 0), (2, 100), (1, 1), (2, 102)]), (4, Some(1), 0));
    }

    #[test]
    fn messages_without_a_number_tell_of_no_loss() {
        let mut reception = Reception::default();
        reception.note(None);
        assert_eq!((reception.received(), reception.lost()), (1, None));
    }

    #[test]
    fn publishers_without_end_take_no_memory_without_end() {
        let mut reception = Reception::default();
        for run in 0..1000 {
            reception.note(Some(Number { run, count: 0 }));
            reception.note(Some(Number { run, count: 2 }));
        }
        assert_eq!(reception.runs.len(), MOST_RUNS);
        assert_eq!(reception.lost(), Some(1000));
    }
}
