//! Where a recording ends, although images follow: those of another time are another recording's.

use geometry::Stamp;

/// As in the odometry of a LiDAR: an image that is earlier by this much belongs to another time. One that is a little late does not.
const BACK_IN_TIME_S: f64 = 0.5;
/// So does one that is later by this much, until another one agrees.
const AHEAD_IN_TIME_S: f64 = 10.0;

/// Judges the stamps of a recording's images. A wrong stamp changes no other; where two images in a row are of an earlier time, the clock
/// was set back, or a second recording begins.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RecordingEnd {
    last: Option<Stamp>,
    /// That of the image before, if it was of another time.
    doubtful: Option<Stamp>,
    gone_back_s: Option<f64>,
    left_out: u64,
}

impl RecordingEnd {
    /// Whether the image of this stamp belongs to the recording.
    pub(super) fn admits(&mut self, stamp: Stamp) -> bool {
        let admits = self.gone_back_s.is_none() && self.follows(stamp);
        self.left_out += u64::from(!admits);
        admits
    }

    fn follows(&mut self, stamp: Stamp) -> bool {
        let before = self.doubtful.take();
        let later_s = self.last.map_or(0.0, |last| stamp.seconds_since(last));
        if (-BACK_IN_TIME_S..=AHEAD_IN_TIME_S).contains(&later_s) {
            self.last = Some(stamp);
            return true;
        }
        let since_s = before.map(|before| stamp.seconds_since(before));
        let agrees = since_s.is_some_and(|since_s| since_s > 0.0 && since_s < later_s.abs());
        if agrees && later_s < 0.0 {
            self.gone_back_s = Some(-later_s);
        } else if agrees {
            self.last = Some(stamp);
        } else {
            self.doubtful = Some(stamp);
        }
        later_s > 0.0
    }

    /// By how much time has gone back where the recording has ended; `None` while it has not.
    pub(super) fn gone_back_s(&self) -> Option<f64> {
        self.gone_back_s
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
