//! The test messages: images of any size with a number, by which the receiver counts losses,
//! and the time of sending, by which it measures the latency.

use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use geometry::Stamp;
use msgs::convert::{stamp_from_time, time_from_stamp};
use msgs::sensor_msgs::Image;

/// The prefix of the frame id of a test image. Its numbers follow with a fixed width, so that all images of
/// a run have the same length.
const MARK: &str = "stillmap_bench";
/// The period of the content in bytes: a prime, so that no two fragments are equal.
const PATTERN: usize = 251;

/// The wall clock, which is the same for both ends on one machine.
pub(super) fn now() -> Stamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Stamp::from_nanos(i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
}

/// The publisher of an image, and its number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Number {
    /// Differs between publishers.
    pub(super) run: u32,
    /// Counts from 0.
    pub(super) count: u64,
}

impl Number {
    /// The number of an image, if it is a test image.
    pub(super) fn of(image: &Image) -> Option<Self> {
        let mut parts = image.header.frame_id.split('/');
        if parts.next() != Some(MARK) {
            return None;
        }
        let run = u32::from_str_radix(parts.next()?, 16).ok()?;
        let count = parts.next()?.parse().ok()?;
        parts.next().is_none().then_some(Self { run, count })
    }

    fn frame_id(self) -> String {
        format!("{MARK}/{:08x}/{:020}", self.run, self.count)
    }
}

/// The time at which an image was sent.
pub(super) fn sent(image: &Image) -> Stamp {
    stamp_from_time(image.header.stamp)
}

/// Creates the images of one publisher. They share one buffer, as long as nobody else holds it.
pub(super) struct Source {
    image: Arc<Image>,
    next: Number,
}

impl Source {
    /// Images of `bytes` bytes of data.
    pub(super) fn new(bytes: u32) -> Self {
        // There are no two publishers in one process; two processes differ by their id or by the time.
        let run = std::process::id() ^ (now().as_nanos() as u32).rotate_left(16);
        let image = Image {
            height: 1,
            width: bytes,
            encoding: "mono8".to_owned(),
            step: bytes,
            data: (0..bytes as usize).map(|at| (at % PATTERN) as u8).collect(),
            ..Image::default()
        };
        Self { image: Arc::new(image), next: Number { run, count: 0 } }
    }

    /// The next image, stamped now.
    pub(super) fn next(&mut self) -> Arc<Image> {
        let image = Arc::make_mut(&mut self.image);
        image.header.frame_id = self.next.frame_id();
        image.header.stamp = time_from_stamp(now());
        self.next.count += 1;
        Arc::clone(&self.image)
    }
}

#[cfg(test)]
mod tests {
    use msgs::std_msgs::Header;

    use super::*;

    #[test]
    fn images_carry_their_number_and_moment_and_keep_their_length() {
        let mut source = Source::new(1000);
        let before = now();
        let (first, second) = (source.next(), source.next());
        let (one, two) = (Number::of(&first).unwrap(), Number::of(&second).unwrap());
        assert_eq!((one.count, two.count, one.run), (0, 1, two.run));
        assert!(sent(&first) >= before && sent(&second) >= sent(&first));
        assert_eq!(first.data.len(), 1000);
        assert_eq!(first.step * first.height, 1000);
        assert_eq!(first.header.frame_id.len(), second.header.frame_id.len());
    }

    #[test]
    fn an_image_of_somebody_else_has_no_number() {
        for frame_id in [
            "",
            "camera",
            "stillmap_bench",
            "stillmap_bench/0",
            "stillmap_bench/0/-1",
            "stillmap_bench/g/1",
            "stillmap_bench/0/1/2",
            "stillmap_bench/1ffffffff/1",
        ] {
            let header = Header { frame_id: frame_id.to_owned(), ..Header::default() };
            assert_eq!(Number::of(&Image { header, ..Image::default() }), None, "{frame_id}");
        }
    }
}
