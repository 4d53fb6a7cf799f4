//! Where a recording ends, although images follow: those of another time are another recording's.

use geometry::Stamp;
use node_shell::{StampCheck, StampOrder};

/// Judges the stamps of a recording's images. A wrong stamp changes no other; where two images in a row are of an earlier time, the clock
/// was set back, or a second recording begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct RecordingEnd {
    stamps: StampCheck,
    last: Option<Stamp>,
    left_out: u64,
}

impl Default for RecordingEnd {
    fn default() -> Self {
        Self { stamps: StampCheck::of_a_recording(), last: None, left_out: 0 }
    }
}

impl RecordingEnd {
    /// Whether the image of this stamp belongs to the recording.
    pub(super) fn admits(&mut self, stamp: Stamp) -> bool {
        let admits = match self.stamps.judge(stamp, self.last) {
            StampOrder::Follows => {
                self.last = Some(stamp);
                true
            }
            // The pose node says what it makes of an image after a pause.
            StampOrder::Doubtful { later_s } => later_s > 0.0,
            StampOrder::BeginsAnew { .. } | StampOrder::Ended => false,
        };
        self.left_out += u64::from(!admits);
        admits
    }

    /// By how much time has gone back where the recording has ended; `None` while it has not.
    pub(super) fn gone_back_s(&self) -> Option<f64> {
        self.stamps.gone_back_s()
    }

    /// The number of images of another time.
    pub(super) fn left_out(&self) -> u64 {
        self.left_out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn admitted(stamps_s: &[f64]) -> (Vec<bool>, Option<f64>) {
        let mut end = RecordingEnd::default();
        let start = Stamp::from_secs_nanos(1_000, 0);
        let admitted = stamps_s.iter().map(|at_s| end.admits(start.plus_seconds(*at_s))).collect();
        (admitted, end.gone_back_s().map(f64::round))
    }

    /// Regression: the poses of two recordings in one bag were put upon each other, without a word.
    #[test]
    fn a_recording_ends_where_its_time_goes_back() {
        let (admitted, back_s) = admitted(&[0.0, 0.1, 9.0, 9.1, 0.0, 0.1, 0.2, 99.0]);
        assert_eq!(admitted, [true, true, true, true, false, false, false, false]);
        assert_eq!(back_s, Some(9.0));
    }

    #[test]
    fn one_wrong_stamp_ends_nothing() {
        for wrong_s in [-999.0, -1.0, 999.0] {
            let (admitted, back_s) = admitted(&[0.0, 0.1, wrong_s, 0.3, 0.2, 0.4]);
            assert_eq!((admitted[2], back_s), (wrong_s > 0.0, None));
            assert!(admitted[3..].iter().all(|admitted| *admitted), "{wrong_s}");
        }
    }

    #[test]
    fn a_pause_ends_nothing() {
        let (admitted, back_s) = admitted(&[0.0, 0.1, 99.0, 99.1, 99.2, 98.9]);
        assert_eq!((admitted, back_s), (vec![true; 6], None));
    }
}
